// SPDX-License-Identifier: MIT
// Walks the tokens and computes as it goes: a call walks the function's tokens, a loop walks its own again. Where it stands only for some
// points, a stack of conditions, numbers that are 0 or 1, says for which; what is assigned there is chosen by them.
// The language: "The OpenGL Shading Language, Version 4.60.8" (Khronos Group, 2023).

#include "sdf/expression_glsl.h"

#include "sdf/expression_build.h"

#include "base/format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace kiln::sdf {

namespace {

constexpr size_t kMaxText = size_t(16) << 20;
constexpr int kMostCalls = 64, kMostNested = 400, kMostSteps = 1000000;

enum class Type : uint8_t { Void, Float, Int, Bool, Vec2, Vec3, Vec4, Mat2, Mat3 };

struct TypeFacts {
    std::string_view name;
    int size;     // numbers
    int columns;  // of a matrix
};
constexpr TypeFacts kTypes[] = {{"void", 0, 0}, {"float", 1, 0}, {"int", 1, 0},  {"bool", 1, 0}, {"vec2", 2, 0},
                                {"vec3", 3, 0}, {"vec4", 4, 0},  {"mat2", 4, 2}, {"mat3", 9, 3}};
const TypeFacts& facts(Type t) { return kTypes[size_t(t)]; }
bool is_number(Type t) { return t == Type::Float || t == Type::Int; }
bool is_vector(Type t) { return t >= Type::Vec2 && t <= Type::Vec4; }
bool is_matrix(Type t) { return t >= Type::Mat2; }
Type vector_of(int size) { return size == 1 ? Type::Float : Type(int(Type::Vec2) + size - 2); }

struct Value {
    Type type = Type::Void;
    std::array<uint32_t, 9> at{};  // matrices by columns
    int size() const { return facts(type).size; }
    std::span<const uint32_t> parts() const { return {at.data(), size_t(size())}; }
};

struct Token {
    enum class Kind : uint8_t { Name, Number, Symbol, End };
    Kind kind = Kind::End;
    std::string_view text;
    size_t place = 0;
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

class Reader {
public:
    Reader(std::string_view text, std::span<const float> arguments) : text_(text), arguments_(arguments) {}

    Result<Formula> run() {
        uint32_t value = 0;
        const bool ok = text_.size() <= kMaxText ? split() && units() && entry(value)
                                                 : fail(0, "longer than 16 MiB; write a shorter function");
        if (!ok) return Error{std::move(error_), ErrorKind::Input};
        return build_.finish(value);
    }

private:
    // ---- text

    bool fail(size_t place, std::string what) {
        error_ = place_in(text_, place) + ": " + std::move(what);
        return false;
    }
    bool fail_here(std::string what) { return fail(now().place, std::move(what)); }
    static std::string seen(const Token& t) {
        return t.kind == Token::Kind::End ? "the end" : "\"" + std::string(t.text.substr(0, 40)) + "\"";
    }

    bool split() {
        static constexpr std::string_view kPairs[] = {"==", "!=", "<=", ">=", "&&", "||", "^^",
                                                      "++", "--", "+=", "-=", "*=", "/="};
        const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
        const auto digit = [](char c) { return c >= '0' && c <= '9'; };
        size_t i = 0;
        const size_t n = text_.size();
        while (i < n) {
            const char c = text_[i];
            const std::string_view two = text_.substr(i, 2);
            if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
                ++i;
            } else if (two == "//") {
                while (i < n && text_[i] != '\n') ++i;
            } else if (two == "/*") {
                const size_t end = text_.find("*/", i + 2);
                if (end == std::string_view::npos) return fail(i, "this comment has no end; add */");
                i = end + 2;
            } else if (letter(c)) {
                const size_t from = i;
                while (i < n && (letter(text_[i]) || digit(text_[i]))) ++i;
                tokens_.push_back({Token::Kind::Name, text_.substr(from, i - from), from});
            } else if (digit(c) || (c == '.' && i + 1 < n && digit(text_[i + 1]))) {
                const size_t from = i;
                double ignored = 0;
                const auto [rest, error] = std::from_chars(text_.data() + i, text_.data() + n, ignored);
                i = size_t(rest - text_.data());
                if (i < n && (text_[i] == 'f' || text_[i] == 'F' || text_[i] == 'u')) ++i;
                if (error != std::errc{} || !(std::fabs(ignored) <= kLargestConstant))
                    return fail(from, "a number out of range; use one below 1e30");
                if (i < n && (letter(text_[i]) || digit(text_[i])))
                    return fail(from, "not a number; use one such as 1, 0.5 or 2e-3");
                tokens_.push_back({Token::Kind::Number, text_.substr(from, i - from), from});
            } else {
                size_t length = 1;
                for (const std::string_view pair : kPairs)
                    if (two == pair) length = 2;
                if (length == 1 && std::string_view("+-*/=<>!?:;,.(){}[]&|").find(c) == std::string_view::npos) {
                    if (c == '#') return fail(i, "# lines are not read; write constants as const float NAME = VALUE;");
                    while (i + length < n && (uint8_t(text_[i + length]) & 0xc0) == 0x80) ++length;
                    return fail(i, formatted("\"{}\" is not of this language; take it out", text_.substr(i, length)));
                }
                tokens_.push_back({Token::Kind::Symbol, text_.substr(i, length), i});
                i += length;
            }
        }
        tokens_.push_back({Token::Kind::End, {}, n});
        return true;
    }
    const Token& now() const { return tokens_[at_]; }
    bool is(std::string_view text) const { return now().kind != Token::Kind::End && now().text == text; }
    bool take(std::string_view text) {
        if (!is(text)) return false;
        ++at_;
        return true;
    }
    bool need(std::string_view text) {
        if (take(text)) return true;
        return fail_here(formatted("\"{}\" is missing before {}; add it", text, seen(now())));
    }
    std::optional<Type> type_here() const {
        for (const TypeFacts& f : kTypes)
            if (is(f.name)) return Type(&f - kTypes);
        return std::nullopt;
    }
    bool name(std::string_view& out) {
        if (now().kind != Token::Kind::Name) return fail_here(formatted("a name is missing before {}", seen(now())));
        out = now().text;
        ++at_;
        return true;
    }
    // Past the bracket that closes the one here.
    bool skip_brackets() {
        const size_t open = at_;
        for (int depth = 0;; ++at_) {
            if (now().kind == Token::Kind::End)
                return fail(tokens_[open].place, "this bracket is not closed; close it");
            if (is("(") || is("{") || is("[")) ++depth;
            if ((is(")") || is("}") || is("]")) && --depth == 0) break;
        }
        ++at_;
        return true;
    }
    bool skip_statement(int nested = 0) {
        if (nested > kMostNested) return fail_here("nested too deeply; write it flatter");
        if (is("{")) return skip_brackets();
        if (take("if")) {
            if (!skip_brackets() || !skip_statement(nested + 1)) return false;
            return !take("else") || skip_statement(nested + 1);
        }
        if (take("for")) return skip_brackets() && skip_statement(nested + 1);
        while (!is(";")) {
            if (is("(") || is("[")) {
                if (!skip_brackets()) return false;
                continue;
            }
            if (now().kind == Token::Kind::End || is("}")) return need(";");
            ++at_;
        }
        ++at_;
        return true;
    }
    bool skip_precision() {
        while (is("highp") || is("mediump") || is("lowp")) ++at_;
        return true;
    }

