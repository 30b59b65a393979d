// SPDX-License-Identifier: MIT
// Every row of domain/list.inl: composed with every shape it stays 1-Lipschitz after division by its own factor, its bounds hold
// the solid, and its map is the inverse of the one that the scene format describes.

#include "texts.h"

#include "sdf/eval.h"
#include "sdf/judge.h"
#include "sdf/program.h"
#include "rounds.h"

#include <functional>

namespace kiln::sdf {
namespace {

class EachWarp : public testing::TestWithParam<int> {
protected:
    uint32_t kind() const { return uint32_t(GetParam()); }
    const KindRow& row() const { return warp_rows()[kind()]; }
    std::string name() const { return std::string(row().name); }
};
INSTANTIATE_TEST_SUITE_P(Sdf, EachWarp, testing::Range(0, int(warp_rows().size())),
                         [](const auto& row) { return std::string(warp_rows()[size_t(row.param)].name); });

// A bounded shape of about a metre.
struct Bare {
    uint32_t kind;
    Params w;
    text32::Bounds bounds;
    explicit Bare(RandomValues& random) : kind(0), w{}, bounds{{0, 0, 0}, {0, 0, 0}} {
        do {
            kind = uint32_t(random.below(primitive_count()));
            w = shape_rows()[kind].how == KindRow::Sampled ? Params{} : random.params(shape_rows()[kind]);
            for (const FieldRow& f : shape_rows()[kind].fields()) {
                if (f.unit != "m") continue;
                for (int i = 0; i < f.arity; ++i) w[size_t(f.offset + i)] = std::min(w[size_t(f.offset + i)], 1.0f);
            }
            bounds = text32::shape_bounds(kind, w.data());
        } while (shape_rows()[kind].how == KindRow::Sampled || shape_rows()[kind].how == KindRow::Formula ||
                 !std::isfinite(bounds.lo.x));
    }
    double at(text64::real3 p) const { return text64::shape_distance(kind, p, w.data(), {samples_of(kind)}); }
};

// What the entry shows of p to the child: one point, or the nearest copies of it.
std::vector<text64::real3> seen(uint32_t kind, const Params& w, const Point& p, double middle) {
    const text64::real3 q(p[0], p[1], p[2]);
    if (warp_rows()[kind].how == KindRow::Value) return {q};
    if (warp_rows()[kind].how == KindRow::Point) return {text64::point_warp(kind, q, w.data())};
    return {text64::copy_warp(kind, q, w.data(), {middle, 0, 0}, {0, 0, 0}),
            text64::copy_warp(kind, q, w.data(), {middle, 0, 0}, {1, 0, 0})};
}

double warped(uint32_t kind, const Params& w, const Bare& bare, const Point& p) {
    double d = std::numeric_limits<double>::infinity();
    for (const text64::real3& q : seen(kind, w, p, 0.5 * double(bare.bounds.lo.x + bare.bounds.hi.x)))
        d = std::min(d, bare.at(q));
    if (warp_rows()[kind].how != KindRow::Value) return d;
    return text64::value_warp(kind, d, {p[0], p[1], p[2]}, w.data());
}

// The edit of one entry over a bare shape.
Edit entry_over(uint32_t kind, const Params& w, const Bare& bare) {
    Edit edit;
    edit.name = "entry";
    edit.node.shape.kind = uint16_t(bare.kind);
    edit.node.shape.params = bare.w;
    edit.node.domain = {Warp{.kind = uint16_t(kind), .params = w}};
    return edit;
}

TEST_P(EachWarp, StaysOneLipschitzOverEveryShape) {
    int refused = 0, tried = 0;
    for_all(name() + ": Lipschitz", [&](RandomValues& random) {
        const Bare bare(random);
        Params w = random.params(row());
        if (name() == "repeat") {  // most shapes fit
            for (size_t axis = 0; axis < 3; ++axis) w[axis] *= 10;
        }
        const Edit edit = entry_over(kind(), w, bare);
        const Result<Program> program = compile({{&edit, 1}, {}, {}});
        ++tried;
        if (!program) {
            ++refused;
            return;
        }
        const Box3& box = program->edits[0].bounds;
        const Around around({{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}});
        for (int i = 0; i < 200; ++i) {
            const Point p = around.point(random);
            const Point q = beside(random, p, around.size * std::pow(10.0, random.in(-4, 0.3)));
            const double change = std::fabs(evaluate(view(*program), dvec3{p[0], p[1], p[2]}) -
                                            evaluate(view(*program), dvec3{q[0], q[1], q[2]}));
            if (change > between(p, q) * (1 + 1e-5) + 2e-6 * (around.size + magnitude(p))) {
                RC_FAIL(show(row(), w) + " over " + show(shape_rows()[bare.kind], bare.w) + " " + show(p) + " " +
                        show(q) + ": " + std::to_string(change / between(p, q)));
            }
        }
    });
    EXPECT_LT(refused, row().how == KindRow::Copies ? tried * 3 / 4 : 1) << "of " << tried;
}

// Every bare point that an entry may put at p, by the forward maps of the scene format.
std::vector<Point> bare_points(std::string_view entry, const Params& f, const Point& p) {
    double w[kMaxParams];
    std::copy(f.begin(), f.end(), w);
    const double x = p[0], y = p[1], z = p[2];
    std::vector<Point> out;
    if (entry == "twist") {
        const double c = std::cos(w[0] * y), s = std::sin(w[0] * y);
        out = {{c * x - s * z, y, s * x + c * z}};
    } else if (entry == "bend") {
        if (w[0] == 0) return {p};
        const double angle = std::atan2(x * w[0], 1 - y * w[0]), r = std::hypot(x, 1 / w[0] - y);
        for (int turn = -4; turn <= 4; ++turn)
            out.push_back({(angle + 2 * M_PI * turn) / w[0], 1 / w[0] - std::copysign(r, w[0]), z});
    } else if (entry == "elongate") {
        out = {p};
        for (size_t a = 0; a < 3; ++a) out[0][a] = p[a] > 0 ? std::max(p[a] - w[a], 0.0) : std::min(p[a] + w[a], 0.0);
    } else if (entry == "mirror") {
        out = {p};
        out[0][size_t(w[0])] = std::fabs(p[size_t(w[0])]);
    } else if (entry == "taper") {
        const double s = std::max(1 - w[0] * y, 0.05);
        out = {{x / s, y, z / s}};
    } else if (entry == "repeat") {
        const auto copies = [&](size_t a) {
            if (w[a] == 0) return std::vector<double>{p[a]};
            std::vector<double> at;
            const int count = w[3 + a] == 0 ? 101 : int(w[3 + a]);
            for (int n = 0; n < count; ++n) {
                const double q = p[a] - (n - 0.5 * (count - 1)) * w[a];
                if (std::fabs(q) < 3) at.push_back(q);  // no bare shape of these tests is larger
            }
            return at;
        };
        for (double a : copies(0)) {
            for (double b : copies(1)) {
                for (double c : copies(2)) out.push_back({a, b, c});
            }
        }
    } else {
        out = {p};
    }
    return out;
}

TEST_P(EachWarp, SolidIsTheImageOfTheBareOne) {
    int64_t solid = 0, empty = 0;
    for_all(name() + ": solid", [&](RandomValues& random) {
        const Bare bare(random);
        Params w = random.params(row());
        if (name() == "repeat") {
            for (size_t axis = 0; axis < 3; ++axis) {
                w[axis] = random.one_in(3) ? 0.0f : float(random.in(1.5, 4));
                w[axis + 3] = float(random.below(5));
            }
        }
        const Edit edit = entry_over(kind(), w, bare);
        const Result<Program> program = compile({{&edit, 1}, {}, {}});
        if (!program) return;
        const Box3& box = program->edits[0].bounds;
        const Around around({{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}});
        for (int i = 0; i < 100; ++i) {
            const Point p = around.point(random);
            double d = std::numeric_limits<double>::infinity();
            for (const Point& q : bare_points(name(), w, p)) d = std::min(d, bare.at({q[0], q[1], q[2]}));
            if (row().how == KindRow::Value) d = text64::value_warp(kind(), d, {p[0], p[1], p[2]}, w.data());
            if (std::fabs(d) < 1e-5 * (1 + around.size)) continue;
            const double value = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
            (d < 0 ? solid : empty)++;
            if ((value < 0) != (d < 0))
                RC_FAIL(show(row(), w) + " over " + show(shape_rows()[bare.kind], bare.w) + " at " + show(p) + ": " +
                        std::to_string(value) + " where the bare one has " + std::to_string(d));
        }
    });
    EXPECT_GT(solid, 200);
    EXPECT_GT(empty, 200);
}

// The largest stretch of a map at a point: its Jacobian's largest singular value, by power iteration on J^T J.
double stretch(uint32_t kind, const Params& w, const Point& p, double h) {
    double j[3][3];
    for (size_t a = 0; a < 3; ++a) {
        Point up = p, down = p;
        up[a] += h;
        down[a] -= h;
        const text64::real3 u = seen(kind, w, up, 0)[0];
        const text64::real3 d = seen(kind, w, down, 0)[0];
        j[0][a] = (u.x - d.x) / (2 * h);
        j[1][a] = (u.y - d.y) / (2 * h);
        j[2][a] = (u.z - d.z) / (2 * h);
    }
    double v[3] = {0.53, 0.62, 0.58}, size = 0;
    for (int i = 0; i < 60; ++i) {
        double image[3], back[3];
        for (int a = 0; a < 3; ++a) image[a] = j[a][0] * v[0] + j[a][1] * v[1] + j[a][2] * v[2];
        for (int a = 0; a < 3; ++a) back[a] = j[0][a] * image[0] + j[1][a] * image[1] + j[2][a] * image[2];
        size = std::hypot(back[0], back[1], back[2]);
        if (size == 0) return 0;
        for (int a = 0; a < 3; ++a) v[a] = back[a] / size;
    }
    return std::sqrt(size);
}

TEST_P(EachWarp, FactorIsTheLargestStretchIntoTheRegion) {
    if (row().how == KindRow::Value) GTEST_SKIP() << "moves no points";
    double closest = 0;
    for_all(name() + ": stretch", [&](RandomValues& random) {
        const Params w = random.params(row());
        for (int i = 0; i < 40; ++i) {
            const Point p{random.in(-1.5, 1.5), random.in(-1.5, 1.5), random.in(-1.5, 1.5)};
            const text64::real3 q = seen(kind(), w, p, 0)[0];
            // A box that the point's image lies in, often on its border: there the extremes are.
            const auto less = [&] { return float(random.one_in(3) ? random.in(0, 0.5) : random.in(0, 1e-6)); };
            const text32::Bounds region{{float(q.x) - less(), float(q.y) - less(), float(q.z) - less()},
                                        {float(q.x) + less(), float(q.y) + less(), float(q.z) + less()}};
            const double factor = double(text32::warp_lipschitz(kind(), w.data(), text32::inflated(region, 1e-6f)));
            if (!std::isfinite(factor) || factor > 1e3) continue;
            // A map may jump half a turn from its middle, and displaces nothing there.
            if (row().name == "bend" && std::fabs(q.x * double(w[0])) > 3.14) continue;
            const double found = stretch(kind(), w, p, 1e-7);
            closest = std::max(closest, found / factor);
            if (found > factor * (1 + 1e-3))
                RC_FAIL(show(row(), w) + " stretches " + std::to_string(found) + " > " + std::to_string(factor) +
                        " at " + show(p));
        }
    });
    EXPECT_GT(closest, 0.9) << "the factor is needlessly large";
}

TEST_P(EachWarp, BoundsHoldTheSolid) {
    if (name() == "repeat") GTEST_SKIP() << "tested below";
    int64_t solid = 0;
    for_all(name() + ": bounds", [&](RandomValues& random) {
        const Bare bare(random);
        if (shape_rows()[bare.kind].how != KindRow::Exact)
            return;  // a lower bound may grow by more than round's radius
        const Params w = random.params(row());
        const text32::Bounds b = text32::warp_bounds(kind(), w.data(), bare.bounds);
        const Around around(b);
        for (int i = 0; i < 300; ++i) {
            const Point p = around.point(random);
            if (magnitude(p) > 3 || warped(kind(), w, bare, p) > 0) continue;
            ++solid;
            const double slack = 1e-5 * (1 + around.size);
            if (p[0] < double(b.lo.x) - slack || p[0] > double(b.hi.x) + slack || p[1] < double(b.lo.y) - slack ||
                p[1] > double(b.hi.y) + slack || p[2] < double(b.lo.z) - slack || p[2] > double(b.hi.z) + slack) {
                RC_FAIL(show(row(), w) + " over " + show(shape_rows()[bare.kind], bare.w) + " is solid outside at " +
                        show(p));
            }
        }
    });
    EXPECT_GT(solid, 200);
}

TEST_P(EachWarp, FloatAgreesWithDouble) {
    if (name() == "repeat") GTEST_SKIP() << "tested below";
    for_all(name() + ": float = double", [&](RandomValues& random) {
        const Params w = random.params(row());
        const Point p{double(float(random.in(-3, 3))), double(float(random.in(-3, 3))),
                      double(float(random.in(-3, 3)))};
        const text64::real3 p64(p[0], p[1], p[2]);
        const text32::real3 p32{float(p[0]), float(p[1]), float(p[2])};
        if (row().how != KindRow::Value) {
            const text64::real3 a = seen(kind(), w, p, 0)[0];
            const text32::real3 b = row().how == KindRow::Point
                                        ? text32::point_warp(kind(), p32, w.data())
                                        : text32::copy_warp(kind(), p32, w.data(), {0, 0, 0}, {0, 0, 0});
            // Near its centre a bend's angle is as uncertain as the point; compare where the map stretches by less than 10.
            const double k = name() == "bend" ? double(w[0]) : 0;
            if (name() == "bend" &&
                (std::hypot(k * p[0], 1 - k * p[1]) < 0.1 || std::fabs(std::atan2(k * p[0], 1 - k * p[1])) > 3.14))
                return;
            RC_ASSERT(between({a.x, a.y, a.z}, {double(b.x), double(b.y), double(b.z)}) <
                      3e-5 * std::max(1.0, length(a)));
        } else {
            const double d = double(float(random.in(-1, 1)));
            const double a = text64::value_warp(kind(), d, p64, w.data());
            const double b = double(text32::value_warp(kind(), float(d), p32, w.data()));
            // Displace multiplies the point by its frequency before it takes the fraction: rounding grows with it.
            const double slope = name() == "displace" ? 3.5 * std::fabs(double(w[0])) * double(w[1]) * magnitude(p) : 0;
            RC_ASSERT(std::fabs(a - b) < 1e-5 + 1e-6 * slope);
        }
    });
}

// ---- Each map against the forward one of the scene format: bare point -> where the warp puts it.

void expect_inverse(const char* warp, const std::function<Point(const Params&, const Point&)>& forward, double range) {
    const uint32_t kind = *warp_kind(warp);
    for_all(std::string(warp) + " undoes the forward map", [&](RandomValues& random) {
        const Params w = random.params(warp_rows()[kind]);
        const Point bare{random.in(-range, range), random.in(-range, range), random.in(-range, range)};
        const Point p = forward(w, bare);
        const text64::real3 back = seen(kind, w, p, bare[0])[0];
        if (between({back.x, back.y, back.z}, bare) > 1e-9) RC_FAIL(show(warp_rows()[kind], w) + " at " + show(bare));
    });
}

TEST(Twist, TurnsTheCrossSectionRightHandedAboutY) {
    expect_inverse(
        "twist",
        [](const Params& w, const Point& p) {
            const double c = std::cos(double(w[0]) * p[1]), s = std::sin(double(w[0]) * p[1]);
            return Point{c * p[0] + s * p[2], p[1], -s * p[0] + c * p[2]};  // z towards x
        },
        1);
}

TEST(Bend, PutsTheXAxisOnACircleTowardsPlusY) {
    expect_inverse(
        "bend",
        [](const Params& w, const Point& p) {
            const double k = double(w[0]);
            if (k == 0) return p;
            const double angle = k * p[0], r = 1 / k - p[1];
            return Point{r * std::sin(angle), 1 / k - r * std::cos(angle), p[2]};
        },
        0.45);
}

Edit bent(const Shape& shape, float curvature) {
    Edit edit;
    edit.name = "bar";
    edit.node.shape = shape;
    edit.node.domain = {Bend{.curvature = curvature}};
    return edit;
}

TEST(Bend, ABarGoesAllTheWayRoundAndOn) {
    // As long as a part of the circle of radius 1; the distance to the ring's surface is sqrt((r - 1)^2 + z^2) off a round bar.
    for (double turns : {0.25, 0.5, 0.9, 0.99, 1.0, 1.3, 1.8}) {
        const Edit edit = bent(Box{.half_extents = {float(M_PI * turns), 0.05f, 0.05f}}, 1);
        const Result<Program> program = compile({{&edit, 1}, {}, {}});
        ASSERT_TRUE(program) << turns << ": " << program.error().message;
        RandomValues random(1);
        for (int i = 0; i < 2000; ++i) {
            const double angle = random.in(-M_PI, M_PI), r = random.in(0.5, 1.5), z = random.in(-0.5, 0.5);
            const Point p{r * std::sin(angle), 1 - r * std::cos(angle), z};
            const double value = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
            const double beyond = std::max(std::fabs(angle) - M_PI * turns, 0.0);  // past the bar's end
            const double u = std::max(std::fabs(r - 1) - 0.05, 0.0), v = std::max(std::fabs(z) - 0.05, 0.0);
            if (beyond == 0) {
                EXPECT_EQ(value <= 0, u == 0 && v == 0) << turns << " at " << show(p);
                EXPECT_LE(value, std::hypot(u, v) + 1e-5);
                const double honest = std::min(value, 0.0) + 0.45 * std::min(std::hypot(u, v), 0.1);
                EXPECT_GE(value, honest - 1e-5) << turns << " at " << show(p);
            } else if (beyond > 1e-3) {
                EXPECT_GT(value, 0) << turns << " at " << show(p);
            }
        }
    }
}

TEST(Bend, ThroughTheCentreOrTwiceAroundIsOneClearError) {
    for (const Edit& edit :
         {bent(Box{.half_extents = {1, 1.01f, 0.1f}}, 1), bent(Box{.half_extents = {1, 1.01f, 0.1f}}, -1),
          bent(Box{.half_extents = {6.29f, 0.1f, 0.1f}}, 1)}) {
        Fault fault;
        const Result<Program> program = compile({{&edit, 1}, {}, {}}, &fault);
        ASSERT_FALSE(program);
        EXPECT_NE(program.error().message.find("through the centre of its circle"), std::string::npos)
            << program.error().message;
        EXPECT_EQ(fault.warp, 0);
    }
    const Edit thick = bent(Box{.half_extents = {3, 0.97f, 0.1f}}, 1);
    EXPECT_TRUE(compile({{&thick, 1}, {}, {}})) << "thick, but short of the centre";
}

TEST(Bend, NeedsNoCurvatureThatIsFarFromZero) {
    for (double k : {1e-3, 1e-6, 1e-9, 1e-20, 0.0}) {
        const float w[kMaxParams] = {float(k)};
        const auto q = text32::copy_warp(*warp_kind("bend"), {0.7f, 0.2f, 0.1f}, w, {0, 0, 0}, {0, 0, 0});
        EXPECT_NEAR(q.x, 0.7, 1e-3 * k / 1e-3 + 1e-6) << k;
        EXPECT_NEAR(q.y, 0.2, 1e-3 * k / 1e-3 + 1e-6) << k;
    }
}

TEST(Taper, ScalesTheCrossSectionAndStopsAtATwentieth) {
    expect_inverse(
        "taper",
        [](const Params& w, const Point& p) {
            const double s = std::max(1 - double(w[0]) * p[1], double(0.05));
            return Point{p[0] * s, p[1], p[2] * s};
        },
        2);
}

TEST(Elongate, PullsTheHalvesApart) {
    expect_inverse(
        "elongate",
        [](const Params& w, const Point& p) {
            Point out = p;
            for (size_t i = 0; i < 3; ++i) out[i] += p[i] < 0 ? -double(w[i]) : double(w[i]);
            return out;
        },
        1);
    const float w[kMaxParams] = {0.5f, 0, 0};
    EXPECT_EQ(text32::point_warp(*warp_kind("elongate"), {0.4f, 1, 2}, w).x, 0.0f)
        << "the gap is filled with what was at 0";
}

TEST(Mirror, KeepsThePlusHalfOfItsAxis) {
    for (int axis = 0; axis < 3; ++axis) {
        const float w[kMaxParams] = {float(axis)};
        const auto q = text32::point_warp(*warp_kind("mirror"), {-1, -2, -3}, w);
        EXPECT_EQ(q.x, axis == 0 ? 1.0f : -1.0f);
        EXPECT_EQ(q.y, axis == 1 ? 2.0f : -2.0f);
        EXPECT_EQ(q.z, axis == 2 ? 3.0f : -3.0f);
    }
}

TEST(Shell, IsTheLayerAroundTheSurface) {
    const float w[kMaxParams] = {0.2f};
    for (float d : {-0.5f, -0.1f, 0.0f, 0.05f, 0.3f}) {
        EXPECT_FLOAT_EQ(text32::value_warp(*warp_kind("shell"), d, {0, 0, 0}, w), std::fabs(d) - 0.1f);
    }
}

TEST(Round, MovesTheSurfaceOut) {
    const float w[kMaxParams] = {0.2f};
    EXPECT_FLOAT_EQ(text32::value_warp(*warp_kind("round"), 0.5f, {1, 2, 3}, w), 0.3f);
}

TEST(Repeat, TwoCopiesAnAxisFindTheNearestOfAll) {
    const uint32_t kind = *warp_kind("repeat");
    for_all("nearest of all copies", [&](RandomValues& random) {
        // A capsule off its centre and turned in the xy-plane; cells are centred on its bounds.
        const double angle = random.in(-3, 3), half = random.in(0, 0.3), radius = random.in(0.05, 0.2);
        const Point at{random.in(-5, 5), random.in(-5, 5), random.in(-5, 5)};
        const auto bare = [&](double x, double y, double z) {
            const double u = std::cos(angle) * (x - at[0]) + std::sin(angle) * (y - at[1]);
            const double v = -std::sin(angle) * (x - at[0]) + std::cos(angle) * (y - at[1]);
            return std::hypot(u - std::clamp(u, -half, half), v, z - at[2]) - radius;
        };
        const double size[3] = {half * std::fabs(std::cos(angle)) + radius, half * std::fabs(std::sin(angle)) + radius,
                                radius};
        Params w{};
        for (size_t a = 0; a < 3; ++a) {
            w[a] = random.one_in(4) ? 0.0f : float(2 * size[a] * random.in(1.0001, 2));
            w[3 + a] = float(random.one_in(3) ? 0 : 1 + random.below(5));
        }
        for (int i = 0; i < 20; ++i) {
            const Point p{at[0] + random.in(-3, 3), at[1] + random.in(-3, 3), at[2] + random.in(-3, 3)};
            double few = 1e9, all = 1e9;
            for (int c = 0; c < 8; ++c) {
                const text64::real3 q = text64::copy_warp(kind, {p[0], p[1], p[2]}, w.data(), {at[0], at[1], at[2]},
                                                          {double(c & 1), double(c >> 1 & 1), double(c >> 2 & 1)});
                few = std::min(few, bare(q.x, q.y, q.z));
            }
            // Counted copies lie at (n - (count - 1) / 2) * spacing, endless ones at whole multiples.
            const auto offsets = [&](size_t a) {
                std::vector<double> out;
                if (w[a] == 0) return std::vector<double>{0.0};
                const int count = w[3 + a] == 0 ? 61 : int(w[3 + a]);
                for (int n = 0; n < count; ++n) out.push_back((n - 0.5 * (count - 1)) * double(w[a]));
                return out;
            };
            for (double x : offsets(0)) {
                for (double y : offsets(1)) {
                    for (double z : offsets(2)) all = std::min(all, bare(p[0] - x, p[1] - y, p[2] - z));
                }
            }
            if (std::fabs(few - all) > 1e-9) RC_FAIL(show(warp_rows()[kind], w) + " at " + show(p));
        }
    });
}

// ---- Noise of displace, written again from its description.

uint32_t mix(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

double reference_noise(const Point& p, uint32_t seed) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        double offset[3];
        uint32_t at[3];
        for (size_t a = 0; a < 3; ++a) {
            const double cell = std::floor(p[a]), t = p[a] - cell;
            const int high = corner >> a & 1;
            const double fade = t * t * t * (t * (t * 6 - 15) + 10);
            weight *= high != 0 ? fade : 1 - fade;
            offset[a] = t - high;
            at[a] = uint32_t(int64_t(cell) + high);
        }
        const uint32_t hash = mix(at[0] + mix(at[1] + mix(at[2] + seed)));
        double dot = 0;
        for (size_t a = 0; a < 3; ++a) dot += (hash >> (31 - a) & 1u) != 0 ? -offset[a] : offset[a];
        sum += weight * dot;
    }
    return sum * 2 / 3;
}

TEST(Displace, IsTheDocumentedNoise) {
    for_all("noise", [](RandomValues& random) {
        const double reach = random.one_in(4) ? 1e6 : 10;
        const Point p{random.in(-reach, reach), random.in(-reach, reach), random.in(-reach, reach)};
        const uint32_t seed = uint32_t(random.below(16777216));
        const double n = text64::gradient_noise({p[0], p[1], p[2]}, seed);
        RC_ASSERT(std::fabs(n - reference_noise(p, seed)) < 1e-9);
        RC_ASSERT(std::fabs(n) <= 1);
    });
}

// Largest |gradient| of the noise at a point of the cell over all signs of its eight gradients, along e: the sum over corners c and
// axes a of |w_c e_a + (e · grad w_c) (f - c)_a|. Symmetry of the cell (reflections, permutations) leaves f in [0, 1/2]³ and e with
// e_x = 1 the largest component. Boxes in (f, e_y, e_z) are split until the value at the centre plus the largest slope over the
// box times its half size (mean value form, in interval arithmetic) is below the bound everywhere.
struct Interval {
    double lo, hi;
};
Interval operator+(Interval a, Interval b) { return {a.lo + b.lo, a.hi + b.hi}; }
Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
Interval operator*(Interval a, Interval b) {
    const double v[4] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
    return {*std::min_element(v, v + 4), *std::max_element(v, v + 4)};
}
double largest(Interval a) { return std::max(std::fabs(a.lo), std::fabs(a.hi)); }

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double fade_slope(double t) { return 30 * t * t * (t - 1) * (t - 1); }
double fade_bend(double t) { return 60 * t * (2 * t - 1) * (t - 1); }

struct Cell {
    double center[5], half[5];
};

double steepest_at(const double* f, const double* e) {
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        double w[3], d[3], o[3];
        for (int a = 0; a < 3; ++a) {
            const int high = c >> a & 1;
            w[a] = high != 0 ? fade(f[a]) : 1 - fade(f[a]);
            d[a] = high != 0 ? fade_slope(f[a]) : -fade_slope(f[a]);
            o[a] = f[a] - high;
        }
        const double along = e[0] * d[0] * w[1] * w[2] + e[1] * w[0] * d[1] * w[2] + e[2] * w[0] * w[1] * d[2];
        for (int a = 0; a < 3; ++a) sum += std::fabs(w[0] * w[1] * w[2] * e[a] + along * o[a]);
    }
    return sum;
}

