// SPDX-License-Identifier: MIT
// Walks the tokens and computes as it goes: a call walks the function's tokens, a loop walks its own again. Where it stands only for some
// points, a stack of conditions, numbers that are 0 or 1, says for which; what is assigned there is chosen by them.
// The language: "The OpenGL Shading Language, Version 4.60.8" (Khronos Group, 2023).
#pragma once

#include "sdf/expression_build.h"
#include "sdf/expression_glsl_tokens.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::sdf::glsl {

enum class Type : uint8_t { Void, Float, Int, Bool, Vec2, Vec3, Vec4, Mat2, Mat3 };

struct TypeFacts {
    std::string_view name;
    int size;     // numbers
    int columns;  // of a matrix
};
inline constexpr TypeFacts kTypes[] = {{"void", 0, 0}, {"float", 1, 0}, {"int", 1, 0},  {"bool", 1, 0}, {"vec2", 2, 0},
                                       {"vec3", 3, 0}, {"vec4", 4, 0},  {"mat2", 4, 2}, {"mat3", 9, 3}};
inline const TypeFacts& facts(Type t) { return kTypes[size_t(t)]; }
inline bool is_number(Type t) { return t == Type::Float || t == Type::Int; }
inline bool is_vector(Type t) { return t >= Type::Vec2 && t <= Type::Vec4; }
inline bool is_matrix(Type t) { return t >= Type::Mat2; }
inline Type vector_of(int size) { return size == 1 ? Type::Float : Type(int(Type::Vec2) + size - 2); }

struct Value {
    Type type = Type::Void;
    std::array<uint32_t, 9> at{};  // matrices by columns
    int size() const { return facts(type).size; }
    std::span<const uint32_t> parts() const { return {at.data(), size_t(size())}; }
};

struct Parameter {
    Type type = Type::Void;
    std::string_view name;
    bool in = true, out = false;
};
struct Function {
    Type type = Type::Void;
    std::string_view name;
    std::vector<Parameter> parameters;
    size_t body = 0;  // token of its brace
};

struct Variable {
    std::string_view name;
    Value value;
    bool constant = false;
    size_t conditions = 0;  // how many there were when it was declared
};

// Where an assignment goes: components of a variable.
struct Target {
    size_t variable = 0;
    Type type = Type::Void;
    std::array<int, 9> parts{};
};

class Reader : Tokens {
public:
    Reader(std::string_view text, std::span<const float> arguments) : Tokens(text), arguments_(arguments) {}

    Result<Formula> run();

private:
    // ---- outside functions: expression_glsl.cpp

    std::optional<Type> type_here() const;
    bool units();
    bool parameters(Function& f);
    bool entry(uint32_t& out);

    // ---- statements: expression_glsl_statements.cpp

    struct Frame {
        Type type = Type::Void;
        size_t first_variable = 0, parameters = 0, first_condition = 0;
        Value result;
        uint32_t returned = 0;  // 1 where the result stands
        bool done = false;      // everywhere
    };
    struct Loop {
        size_t broken = 0, skipped = 0;  // conditions: it goes on; this round goes on
    };
    bool call(const Function& f, const std::vector<Value>& in, std::vector<Value>& back, size_t place, Value& out);
    bool fits(size_t place);
    bool block();
    // Nothing that follows in this round of the loop happens for any point.
    bool stopped() const;
    // Equal parts are one node, so a text may ask for far more work than it makes nodes.
    bool step(size_t place);
    bool statement();
    bool statement_here();
    // Braces among a statement's: what they hold may be left early, so their end is found first.
    bool inner_block();
    // After the type, up to the semicolon.
    bool declarations(Type type, bool constant);
    bool if_statement();
    // One statement that may leave early: where it ends is found first.
    bool branch();
    bool for_statement();
    bool return_statement();
    Variable* find(std::string_view what);
    bool target(Target& out);
    Value read(const Target& t) const;
    void write(const Target& t, const Value& value);
    // NAME… = VALUE, or a call whose value nobody wants.
    bool assignment();

    // ---- conditions and expressions: expression_glsl_expressions.cpp

    uint32_t k(double v) { return build_.constant(v); }
    std::optional<double> known(uint32_t node) const { return build_.number_of(node); }
    uint32_t both(uint32_t a, uint32_t b);
    uint32_t either(uint32_t a, uint32_t b);
    uint32_t no(uint32_t a) { return build_.binary(Fn::Sub, k(1), a); }
    // a >= b, from the sign of their difference, which is exact: its floor is at least 0, or at most -1.
    uint32_t reaches(uint32_t a, uint32_t b);
    // Exact: what is not chosen is multiplied by 0.
    uint32_t choose(uint32_t condition, uint32_t yes, uint32_t other);
    Value choose(uint32_t condition, const Value& yes, const Value& other);
    uint32_t since(size_t first);
    static std::string named(Type t) { return std::string(facts(t).name); }
    bool convert(Value& v, Type to, size_t place);
    bool truth(uint32_t& out);
    bool expression(Value& out);
    bool ternary(Value& out);
    static int level(std::string_view op);
    // Operators that bind tighter than `least`.
    bool binary(Value& out, int least);
    bool compare(std::string_view op, Value& a, const Value& b, size_t place);
    // Makes both the same size; a number stands for a vector of itself.
    bool match(Value& a, Value& b, size_t place);
    bool arithmetic(char symbol, Value& a, Value b, size_t place);
    bool multiply(Value& a, const Value& b, size_t place);
    bool unary(Value& out);
    bool postfix(Value& out);
    // .xy or [n] of a value of type `of`.
    bool picked(Type of, std::array<int, 9>& picks, Type& type);
    bool primary(Value& out);
    bool called(const Token& what, Value& out);
    bool unknown_variable(const Token& t);

    // ---- what comes with the language: expression_glsl_functions.cpp

    bool construct(Type type, const std::vector<Value>& in, size_t place, Value& out);
    bool built_in(const Token& what, std::vector<Value>& in, Value& out);

    std::span<const float> arguments_;
    Builder build_;
    std::vector<Function> functions_;
    std::vector<Variable> globals_, variables_;
    size_t first_visible_ = 0;          // variables below are a caller's
    std::vector<uint32_t> conditions_;  // 0 or 1: whether what is walked happens
    std::vector<Frame> frames_;
    std::vector<Loop> loops_;
    int depth_ = 0, nested_ = 0, steps_ = 0;
};

}  // namespace kiln::sdf::glsl