    // ---- outside functions

    bool units() {
        while (now().kind != Token::Kind::End) {
            if (take("precision")) {
                if (!skip_statement()) return false;
                continue;
            }
            (void)take("const");
            skip_precision();
            const size_t place = now().place;
            const auto type = type_here();
            if (!type) {
                return fail_here(
                    formatted("{} begins no function; write one such as float shape(vec3 p) {{ … }}", seen(now())));
            }
            ++at_;
            std::string_view what;
            if (!name(what)) return false;
            if (!is("(")) {
                if (*type == Type::Void) return fail(place, "a constant of no type; make it a float");
                at_ -= 1;
                if (!declarations(*type, true)) return false;
                continue;
            }
            Function f{*type, what, {}, 0};
            ++at_;
            if (!parameters(f)) return false;
            if (take(";")) continue;  // said beforehand
            if (!is("{")) return need("{");
            f.body = at_;
            if (!skip_brackets()) return false;
            functions_.push_back(std::move(f));
        }
        return true;
    }
    bool parameters(Function& f) {
        if (take("void")) return need(")");
        while (!take(")")) {
            if (!f.parameters.empty() && !need(",")) return false;
            Parameter p;
            (void)take("const");
            if (take("inout")) {
                p.out = true;
            } else if (take("out")) {
                p.in = false, p.out = true;
            } else {
                (void)take("in");
            }
            skip_precision();
            const auto type = type_here();
            if (!type || *type == Type::Void)
                return fail_here(formatted("{} is no type of a parameter; use float, vec3 and the like", seen(now())));
            ++at_;
            p.type = *type;
            if (!is(",") && !is(")") && !name(p.name)) return false;
            f.parameters.push_back(p);
        }
        return true;
    }

    bool entry(uint32_t& out) {
        const auto fits = [](const Function& f) {
            return f.type == Type::Float && !f.parameters.empty() && f.parameters[0].type == Type::Vec3;
        };
        const auto found = std::find_if(functions_.rbegin(), functions_.rend(), fits);
        if (found == functions_.rend())
            return fail(text_.size(),
                        "no function takes a point and returns a distance; write float shape(vec3 p) { … }");
        const Function& f = *found;
        const size_t place = tokens_[f.body].place;
        if (f.parameters.size() != 1 + arguments_.size()) {
            return fail(place, formatted("{} has {} parameters after the point; {} are given", f.name,
                                         f.parameters.size() - 1, arguments_.size()));
        }
        std::vector<Value> in{{Type::Vec3, {build_.variable(Fn::X), build_.variable(Fn::Y), build_.variable(Fn::Z)}}};
        for (size_t i = 0; i < arguments_.size(); ++i) {
            if (!is_number(f.parameters[i + 1].type))
                return fail(place, formatted("parameter {} of {} is no float; make it one", i + 1, f.name));
            in.push_back({Type::Float, {build_.constant(double(arguments_[i]))}});
        }
        Value value;
        std::vector<Value> back;
        if (!call(f, in, back, place, value)) return false;
        out = value.at[0];
        return true;
    }

    // ---- conditions

    uint32_t k(double v) { return build_.constant(v); }
    std::optional<double> known(uint32_t node) const { return build_.number_of(node); }
    uint32_t both(uint32_t a, uint32_t b) {
        if (const auto n = known(a)) return *n == 0 ? a : b;
        if (const auto n = known(b)) return *n == 0 ? b : a;
        return build_.binary(Fn::Mul, a, b);
    }
    uint32_t either(uint32_t a, uint32_t b) {
        if (const auto n = known(a)) return *n == 0 ? b : a;
        if (const auto n = known(b)) return *n == 0 ? a : b;
        return build_.binary(Fn::Max, a, b);
    }
    uint32_t no(uint32_t a) { return build_.binary(Fn::Sub, k(1), a); }
    // a >= b, from the sign of their difference, which is exact: its floor is at least 0, or at most -1.
    uint32_t reaches(uint32_t a, uint32_t b) {
        const uint32_t steps = build_.binary(Fn::Add, build_.unary(Fn::Floor, build_.binary(Fn::Sub, a, b)), k(1));
        return build_.clamp(steps, k(0), k(1));
    }
    // Exact: what is not chosen is multiplied by 0.
    uint32_t choose(uint32_t condition, uint32_t yes, uint32_t other) {
        if (const auto n = known(condition)) return *n != 0 ? yes : other;
        if (yes == other) return yes;
        return build_.binary(Fn::Add, build_.binary(Fn::Mul, yes, condition),
                             build_.binary(Fn::Mul, other, no(condition)));
    }
    Value choose(uint32_t condition, const Value& yes, const Value& other) {
        Value out = yes;
        for (size_t i = 0; i < size_t(yes.size()); ++i) out.at[i] = choose(condition, yes.at[i], other.at[i]);
        return out;
    }
    uint32_t since(size_t first) {
        uint32_t all = k(1);
        for (size_t i = first; i < conditions_.size(); ++i) all = both(all, conditions_[i]);
        return all;
    }

