// SPDX-License-Identifier: MIT
// What stands outside functions, and which function is the shape.
#include "sdf/expression_glsl.h"

#include "sdf/expression_glsl_reader.h"

#include "base/format.h"

#include <algorithm>
#include <utility>

namespace kiln::sdf {

namespace glsl {

namespace {

constexpr size_t kMaxText = size_t(16) << 20;

}  // namespace

Result<Formula> Reader::run() {
    uint32_t value = 0;
    const bool ok = text_.size() <= kMaxText ? split() && units() && entry(value)
                                             : fail(0, "longer than 16 MiB; write a shorter function");
    if (!ok) return Error{std::move(error_), ErrorKind::Input};
    return build_.finish(value);
}

std::optional<Type> Reader::type_here() const {
    for (const TypeFacts& f : kTypes)
        if (is(f.name)) return Type(&f - kTypes);
    return std::nullopt;
}

bool Reader::units() {
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

bool Reader::parameters(Function& f) {
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

bool Reader::entry(uint32_t& out) {
    const auto fits = [](const Function& f) {
        return f.type == Type::Float && !f.parameters.empty() && f.parameters[0].type == Type::Vec3;
    };
    const auto found = std::find_if(functions_.rbegin(), functions_.rend(), fits);
    if (found == functions_.rend())
        return fail(text_.size(), "no function takes a point and returns a distance; write float shape(vec3 p) { … }");
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

}  // namespace glsl

Result<Formula> read_glsl(std::string_view text, std::span<const float> arguments) {
    return glsl::Reader(text, arguments).run();
}

}  // namespace kiln::sdf
