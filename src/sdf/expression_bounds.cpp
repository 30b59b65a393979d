// SPDX-License-Identifier: MIT
// Interval values and interval gradients of formulas (forward differentiation on intervals), and the slope's bound by subdivision.
// In double, whose rounding (1e-16 a step) is covered by one widening of the end result: 1e-9 of it.

#include "sdf/expression.h"

#include "base/format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <vector>

namespace kiln::sdf {

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

struct Interval {
    double lo = 0, hi = 0;
    double most() const { return std::max(std::fabs(lo), std::fabs(hi)); }
    double least() const { return lo > 0 ? lo : hi < 0 ? -hi : 0; }
    bool finite() const { return std::isfinite(lo) && std::isfinite(hi); }
    bool zero() const { return lo == 0 && hi == 0; }
};
constexpr Interval kAll{-kInf, kInf};

Interval checked(Interval v) { return v.lo <= v.hi ? v : kAll; }  // NaN ends say nothing
Interval hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }
Interval operator+(Interval a, Interval b) { return checked({a.lo + b.lo, a.hi + b.hi}); }
Interval operator-(Interval a, Interval b) { return checked({a.lo - b.hi, a.hi - b.lo}); }
Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
Interval operator*(Interval a, Interval b) {
    if (a.zero() || b.zero()) return {0, 0};  // also of a slope that is not known: what does not change adds none
    const double u = a.lo * b.lo, v = a.lo * b.hi, s = a.hi * b.lo, t = a.hi * b.hi;
    if (std::isnan(u) || std::isnan(v) || std::isnan(s) || std::isnan(t)) return kAll;
    return {std::min({u, v, s, t}), std::max({u, v, s, t})};
}
Interval inverse(Interval b) {
    if (b.lo <= 0 && b.hi >= 0) return kAll;
    return {1 / b.hi, 1 / b.lo};
}
Interval meet(Interval a, Interval b) { return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)}; }
Interval squared(Interval a) { return {a.least() * a.least(), a.most() * a.most()}; }

// Sine over an interval; `crest` is where it is 1.
Interval wave(Interval a, double (*function)(double), double crest) {
    if (!a.finite() || a.most() > 1e8) return {-1, 1};
    constexpr double kTurn = 2 * std::numbers::pi;
    const double slack = 1e-9 * (1 + a.most());
    const double from = (a.lo - slack - crest) / kTurn, to = (a.hi + slack - crest) / kTurn;
    Interval out{std::min(function(a.lo), function(a.hi)), std::max(function(a.lo), function(a.hi))};
    if (std::floor(to) > std::floor(from)) out.hi = 1;
    if (std::floor(to + 0.5) > std::floor(from + 0.5)) out.lo = -1;
    return out;
}
double sine(double x) { return std::sin(x); }
double cosine(double x) { return std::cos(x); }
Interval sine(Interval a) { return wave(a, sine, 0.5 * std::numbers::pi); }
Interval cosine(Interval a) { return wave(a, cosine, 0); }

// A value and how steep it is: the box its gradient lies in, and a bound of the gradient's length (often far smaller than the
// box's, for directions that are known only as "some unit vector").
struct Slope {
    Interval value;
    Interval gradient[3];
    double length = 0;
};

void settle(Slope& s) {
    s.value = checked(s.value);
    double sum = 0;
    for (Interval& g : s.gradient) {
        g = checked(g);
        sum += g.most() * g.most();
    }
    if (std::isnan(s.length)) s.length = kInf;
    s.length = std::min(s.length, std::sqrt(sum));
    for (Interval& g : s.gradient) g = meet(g, {-s.length, s.length});
}

Slope unknown() { return {kAll, {kAll, kAll, kAll}, kInf}; }

// |J v| for a matrix whose rows are the gradients of several values: at most sqrt(|J|_1 |J|_inf), sqrt(|J J'|_inf), and the root of the
// sum of squares.
double stretch_of(const std::vector<const Slope*>& rows) {
    double row_most = 0, column[3] = {0, 0, 0}, squares = 0, products_most = 0;
    for (const Slope* row : rows) {
        double sum = 0, products = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double g = row->gradient[axis].most();
            sum += g;
            column[axis] += g;
        }
        for (const Slope* other : rows) {
            double product = 0;
            for (size_t axis = 0; axis < 3; ++axis) {
                const double g = row->gradient[axis].most(), h = other->gradient[axis].most();
                if (g != 0 && h != 0) product += g * h;
            }
            products += std::min(product, row->length * other->length);
        }
        row_most = std::max(row_most, sum);
        squares += row->length * row->length;
        products_most = std::max(products_most, products);
    }
    const double bounds[3] = {row_most * std::max({column[0], column[1], column[2]}), products_most, squares};
    double least = kInf;
    for (const double b : bounds)
        if (b < least) least = b;  // NaN says nothing
    return std::sqrt(least);
}