    // ---- statements

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

    bool call(const Function& f, const std::vector<Value>& in, std::vector<Value>& back, size_t place, Value& out) {
        if (depth_ >= kMostCalls)
            return fail(place, formatted("{} calls itself, or calls go too deep; inline them", f.name));
        if (!step(place)) return false;
        ++depth_;
        const size_t from = at_, scope = variables_.size();
        const std::vector<Loop> loops = std::exchange(loops_, {});
        const size_t hidden = std::exchange(first_visible_, scope);
        frames_.push_back({f.type, scope, f.parameters.size(), conditions_.size(), {f.type, {}}, k(0), false});
        for (size_t i = 0; i < f.parameters.size(); ++i)
            variables_.push_back({f.parameters[i].name, in[i], false, conditions_.size()});
        at_ = f.body;
        if (!block()) return false;
        const Frame frame = frames_.back();
        frames_.pop_back();
        if (f.type != Type::Void && !frame.done && known(frame.returned) == 0.0)
            return fail(tokens_[f.body].place, formatted("{} returns nothing; end it with return", f.name));
        back.clear();
        for (size_t i = 0; i < f.parameters.size(); ++i) back.push_back(variables_[scope + i].value);
        variables_.resize(scope);
        first_visible_ = hidden;
        loops_ = loops;
        at_ = from;
        out = frame.result;
        --depth_;
        return fits(place);
    }

    bool fits(size_t place) {
        if (build_.full())
            return fail(place, formatted("more than {} operations; use a smaller function", kMaxFormulaNodes));
        if (build_.not_finite())
            return fail(place, "this comes to no finite number (a division by 0?); change its constants");
        return true;
    }

    bool block() {
        const size_t scope = variables_.size();
        if (!need("{")) return false;
        while (!is("}")) {
            if (now().kind == Token::Kind::End) return need("}");
            if (!statement()) return false;
            if (frames_.back().done || stopped()) break;
        }
        variables_.resize(std::max(scope, frames_.back().first_variable));
        ++at_;
        return true;
    }
    // Nothing that follows in this round of the loop happens for any point.
    bool stopped() const {
        if (loops_.empty()) return false;
        return known(conditions_[loops_.back().broken]) == 0.0 || known(conditions_[loops_.back().skipped]) == 0.0;
    }

    // Equal parts are one node, so a text may ask for far more work than it makes nodes.
    bool step(size_t place) {
        return ++steps_ <= kMostSteps ||
               fail(place, formatted("more than {} calls, rounds of loops and statements; use fewer", kMostSteps));
    }

    bool statement() {
        if (!step(now().place)) return false;
        if (++nested_ > kMostNested) return fail_here("nested too deeply; write it flatter");
        const bool ok = statement_here();
        --nested_;
        return ok;
    }
    bool statement_here() {
        if (take(";")) return true;
        if (is("{")) return inner_block();
        if (take("if")) return if_statement();
        if (take("for")) return for_statement();
        if (is("while") || is("do") || is("switch") || is("struct") || is("discard"))
            return fail_here(formatted("{} is not read; use for or if", seen(now())));
        if (take("return")) return return_statement();
        if (is("break") || is("continue")) {
            if (loops_.empty()) return fail_here(formatted("{} outside a loop; take it out", seen(now())));
            const bool ends = is("break");
            ++at_;
            const size_t at = ends ? loops_.back().broken : loops_.back().skipped;
            conditions_[at] = both(conditions_[at], no(since(at + 1)));
            return need(";");
        }
        if (take("const")) {
            skip_precision();
            const auto type = type_here();
            if (!type || *type == Type::Void)
                return fail_here(formatted("{} is no type; use float, vec3 and the like", seen(now())));
            ++at_;
            return declarations(*type, true);
        }
        skip_precision();
        if (const auto type = type_here(); type && tokens_[at_ + 1].kind == Token::Kind::Name) {
            if (*type == Type::Void) return fail_here("a variable of no type; make it a float");
            ++at_;
            return declarations(*type, false);
        }
        return assignment() && need(";");
    }
    // Braces among a statement's: what they hold may be left early, so their end is found first.
    bool inner_block() {
        const size_t open = at_;
        if (!skip_brackets()) return false;
        const size_t end = at_;
        at_ = open;
        const size_t scope = variables_.size();
        if (!block()) return false;
        variables_.resize(scope);
        at_ = end;
        return true;
    }

    // After the type, up to the semicolon.
    bool declarations(Type type, bool constant) {
        do {
            Variable v{{}, {type, {}}, constant, conditions_.size()};
            const size_t place = now().place;
            if (!name(v.name)) return false;
            if (is("[")) return fail_here("arrays are not read; use variables of their own");
            if (take("=")) {
                Value value;
                if (!expression(value) || !convert(value, type, place)) return false;
                v.value = value;
            } else {
                if (constant) return fail(place, formatted("the constant {} has no value; give it one", v.name));
                for (size_t i = 0; i < size_t(v.value.size()); ++i) v.value.at[i] = k(0);
            }
            if (frames_.empty()) {
                v.conditions = 0;
                globals_.push_back(v);
            } else {
                variables_.push_back(v);
            }
        } while (take(","));
        return need(";");
    }

    bool if_statement() {
        uint32_t condition = 0;
        if (!need("(") || !truth(condition) || !need(")")) return false;
        const size_t scope = variables_.size();
        if (const auto n = known(condition)) {
            const bool yes = *n != 0;
            if (yes ? !branch() : !skip_statement()) return false;
            if (take("else") && (yes ? !skip_statement() : !branch())) return false;
            variables_.resize(scope);
            return true;
        }
        // What a side returned or broke out of reaches the other side's conditions through the frame's and the loop's own.
        conditions_.push_back(condition);
        if (!branch()) return false;
        if (take("else")) {
            conditions_.back() = no(condition);
            if (!branch()) return false;
        }
        conditions_.pop_back();
        variables_.resize(scope);
        return true;
    }
    // One statement that may leave early: where it ends is found first.
    bool branch() {
        const size_t from = at_;
        if (!skip_statement()) return false;
        const size_t end = at_;
        at_ = from;
        if (!statement()) return false;
        at_ = end;
        return true;
    }

