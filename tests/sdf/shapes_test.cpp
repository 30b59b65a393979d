// SPDX-License-Identifier: MIT
// Properties of every row of shapes/list.inl, with parameters over their whole range. Together they pin a shape down: its sign
// agrees with an independent definition of its solid, it is 1-Lipschitz (so |f| never exceeds the true distance), and for rows
// marked Exact every outside point finds a surface point at distance f (so it is not less either).

#include "texts.h"

#include "sdf/eval.h"
#include "sdf/program.h"

#include <cstring>

namespace kiln::sdf {
namespace {

class EachShape : public testing::TestWithParam<int> {
protected:
    uint32_t kind() const { return uint32_t(GetParam()); }
    const KindRow& row() const { return shape_rows()[kind()]; }
    std::string name() const { return std::string(row().name); }
};
// Formulas have no text of their own: expression_test.cpp.
std::vector<int> kinds_with_text() {
    std::vector<int> out;
    for (int kind = 0; kind < primitive_count(); ++kind)
        if (shape_rows()[size_t(kind)].how != KindRow::Formula) out.push_back(kind);
    return out;
}
INSTANTIATE_TEST_SUITE_P(Sdf, EachShape, testing::ValuesIn(kinds_with_text()),
                         [](const auto& row) { return std::string(shape_rows()[size_t(row.param)].name); });

// ---- Independent definitions of the solids: true inside. Nothing here is shared with the texts.

double square(double x) { return x * x; }

bool in_prism(int sides, double radius, double x, double z) {
    for (int i = 0; i < sides; ++i) {
        const double angle = (i + 0.5) * 2 * M_PI / sides;
        if (x * std::cos(angle) + z * std::sin(angle) > radius * std::cos(M_PI / sides)) return false;
    }
    return true;
}

// Convex hull of unit vertices that are pairwise at least `neighbour` apart in cosine: every face is a triple of neighbours.
bool in_solid_of_triangles(const std::vector<Point>& vertices, double neighbour, double radius, const Point& p) {
    const auto dot = [](const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    int faces = 0;
    for (size_t i = 0; i < vertices.size(); ++i) {
        for (size_t j = i + 1; j < vertices.size(); ++j) {
            for (size_t k = j + 1; k < vertices.size(); ++k) {
                const Point &a = vertices[i], &b = vertices[j], &c = vertices[k];
                if (std::fabs(dot(a, b) - neighbour) > 1e-9 || std::fabs(dot(b, c) - neighbour) > 1e-9 ||
                    std::fabs(dot(a, c) - neighbour) > 1e-9) {
                    continue;
                }
                ++faces;
                const Point n{a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]};
                if (dot(p, n) > radius * dot(a, n)) return false;
            }
        }
    }
    EXPECT_EQ(faces, vertices.size() == 4 ? 4 : 20);
    return true;
}

std::vector<Point> ring(double y, int count, double first_angle) {
    std::vector<Point> out;
    for (int i = 0; i < count; ++i) {
        const double angle = first_angle + i * 2 * M_PI / count;
        out.push_back({std::sqrt(1 - y * y) * std::cos(angle), y, std::sqrt(1 - y * y) * std::sin(angle)});
    }
    return out;
}

double ground(const Params& w, double x, double z) {
    const double u = std::clamp((x / double(w[0]) + 0.5) * (kGridSide - 1), 0.0, kGridSide - 1.0);
    const double v = std::clamp((z / double(w[1]) + 0.5) * (kGridSide - 1), 0.0, kGridSide - 1.0);
    const int i = std::min(int(u), kGridSide - 2), j = std::min(int(v), kGridSide - 2);
    const auto at = [](int column, int r) { return double(kGrid[r * kGridSide + column]); };
    const double a = at(i, j) * (1 - (u - i)) + at(i + 1, j) * (u - i);
    const double b = at(i, j + 1) * (1 - (u - i)) + at(i + 1, j + 1) * (u - i);
    return double(w[2]) * (a * (1 - (v - j)) + b * (v - j));
}

// The grid of ball_grid(), read by loops.
bool in_mesh(const Point& p) {
    static const MeshGrid grid = ball_grid();
    const double lo[3] = {double(grid.lo.x), double(grid.lo.y), double(grid.lo.z)};
    const double hi[3] = {double(grid.hi.x), double(grid.hi.y), double(grid.hi.z)};
    int cell[3];
    double at[3];
    for (size_t a = 0; a < 3; ++a) {
        if (p[a] < lo[a] || p[a] > hi[a]) return false;
        at[a] = (p[a] - lo[a]) / double(grid.cell);
        cell[a] = int(at[a] / 7);
        at[a] -= 7 * cell[a];
    }
    const auto lattice = [&](int x, int y, int z) {
        return size_t(2 * (cell[0] + x + (grid.columns + 1) * (cell[1] + y + (grid.rows + 1) * (cell[2] + z))));
    };
    const int block = int(grid.values[lattice(0, 0, 0) + 1]);
    int first[3] = {};
    for (size_t a = 0; a < 3; ++a) {
        if (block < 0) at[a] /= 7;
        if (block >= 0) first[a] = std::min(int(at[a]), 6);
        at[a] -= first[a];
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        const int d[3] = {c & 1, c >> 1 & 1, c >> 2};
        double weight = 1;
        for (size_t a = 0; a < 3; ++a) weight *= d[a] == 1 ? at[a] : 1 - at[a];
        const size_t texel =
            block < 0 ? lattice(d[0], d[1], d[2])
                      : size_t(block) * 512 + size_t(first[0] + d[0] + 8 * (first[1] + d[1]) + 64 * (first[2] + d[2]));
        sum += weight * double(grid.values[texel]);
    }
    return sum <= 0;
}

bool inside(std::string_view name, const Params& f, const Point& p) {
    double w[kMaxParams];
    std::copy(f.begin(), f.end(), w);
    const double x = p[0], y = p[1], z = p[2];
    const double ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
    const double r = std::hypot(x, z), size = std::hypot(x, y, z);
    if (name == "sphere") return size <= w[0];
    if (name == "box") return ax <= w[0] && ay <= w[1] && az <= w[2];
    if (name == "rounded_box") {
        const double round = std::min({w[3], w[0], w[1], w[2]});
        return std::hypot(std::max(ax - w[0] + round, 0.0), std::max(ay - w[1] + round, 0.0),
                          std::max(az - w[2] + round, 0.0)) <= round;
    }
    if (name == "box_frame") {
        const auto rim = [&](double a, double h) { return a >= h - std::min(w[3], h); };
        return ax <= w[0] && ay <= w[1] && az <= w[2] &&
               int(rim(ax, w[0])) + int(rim(ay, w[1])) + int(rim(az, w[2])) >= 2;
    }
    if (name == "torus") return square(r - w[0]) + y * y <= w[1] * w[1];
    if (name == "capped_torus") {
        if (std::fabs(std::atan2(z, x)) <= w[2]) return square(r - w[0]) + y * y <= w[1] * w[1];
        return std::hypot(x - w[0] * std::cos(w[2]), y, az - w[0] * std::sin(w[2])) <= w[1];
    }
    if (name == "link") {
        const double way = ay <= w[0] ? ax - w[1] : std::hypot(x, ay - w[0]) - w[1];
        return std::hypot(way, z) <= w[2];
    }
    if (name == "capsule") return (ay <= w[0] ? r : std::hypot(r, ay - w[0])) <= w[1];
    if (name == "cylinder") return ay <= w[0] && r <= w[1];
    if (name == "rounded_cylinder") {
        const double round = std::min({w[2], w[0], w[1]});
        return std::hypot(std::max(r - w[1] + round, 0.0), std::max(ay - w[0] + round, 0.0)) <= round;
    }
    if (name == "cone") return ay <= w[0] && r <= w[1] + (w[2] - w[1]) * (y + w[0]) / (2 * w[0]);
    if (name == "ellipsoid") return square(x / w[0]) + square(y / w[1]) + square(z / w[2]) <= 1;
    if (name == "plane") return y <= 0;
    if (name == "prism") return ay <= w[1] && in_prism(int(w[0]), w[2], x, z);
    if (name == "pyramid") return ay <= w[0] && std::max(ax, az) <= w[1] * (w[0] - y) / (2 * w[0]);
    if (name == "tetrahedron") {
        std::vector<Point> v = ring(-1.0 / 3, 3, 0);
        v.push_back({0, 1, 0});
        return in_solid_of_triangles(v, -1.0 / 3, w[0], p);
    }
    if (name == "octahedron") return ax + ay + az <= w[0];
    if (name == "icosahedron") {
        std::vector<Point> v = ring(std::sqrt(0.2), 5, 0);
        const std::vector<Point> low = ring(-std::sqrt(0.2), 5, M_PI / 5);
        v.insert(v.end(), low.begin(), low.end());
        v.push_back({0, 1, 0});
        v.push_back({0, -1, 0});
        return in_solid_of_triangles(v, std::sqrt(0.2), w[0], p);
    }
    if (name == "cut_sphere") return size <= w[0] && y >= w[1];
    if (name == "solid_angle") return size <= w[0] && std::atan2(r, y) <= w[1];
    if (name == "vesica") return std::hypot(r + std::min(w[1], w[0]), y) <= w[0];
    if (name == "heightfield") return ax <= 0.5 * w[0] && az <= 0.5 * w[1] && y >= -w[2] && y <= ground(f, x, z);
    if (name == "mesh") return in_mesh(p);
    ADD_FAILURE() << "no independent definition of " << name << "; write one";
    return false;
}

TEST_P(EachShape, SignAgreesWithAnIndependentDefinition) {
    for_all(name() + ": sign", [&](RandomValues& random) {
        const Params w = random.params(row());
        const Around around(text32::shape_bounds(kind(), w.data()));
        for (int i = 0; i < 200; ++i) {
            const Point p = around.point(random);
            const double d = distance64(kind(), w, p);
            // Parameters that touch (a full solid angle, a cut at the very top) leave surfaces without thickness.
            if (std::fabs(d) < 1e-6 * std::max(around.size, magnitude(p)) + 1e-9) continue;
            if ((d < 0) != inside(row().name, w, p))
                RC_FAIL(show(row(), w) + " at " + show(p) + " says " + std::to_string(d));
        }
    });
}

TEST_P(EachShape, IsOneLipschitz) {
    for_all(name() + ": |f(p) - f(q)| <= |p - q|", [&](RandomValues& random) {
        const Params w = random.params(row());
        const Around around(text32::shape_bounds(kind(), w.data()));
        for (int i = 0; i < 100; ++i) {
            const Point p = around.point(random);
            const Point q =
                i % 4 == 3 ? around.point(random) : beside(random, p, around.size * std::pow(10.0, random.in(-5, 0.5)));
            const double far = between(p, q);
            const double scale = std::max({around.size, magnitude(p), magnitude(q)});
            // The ellipsoid's iteration stops within 1e-6 of its size.
            const double left = row().name == "ellipsoid" ? 1e-6 : 1e-12;
            if (std::fabs(distance64(kind(), w, p) - distance64(kind(), w, q)) > far * (1 + 1e-6) + left * scale) {
                RC_FAIL(show(row(), w) + " in double, " + show(p) + " " + show(q));
            }
            if (std::fabs(distance32(kind(), w, p) - distance32(kind(), w, q)) > far * (1 + 1e-6) + 5e-6 * scale) {
                RC_FAIL(show(row(), w) + " in float, " + show(p) + " " + show(q));
            }
        }
    });
}

TEST_P(EachShape, FloatAgreesWithDouble) {
    for_all(name() + ": float = double within 1e-5", [&](RandomValues& random) {
        const Params w = random.params(row());
        const Around around(text32::shape_bounds(kind(), w.data()));
        for (int i = 0; i < 200; ++i) {
            const Point p = around.point(random);
            const double difference = std::fabs(distance64(kind(), w, p) - distance32(kind(), w, p));
            if (!(difference <= 1e-5 * std::max(around.size, magnitude(p)))) {
                RC_FAIL(show(row(), w) + " at " + show(p) + " differ by " + std::to_string(difference));
            }
        }
    });
}

TEST_P(EachShape, IsFiniteAtDegenerateAndFarPoints) {
    for_all(name() + ": finite", [&](RandomValues& random) {
        const Params w = random.params(row());
        const double special[] = {0.0,  -0.0,         1e-38,         1e-30,        -1e-20,      1e6,
                                  -1e6, double(w[0]), -double(w[0]), double(w[1]), double(w[2])};
        for (int i = 0; i < 100; ++i) {
            Point p;
            for (double& c : p) c = special[random.below(int(std::size(special)))];
            if (!std::isfinite(distance32(kind(), w, p)) || !std::isfinite(distance64(kind(), w, p))) {
                RC_FAIL(show(row(), w) + " at " + show(p));
            }
        }
    });
}

TEST_P(EachShape, ExactOnesAreExactOutside) {
    if (row().how != KindRow::Exact) GTEST_SKIP() << name() << " is a lower bound";
    int tried = 0, unclear = 0;
    for_all(name() + ": p - f grad f lies on the surface", [&](RandomValues& random) {
        const Params w = random.params(row());
        const Around around(text32::shape_bounds(kind(), w.data()));
        for (int i = 0; i < 50; ++i) {
            // Off the planes of symmetry, where two points can be equally near.
            const Point p = beside(random, around.point(random), 0.01 * around.size);
            const double d = distance64(kind(), w, p);
            const double scale = std::max(around.size, magnitude(p));
            if (d <= 1e-3 * scale) continue;
            ++tried;
            const double h = 1e-7 * scale;
            Point g;
            for (size_t a = 0; a < 3; ++a) {
                Point up = p, down = p;
                up[a] += h;
                down[a] -= h;
                g[a] = (distance64(kind(), w, up) - distance64(kind(), w, down)) / (2 * h);
            }
            const double length = std::hypot(g[0], g[1], g[2]);
            // Where two surface points are equally near there is no gradient; those places have no volume.
            if (length < 1 - 1e-5) {
                ++unclear;
                continue;
            }
            const Point foot{p[0] - d * g[0] / length, p[1] - d * g[1] / length, p[2] - d * g[2] / length};
            const double left = distance64(kind(), w, foot);
            if (std::fabs(left) > 1e-4 * scale)
                RC_FAIL(show(row(), w) + " at " + show(p) + " misses the surface by " + std::to_string(left));
        }
    });
    EXPECT_GT(tried, 1000);
    EXPECT_LT(unclear, tried / 100);
}

// From far away along +x the distance is the way to the supporting plane, but for (size² / far): the face of the tightest box.
TEST_P(EachShape, BoundsAreTheTightestBox) {
    const bool of_box = row().how == KindRow::Sampled;  // its far distance is its box's, whatever the ground
    for_all(name() + ": tight bounds", [&](RandomValues& random) {
        const Params w = random.params(row());
        const text32::Bounds b = text32::shape_bounds(kind(), w.data());
        const Around around(b);
        const Point lo{b.lo.x, b.lo.y, b.lo.z}, hi{b.hi.x, b.hi.y, b.hi.z};
        for (size_t axis = 0; axis < 3; ++axis) {
            for (double sign : {-1.0, 1.0}) {
                const double face = sign < 0 ? lo[axis] : hi[axis];
                if (!std::isfinite(face)) continue;
                Point far{};
                far[axis] = face + sign * 1e5 * around.size;
                const double d = distance64(kind(), w, far);
                const double slack =
                    (d - 1e5 * around.size) / around.size;  // positive: the solid stays away from the face
                if (std::fabs(slack) > 2e-5 && !of_box)
                    RC_FAIL(show(row(), w) + " axis " + std::to_string(axis) + " off by " + std::to_string(slack));
            }
        }
        for (int i = 0; i < 100; ++i) {
            const Point p = around.point(random);
            if (distance64(kind(), w, p) > 0) continue;
            for (size_t a = 0; a < 3; ++a) {
                const double slack = 1e-6 * around.size;
                if (p[a] < lo[a] - slack || p[a] > hi[a] + slack)
                    RC_FAIL(show(row(), w) + " is solid outside its bounds at " + show(p));
            }
        }
    });
}

TEST_P(EachShape, EveryInstructionSetGivesTheSameBytes) {
    HeightGrid grid;
    grid.columns = grid.rows = kGridSide;
    grid.values.assign(std::begin(kGrid), std::end(kGrid));
    const MeshGrid mesh = ball_grid();
    for_all(name() + ": same bytes", [&](RandomValues& random) {
        Edit edit;
        edit.name = "shape";
        edit.node.shape.kind = uint16_t(kind());
        edit.node.shape.params = random.params(row());
        edit.node.shape.data = row().how == KindRow::Sampled ? "0" : "";
        const Result<Program> program =
            compile({.edits = {&edit, 1}, .objects = {}, .grids = {&grid, 1}, .meshes = {&mesh, 1}});
        RC_ASSERT(bool(program));
        const Around around(text32::shape_bounds(kind(), edit.node.shape.params.data()));
        constexpr int kCount = 77;
        std::vector<float> x, y, z, reference(kCount), other(kCount);
        for (int i = 0; i < kCount; ++i) {
            const Point p = around.point(random);
            x.push_back(float(p[0]));
            y.push_back(float(p[1]));
            z.push_back(float(p[2]));
        }
        const Points points{x.data(), y.data(), z.data(), kCount};
        evaluate(view(*program), points, reference.data(), Isa::Scalar);
        for (Isa isa : {Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
            if (!has_isa(isa)) continue;
            evaluate(view(*program), points, other.data(), isa);
            for (int i = 0; i < kCount; ++i) {
                if (std::memcmp(&reference[size_t(i)], &other[size_t(i)], 4) != 0) {
                    RC_FAIL(show(row(), edit.node.shape.params) + " with instruction set " + std::to_string(int(isa)) +
                            " at point " +
                            show(Point{double(x[size_t(i)]), double(y[size_t(i)]), double(z[size_t(i)])}));
                }
            }
        }
        for (int i = 0; i < kCount; ++i) {
            const Point p{double(x[size_t(i)]), double(y[size_t(i)]), double(z[size_t(i)])};
            RC_ASSERT(double(reference[size_t(i)]) == distance32(kind(), edit.node.shape.params, p));
        }
    });
}

// Thin and needle-like ellipsoids are where the iteration has the farthest to go.
TEST(Ellipsoid, IsOneLipschitzAndConvergedForAnyProportions) {
    const uint32_t kind = *shape_kind("ellipsoid");
    for_all("ellipsoid of any proportions", [&](RandomValues& random) {
        Params w{};
        for (size_t i = 0; i < 3; ++i) w[i] = float(std::pow(10.0, random.in(-3, 1)));
        const double size = double(std::max({w[0], w[1], w[2]}));
        const double r[3] = {w[0], w[1], w[2]};
        for (int i = 0; i < 200; ++i) {
            // A surface point and the normal there: beyond it the distance is known in closed form.
            Point n{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
            for (double& c : n) c = random.one_in(3) ? c * std::pow(10.0, random.in(-4, 0)) : c;
            const double norm = std::hypot(n[0], n[1], n[2]);
            const double support = std::hypot(r[0] * n[0], r[1] * n[1], r[2] * n[2]);
            const double out = size * std::pow(10.0, random.in(-4, 1));
            Point p;
            for (size_t a = 0; a < 3; ++a) p[a] = r[a] * r[a] * n[a] / support + out * n[a] / norm;
            const double d = distance64(kind, w, p);
            if (d > out + 1e-12 * size) RC_FAIL(show(shape_rows()[kind], w) + " claims too much at " + show(p));
            if (d < out - 1e-6 * size)
                RC_FAIL(show(shape_rows()[kind], w) + " is " + std::to_string(d / out) + " of the distance at " +
                        show(p));
            const Point q = beside(random, p, out * std::pow(10.0, random.in(-6, 0)));
            if (std::fabs(distance64(kind, w, p) - distance64(kind, w, q)) > between(p, q) * (1 + 1e-6) + 1e-6 * size) {
                RC_FAIL(show(shape_rows()[kind], w) + " " + show(p) + " " + show(q));
            }
        }
    });
}

}  // namespace
}  // namespace kiln::sdf