double steepest_over(const Cell& cell, int& widest) {
    const double middle[3] = {1, cell.center[3], cell.center[4]};
    double slope[5] = {};
    Interval e[3] = {{1, 1}, {0, 0}, {0, 0}}, u[3], d[3], dd[3], f[3];
    for (int a = 1; a < 3; ++a) e[a] = {cell.center[2 + a] - cell.half[2 + a], cell.center[2 + a] + cell.half[2 + a]};
    for (int a = 0; a < 3; ++a) {
        const double lo = cell.center[a] - cell.half[a], hi = cell.center[a] + cell.half[a];
        f[a] = {lo, hi};
        u[a] = {fade(lo), fade(hi)};  // both rise on [0, 1/2]
        d[a] = {fade_slope(lo), fade_slope(hi)};
        const double peak = 0.5 - std::sqrt(3.0) / 6;
        dd[a] = {std::min(fade_bend(lo), fade_bend(hi)),
                 lo <= peak && peak <= hi ? fade_bend(peak) : std::max(fade_bend(lo), fade_bend(hi))};
    }
    for (int c = 0; c < 8; ++c) {
        Interval w[3], s[3], b[3], o[3];
        for (int a = 0; a < 3; ++a) {
            const bool high = (c >> a & 1) != 0;
            w[a] = high ? u[a] : Interval{1 - u[a].hi, 1 - u[a].lo};
            s[a] = high ? d[a] : -d[a];
            b[a] = high ? dd[a] : -dd[a];
            o[a] = high ? Interval{f[a].lo - 1, f[a].hi - 1} : f[a];
        }
        const auto part = [&](int i, int k) {  // of w_c: no derivative (3), the first or the second ones
            Interval out{1, 1};
            for (int a = 0; a < 3; ++a) out = out * (a == i && a == k ? b[a] : a == i || a == k ? s[a] : w[a]);
            return out;
        };
        const Interval along = e[0] * part(0, 3) + e[1] * part(1, 3) + e[2] * part(2, 3);
        for (int k = 0; k < 3; ++k) {
            const Interval change = e[0] * part(0, k) + e[1] * part(1, k) + e[2] * part(2, k);
            for (int a = 0; a < 3; ++a) {
                const Interval term = part(k, 3) * e[a] + change * o[a];
                slope[k] += largest(a == k ? term + along : term);
                if (k == 0) continue;
                const Interval turn = part(k, 3) * o[a];
                slope[2 + k] += largest(a == k ? turn + part(3, 3) : turn);
            }
        }
    }
    double value = steepest_at(cell.center, middle), most = -1, norm2 = 1;
    for (int k = 0; k < 5; ++k) {
        value += slope[k] * cell.half[k];
        if (slope[k] * cell.half[k] > most) {
            most = slope[k] * cell.half[k];
            widest = k;
        }
    }
    for (int a = 1; a < 3; ++a) norm2 += std::pow(std::max({0.0, e[a].lo, -e[a].hi}), 2);
    return value / std::sqrt(norm2) * 2 / 3;
}