class Slopes {
public:
    explicit Slopes(const Formula& formula) : nodes_(formula.nodes), slopes_(nodes_.size()), roots_(nodes_.size()) {
        // Roots of sums of squares are lengths: there the slope stays bounded where the root's own does not.
        for (size_t i = 0; i < nodes_.size(); ++i) {
            if (nodes_[i].fn == Fn::Sqrt) find_squares(nodes_[i].a, roots_[i]);
        }
    }

    const Slope& over(const Interval (&box)[3]) {
        for (size_t i = 0; i < nodes_.size(); ++i) {
            slopes_[i] = one(i, box);
            settle(slopes_[i]);
        }
        return slopes_.back();
    }

private:
    void find_squares(uint32_t top, std::vector<uint32_t>& out) const {
        constexpr size_t kMostTerms = 16;
        std::vector<uint32_t> open{top};
        while (!open.empty()) {
            const uint32_t n = open.back();
            open.pop_back();
            const FormulaNode& node = nodes_[n];
            if (node.fn == Fn::Add && open.size() + out.size() < kMostTerms) {
                open.push_back(node.a);
                open.push_back(node.b);
            } else if (node.fn == Fn::Square) {
                out.push_back(node.a);
            } else if (node.fn == Fn::Constant && node.constant >= 0) {
                // adds nothing to the slope, and only lengthens the root
            } else {
                out.clear();
                return;
            }
        }
    }

    static Slope scaled(const Slope& a, Interval by, Interval value) {
        Slope out;
        out.value = value;
        for (size_t i = 0; i < 3; ++i) out.gradient[i] = a.gradient[i] * by;
        out.length = a.length == 0 ? 0 : a.length * by.most();
        return out;
    }