    bool for_statement() {
        const size_t scope = variables_.size(), place = now().place;
        if (!need("(")) return false;
        if (!statement()) return false;
        const size_t condition_at = at_;
        size_t step_at = 0;
        // The step and the body are found first; they are walked when it is their turn.
        for (; !is(";"); ++at_)
            if (now().kind == Token::Kind::End) return need(";");
        ++at_;
        step_at = at_;
        at_ = condition_at;
        loops_.push_back({conditions_.size(), conditions_.size() + 1});
        conditions_.push_back(k(1));
        conditions_.push_back(k(1));
        size_t end = 0;
        for (;;) {
            at_ = condition_at;
            uint32_t condition = k(1);
            if (!is(";") && !truth(condition)) return false;
            const auto goes_on = known(condition);
            if (!goes_on)
                return fail(tokens_[condition_at].place,
                            "how often this loop runs depends on the point; bound it by a constant and break");
            at_ = step_at;
            int depth = 0;
            for (; depth > 0 || !is(")"); ++at_) {
                if (is("(")) ++depth;
                if (is(")")) --depth;
                if (now().kind == Token::Kind::End) return need(")");
            }
            ++at_;
            const size_t body = at_;
            if (end == 0) {
                if (!skip_statement()) return false;
                end = at_;
            }
            const bool broken = known(conditions_[loops_.back().broken]) == 0.0;
            if (*goes_on == 0 || broken || frames_.back().done) break;
            if (!step(place)) return false;
            at_ = body;
            conditions_[loops_.back().skipped] = k(1);
            const size_t inner = variables_.size();
            if (!statement()) return false;
            variables_.resize(inner);
            conditions_[loops_.back().skipped] = k(1);
            at_ = step_at;
            // The counter counts for every point.
            const uint32_t kept = std::exchange(conditions_[loops_.back().broken], k(1));
            if (!is(")") && !assignment()) return false;
            conditions_[loops_.back().broken] = kept;
            if (!fits(place)) return false;
        }
        conditions_.resize(loops_.back().broken);
        loops_.pop_back();
        variables_.resize(scope);
        at_ = end;
        return true;
    }

    bool return_statement() {
        const Type type = frames_.back().type;
        const size_t place = now().place;
        Value value{Type::Void, {}};
        if (!is(";")) {
            if (!expression(value)) return false;
            if (type == Type::Void) return fail(place, "this function returns nothing; take the value out");
            if (!convert(value, type, place)) return false;
        } else if (type != Type::Void) {
            return fail(place, "the value to return is missing; add it");
        }
        if (!need(";")) return false;
        Frame& frame = frames_.back();
        const uint32_t here = both(since(frame.first_condition), no(frame.returned));
        frame.result = known(frame.returned) == 0.0 ? value : choose(here, value, frame.result);
        frame.returned = either(frame.returned, here);
        frame.done = known(since(frame.first_condition)) == 1.0;
        return true;
    }

    Variable* find(std::string_view what) {
        for (size_t i = variables_.size(); i-- > first_visible_;)
            if (variables_[i].name == what) return &variables_[i];
        for (Variable& v : globals_)
            if (v.name == what) return &v;
        return nullptr;
    }

    bool target(Target& out) {
        const Token start = now();
        std::string_view what;
        if (!name(what)) return false;
        Variable* const v = find(what);
        if (v == nullptr) return unknown(start);
        if (v->constant || v < variables_.data() || v >= variables_.data() + variables_.size())
            return fail(start.place, formatted("{} is a constant; give the new value another name", what));
        out.variable = size_t(v - variables_.data());
        out.type = v->value.type;
        for (int i = 0; i < 9; ++i) out.parts[size_t(i)] = i;
        while (is(".") || is("[")) {
            std::array<int, 9> picks{};
            Type type = Type::Void;
            if (!picked(out.type, picks, type)) return false;
            std::array<int, 9> parts{};
            for (size_t i = 0; i < size_t(facts(type).size); ++i) parts[i] = out.parts[size_t(picks[i])];
            out.parts = parts;
            out.type = type;
        }
        return true;
    }
    Value read(const Target& t) const {
        Value out{t.type, {}};
        for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = variables_[t.variable].value.at[size_t(t.parts[i])];
        return out;
    }
    void write(const Target& t, const Value& value) {
        uint32_t here = since(variables_[t.variable].conditions);
        // What a parameter was when a function returned goes back to its caller.
        const Frame& frame = frames_.back();
        if (t.variable < frame.first_variable + frame.parameters) here = both(here, no(frame.returned));
        for (size_t i = 0; i < size_t(value.size()); ++i) {
            uint32_t& at = variables_[t.variable].value.at[size_t(t.parts[i])];
            at = choose(here, value.at[i], at);
        }
    }

    // NAME… = VALUE, or a call whose value nobody wants.
    bool assignment() {
        if (now().kind == Token::Kind::Name && tokens_[at_ + 1].text == "(") {
            Value ignored;
            return expression(ignored);
        }
        const size_t place = now().place;
        const bool before = is("++") || is("--");
        const std::string_view first = now().text;
        if (before) ++at_;
        Target to;
        if (!target(to)) return false;
        const Token op = now();
        Value value{Type::Int, {k(1)}};
        if (before || op.text == "++" || op.text == "--") {
            if (!before) ++at_;
            Value sum = read(to);
            if (!arithmetic((before ? first : op.text)[0], sum, value, place)) return false;
            write(to, sum);
            return true;
        }
        if (op.text != "=" && op.text != "+=" && op.text != "-=" && op.text != "*=" && op.text != "/=")
            return fail(op.place, formatted("{} does not follow a variable here; write = and its new value", seen(op)));
        ++at_;
        if (!expression(value)) return false;
        if (op.text != "=") {
            Value was = read(to);
            if (!arithmetic(op.text[0], was, value, op.place)) return false;
            value = was;
        }
        if (!convert(value, to.type, op.place)) return false;
        write(to, value);
        return true;
    }