TEST(Displace, NoiseIsNeverSteeper) {
    const double bound = double(text32::kDisplaceSteepest);
    const double center[3] = {0.5, 0.5, 0.5}, along_x[3] = {1, 0, 0};
    EXPECT_NEAR(steepest_at(center, along_x) * 2 / 3, 37.0 / 12, 1e-12);
    ASSERT_LT(37.0 / 12, bound);
    std::vector<Cell> open{{{0.25, 0.25, 0.25, 0, 0}, {0.25, 0.25, 0.25, 1, 1}}};
    int64_t boxes = 0;
    while (!open.empty() && !(kSanitized && boxes > 50'000)) {
        const Cell cell = open.back();
        open.pop_back();
        ASSERT_LT(++boxes, 5'000'000) << "the bound cannot be proven";
        int widest = 0;
        if (steepest_over(cell, widest) <= bound) continue;
        Cell low = cell, high = cell;
        low.half[widest] = high.half[widest] = 0.5 * cell.half[widest];
        low.center[widest] -= low.half[widest];
        high.center[widest] += high.half[widest];
        open.push_back(low);
        open.push_back(high);
    }
}

TEST(Displace, TheProofIsAboutThisNoise) {
    for_all("slope of the noise", [](RandomValues& random) {
        const Point p{random.in(-5, 5), random.in(-5, 5), random.in(-5, 5)};
        const double h = 1e-5;
        double g[3];
        for (size_t a = 0; a < 3; ++a) {
            Point up = p, down = p;
            up[a] += h;
            down[a] -= h;
            g[a] = (text64::gradient_noise({up[0], up[1], up[2]}, 7) -
                    text64::gradient_noise({down[0], down[1], down[2]}, 7)) /
                   (2 * h);
        }
        const double length = std::hypot(g[0], g[1], g[2]);
        const double e[3] = {g[0] / length, g[1] / length, g[2] / length};
        const double f[3] = {p[0] - std::floor(p[0]), p[1] - std::floor(p[1]), p[2] - std::floor(p[2])};
        RC_ASSERT(length <= steepest_at(f, e) * 2 / 3 + 1e-6);
    });
}

// ---- The whole way: stacks of warps through the compiler and in double precision.

TEST(Domain, StacksOfWarpsStayOneLipschitzThroughTheProgram) {
    int compiled = 0;
    for_all("stacks", [&](RandomValues& random) {
        const Bare bare(random);
        Edit edit;
        edit.name = "stack";
        edit.node.shape.kind = uint16_t(bare.kind);
        edit.node.shape.params = bare.w;
        for (int n = random.below(4); n > 0; --n) {
            Warp warp;
            warp.kind = uint16_t(random.below(int(warp_rows().size())));
            if (warp_rows()[warp.kind].how == KindRow::Copies) continue;
            warp.params = random.params(warp_rows()[warp.kind]);
            edit.node.domain.push_back(warp);
        }
        const Result<Program> program = compile({{&edit, 1}, {}, {}});
        if (!program) return;
        ++compiled;
        const Box3 box = program->bounds;
        const double size = double(std::max({box.half_extents().x, box.half_extents().y, box.half_extents().z}));
        for (int i = 0; i < 60; ++i) {
            const vec3 c = box.center();
            const Point middle{double(c.x), double(c.y), double(c.z)};
            const Point p = beside(random, middle, size * random.in(0, 2.5));
            const Point q = beside(random, p, size * std::pow(10.0, random.in(-4, 0)));
            const double f = evaluate(view(*program), dvec3{p[0], p[1], p[2]});
            const double g = evaluate(view(*program), dvec3{q[0], q[1], q[2]});
            if (std::fabs(f - g) > between(p, q) * (1 + 1e-5) + 3e-6 * (size + magnitude(middle))) {
                std::string text = show(shape_rows()[bare.kind], bare.w);
                for (const Warp& warp : edit.node.domain) text += " -> " + show(warp_rows()[warp.kind], warp.params);
                RC_FAIL(text + " " + show(p) + " " + show(q) + " " + std::to_string(std::fabs(f - g) / between(p, q)));
            }
        }
    });
    EXPECT_GT(compiled, 30);
}

}  // namespace
}  // namespace kiln::sdf