    Slope one(size_t i, const Interval (&box)[3]) const {
        const FormulaNode& n = nodes_[i];
        const Slope& a = slopes_[n.a];
        const Slope& b = slopes_[n.b];
        Slope out;
        switch (n.fn) {
        case Fn::X:
        case Fn::Y:
        case Fn::Z: {
            const size_t axis = n.fn == Fn::X ? 0 : n.fn == Fn::Y ? 1 : 2;
            out.value = box[axis];
            out.gradient[axis] = {1, 1};
            out.length = 1;
            return out;
        }
        case Fn::Constant:
            out.value = {double(n.constant), double(n.constant)};
            return out;
        case Fn::Negate:
            return scaled(a, {-1, -1}, -a.value);
        case Fn::Abs:
            if (a.value.lo >= 0) return a;
            if (a.value.hi <= 0) return scaled(a, {-1, -1}, -a.value);
            return scaled(a, {-1, 1}, {0, a.value.most()});
        case Fn::Sqrt:
            return root(i, a);
        case Fn::Square:
            return scaled(a, Interval{2, 2} * a.value, squared(a.value));
        case Fn::Floor: {
            out.value = {std::floor(a.value.lo), std::floor(a.value.hi)};
            if (out.value.lo == out.value.hi || a.length == 0) return out;
            return {out.value, {kAll, kAll, kAll}, kInf};  // it jumps
        }
        case Fn::Sin:
            return scaled(a, cosine(a.value), sine(a.value));
        case Fn::Cos:
            return scaled(a, -sine(a.value), cosine(a.value));
        case Fn::Exp: {
            const Interval value{std::exp(std::clamp(a.value.lo, -87.0, 88.0)),
                                 std::exp(std::clamp(a.value.hi, -87.0, 88.0))};
            return scaled(a, a.value.finite() ? value : kAll, value);
        }
        case Fn::Log: {
            const Interval value{std::log(std::max(a.value.lo, 1e-37)), std::log(std::max(a.value.hi, 1e-37))};
            return scaled(a, a.value.lo > 0 ? inverse(a.value) : Interval{0, kInf}, value);
        }
        case Fn::Add:
        case Fn::Sub:
            out.value = n.fn == Fn::Add ? a.value + b.value : a.value - b.value;
            for (size_t k = 0; k < 3; ++k)
                out.gradient[k] = n.fn == Fn::Add ? a.gradient[k] + b.gradient[k] : a.gradient[k] - b.gradient[k];
            out.length = a.length + b.length;
            return out;
        case Fn::Mul:
            out.value = a.value * b.value;
            for (size_t k = 0; k < 3; ++k) out.gradient[k] = a.gradient[k] * b.value + b.gradient[k] * a.value;
            out.length = sum_of(a.length, b.value.most(), b.length, a.value.most());
            return out;
        case Fn::Div: {
            if (b.value.lo <= 0 && b.value.hi >= 0) return unknown();
            const Interval by = inverse(b.value);
            out.value = a.value * by;
            for (size_t k = 0; k < 3; ++k) out.gradient[k] = (a.gradient[k] - out.value * b.gradient[k]) * by;
            out.length = sum_of(a.length, by.most(), b.length, out.value.most() * by.most());
            return out;
        }
        case Fn::Min:
        case Fn::Max: {
            const bool least = n.fn == Fn::Min;
            if (least ? a.value.hi < b.value.lo : b.value.hi < a.value.lo) return a;
            if (least ? b.value.hi < a.value.lo : a.value.hi < b.value.lo) return b;
            out.value = least ? Interval{std::min(a.value.lo, b.value.lo), std::min(a.value.hi, b.value.hi)}
                              : Interval{std::max(a.value.lo, b.value.lo), std::max(a.value.hi, b.value.hi)};
            for (size_t k = 0; k < 3; ++k) out.gradient[k] = hull(a.gradient[k], b.gradient[k]);
            out.length = std::max(a.length, b.length);
            return out;
        }
        case Fn::Atan2: {
            const double nearest = std::sqrt(squared(a.value).lo + squared(b.value).lo);
            const bool cut = b.value.lo <= 0 && a.value.lo <= 0 && a.value.hi >= 0;  // the angle jumps there
            if (cut && a.length + b.length > 0)
                return {{-std::numbers::pi, std::numbers::pi}, {kAll, kAll, kAll}, kInf};
            const double corners[4] = {std::atan2(a.value.lo, b.value.lo), std::atan2(a.value.lo, b.value.hi),
                                       std::atan2(a.value.hi, b.value.lo), std::atan2(a.value.hi, b.value.hi)};
            out.value = {*std::min_element(corners, corners + 4), *std::max_element(corners, corners + 4)};
            const Interval by = inverse(squared(a.value) + squared(b.value));
            for (size_t k = 0; k < 3; ++k) out.gradient[k] = (b.value * a.gradient[k] - a.value * b.gradient[k]) * by;
            out.length = std::sqrt(a.length * a.length + b.length * b.length) / nearest;
            return out;
        }
        case Fn::Mod: {
            if (b.value.lo <= 0 && b.value.hi >= 0) return unknown();
            const Interval times = a.value * inverse(b.value);
            const double whole = std::floor(times.lo);
            if (times.finite() && whole == std::floor(times.hi)) {
                const Interval by{whole, whole};
                out.value = a.value - by * b.value;
                for (size_t k = 0; k < 3; ++k) out.gradient[k] = a.gradient[k] - by * b.gradient[k];
                out.length = a.length + std::fabs(whole) * b.length;
                return out;
            }
            return {hull({0, 0}, b.value), {kAll, kAll, kAll}, kInf};
        }
        default:
            return unknown();
        }
    }

    // a b + c d, where nothing times anything is nothing.
    static double sum_of(double a, double b, double c, double d) { return (a == 0 ? 0 : a * b) + (c == 0 ? 0 : c * d); }