    // ---- expressions

    static std::string named(Type t) { return std::string(facts(t).name); }

    bool convert(Value& v, Type to, size_t place) {
        if (v.type == to) return true;
        if (to == Type::Float && v.type == Type::Int) {
            v.type = Type::Float;
            return true;
        }
        return fail(place, formatted("a {} where a {} belongs; convert it", named(v.type), named(to)));
    }
    bool truth(uint32_t& out) {
        const size_t place = now().place;
        Value v;
        if (!expression(v) || !convert(v, Type::Bool, place)) return false;
        out = v.at[0];
        return true;
    }

    bool expression(Value& out) {
        if (++nested_ > kMostNested) return fail_here("nested too deeply; name parts of it");
        const bool ok = ternary(out);
        --nested_;
        return ok;
    }
    bool ternary(Value& out) {
        const size_t place = now().place;
        if (!binary(out, 0)) return false;
        if (!take("?")) return true;
        if (out.type != Type::Bool) return fail(place, "what stands before ? is no condition; compare something");
        Value yes, other;
        if (!expression(yes) || !need(":") || !expression(other)) return false;
        if (yes.type != other.type) {
            if (is_number(yes.type) && is_number(other.type)) {
                yes.type = other.type = Type::Float;
            } else {
                return fail(place, formatted("one side of ?: is a {}, the other a {}; make them the same",
                                             named(yes.type), named(other.type)));
            }
        }
        out = choose(out.at[0], yes, other);
        return fits(place);
    }

    static int level(std::string_view op) {
        if (op == "||") return 1;
        if (op == "^^") return 2;
        if (op == "&&") return 3;
        if (op == "==" || op == "!=") return 4;
        if (op == "<" || op == ">" || op == "<=" || op == ">=") return 5;
        if (op == "+" || op == "-") return 6;
        if (op == "*" || op == "/") return 7;
        return 0;
    }
    // Operators that bind tighter than `least`.
    bool binary(Value& out, int least) {
        if (!unary(out)) return false;
        for (;;) {
            const Token op = now();
            const int binds = op.kind == Token::Kind::Symbol ? level(op.text) : 0;
            if (binds <= least) return true;
            ++at_;
            Value right;
            if (!binary(right, binds)) return false;
            if (binds <= 5 ? !compare(op.text, out, right, op.place) : !arithmetic(op.text[0], out, right, op.place))
                return false;
        }
    }
    bool compare(std::string_view op, Value& a, const Value& b, size_t place) {
        if (op == "||" || op == "&&" || op == "^^") {
            if (a.type != Type::Bool || b.type != Type::Bool)
                return fail(place, formatted("{} joins conditions; compare something on both sides", op));
            const uint32_t u = a.at[0], v = b.at[0];
            a.at[0] = op == "&&" ? both(u, v) : op == "||" ? either(u, v) : both(either(u, v), no(both(u, v)));
            return fits(place);
        }
        if (a.type != b.type && !(is_number(a.type) && is_number(b.type)))
            return fail(place, formatted("a {} meets a {}; compare two of a kind", named(a.type), named(b.type)));
        if (op == "==" || op == "!=") {
            uint32_t same = k(1);
            for (size_t i = 0; i < size_t(a.size()); ++i)
                same = both(same, both(reaches(a.at[i], b.at[i]), reaches(b.at[i], a.at[i])));
            a = {Type::Bool, {op == "==" ? same : no(same)}};
            return fits(place);
        }
        if (!is_number(a.type)) return fail(place, formatted("{} compares numbers; take one component", op));
        const uint32_t u = a.at[0], v = b.at[0];
        a = {Type::Bool,
             {op == ">="   ? reaches(u, v)
              : op == "<=" ? reaches(v, u)
                           : no(op == ">" ? reaches(v, u) : reaches(u, v))}};
        return fits(place);
    }

    // Makes both the same size; a number stands for a vector of itself.
    bool match(Value& a, Value& b, size_t place) {
        const auto spread = [](Value& v, Type type) {
            for (size_t i = 1; i < size_t(facts(type).size); ++i) v.at[i] = v.at[0];
            v.type = type;
        };
        if (a.type == b.type && a.type != Type::Bool) return true;
        if (is_number(a.type) && is_number(b.type)) {
            a.type = b.type = Type::Float;
            return true;
        }
        if (is_number(a.type) && (is_vector(b.type) || is_matrix(b.type))) {
            spread(a, b.type);
            return true;
        }
        if (is_number(b.type) && (is_vector(a.type) || is_matrix(a.type))) {
            spread(b, a.type);
            return true;
        }
        return fail(place, formatted("a {} meets a {}; make them the same", named(a.type), named(b.type)));
    }

