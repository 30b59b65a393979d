// SPDX-License-Identifier: MIT
// Blocks, declarations, assignments, if, for and return; and calls, which walk a function's statements.
#include "sdf/expression_glsl_reader.h"

#include "base/format.h"

#include <algorithm>
#include <utility>

namespace kiln::sdf::glsl {

namespace {

constexpr int kMostCalls = 64, kMostSteps = 1000000;

}  // namespace

bool Reader::call(const Function& f, const std::vector<Value>& in, std::vector<Value>& back, size_t place, Value& out) {
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

bool Reader::fits(size_t place) {
    if (build_.full())
        return fail(place, formatted("more than {} operations; use a smaller function", kMaxFormulaNodes));
    if (build_.not_finite())
        return fail(place, "this comes to no finite number (a division by 0?); change its constants");
    return true;
}

bool Reader::block() {
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

bool Reader::stopped() const {
    if (loops_.empty()) return false;
    return known(conditions_[loops_.back().broken]) == 0.0 || known(conditions_[loops_.back().skipped]) == 0.0;
}

bool Reader::step(size_t place) {
    return ++steps_ <= kMostSteps ||
           fail(place, formatted("more than {} calls, rounds of loops and statements; use fewer", kMostSteps));
}

bool Reader::statement() {
    if (!step(now().place)) return false;
    if (++nested_ > kMostNested) return fail_here("nested too deeply; write it flatter");
    const bool ok = statement_here();
    --nested_;
    return ok;
}

bool Reader::statement_here() {
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

bool Reader::inner_block() {
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

bool Reader::declarations(Type type, bool constant) {
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

bool Reader::if_statement() {
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

bool Reader::branch() {
    const size_t from = at_;
    if (!skip_statement()) return false;
    const size_t end = at_;
    at_ = from;
    if (!statement()) return false;
    at_ = end;
    return true;
}

bool Reader::for_statement() {
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

bool Reader::return_statement() {
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

Variable* Reader::find(std::string_view what) {
    for (size_t i = variables_.size(); i-- > first_visible_;)
        if (variables_[i].name == what) return &variables_[i];
    for (Variable& v : globals_)
        if (v.name == what) return &v;
    return nullptr;
}

bool Reader::target(Target& out) {
    const Token start = now();
    std::string_view what;
    if (!name(what)) return false;
    Variable* const v = find(what);
    if (v == nullptr) return unknown_variable(start);
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

Value Reader::read(const Target& t) const {
    Value out{t.type, {}};
    for (size_t i = 0; i < size_t(out.size()); ++i) out.at[i] = variables_[t.variable].value.at[size_t(t.parts[i])];
    return out;
}

void Reader::write(const Target& t, const Value& value) {
    uint32_t here = since(variables_[t.variable].conditions);
    // What a parameter was when a function returned goes back to its caller.
    const Frame& frame = frames_.back();
    if (t.variable < frame.first_variable + frame.parameters) here = both(here, no(frame.returned));
    for (size_t i = 0; i < size_t(value.size()); ++i) {
        uint32_t& at = variables_[t.variable].value.at[size_t(t.parts[i])];
        at = choose(here, value.at[i], at);
    }
}

bool Reader::assignment() {
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

}  // namespace kiln::sdf::glsl
