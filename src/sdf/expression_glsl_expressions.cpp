// SPDX-License-Identifier: MIT
// Operators, components and calls; and what conditions, numbers that are 0 or 1, make of each other.
#include "sdf/expression_glsl_reader.h"

#include "base/format.h"
#include "base/suggest.h"

#include <charconv>
#include <cmath>

namespace kiln::sdf::glsl {

uint32_t Reader::both(uint32_t a, uint32_t b) {
    if (const auto n = known(a)) return *n == 0 ? a : b;
    if (const auto n = known(b)) return *n == 0 ? b : a;
    return build_.binary(Fn::Mul, a, b);
}

uint32_t Reader::either(uint32_t a, uint32_t b) {
    if (const auto n = known(a)) return *n == 0 ? b : a;
    if (const auto n = known(b)) return *n == 0 ? a : b;
    return build_.binary(Fn::Max, a, b);
}

uint32_t Reader::reaches(uint32_t a, uint32_t b) {
    const uint32_t steps = build_.binary(Fn::Add, build_.unary(Fn::Floor, build_.binary(Fn::Sub, a, b)), k(1));
    return build_.clamp(steps, k(0), k(1));
}

uint32_t Reader::choose(uint32_t condition, uint32_t yes, uint32_t other) {
    if (const auto n = known(condition)) return *n != 0 ? yes : other;
    if (yes == other) return yes;
    return build_.binary(Fn::Add, build_.binary(Fn::Mul, yes, condition), build_.binary(Fn::Mul, other, no(condition)));
}

Value Reader::choose(uint32_t condition, const Value& yes, const Value& other) {
    Value out = yes;
    for (size_t i = 0; i < size_t(yes.size()); ++i) out.at[i] = choose(condition, yes.at[i], other.at[i]);
    return out;
}

uint32_t Reader::since(size_t first) {
    uint32_t all = k(1);
    for (size_t i = first; i < conditions_.size(); ++i) all = both(all, conditions_[i]);
    return all;
}

bool Reader::convert(Value& v, Type to, size_t place) {
    if (v.type == to) return true;
    if (to == Type::Float && v.type == Type::Int) {
        v.type = Type::Float;
        return true;
    }
    return fail(place, formatted("a {} where a {} belongs; convert it", named(v.type), named(to)));
}

bool Reader::truth(uint32_t& out) {
    const size_t place = now().place;
    Value v;
    if (!expression(v) || !convert(v, Type::Bool, place)) return false;
    out = v.at[0];
    return true;
}

bool Reader::expression(Value& out) {
    if (++nested_ > kMostNested) return fail_here("nested too deeply; name parts of it");
    const bool ok = ternary(out);
    --nested_;
    return ok;
}

bool Reader::ternary(Value& out) {
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
            return fail(place, formatted("one side of ?: is a {}, the other a {}; make them the same", named(yes.type),
                                         named(other.type)));
        }
    }
    out = choose(out.at[0], yes, other);
    return fits(place);
}

int Reader::level(std::string_view op) {
    if (op == "||") return 1;
    if (op == "^^") return 2;
    if (op == "&&") return 3;
    if (op == "==" || op == "!=") return 4;
    if (op == "<" || op == ">" || op == "<=" || op == ">=") return 5;
    if (op == "+" || op == "-") return 6;
    if (op == "*" || op == "/") return 7;
    return 0;
}

bool Reader::binary(Value& out, int least) {
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

bool Reader::compare(std::string_view op, Value& a, const Value& b, size_t place) {
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

bool Reader::match(Value& a, Value& b, size_t place) {
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

bool Reader::arithmetic(char symbol, Value& a, Value b, size_t place) {
    if (symbol == '*' && (is_matrix(a.type) || is_matrix(b.type)) && !is_number(a.type) && !is_number(b.type))
        return multiply(a, b, place);
    if (!match(a, b, place)) return false;
    const bool whole = a.type == Type::Int;
    for (size_t i = 0; i < size_t(a.size()); ++i) {
        const Fn fn = symbol == '+' ? Fn::Add : symbol == '-' ? Fn::Sub : symbol == '*' ? Fn::Mul : Fn::Div;
        a.at[i] = build_.binary(fn, a.at[i], b.at[i]);
        if (!whole || fn != Fn::Div) continue;
        const auto quotient = known(a.at[i]);
        if (!quotient) return fail(place, "whole numbers that depend on the point cannot be divided; make them floats");
        a.at[i] = k(std::trunc(*quotient));
    }
    return fits(place);
}

bool Reader::multiply(Value& a, const Value& b, size_t place) {
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

bool Reader::unary(Value& out) {
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
    if (out.type == Type::Bool || out.type == Type::Void) return fail(op.place, "this is no number; take the sign out");
    for (size_t i = 0; op.text == "-" && i < size_t(out.size()); ++i) out.at[i] = build_.unary(Fn::Negate, out.at[i]);
    return true;
}

bool Reader::postfix(Value& out) {
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

bool Reader::picked(Type of, std::array<int, 9>& picks, Type& type) {
    const Token open = now();
    ++at_;
    if (open.text == "[") {
        Value index;
        const size_t place = now().place;
        if (!expression(index) || !need("]")) return false;
        const auto n = is_number(index.type) ? known(index.at[0]) : std::nullopt;
        const int count = is_matrix(of) ? facts(of).columns : is_vector(of) ? facts(of).size : 0;
        if (count == 0) return fail(open.place, formatted("a {} has no components; take the brackets out", named(of)));
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

bool Reader::primary(Value& out) {
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
        if (v == nullptr) return unknown_variable(t);
        out = v->value;
        return true;
    }
    return called(t, out);
}

bool Reader::called(const Token& what, Value& out) {
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
            if (v != nullptr && !v->constant && v >= variables_.data() && v < variables_.data() + variables_.size() &&
                target(t) && (is(",") || is(")")))
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
                return fail(what.place, formatted("{} writes to its operand {}; give it a variable", f.name, i + 1));
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

bool Reader::unknown_variable(const Token& t) {
    std::vector<std::string_view> known;
    for (size_t i = first_visible_; i < variables_.size(); ++i) known.push_back(variables_[i].name);
    for (const Variable& v : globals_) known.push_back(v.name);
    return fail(t.place, formatted("there is no variable \"{}\" here; {}", t.text.substr(0, 40),
                                   suggestion(t.text, known, "declare it before")));
}

}  // namespace kiln::sdf::glsl