    bool arithmetic(char symbol, Value& a, Value b, size_t place) {
        if (symbol == '*' && (is_matrix(a.type) || is_matrix(b.type)) && !is_number(a.type) && !is_number(b.type))
            return multiply(a, b, place);
        if (!match(a, b, place)) return false;
        const bool whole = a.type == Type::Int;
        for (size_t i = 0; i < size_t(a.size()); ++i) {
            const Fn fn = symbol == '+' ? Fn::Add : symbol == '-' ? Fn::Sub : symbol == '*' ? Fn::Mul : Fn::Div;
            a.at[i] = build_.binary(fn, a.at[i], b.at[i]);
            if (!whole || fn != Fn::Div) continue;
            const auto quotient = known(a.at[i]);
            if (!quotient)
                return fail(place, "whole numbers that depend on the point cannot be divided; make them floats");
            a.at[i] = k(std::trunc(*quotient));
        }
        return fits(place);
    }
    bool multiply(Value& a, const Value& b, size_t place) {
        const int n = is_matrix(a.type) ? facts(a.type).columns : facts(b.type).columns;
        const int rows_a = is_matrix(a.type) ? n : 1, columns_b = is_matrix(b.type) ? n : 1;
        if ((is_matrix(a.type) ? facts(a.type).columns : a.size()) != n ||
            (is_matrix(b.type) ? facts(b.type).columns : b.size()) != n)
            return fail(place, formatted("a {} times a {}; make their sizes meet", named(a.type), named(b.type)));
        Value out{is_matrix(a.type) && is_matrix(b.type) ? a.type : vector_of(n), {}};
        for (int c = 0; c < columns_b; ++c) {
            for (int r = 0; r < rows_a; ++r) {
                std::array<uint32_t, 3> row{}, column{};
                for (int i = 0; i < n; ++i) {
                    row[size_t(i)] = a.at[size_t(is_matrix(a.type) ? i * n + r : i)];
                    column[size_t(i)] = b.at[size_t(c * n + i)];
                }
                out.at[size_t(c * rows_a + r)] =
                    build_.dot(std::span(row).first(size_t(n)), std::span(column).first(size_t(n)));
            }
        }
        a = out;
        return fits(place);
    }

    bool unary(Value& out) {
        const Token op = now();
        if (op.kind != Token::Kind::Symbol || (op.text != "-" && op.text != "+" && op.text != "!")) return postfix(out);
        if (++nested_ > kMostNested) return fail_here("nested too deeply; name parts of it");
        ++at_;
        if (!unary(out)) return false;
        --nested_;
        if (op.text == "!") {
            if (out.type != Type::Bool) return fail(op.place, "! turns a condition; compare something");
            out.at[0] = no(out.at[0]);
            return true;
        }
        if (out.type == Type::Bool || out.type == Type::Void)
            return fail(op.place, "this is no number; take the sign out");
        for (size_t i = 0; op.text == "-" && i < size_t(out.size()); ++i)
            out.at[i] = build_.unary(Fn::Negate, out.at[i]);
        return true;
    }

    bool postfix(Value& out) {
        if (!primary(out)) return false;
        while (is(".") || is("[")) {
            std::array<int, 9> picks{};
            Type type = Type::Void;
            if (!picked(out.type, picks, type)) return false;
            Value parts{type, {}};
            for (size_t i = 0; i < size_t(parts.size()); ++i) parts.at[i] = out.at[size_t(picks[i])];
            out = parts;
        }
        return true;
    }
    // .xy or [n] of a value of type `of`.
    bool picked(Type of, std::array<int, 9>& picks, Type& type) {
        const Token open = now();
        ++at_;
        if (open.text == "[") {
            Value index;
            const size_t place = now().place;
            if (!expression(index) || !need("]")) return false;
            const auto n = is_number(index.type) ? known(index.at[0]) : std::nullopt;
            const int count = is_matrix(of) ? facts(of).columns : is_vector(of) ? facts(of).size : 0;
            if (count == 0)
                return fail(open.place, formatted("a {} has no components; take the brackets out", named(of)));
            if (!n || *n < 0 || *n >= count)
                return fail(place, formatted("a component's number is a constant, 0 to {}", count - 1));
            type = is_matrix(of) ? vector_of(count) : Type::Float;
            for (int i = 0; i < facts(type).size; ++i) picks[size_t(i)] = int(*n) * facts(type).size + i;
            return true;
        }
        std::string_view letters;
        if (!name(letters)) return false;
        if (!is_vector(of))
            return fail(open.place, formatted(".{} of a {}; only vectors have components", letters, named(of)));
        if (letters.size() > 4) return fail(open.place, "one to four components follow a dot; write for example p.xz");
        for (size_t i = 0; i < letters.size(); ++i) {
            size_t n = std::string_view("xyzw").find(letters[i]);
            if (n == std::string_view::npos) n = std::string_view("rgba").find(letters[i]);
            if (n == std::string_view::npos || int(n) >= facts(of).size)
                return fail(open.place, formatted(".{} of a {}; it has no such component", letters, named(of)));
            picks[i] = int(n);
        }
        type = vector_of(int(letters.size()));
        return true;
    }

    bool primary(Value& out) {
        const Token t = now();
        if (t.kind == Token::Kind::Number) {
            ++at_;
            double value = 0;
            std::from_chars(t.text.data(), t.text.data() + t.text.size(), value);
            const bool whole = t.text.find_first_not_of("0123456789u") == std::string_view::npos;
            out = {whole ? Type::Int : Type::Float, {k(value)}};
            return true;
        }
        if (take("(")) return expression(out) && need(")");
        if (t.kind != Token::Kind::Name)
            return fail_here(formatted("a value is missing before {}; write one, such as p.x", seen(t)));
        if (t.text == "true" || t.text == "false") {
            ++at_;
            out = {Type::Bool, {k(t.text == "true" ? 1 : 0)}};
            return true;
        }
        ++at_;
        if (!is("(")) {
            const Variable* const v = find(t.text);
            if (v == nullptr) return unknown(t);
            out = v->value;
            return true;
        }
        return called(t, out);
    }

