// SPDX-License-Identifier: MIT
// The generated shape texts in float (with their host part) and in double, and random parameters made from the rows' own ranges.
#pragma once

#include "mesh_grid.h"
#include "sdf/tables.h"

#include <kiln/edit.h>
#include <kiln/shapes.h>

#include <rapidcheck.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

// Texts shared with GLSL name parameters they do not always use.
#pragma GCC diagnostic ignored "-Wunused-parameter"

namespace kiln::sdf::text32 {
#define KILN_SCALAR float
#define KILN_HOST
#include "sdf/lang/scalar.h"

#include "sdf/lang/host.h"
#define KILN_T real
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/lang/explog.sdf.h"

#include "sdf/texts.gen.inl"
#undef KILN_SCALAR
#undef KILN_SDF
#undef KILN_C
}  // namespace kiln::sdf::text32

namespace kiln::sdf::text64 {
#define KILN_SCALAR double
#include "sdf/lang/scalar.h"

#include "sdf/lang/host.h"

#include "sdf/lang/trig_exact.h"

#include "sdf/texts.gen.inl"
#undef KILN_SCALAR
#undef KILN_HOST
#undef KILN_SDF
#undef KILN_C
}  // namespace kiln::sdf::text64

namespace kiln::sdf {

using Params = std::array<float, kMaxParams>;
using Point = std::array<double, 3>;

inline constexpr int kGridSide = 5;
/// Numbers that every heightfield of these tests reads.
inline constexpr float kGrid[kGridSide * kGridSide] = {0.0f, 0.3f, 0.5f, 1.0f, 0.2f, 0.2f, 0.7f, 0.1f, 0.4f,
                                                       0.9f, 0.9f, 0.3f, 0.2f, 0.6f, 0.1f, 0.1f, 0.0f, 1.0f,
                                                       0.5f, 0.4f, 0.8f, 0.1f, 0.3f, 0.6f, 0.7f};
/// Their largest differences between neighbours.
inline constexpr float kGridStepX = 1.0f;
inline constexpr float kGridStepZ = 0.8f;

/// What a shape reads: the numbers above, or ball_grid() behind one block of others.
inline const float* samples_of(uint32_t kind) {
    static const std::vector<float> ball = [] {
        std::vector<float> out(MeshGrid::kBlock, 7.0f);
        const MeshGrid grid = ball_grid();
        out.insert(out.end(), grid.values.begin(), grid.values.end());
        return out;
    }();
    return shape_rows()[kind].name == "mesh" ? ball.data() : kGrid;
}

class RandomValues {
public:
    explicit RandomValues(uint64_t seed) : engine_(seed) {}
    double in(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(engine_); }
    int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
    bool one_in(int n) { return below(n) == 0; }

    /// A legal value, often at an end of the range.
    float value(const FieldRow& field) {
        const std::string range(field.range);
        if (range == "internal") return 0;
        if (range == "axis") return float(below(3));
        if (range == "flag") return float(below(2));
        if (range == "any") return one_in(8) ? 0.0f : float(in(-2, 2));
        if (range == "> 0") return float(one_in(3) ? std::pow(10.0, in(-3, 2)) : in(0.05, 2));
        if (range == ">= 0") return one_in(5) ? 0.0f : float(in(0, 1.5));
        double lo = 0, hi = 0;
        char open = 0;
        if (std::sscanf(range.c_str(), "integer [%lf, %lf]", &lo, &hi) == 2) {
            return float(int(one_in(4) ? (one_in(2) ? lo : hi) : std::floor(in(lo, std::min(hi, lo + 100)))));
        }
        if (std::sscanf(range.c_str(), "%c%lf, %lf", &open, &lo, &hi) == 3) {
            if (one_in(6)) return float(hi);
            return float(one_in(6) ? lo + (hi - lo) * 1e-3 : in(lo + (hi - lo) * 1e-6, hi));
        }
        ADD_FAILURE() << "unknown range " << range;
        return 0;
    }

