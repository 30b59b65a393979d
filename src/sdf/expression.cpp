// SPDX-License-Identifier: MIT
// The text's reader: an operator-precedence parser on stacks of its own (Dijkstra, "Making a Translator for ALGOL 60", 1961), so that
// nesting is limited by memory only.

#include "sdf/expression.h"

#include "sdf/expression_build.h"

#include "base/format.h"
#include "base/suggest.h"

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <string>

namespace kiln::sdf {

namespace {

constexpr size_t kMaxText = size_t(16) << 20;

// A number or a vector of nodes.
struct Value {
    int size = 1;
    std::array<uint32_t, 3> at{};
    size_t place = 0;
};

enum class Call : uint8_t {
    Each1,  // of each component, one operand
    Each2,
    Many,  // min and max
    Ceil,
    Round,
    Fract,
    Tan,
    Asin,
    Acos,
    Atan,
    Pow,
    Clamp,
    Mix,
    Smoothstep,
    SmoothMin,
    SmoothMax,
    Vec2,
    Vec3,
    Length,
    Distance,
    Dot,
    Cross,
    Normalize,
};

struct Function {
    std::string_view name;
    int least, most;  // operands
    Call call;
    Fn fn = Fn::Constant;
};

constexpr int kAny = 1 << 20;
constexpr Function kFunctions[] = {
    {"abs", 1, 1, Call::Each1, Fn::Abs},
    {"sqrt", 1, 1, Call::Each1, Fn::Sqrt},
    {"square", 1, 1, Call::Each1, Fn::Square},
    {"floor", 1, 1, Call::Each1, Fn::Floor},
    {"sin", 1, 1, Call::Each1, Fn::Sin},
    {"cos", 1, 1, Call::Each1, Fn::Cos},
    {"exp", 1, 1, Call::Each1, Fn::Exp},
    {"log", 1, 1, Call::Each1, Fn::Log},
    {"ln", 1, 1, Call::Each1, Fn::Log},
    {"min", 2, kAny, Call::Many, Fn::Min},
    {"max", 2, kAny, Call::Many, Fn::Max},
    {"mod", 2, 2, Call::Each2, Fn::Mod},
    {"atan2", 2, 2, Call::Each2, Fn::Atan2},
    {"ceil", 1, 1, Call::Ceil},
    {"round", 1, 1, Call::Round},
    {"fract", 1, 1, Call::Fract},
    {"tan", 1, 1, Call::Tan},
    {"asin", 1, 1, Call::Asin},
    {"acos", 1, 1, Call::Acos},
    {"atan", 1, 1, Call::Atan},
    {"pow", 2, 2, Call::Pow},
    {"clamp", 3, 3, Call::Clamp},
    {"mix", 3, 3, Call::Mix},
    {"smoothstep", 3, 3, Call::Smoothstep},
    {"smin", 3, 3, Call::SmoothMin},
    {"smax", 3, 3, Call::SmoothMax},
    {"vec2", 2, 2, Call::Vec2},
    {"vec3", 3, 3, Call::Vec3},
    {"length", 1, 1, Call::Length},
    {"distance", 2, 2, Call::Distance},
    {"dot", 2, 2, Call::Dot},
    {"cross", 2, 2, Call::Cross},
    {"normalize", 1, 1, Call::Normalize},
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

class Parser {
public:
    explicit Parser(std::string_view text) : text_(text) {}

    Result<Formula> run() {
        if (text_.size() > kMaxText)
            return Error{"1:1: longer than 16 MiB; write a shorter expression", ErrorKind::Input};
        if (!statements()) return Error{std::move(error_), ErrorKind::Input};
        return build_.finish(result_);
    }

private:
    enum class Kind : uint8_t { Binary, Negate, Paren, Call };
    struct Pending {
        Kind kind;
        char symbol = 0;
        const Function* function = nullptr;
        size_t place = 0;
        size_t first_value = 0;  // Paren, Call: values below it are others'
    };

    bool fail(size_t place, std::string what) {
        error_ = place_in(text_, place) + ": " + std::move(what);
        return false;
    }
    std::string seen(size_t place) const {
        if (place >= text_.size()) return "the end";
        size_t n = 1;
        if (is_letter(text_[place]))
            while (place + n < text_.size() && (is_letter(text_[place + n]) || is_digit(text_[place + n])) && n < 40)
                ++n;
        while (place + n < text_.size() && (uint8_t(text_[place + n]) & 0xc0) == 0x80) ++n;  // a whole UTF-8 letter
        return "\"" + std::string(text_.substr(place, n)) + "\"";
    }
    void skip() {
        while (at_ < text_.size() &&
               (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r'))
            ++at_;
    }
    std::string_view word() {
        const size_t from = at_;
        while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
        return text_.substr(from, at_ - from);
    }

    bool statements() {
        for (;;) {
            skip();
            const size_t from = at_;
            std::string_view name;
            if (at_ < text_.size() && is_letter(text_[at_])) {
                name = word();
                skip();
                if (at_ < text_.size() && text_[at_] == '=') {
                    ++at_;
                } else {
                    name = {};
                    at_ = from;
                }
            }
            Value value;
            if (!expression(value)) return false;
            if (name.empty()) {
                if (at_ < text_.size()) return fail(at_, "a value stands alone before \";\"; give it a name: a = …;");
                if (value.size != 1)
                    return fail(
                        from, formatted("the value is a vector of {}; a distance is one number, such as length(p) - 1",
                                        value.size));
                result_ = value.at[0];
                return true;
            }
            if (at_ == text_.size())
                return fail(at_,
                            formatted("nothing follows \"{} = …\"; end it with \";\" and write the distance", name));
            ++at_;  // the semicolon
            if (known(name)) return fail(from, formatted("\"{}\" has a meaning already; choose another name", name));
            names_.emplace(name, value);
        }
    }
    bool known(std::string_view name) const {
        if (name == "x" || name == "y" || name == "z" || name == "p" || name == "pi" || names_.contains(name))
            return true;
        for (const Function& f : kFunctions)
            if (f.name == name) return true;
        return false;
    }

    // Up to a semicolon or the end.
    bool expression(Value& out) {
        values_.clear();
        pending_.clear();
        bool wants_value = true;
        for (;;) {
            skip();
            const size_t place = at_;
            const char c = at_ < text_.size() ? text_[at_] : '\0';
            const bool ends = at_ == text_.size() || c == ';';
            if (wants_value) {
                if (ends)
                    return fail(place, formatted("a value is missing before {}; write one, such as x", seen(place)));
                if (is_digit(c) || (c == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]))) {
                    if (!number()) return false;
                    wants_value = false;
                } else if (is_letter(c)) {
                    bool called = false;
                    if (!named(called)) return false;
                    wants_value = called;
                } else if (c == '(') {
                    ++at_;
                    pending_.push_back({Kind::Paren, '(', nullptr, place, values_.size()});
                } else if (c == '-') {
                    ++at_;
                    pending_.push_back({Kind::Negate, '-', nullptr, place, 0});
                } else if (c == '+') {
                    ++at_;
                } else {
                    return fail(place, formatted("a value is missing before {}; write one, such as x", seen(place)));
                }
                continue;
            }
            if (ends) {
                if (!reduce(0)) return false;
                if (!pending_.empty()) return fail(pending_.back().place, "this bracket is not closed; add \")\"");
                out = values_.back();
                return true;
            }
            if (c == '+' || c == '-' || c == '*' || c == '/' || c == '^') {
                ++at_;
                if (!reduce(c == '^' ? 5 : level(c))) return false;  // ^ is right-associative
                pending_.push_back({Kind::Binary, c, nullptr, place, 0});
                wants_value = true;
            } else if (c == '.') {
                if (!component()) return false;
            } else if (c == ',') {
                if (!reduce(0)) return false;
                if (pending_.empty() || pending_.back().kind != Kind::Call)
                    return fail(place, "a comma outside a function's operands; take it out, or use . in numbers");
                ++at_;
                wants_value = true;
            } else if (c == ')') {
                if (!reduce(0)) return false;
                if (pending_.empty()) return fail(place, "no bracket is open here; take \")\" out");
                ++at_;
                const Pending open = pending_.back();
                pending_.pop_back();
                if (open.kind == Kind::Call && !call(open)) return false;
            } else {
                return fail(place, formatted("{} is not an operator; use + - * / ^ or take it out", seen(place)));
            }
        }
    }

    static int level(char symbol) {
        return symbol == '+' || symbol == '-' ? 1 : symbol == '*' || symbol == '/' ? 2 : 4;
    }

    // Applies what waits and binds at least as tightly as `least`, up to the innermost bracket.
    bool reduce(int least) {
        while (!pending_.empty()) {
            const Pending top = pending_.back();
            if (top.kind == Kind::Paren || top.kind == Kind::Call) return true;
            if ((top.kind == Kind::Negate ? 3 : level(top.symbol)) < least) return true;
            pending_.pop_back();
            if (top.kind == Kind::Negate) {
                Value& v = values_.back();
                for (int i = 0; i < v.size; ++i) v.at[size_t(i)] = build_.unary(Fn::Negate, v.at[size_t(i)]);
                if (!fits(top.place)) return false;
                continue;
            }
            const Value b = values_.back();
            values_.pop_back();
            if (!binary(top.symbol, values_.back(), b, top.place)) return false;
        }
        return true;
    }

    bool fits(size_t place) {
        if (build_.full())
            return fail(place, formatted("more than {} operations; use a smaller expression", kMaxFormulaNodes));
        if (build_.not_finite())
            return fail(place, "this comes to no finite number (a division by 0?); change its constants");
        return true;
    }

    // Makes both the same size; a number stands for a vector of itself.
    bool match(Value& a, Value& b, size_t place) {
        const auto spread = [](Value& v, int size) {
            for (int i = 1; i < size; ++i) v.at[size_t(i)] = v.at[0];
            v.size = size;
        };
        if (a.size == 1) spread(a, b.size);
        if (b.size == 1) spread(b, a.size);
        if (a.size == b.size) return true;
        return fail(place, formatted("a vector of {} meets a vector of {}; make them the same size", a.size, b.size));
    }

    bool binary(char symbol, Value& a, Value b, size_t place) {
        if (!match(a, b, place)) return false;
        for (size_t i = 0; i < size_t(a.size); ++i) {
            uint32_t& at = a.at[i];
            switch (symbol) {
            case '+':
                at = build_.binary(Fn::Add, at, b.at[i]);
                break;
            case '-':
                at = build_.binary(Fn::Sub, at, b.at[i]);
                break;
            case '*':
                at = build_.binary(Fn::Mul, at, b.at[i]);
                break;
            case '/':
                at = build_.binary(Fn::Div, at, b.at[i]);
                break;
            default:
                at = build_.power(at, b.at[i]);
                break;
            }
        }
        return fits(place);
    }

    bool number() {
        double value = 0;
        const char* end = text_.data() + text_.size();
        const auto [rest, error] = std::from_chars(text_.data() + at_, end, value);
        const size_t place = at_;
        at_ = size_t(rest - text_.data());
        if (error != std::errc{} || !(std::fabs(value) <= kLargestConstant))
            return fail(place, "a number out of range; use one below 1e30");
        if (at_ < text_.size() && is_letter(text_[at_]))
            return fail(at_, formatted("{} follows a number at once; write * between them", seen(at_)));
        push({1, {build_.constant(value)}, place});
        return fits(place);
    }
    void push(Value v) { values_.push_back(v); }

    bool named(bool& called) {
        const size_t place = at_;
        const std::string_view name = word();
        const size_t after = at_;
        skip();
        if (at_ < text_.size() && text_[at_] == '(') {
            for (const Function& f : kFunctions) {
                if (f.name != name) continue;
                ++at_;
                skip();
                if (at_ < text_.size() && text_[at_] == ')')
                    return fail(at_, formatted("{} has no operands here; it takes {}", name, taken(f)));
                pending_.push_back({Kind::Call, '(', &f, place, values_.size()});
                called = true;
                return true;
            }
            return unknown(place, name, "function");
        }
        at_ = after;
        if (name == "x" || name == "y" || name == "z") {
            push({1, {build_.variable(name == "x" ? Fn::X : name == "y" ? Fn::Y : Fn::Z)}, place});
        } else if (name == "p") {
            push({3, {build_.variable(Fn::X), build_.variable(Fn::Y), build_.variable(Fn::Z)}, place});
        } else if (name == "pi") {
            push({1, {build_.constant(3.14159265358979323846)}, place});
        } else if (const auto found = names_.find(name); found != names_.end()) {
            push(found->second);
            values_.back().place = place;
        } else {
            for (const Function& f : kFunctions)
                if (f.name == name)
                    return fail(after, formatted("{} is a function; it takes {} in brackets", name, taken(f)));
            return unknown(place, name, "name");
        }
        return true;
    }
    static std::string taken(const Function& f) {
        return f.most == kAny ? formatted("{} or more operands", f.least)
                              : formatted("{} operand{}", f.least, f.least == 1 ? "" : "s");
    }
    bool unknown(size_t place, std::string_view name, std::string_view what) {
        std::vector<std::string_view> all;
        if (what == "function") {
            for (const Function& f : kFunctions) all.push_back(f.name);
        } else {
            all = {"x", "y", "z", "p", "pi"};
            for (const auto& [n, v] : names_) all.push_back(n);
        }
        std::string mend = "use";
        for (const std::string_view n : all) mend += " " + std::string(n);
        return fail(place,
                    formatted("there is no {} \"{}\"; {}", what, name.substr(0, 40), suggestion(name, all, mend)));
    }

    // .x, .y, .z or several of them.
    bool component() {
        const size_t place = at_++;
        const std::string_view letters = word();
        Value& v = values_.back();
        Value out;
        out.place = v.place;
        out.size = int(letters.size());
        if (letters.empty() || letters.size() > 3)
            return fail(place, "one to three of x, y, z follow a dot; write for example p.x");
        for (size_t i = 0; i < letters.size(); ++i) {
            const char c = letters[i];
            if (c < 'x' || c > 'z') return fail(place, formatted(".{} is no component; use .x, .y or .z", letters));
            if (c - 'x' >= v.size || v.size == 1)
                return fail(place, v.size == 1
                                       ? formatted(".{} of a number; take it out", letters)
                                       : formatted(".{} of a vector of {}; it has no such component", letters, v.size));
            out.at[i] = v.at[size_t(c - 'x')];
        }
        v = out;
        return true;
    }

    static std::span<const uint32_t> parts(const Value& v) { return {v.at.data(), size_t(v.size)}; }

    bool call(const Pending& open) {
        const Function& f = *open.function;
        const size_t place = open.place;
        const size_t count = values_.size() - open.first_value;
        if (int(count) < f.least || int(count) > f.most)
            return fail(place, formatted("{} has {} operand{} here; it takes {}", f.name, count, count == 1 ? "" : "s",
                                         taken(f)));
        std::vector<Value> in(values_.begin() + long(open.first_value), values_.end());
        values_.resize(open.first_value);
        const bool each = f.call <= Call::SmoothMax;
        if (each) {
            for (size_t i = 1; i < count; ++i)
                if (!match(in[0], in[i], place)) return false;
            for (size_t i = 1; i < count; ++i)
                if (!match(in[0], in[i], place)) return false;
        }
        Value out = in[0];
        out.place = place;
        Builder& b = build_;
        const auto k = [&](double v) { return b.constant(v); };
        for (size_t i = 0; each && i < size_t(out.size); ++i) {
            const uint32_t u = in[0].at[i];
            const uint32_t v = count > 1 ? in[1].at[i] : 0;
            const uint32_t w = count > 2 ? in[2].at[i] : 0;
            uint32_t& to = out.at[i];
            switch (f.call) {
            case Call::Each1:
                to = b.unary(f.fn, u);
                break;
            case Call::Each2:
                to = b.binary(f.fn, u, v);
                break;
            case Call::Many:
                to = u;
                for (size_t n = 1; n < count; ++n) to = b.binary(f.fn, to, in[n].at[i]);
                break;
            case Call::Ceil:
                to = b.ceil(u);
                break;
            case Call::Round:
                to = b.round(u);
                break;
            case Call::Fract:
                to = b.fract(u);
                break;
            case Call::Tan:
                to = b.tan(u);
                break;
            case Call::Asin:
                to = b.asin(u);
                break;
            case Call::Acos:
                to = b.acos(u);
                break;
            case Call::Atan:
                to = b.binary(Fn::Atan2, u, k(1));
                break;
            case Call::Pow:
                to = b.power(u, v);
                break;
            case Call::Clamp:
                to = b.clamp(u, v, w);
                break;
            case Call::Mix:
                to = b.mix(u, v, w);
                break;
            case Call::Smoothstep:
                to = b.smoothstep(u, v, w);
                break;
            default: {  // the smooth kernel of the operations
                const bool least = f.call == Call::SmoothMin;
                const uint32_t gap = b.unary(Fn::Abs, b.binary(Fn::Sub, u, v));
                const uint32_t h = b.binary(Fn::Div, b.binary(Fn::Max, b.binary(Fn::Sub, w, gap), k(0)), w);
                const uint32_t bulge = b.binary(Fn::Mul, b.binary(Fn::Mul, b.unary(Fn::Square, h), w), k(0.25));
                to = least ? b.binary(Fn::Sub, b.binary(Fn::Min, u, v), bulge)
                           : b.binary(Fn::Add, b.binary(Fn::Max, u, v), bulge);
                break;
            }
            }
        }
        switch (f.call) {
        case Call::Vec2:
        case Call::Vec3:
            out.size = int(count);
            for (size_t i = 0; i < count; ++i) {
                if (in[i].size != 1)
                    return fail(in[i].place, formatted("{} is made of numbers; take one component of this", f.name));
                out.at[i] = in[i].at[0];
            }
            break;
        case Call::Length:
            out = {1, {b.length(parts(in[0]))}, place};
            break;
        case Call::Distance:
        case Call::Dot:
            if (!match(in[0], in[1], place)) return false;
            if (f.call == Call::Dot) {
                out = {1, {b.dot(parts(in[0]), parts(in[1]))}, place};
            } else {
                for (size_t i = 0; i < size_t(in[0].size); ++i)
                    in[0].at[i] = b.binary(Fn::Sub, in[0].at[i], in[1].at[i]);
                out = {1, {b.length(parts(in[0]))}, place};
            }
            break;
        case Call::Cross: {
            if (in[0].size != 3 || in[1].size != 3)
                return fail(place, "cross takes two vectors of 3; write them as vec3(…)");
            const auto minor = [&](size_t i, size_t j) {
                return b.binary(Fn::Sub, b.binary(Fn::Mul, in[0].at[i], in[1].at[j]),
                                b.binary(Fn::Mul, in[0].at[j], in[1].at[i]));
            };
            out = {3, {minor(1, 2), minor(2, 0), minor(0, 1)}, place};
            break;
        }
        case Call::Normalize: {
            const uint32_t size = b.length(parts(in[0]));
            for (size_t i = 0; i < size_t(out.size); ++i) out.at[i] = b.binary(Fn::Div, in[0].at[i], size);
            break;
        }
        default:
            break;
        }
        values_.push_back(out);
        return fits(place);
    }

    std::string_view text_;
    size_t at_ = 0;
    Builder build_;
    std::vector<Value> values_;
    std::vector<Pending> pending_;
    std::map<std::string_view, Value, std::less<>> names_;
    std::string error_;
    uint32_t result_ = 0;
};

}  // namespace

Result<Formula> parse_formula(std::string_view text) { return Parser(text).run(); }

}  // namespace kiln::sdf