    bool called(const Token& what, Value& out) {
        ++at_;
        std::vector<Value> in;
        std::vector<std::optional<Target>> targets;
        while (!take(")")) {
            if (!in.empty() && !need(",")) return false;
            // A variable that stands alone may be written to.
            std::optional<Target> to;
            const size_t from = at_;
            if (now().kind == Token::Kind::Name && tokens_[at_ + 1].text != "(") {
                const Variable* const v = find(now().text);
                Target t;
                if (v != nullptr && !v->constant && v >= variables_.data() &&
                    v < variables_.data() + variables_.size() && target(t) && (is(",") || is(")")))
                    to = t;
                error_.clear();
                at_ = from;
            }
            Value v;
            if (!expression(v)) return false;
            in.push_back(v);
            targets.push_back(to);
        }
        for (const TypeFacts& f : kTypes)
            if (f.name == what.text) return construct(Type(&f - kTypes), in, what.place, out);
        bool named_so = false;
        for (const Function& f : functions_) {
            if (f.name != what.text) continue;
            named_so = true;
            if (f.parameters.size() != in.size()) continue;
            bool same = true;
            for (size_t i = 0; i < in.size(); ++i)
                same = same && (in[i].type == f.parameters[i].type ||
                                (in[i].type == Type::Int && f.parameters[i].type == Type::Float));
            if (!same) continue;
            for (size_t i = 0; i < in.size(); ++i) {
                in[i].type = f.parameters[i].type;
                if (f.parameters[i].out && !targets[i])
                    return fail(what.place,
                                formatted("{} writes to its operand {}; give it a variable", f.name, i + 1));
            }
            std::vector<Value> back;
            const Function copy = f;  // functions_ stays as it is; the call may not move it
            if (!call(copy, in, back, what.place, out)) return false;
            for (size_t i = 0; i < in.size(); ++i)
                if (copy.parameters[i].out) write(*targets[i], back[i]);
            return true;
        }
        if (named_so) {
            std::string types;
            for (const Value& v : in) types += (types.empty() ? "" : ", ") + named(v.type);
            return fail(what.place, formatted("no {} takes ({}); see its parameters", what.text, types));
        }
        return built_in(what, in, out);
    }

    bool construct(Type type, const std::vector<Value>& in, size_t place, Value& out) {
        out = {type, {}};
        const size_t size = size_t(facts(type).size);
        if (in.empty() || size == 0) return fail(place, formatted("{} of nothing; give it numbers", named(type)));
        if (size == 1) {
            const uint32_t v = in[0].at[0];
            if (in.size() != 1 || is_matrix(in[0].type))
                return fail(place, formatted("{} takes one number", named(type)));
            out.at[0] = v;
            if (type == Type::Int && in[0].type == Type::Float) {
                const uint32_t down = build_.unary(Fn::Floor, build_.unary(Fn::Abs, v));  // towards 0
                out.at[0] = choose(reaches(v, k(0)), down, build_.unary(Fn::Negate, down));
            }
            if (type == Type::Bool && in[0].type != Type::Bool)
                out.at[0] = no(both(reaches(v, k(0)), reaches(k(0), v)));
            return true;
        }
        if (in.size() == 1 && in[0].size() == 1) {
            for (size_t i = 0; i < size; ++i)
                out.at[i] = !is_matrix(type) || i % size_t(facts(type).columns + 1) == 0 ? in[0].at[0] : k(0);
            return true;
        }
        if (in.size() == 1 && is_matrix(type) && is_matrix(in[0].type)) {
            const int n = facts(type).columns, from = facts(in[0].type).columns;
            for (int c = 0; c < n; ++c)
                for (int r = 0; r < n; ++r)
                    out.at[size_t(c * n + r)] =
                        c < from && r < from ? in[0].at[size_t(c * from + r)] : k(c == r ? 1 : 0);
            return true;
        }
        size_t filled = 0;
        for (const Value& v : in) {
            if (filled >= size) return fail(place, formatted("{} of too many numbers; it takes {}", named(type), size));
            for (size_t i = 0; i < size_t(v.size()) && filled < size; ++i) out.at[filled++] = v.at[i];
        }
        if (filled < size) return fail(place, formatted("{} of {} numbers; it takes {}", named(type), filled, size));
        return true;
    }