    Params params(const KindRow& row) {
        Params out{};
        for (const FieldRow& field : row.fields()) {
            for (int i = 0; i < field.arity; ++i) out[size_t(field.offset + i)] = value(field);
            if (field.name == "columns" || field.name == "rows") out[size_t(field.offset)] = kGridSide;
            if (row.name == "mesh") {
                static const MeshGrid grid = ball_grid();
                const std::pair<const char*, std::array<float, 3>> numbers[] = {
                    {"first", {1}},
                    {"lo", {grid.lo.x, grid.lo.y, grid.lo.z}},
                    {"hi", {grid.hi.x, grid.hi.y, grid.hi.z}},
                    {"cell", {grid.cell}},
                    {"columns", {float(grid.columns)}},
                    {"rows", {float(grid.rows)}}};
                for (const auto& [name, values] : numbers)
                    for (int i = 0; field.name == name && i < field.arity; ++i)
                        out[size_t(field.offset + i)] = values[size_t(i)];
            }
            if (field.name == "step_x") out[size_t(field.offset)] = kGridStepX;
            if (field.name == "step_z") out[size_t(field.offset)] = kGridStepZ;
        }
        return out;
    }

private:
    std::mt19937_64 engine_;
};

/// Runs `property(RandomValues&)` for many seeds; a failing property calls RC_FAIL or RC_ASSERT, and RapidCheck names the seed.
template <typename Property>
void for_all(const std::string& what, Property property) {
    EXPECT_TRUE(rc::check(what, [&] {
        RandomValues random(*rc::gen::noShrink(rc::gen::arbitrary<uint64_t>()));
        property(random);
    }));
}

inline std::string show(const KindRow& row, const Params& w) {
    std::ostringstream out;
    out.precision(9);
    out << row.name << " {";
    for (const FieldRow& field : row.fields()) {
        out << " ." << field.name << " =";
        for (int i = 0; i < field.arity; ++i) out << ' ' << w[size_t(field.offset + i)];
    }
    out << " }";
    return out.str();
}
inline std::string show(const Point& p) {
    std::ostringstream out;
    out.precision(17);
    out << '(' << p[0] << ", " << p[1] << ", " << p[2] << ')';
    return out.str();
}

inline double distance64(uint32_t kind, const Params& w, const Point& p) {
    return text64::shape_distance(kind, {p[0], p[1], p[2]}, w.data(), {samples_of(kind)});
}
inline double distance32(uint32_t kind, const Params& w, const Point& p) {
    return double(text32::shape_distance(kind, {float(p[0]), float(p[1]), float(p[2])}, w.data(), {samples_of(kind)}));
}

/// The box around a shape, infinite faces brought to 2 m, and its size.
struct Around {
    Point lo{}, hi{};
    double size = 0;  ///< largest coordinate
    explicit Around(const text32::Bounds& b) : lo{b.lo.x, b.lo.y, b.lo.z}, hi{b.hi.x, b.hi.y, b.hi.z} {
        for (size_t i = 0; i < 3; ++i) {
            if (!std::isfinite(lo[i])) lo[i] = -2;
            if (!std::isfinite(hi[i])) hi[i] = 2;
            size = std::max({size, std::fabs(lo[i]), std::fabs(hi[i])});
        }
    }
    /// Floats, so that both precisions see the same point. Often near, sometimes far, sometimes on an axis or a plane of symmetry.
    Point point(RandomValues& random) const {
        const double out = random.one_in(4) ? size * random.in(1, 20) : 0.3 * size;
        Point p;
        for (size_t i = 0; i < 3; ++i)
            p[i] = random.one_in(20) ? 0.0 : double(float(random.in(lo[i] - out, hi[i] + out)));
        return p;
    }
};

inline double magnitude(const Point& p) { return std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])}); }
inline double between(const Point& p, const Point& q) { return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]); }
/// A float point at a distance from p of about `reach`.
inline Point beside(RandomValues& random, const Point& p, double reach) {
    Point q;
    for (size_t i = 0; i < 3; ++i) q[i] = double(float(p[i] + random.in(-reach, reach)));
    return q;
}

}  // namespace kiln::sdf
