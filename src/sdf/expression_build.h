// SPDX-License-Identifier: MIT
// Builds a formula's graph: equal nodes once, constants folded (in double, then rounded to float). What both readers use.
#pragma once

#include "sdf/expression.h"

#include <optional>
#include <span>
#include <string>
#include <unordered_map>

namespace kiln::sdf {

/// Beyond it, squares leave the float range.
inline constexpr double kLargestConstant = 1e30;

/// What `fn` gives for numbers, with the standard library's functions. Sqrt and Log as formulas define them below 0.
double apply(Fn fn, double a, double b);

class Builder {
public:
    uint32_t constant(double value);
    uint32_t variable(Fn fn) { return node(fn, 0, 0, 0); }
    uint32_t unary(Fn fn, uint32_t a);
    uint32_t binary(Fn fn, uint32_t a, uint32_t b);
    uint32_t power(uint32_t a, uint32_t b);
    uint32_t ceil(uint32_t a);
    uint32_t round(uint32_t a);
    uint32_t tan(uint32_t a);
    uint32_t asin(uint32_t a);
    uint32_t acos(uint32_t a);
    uint32_t fract(uint32_t a) { return binary(Fn::Sub, a, unary(Fn::Floor, a)); }
    uint32_t clamp(uint32_t v, uint32_t low, uint32_t high) { return binary(Fn::Min, binary(Fn::Max, v, low), high); }
    uint32_t mix(uint32_t a, uint32_t b, uint32_t t) {
        return binary(Fn::Add, a, binary(Fn::Mul, binary(Fn::Sub, b, a), t));
    }
    uint32_t smoothstep(uint32_t low, uint32_t high, uint32_t v);
    uint32_t dot(std::span<const uint32_t> a, std::span<const uint32_t> b);
    uint32_t length(std::span<const uint32_t> v) {
        return v.size() == 1 ? unary(Fn::Abs, v[0]) : unary(Fn::Sqrt, dot(v, v));
    }

    /// The number that a node is, if it is one.
    std::optional<double> number_of(uint32_t n) const {
        return is_constant(n) ? std::optional(number(n)) : std::nullopt;
    }
    bool full() const { return full_; }
    bool not_finite() const { return not_finite_; }  ///< some constant came to NaN or beyond kLargestConstant
    /// The graph of what `value` needs, in an order that keeps few numbers alive.
    Formula finish(uint32_t value) const;

private:
    uint32_t node(Fn fn, uint32_t a, uint32_t b, float constant);
    bool is_constant(uint32_t n) const { return nodes_[n].fn == Fn::Constant; }
    double number(uint32_t n) const { return double(nodes_[n].constant); }

    std::vector<FormulaNode> nodes_;
    std::unordered_multimap<uint64_t, uint32_t> known_;
    bool full_ = false, not_finite_ = false;
};

/// "LINE:COLUMN" of a byte of `text`, from 1; columns count characters.
std::string place_in(std::string_view text, size_t at);

}  // namespace kiln::sdf
