// SPDX-License-Identifier: MIT

#include "sdf/expression_build.h"

#include "base/format.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln::sdf {

namespace {

constexpr std::string_view kNames[] = {"x",   "y",    "z",      "constant", "store", "load", "copy",  "negate",
                                       "abs", "sqrt", "square", "floor",    "sin",   "cos",  "exp",   "log",
                                       "add", "sub",  "mul",    "div",      "min",   "max",  "atan2", "mod"};
static_assert(std::size(kNames) == size_t(Fn::Mod) + 1);

constexpr double kSmallestLogOperand = 1e-37;

}  // namespace

std::string_view fn_name(Fn fn) { return kNames[size_t(fn)]; }

double apply(Fn fn, double a, double b) {
    switch (fn) {
    case Fn::Negate:
        return -a;
    case Fn::Abs:
        return std::fabs(a);
    case Fn::Sqrt:
        return std::sqrt(std::max(a, 0.0));
    case Fn::Square:
        return a * a;
    case Fn::Floor:
        return std::floor(a);
    case Fn::Sin:
        return std::sin(a);
    case Fn::Cos:
        return std::cos(a);
    case Fn::Exp:
        return std::exp(std::clamp(a, -87.0, 88.0));
    case Fn::Log:
        return std::log(std::max(a, kSmallestLogOperand));
    case Fn::Add:
        return a + b;
    case Fn::Sub:
        return a - b;
    case Fn::Mul:
        return a * b;
    case Fn::Div:
        return a / b;
    case Fn::Min:
        return b < a ? b : a;
    case Fn::Max:
        return a < b ? b : a;
    case Fn::Atan2:
        return a == 0 && b == 0 ? 0.0 : std::atan2(a, b);
    case Fn::Mod:
        return a - b * std::floor(a / b);
    default:
        return a;
    }
}

uint32_t Builder::node(Fn fn, uint32_t a, uint32_t b, float constant) {
    const uint64_t key =
        (uint64_t(fn) << 58) ^ (uint64_t(a) << 29) ^ b ^ (uint64_t(std::bit_cast<uint32_t>(constant)) << 7);
    const auto [first, last] = known_.equal_range(key);
    for (auto it = first; it != last; ++it) {
        const FormulaNode& n = nodes_[it->second];
        if (n.fn == fn && n.a == a && n.b == b &&
            std::bit_cast<uint32_t>(n.constant) == std::bit_cast<uint32_t>(constant))
            return it->second;
    }
    if (nodes_.size() >= kMaxFormulaNodes) {
        full_ = true;
        return 0;
    }
    nodes_.push_back({fn, a, b, constant});
    known_.emplace(key, uint32_t(nodes_.size() - 1));
    return uint32_t(nodes_.size() - 1);
}

uint32_t Builder::constant(double value) {
    if (!(std::fabs(value) <= kLargestConstant)) {
        not_finite_ = true;
        value = 0;
    }
    return node(Fn::Constant, 0, 0, float(value));
}

uint32_t Builder::unary(Fn fn, uint32_t a) {
    if (is_constant(a)) return constant(apply(fn, number(a), 0));
    if (fn == Fn::Negate && nodes_[a].fn == Fn::Negate) return nodes_[a].a;
    if (fn == Fn::Abs && (nodes_[a].fn == Fn::Abs || nodes_[a].fn == Fn::Sqrt || nodes_[a].fn == Fn::Square)) return a;
    return node(fn, a, 0, 0);
}

uint32_t Builder::binary(Fn fn, uint32_t a, uint32_t b) {
    if (is_constant(a) && is_constant(b)) return constant(apply(fn, number(a), number(b)));
    if (a == b && (fn == Fn::Min || fn == Fn::Max)) return a;
    if (a == b && fn == Fn::Mul) return unary(Fn::Square, a);
    if (fn == Fn::Div && is_constant(b) && number(b) == 0) not_finite_ = true;
    if (fn == Fn::Mod && is_constant(b) && number(b) == 0) not_finite_ = true;
    // A value of 1 or 0 that changes no bit.
    if (fn == Fn::Mul && is_constant(a) && number(a) == 1) return b;
    if ((fn == Fn::Mul || fn == Fn::Div) && is_constant(b) && number(b) == 1) return a;
    if (fn == Fn::Sub && is_constant(b) && number(b) == 0) return a;
    if ((fn == Fn::Add || fn == Fn::Mul) && a > b) std::swap(a, b);
    return node(fn, a, b, 0);
}

