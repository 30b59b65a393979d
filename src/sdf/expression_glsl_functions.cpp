// SPDX-License-Identifier: MIT
// Constructors of types and the built-in functions of numbers and vectors.
#include "sdf/expression_glsl_reader.h"

#include "base/assert.h"
#include "base/format.h"
#include "base/suggest.h"

#include <algorithm>

namespace kiln::sdf::glsl {

namespace {

constexpr std::string_view kBuiltIns[] = {
    "abs",   "sqrt",      "floor",     "sin",         "cos",        "exp",      "log",  "exp2",
    "log2",  "radians",   "degrees",   "inversesqrt", "tan",        "asin",     "acos", "ceil",
    "round", "roundEven", "fract",     "trunc",       "sign",       "atan",     "min",  "max",
    "mod",   "pow",       "step",      "clamp",       "smoothstep", "mix",      "not",  "length",
    "dot",   "distance",  "normalize", "cross",       "reflect",    "transpose"};

}  // namespace

bool Reader::construct(Type type, const std::vector<Value>& in, size_t place, Value& out) {
    out = {type, {}};
    const size_t size = size_t(facts(type).size);
    if (in.empty() || size == 0) return fail(place, formatted("{} of nothing; give it numbers", named(type)));
    if (size == 1) {
        const uint32_t v = in[0].at[0];
        if (in.size() != 1 || is_matrix(in[0].type)) return fail(place, formatted("{} takes one number", named(type)));
        out.at[0] = v;
        if (type == Type::Int && in[0].type == Type::Float) {
            const uint32_t down = build_.unary(Fn::Floor, build_.unary(Fn::Abs, v));  // towards 0
            out.at[0] = choose(reaches(v, k(0)), down, build_.unary(Fn::Negate, down));
        }
        if (type == Type::Bool && in[0].type != Type::Bool) out.at[0] = no(both(reaches(v, k(0)), reaches(k(0), v)));
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
                out.at[size_t(c * n + r)] = c < from && r < from ? in[0].at[size_t(c * from + r)] : k(c == r ? 1 : 0);
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

bool Reader::built_in(const Token& what, std::vector<Value>& in, Value& out) {
    const std::string_view f = what.text;
    Builder& b = build_;
    const size_t n = in.size(), place = what.place;
    if (std::ranges::count(kBuiltIns, f) == 0) {
        std::vector<std::string_view> known(std::begin(kBuiltIns), std::end(kBuiltIns));
        for (const Function& own : functions_) known.push_back(own.name);
        for (const TypeFacts& type : kTypes)
            if (type.size > 0) known.push_back(type.name);
        return fail(place, formatted("there is no function \"{}\" here; {}", f.substr(0, 40),
                                     suggestion(f, known, "declare it before")));
    }
    const auto takes = [&](size_t count) {
        return n == count ||
               fail(place, formatted("{} has {} operand{} here; it takes {}", f, n, n == 1 ? "" : "s", count));
    };
    for (Value& v : in) {
        if (v.type == Type::Bool && f != "mix" && f != "not")
            return fail(place, formatted("{} of a condition; give it numbers", f));
        if (is_matrix(v.type) && f != "transpose")
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
    KILN_ASSERT(false, "{} is in the list of functions and not made", f);
    return false;
}

}  // namespace kiln::sdf::glsl