    bool built_in(const Token& what, std::vector<Value>& in, Value& out) {
        const std::string_view f = what.text;
        Builder& b = build_;
        const size_t n = in.size(), place = what.place;
        const auto takes = [&](size_t count) {
            return n == count ||
                   fail(place, formatted("{} has {} operand{} here; it takes {}", f, n, n == 1 ? "" : "s", count));
        };
        for (Value& v : in) {
            if (v.type == Type::Bool && f != "mix" && f != "not")
                return fail(place, formatted("{} of a condition; give it numbers", f));
            if (is_matrix(v.type) && f != "transpose" && f != "determinant")
                return fail(place, formatted("{} of a matrix; give it its columns", f));
        }
        // Of each component, one operand.
        const auto each = [&](auto&& fn) {
            if (!takes(1)) return false;
            out = in[0];
            if (out.type == Type::Int) out.type = Type::Float;
            for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = fn(out.at[i]);
            return fits(place);
        };
        const auto each2 = [&](auto&& fn) {
            if (!takes(2) || !match(in[0], in[1], place)) return false;
            out = in[0];
            for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = fn(in[0].at[i], in[1].at[i]);
            return fits(place);
        };
        const auto each3 = [&](auto&& fn) {
            if (!takes(3)) return false;
            for (int i = 0; i < 2; ++i)
                for (size_t j = 0; j < 2; ++j)
                    if (!match(in[j], in[j + 1], place)) return false;
            if (!match(in[0], in[2], place)) return false;
            out = in[0];
            for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = fn(in[0].at[i], in[1].at[i], in[2].at[i]);
            return fits(place);
        };
        const auto one = [&](Fn fn) { return each([&, fn](uint32_t v) { return b.unary(fn, v); }); };
        const auto two = [&](Fn fn) { return each2([&, fn](uint32_t u, uint32_t v) { return b.binary(fn, u, v); }); };
        const auto scaled = [&](Fn fn, double by) {
            return each([&, fn, by](uint32_t v) { return b.unary(fn, b.binary(Fn::Mul, v, k(by))); });
        };
        constexpr double kLog2 = 0.69314718055994530942, kPi = 3.14159265358979323846;
        if (f == "abs") return one(Fn::Abs);
        if (f == "sqrt") return one(Fn::Sqrt);
        if (f == "floor") return one(Fn::Floor);
        if (f == "sin") return one(Fn::Sin);
        if (f == "cos") return one(Fn::Cos);
        if (f == "exp") return one(Fn::Exp);
        if (f == "log") return one(Fn::Log);
        if (f == "exp2") return scaled(Fn::Exp, kLog2);
        if (f == "log2") return each([&](uint32_t v) { return b.binary(Fn::Mul, b.unary(Fn::Log, v), k(1 / kLog2)); });
        if (f == "radians") return each([&](uint32_t v) { return b.binary(Fn::Mul, v, k(kPi / 180)); });
        if (f == "degrees") return each([&](uint32_t v) { return b.binary(Fn::Mul, v, k(180 / kPi)); });
        if (f == "inversesqrt") return each([&](uint32_t v) { return b.binary(Fn::Div, k(1), b.unary(Fn::Sqrt, v)); });
        if (f == "tan") return each([&](uint32_t v) { return b.tan(v); });
        if (f == "asin") return each([&](uint32_t v) { return b.asin(v); });
        if (f == "acos") return each([&](uint32_t v) { return b.acos(v); });
        if (f == "ceil") return each([&](uint32_t v) { return b.ceil(v); });
        if (f == "round" || f == "roundEven") return each([&](uint32_t v) { return b.round(v); });
        if (f == "fract") return each([&](uint32_t v) { return b.fract(v); });
        if (f == "trunc") {
            return each([&](uint32_t v) {
                const uint32_t down = b.unary(Fn::Floor, b.unary(Fn::Abs, v));
                return choose(reaches(v, k(0)), down, b.unary(Fn::Negate, down));
            });
        }
        if (f == "sign") return each([&](uint32_t v) { return b.binary(Fn::Sub, reaches(v, k(0)), reaches(k(0), v)); });
        if (f == "atan") {
            if (n == 2) return two(Fn::Atan2);
            return each([&](uint32_t v) { return b.binary(Fn::Atan2, v, k(1)); });
        }
        if (f == "min") return two(Fn::Min);
        if (f == "max") return two(Fn::Max);
        if (f == "mod") return two(Fn::Mod);
        if (f == "pow") return each2([&](uint32_t u, uint32_t v) { return b.power(u, v); });
        if (f == "step") return each2([&](uint32_t edge, uint32_t v) { return reaches(v, edge); });
        if (f == "clamp") return each3([&](uint32_t v, uint32_t low, uint32_t high) { return b.clamp(v, low, high); });
        if (f == "smoothstep")
            return each3([&](uint32_t low, uint32_t high, uint32_t v) { return b.smoothstep(low, high, v); });
        if (f == "mix") {
            if (n == 3 && in[2].type == Type::Bool) {
                if (!match(in[0], in[1], place)) return false;
                out = choose(in[2].at[0], in[1], in[0]);
                return fits(place);
            }
            for (const Value& v : in)
                if (v.type == Type::Bool) return fail(place, "mix of conditions; give it numbers");
            return each3([&](uint32_t u, uint32_t v, uint32_t t) { return b.mix(u, v, t); });
        }
        if (f == "not") {
            if (!takes(1)) return false;
            if (in[0].type != Type::Bool) return fail(place, "not of a number; compare something");
            out = {Type::Bool, {no(in[0].at[0])}};
            return true;
        }
        if (f == "length") {
            if (!takes(1)) return false;
            out = {Type::Float, {b.length(in[0].parts())}};
            return fits(place);
        }
        if (f == "dot" || f == "distance") {
            if (!takes(2) || !match(in[0], in[1], place)) return false;
            for (size_t i = 0; f == "distance" && i < size_t(in[0].size()); ++i)
                in[0].at[i] = b.binary(Fn::Sub, in[0].at[i], in[1].at[i]);
            out = {Type::Float, {f == "dot" ? b.dot(in[0].parts(), in[1].parts()) : b.length(in[0].parts())}};
            return fits(place);
        }
        if (f == "normalize") {
            if (!takes(1)) return false;
            out = in[0];
            const uint32_t size = b.length(in[0].parts());
            for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = b.binary(Fn::Div, out.at[i], size);
            return fits(place);
        }
        if (f == "cross") {
            if (!takes(2)) return false;
            if (in[0].type != Type::Vec3 || in[1].type != Type::Vec3)
                return fail(place, "cross takes two vec3; make them so");
            const auto minor = [&](size_t i, size_t j) {
                return b.binary(Fn::Sub, b.binary(Fn::Mul, in[0].at[i], in[1].at[j]),
                                b.binary(Fn::Mul, in[0].at[j], in[1].at[i]));
            };
            out = {Type::Vec3, {minor(1, 2), minor(2, 0), minor(0, 1)}};
            return fits(place);
        }
        if (f == "reflect") {
            if (!takes(2) || !match(in[0], in[1], place)) return false;
            const uint32_t twice = b.binary(Fn::Mul, k(2), b.dot(in[1].parts(), in[0].parts()));
            out = in[0];
            for (size_t i = 0; i < size_t(out.size()); ++i)
                out.at[i] = b.binary(Fn::Sub, in[0].at[i], b.binary(Fn::Mul, twice, in[1].at[i]));
            return fits(place);
        }
        if (f == "transpose") {
            if (!takes(1)) return false;
            if (!is_matrix(in[0].type)) return fail(place, "transpose takes a matrix");
            out = in[0];
            const size_t side = size_t(facts(out.type).columns);
            for (size_t c = 0; c < side; ++c)
                for (size_t r = 0; r < side; ++r) out.at[c * side + r] = in[0].at[r * side + c];
            return true;
        }
        return unknown(what, "function");
    }

    bool unknown(const Token& t, std::string_view what = "variable") {
        return fail(t.place, formatted("there is no {} \"{}\" here; declare it before", what, t.text.substr(0, 40)));
    }

    std::string_view text_;
    std::span<const float> arguments_;
    std::vector<Token> tokens_;
    size_t at_ = 0;
    Builder build_;
    std::vector<Function> functions_;
    std::vector<Variable> globals_, variables_;
    size_t first_visible_ = 0;          // variables below are a caller's
    std::vector<uint32_t> conditions_;  // 0 or 1: whether what is walked happens
    std::vector<Frame> frames_;
    std::vector<Loop> loops_;
    int depth_ = 0, nested_ = 0, steps_ = 0;
    std::string error_;
};

}  // namespace

Result<Formula> read_glsl(std::string_view text, std::span<const float> arguments) {
    return Reader(text, arguments).run();
}

}  // namespace kiln::sdf