uint32_t Builder::power(uint32_t a, uint32_t b) {
    if (is_constant(b) && number(b) == std::floor(number(b)) && std::fabs(number(b)) <= 64) {
        auto n = uint32_t(std::fabs(number(b)));
        const bool below_one = number(b) < 0;
        uint32_t product = n == 0 ? constant(1) : a;
        bool any = false;
        for (uint32_t square = a; n > 0; n >>= 1, square = n > 0 ? unary(Fn::Square, square) : square) {
            if ((n & 1u) == 0) continue;
            product = any ? binary(Fn::Mul, product, square) : square;
            any = true;
        }
        return below_one ? binary(Fn::Div, constant(1), product) : product;
    }
    return unary(Fn::Exp, binary(Fn::Mul, b, unary(Fn::Log, a)));
}
uint32_t Builder::ceil(uint32_t a) { return unary(Fn::Negate, unary(Fn::Floor, unary(Fn::Negate, a))); }
uint32_t Builder::round(uint32_t a) { return unary(Fn::Floor, binary(Fn::Add, a, constant(0.5))); }
uint32_t Builder::tan(uint32_t a) { return binary(Fn::Div, unary(Fn::Sin, a), unary(Fn::Cos, a)); }
uint32_t Builder::asin(uint32_t a) {
    return binary(Fn::Atan2, a, unary(Fn::Sqrt, binary(Fn::Sub, constant(1), unary(Fn::Square, a))));
}
uint32_t Builder::acos(uint32_t a) {
    return binary(Fn::Atan2, unary(Fn::Sqrt, binary(Fn::Sub, constant(1), unary(Fn::Square, a))), a);
}

uint32_t Builder::smoothstep(uint32_t low, uint32_t high, uint32_t v) {
    const uint32_t share = binary(Fn::Div, binary(Fn::Sub, v, low), binary(Fn::Sub, high, low));
    const uint32_t t = clamp(share, constant(0), constant(1));
    return binary(Fn::Mul, unary(Fn::Square, t), binary(Fn::Sub, constant(3), binary(Fn::Mul, constant(2), t)));
}
uint32_t Builder::dot(std::span<const uint32_t> a, std::span<const uint32_t> b) {
    uint32_t sum = binary(Fn::Mul, a[0], b[0]);
    for (size_t i = 1; i < a.size(); ++i) sum = binary(Fn::Add, sum, binary(Fn::Mul, a[i], b[i]));
    return sum;
}

Formula Builder::finish(uint32_t value) const {
    // How many registers each node would want if it were a tree (Sethi and Ullman): the greedier operand goes first.
    std::vector<uint8_t> want(nodes_.size(), 1);
    for (size_t i = 0; i <= value; ++i) {
        const FormulaNode& n = nodes_[i];
        const int count = operands(n.fn);
        if (count == 0) want[i] = n.fn == Fn::Constant ? 0 : 1;
        if (count == 1) want[i] = std::max<uint8_t>(want[n.a], 1);
        if (count == 2) {
            const int a = want[n.a], b = want[n.b];
            want[i] = uint8_t(std::clamp(a == b ? a + 1 : std::max(a, b), 1, 255));
        }
    }
    Formula out;
    constexpr uint32_t kUnseen = UINT32_MAX;
    std::vector<uint32_t> number(nodes_.size(), kUnseen);
    struct Visit {
        uint32_t node;
        bool done;
    };
    std::vector<Visit> stack{{value, false}};
    while (!stack.empty()) {
        const Visit v = stack.back();
        stack.pop_back();
        if (number[v.node] != kUnseen) continue;
        FormulaNode n = nodes_[v.node];
        const int count = operands(n.fn);
        if (!v.done && count > 0) {
            stack.push_back({v.node, true});
            const bool b_first = count == 2 && want[n.b] > want[n.a];
            if (count == 2) stack.push_back({b_first ? n.a : n.b, false});
            stack.push_back({b_first ? n.b : n.a, false});
            continue;
        }
        if (count > 0) n.a = number[n.a];
        n.b = count == 2 ? number[n.b] : 0;
        number[v.node] = uint32_t(out.nodes.size());
        out.nodes.push_back(n);
    }
    return out;
}

std::string place_in(std::string_view text, size_t at) {
    size_t line = 1, column = 1;
    for (size_t i = 0; i < at && i < text.size(); ++i) {
        if (text[i] == '\n') {
            ++line;
            column = 1;
        } else if ((uint8_t(text[i]) & 0xc0) != 0x80) {
            ++column;
        }
    }
    return formatted("{}:{}", line, column);
}

double evaluate(const Formula& formula, dvec3 p) {
    std::vector<double> value(formula.nodes.size());
    for (size_t i = 0; i < value.size(); ++i) {
        const FormulaNode& n = formula.nodes[i];
        switch (n.fn) {
        case Fn::X:
            value[i] = p.x;
            break;
        case Fn::Y:
            value[i] = p.y;
            break;
        case Fn::Z:
            value[i] = p.z;
            break;
        case Fn::Constant:
            value[i] = double(n.constant);
            break;
        default:
            value[i] = apply(n.fn, value[n.a], value[n.b]);
            break;
        }
    }
    return value.back();
}

}  // namespace kiln::sdf