    Slope root(size_t i, const Slope& a) const {
        const Interval value{std::sqrt(std::max(a.value.lo, 0.0)), std::sqrt(std::max(a.value.hi, 0.0))};
        Slope out;
        out.value = value;
        if (a.value.hi < 0) return out;  // 0 all over
        if (a.value.lo > 0) {
            out = scaled(a, {0.5 / value.hi, 0.5 / value.lo}, value);
        } else {
            out = {value, {kAll, kAll, kAll}, a.length == 0 ? 0 : kInf};
        }
        if (roots_[i].empty()) return out;
        std::vector<const Slope*> rows;
        for (uint32_t n : roots_[i]) rows.push_back(&slopes_[n]);
        out.length = std::min(out.length, stretch_of(rows));
        // Along an axis a length grows no faster than its operands do together.
        for (size_t k = 0; k < 3; ++k) {
            double squares = 0;
            for (const Slope* row : rows) squares += row->gradient[k].most() * row->gradient[k].most();
            const double most = std::sqrt(squares);
            if (most < kInf) out.gradient[k] = meet(out.gradient[k], {-most, most});
        }
        return out;
    }

    const std::vector<FormulaNode>& nodes_;
    std::vector<Slope> slopes_;
    std::vector<std::vector<uint32_t>> roots_;
};

struct Cell {
    double bound = 0;  // of the slope inside
    std::array<Interval, 3> box{};
    friend bool operator<(const Cell& a, const Cell& b) { return a.bound < b.bound; }
};

std::string point_text(const std::array<double, 3>& p) {
    return formatted("({:.4g}, {:.4g}, {:.4g})", p[0], p[1], p[2]);
}

}  // namespace

FormulaRange range_over(const Formula& formula, const Box3& box) {
    const Interval sides[3] = {{double(box.min.x), double(box.max.x)},
                               {double(box.min.y), double(box.max.y)},
                               {double(box.min.z), double(box.max.z)}};
    Slopes slopes(formula);
    const Slope& s = slopes.over(sides);
    const auto low = [](double v) { return v - 1e-9 * std::fabs(v) - 1e-12; };
    const auto high = [](double v) { return v + 1e-9 * std::fabs(v) + 1e-12; };
    FormulaRange out;
    out.low = low(s.value.lo);
    out.high = high(s.value.hi);
    for (size_t k = 0; k < 3; ++k) {
        out.slope_low[k] = low(s.gradient[k].lo);
        out.slope_high[k] = high(s.gradient[k].hi);
    }
    out.steepest = high(s.length);
    return out;
}

Result<float> formula_lipschitz(const Formula& formula, vec3 half_extents, float declared) {
    constexpr double kCloseEnough = 1.005;
    constexpr double kRounding = 1 + 1e-6;
    // Some tenths of a second at most: a step of a cell is about 30 ns.
    const int budget = int(std::clamp<size_t>(6000000 / formula.nodes.size(), 256, 8192));
    Slopes slopes(formula);
    double steepest_seen = 0;
    std::array<double, 3> steepest_at{};
    bool broken = false;
    // The slope at a point, from below: the interval rules over a box of no size give the gradient itself, except at a kink.
    const auto look_at = [&](const std::array<double, 3>& p) {
        const Interval box[3] = {{p[0], p[0]}, {p[1], p[1]}, {p[2], p[2]}};
        const Slope& s = slopes.over(box);
        if (!s.value.finite()) {
            if (!broken) steepest_at = p;
            broken = true;
            return 0.0;
        }
        double sum = 0;
        for (const Interval& g : s.gradient) sum += g.least() * g.least();
        if (std::isfinite(sum) && std::sqrt(sum) > steepest_seen && !broken) {
            steepest_seen = std::sqrt(sum);
            steepest_at = p;
        }
        return s.value.lo;
    };
    // And between two points, which a jump cannot hide from.
    const auto look_between = [&](const std::array<double, 3>& p, double at_p, const std::array<double, 3>& q,
                                  double at_q) {
        double apart = 0, reach = 0;
        for (size_t k = 0; k < 3; ++k) {
            apart += (p[k] - q[k]) * (p[k] - q[k]);
            reach = std::max(reach, std::fabs(p[k]));
        }
        apart = std::sqrt(apart);
        const double slope = (std::fabs(at_p - at_q) - 1e-12 * (1 + std::fabs(at_p))) / apart;
        if (broken || !(slope > steepest_seen) || !(apart > 1e-9 * reach)) return;
        steepest_seen = slope;
        steepest_at = p;
    };
    const auto bound_of = [&](const std::array<Interval, 3>& box) {
        const Interval sides[3] = {box[0], box[1], box[2]};
        const Slope& s = slopes.over(sides);
        return s.value.finite() ? s.length : kInf;
    };
    std::priority_queue<Cell> cells;
    Cell whole;
    const double half[3] = {double(half_extents.x), double(half_extents.y), double(half_extents.z)};
    for (size_t k = 0; k < 3; ++k) whole.box[k] = {-half[k], half[k]};
    // All over the box first, so that a declared slope is not only looked at where intervals find it steep
    // (points: Halton, "On the efficiency of certain quasi-random sequences", 1960), each with a neighbour along an axis.
    for (int i = 1; i <= budget / 8 && !broken; ++i) {
        const auto radical_inverse = [](int n, int base) {
            double out = 0, digit = 1.0 / base;
            for (; n > 0; n /= base, digit /= base) out += digit * (n % base);
            return out;
        };
        std::array<double, 3> p{};
        for (size_t k = 0; k < 3; ++k) p[k] = half[k] * (2 * radical_inverse(i, k == 0 ? 2 : k == 1 ? 3 : 5) - 1);
        std::array<double, 3> q = p;
        q[size_t(i % 3)] += (q[size_t(i % 3)] > 0 ? -0.05 : 0.05) * half[size_t(i % 3)];
        const double at_p = look_at(p), at_q = look_at(q);
        look_between(p, at_p, q, at_q);
    }
    whole.bound = bound_of(whole.box);
    cells.push(whole);
    double settled = 0;  // the largest bound of cells too small to cut
    const double smallest = 1e-4 * std::max({half[0], half[1], half[2]});
    for (int used = 1; used < budget && !cells.empty() && !broken;) {
        const Cell top = cells.top();
        // What is asked for is proven, or refuted, or as sharp as it is going to be.
        if (declared > 0 && (top.bound <= double(declared) || steepest_seen > double(declared) * 1.0001)) break;
        if (top.bound <= steepest_seen * kCloseEnough) break;
        cells.pop();
        size_t axis = 0;
        const auto side = [&](size_t k) { return top.box[k].hi - top.box[k].lo; };
        for (size_t k = 1; k < 3; ++k)
            if (side(k) > side(axis)) axis = k;
        if (side(axis) < smallest) {
            settled = std::max(settled, top.bound);
            continue;
        }
        std::array<double, 3> points[2];
        double values[2];
        for (int part = 0; part < 2; ++part) {
            Cell next = top;
            const double middle = 0.5 * (top.box[axis].lo + top.box[axis].hi);
            (part == 0 ? next.box[axis].hi : next.box[axis].lo) = middle;
            next.bound = std::min(top.bound, bound_of(next.box));
            // A point inside, off the middle: kinks like the middles.
            std::array<double, 3>& p = points[part];
            for (size_t k = 0; k < 3; ++k)
                p[k] = next.box[k].lo + (0.41 + 0.07 * double(k)) * (next.box[k].hi - next.box[k].lo);
            values[part] = look_at(p);
            cells.push(next);
            used += 2;
        }
        look_between(points[0], values[0], points[1], values[1]);
    }
    const double proven = std::max({settled, cells.empty() ? 0.0 : cells.top().bound, steepest_seen}) * kRounding;
    if (broken)
        return Error{formatted("its value at {} is not a finite number; keep it finite over half_extents",
                               point_text(steepest_at)),
                     ErrorKind::Input};
    if (declared > 0) {
        if (steepest_seen > double(declared) * 1.0001)
            return Error{formatted("lipschitz {:.6g} does not hold: at {} the slope is {:.6g}; use at least {:.4g}, or "
                                   "leave \"lipschitz\" out",
                                   declared, point_text(steepest_at), steepest_seen, 1.01 * steepest_seen),
                         ErrorKind::Input};
        return declared;
    }
    if (!std::isfinite(proven) || proven > 1e6) {
        const Cell& worst = cells.empty() ? whole : cells.top();
        std::array<double, 3> p{};
        for (size_t k = 0; k < 3; ++k) p[k] = 0.5 * (worst.box[k].lo + worst.box[k].hi);
        return Error{
            formatted(
                "no bound of its slope was found near {} (a jump, a pole or a root of 0?); say how steep it is with "
                "\"lipschitz\", or change it there",
                point_text(p)),
            ErrorKind::Input};
    }
    return proven > 1e-6 ? float(proven) : 1.0f;  // a constant is as steep as we like
}

}  // namespace kiln::sdf
