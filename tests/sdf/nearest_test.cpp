// SPDX-License-Identifier: MIT
// Starts threads.
// True distances against rays in all directions from the point, refined around the best: a reference that shares nothing with the
// search but the judge's values, and can only be too far.
#include "sdf/nearest.h"

#include "sdf/judge.h"
#include "sdf/regions.h"
#include "rounds.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

namespace kiln::sdf {
namespace {

constexpr double kTolerance = 5e-5;

struct Judged {
    std::vector<Edit> edits;
    Program program;
    Judge judge;

    explicit Judged(std::vector<Edit> list)
        : edits(std::move(list)), program(*compile({edits, {}, {}})), judge(*Judge::create({edits, {}, {}})) {}
};

Edit edit(Shape shape, vec3 position, Op op = Op::Union, float blend = 0) {
    Edit e;
    e.node.shape = std::move(shape);
    e.node.transform.position = position;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

dvec3 on(dvec3 p, dvec3 u, double t) { return {p.x + u.x * t, p.y + u.y * t, p.z + u.z * t}; }

// First crossing along u, by sphere tracing on the judge's values and bisection; `limit` when there is none before.
double crossing(const Judge& judge, dvec3 p, dvec3 u, double limit) {
    const double side = judge.distance(p) < 0 ? -1 : 1;
    double before = 0, t = 0;
    while (t < limit) {
        const double d = side * judge.distance(on(p, u, t));
        if (d <= 0) {
            for (int i = 0; i < 50; ++i) {
                const double middle = 0.5 * (before + t);
                (side * judge.distance(on(p, u, middle)) > 0 ? before : t) = middle;
            }
            return t;
        }
        before = t;
        t += std::max(d, 1e-8);
    }
    return limit;
}

double dense_reference(const Judge& judge, dvec3 p) {
    const auto unit = [](dvec3 v) {
        const double s = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
        return dvec3{v.x / s, v.y / s, v.z / s};
    };
    struct Best {
        double t;
        dvec3 u;
    };
    std::vector<Best> best;
    constexpr int kDirections = 3000;
    for (int i = 0; i < kDirections; ++i) {  // spread evenly over the sphere by the golden angle
        const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
        const dvec3 u{r * std::cos(a), r * std::sin(a), z};
        best.push_back({crossing(judge, p, u, 30), u});
    }
    std::sort(best.begin(), best.end(), [](const Best& a, const Best& b) { return a.t < b.t; });
    best.resize(12);
    std::mt19937 random(9);
    std::normal_distribution<double> gauss;
    for (Best& b : best) {
        double spread = 0.04;
        for (int i = 0; i < 500; ++i) {
            const dvec3 u =
                unit({b.u.x + spread * gauss(random), b.u.y + spread * gauss(random), b.u.z + spread * gauss(random)});
            const double t = crossing(judge, p, u, b.t);
            if (t < b.t) {
                b = {t, u};
            } else {
                spread *= 0.985;
            }
        }
    }
    return std::min_element(best.begin(), best.end(), [](const Best& a, const Best& b) { return a.t < b.t; })->t;
}

void expect_true_distances(const Judged& scene, int points, float extent, unsigned seed) {
    const Regions regions(scene.program);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> at(-extent, extent);
    for (int i = 0; i < rounds(points); ++i) {
        const dvec3 p{at(random), at(random), at(random)};
        const Nearest n = nearest_surface(regions, p, std::numeric_limits<double>::infinity(), kTolerance);
        ASSERT_TRUE(n.found);
        const double truth = dense_reference(scene.judge, p);
        EXPECT_LE(n.distance, truth + 1.01 * kTolerance) << p.x << " " << p.y << " " << p.z;
        EXPECT_GE(n.distance, truth - 1e-4) << p.x << " " << p.y << " " << p.z;
        EXPECT_LE(n.least, truth + 1e-9);
        EXPECT_LE(n.distance - n.least, 1.01 * kTolerance);
        // The point is where it says, and on the surface.
        const double d = std::hypot(n.point.x - p.x, n.point.y - p.y, n.point.z - p.z);
        EXPECT_NEAR(d, n.distance, 1e-9);
        EXPECT_NEAR(scene.judge.distance(n.point), 0, 5e-6);
    }
}

TEST(Nearest, IsTheTrueDistanceInsideUnionsAndCuts) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> at(-0.6f, 0.6f), size(0.15f, 0.35f);
    std::vector<Edit> edits;
    for (int i = 0; i < 30; ++i) {
        const vec3 p{at(random), at(random), at(random)};
        const Shape shape = i % 2 == 0 ? Shape(Sphere{.radius = size(random)})
                                       : Shape(Box{.half_extents = {size(random), size(random), 0.2f}});
        edits.push_back(edit(shape, p, i % 4 == 3 ? Op::Subtract : Op::Union));
    }
    expect_true_distances(Judged(edits), 24, 0.9f, 1);
}

TEST(Nearest, IsTheTrueDistanceInBlendsWarpsAndStretchedShapes) {
    std::vector<Edit> edits{edit(Sphere{.radius = 0.4f}, {0, 0, 0}),
                            edit(Box{.half_extents = {0.3f, 0.2f, 0.25f}}, {0.4f, 0.1f, 0}, Op::Union, 0.2f),
                            edit(Cylinder{.half_height = 0.6f, .radius = 0.15f}, {0, 0, 0.1f}, Op::Subtract, 0.05f)};
    edits[1].node.domain.push_back(Twist{.rate = 1.0f});
    edits[0].node.transform.scale = {1, 0.6f, 1.3f};
    expect_true_distances(Judged(edits), 15, 0.8f, 2);
}

TEST(Nearest, SeesThatABoundIsTooShort) {
    // Two balls: deep in the overlap the union's value is the larger ball's depth, the surface is farther.
    const Judged scene({edit(Sphere{.radius = 1}, {-0.6f, 0, 0}), edit(Sphere{.radius = 1}, {0.6f, 0, 0})});
    const Regions regions(scene.program);
    const Nearest n = nearest_surface(regions, {0, 0, 0}, 10, 1e-5);
    EXPECT_NEAR(scene.judge.distance({0, 0, 0}), -0.4, 1e-6);
    EXPECT_NEAR(n.distance, 0.8, 1e-5);  // the crease: sqrt(1 - 0.36)
}

TEST(Nearest, IsRightFarAwayAndWhereAllPointsAreEquallyNear) {
    const Judged ball({edit(Sphere{.radius = 1}, {0, 0, 0})});
    const Regions regions(ball.program);
    for (const double x : {0.0, 5.0, 70.0, 1000.0, 1e5}) {
        const Nearest n = nearest_surface(regions, {x, 0, 0}, std::numeric_limits<double>::infinity(), kTolerance);
        ASSERT_TRUE(n.found) << x;
        EXPECT_NEAR(n.distance, std::abs(x - 1), 1e-6 * (1 + x)) << x;
    }
    const Judged ground({edit(Plane{}, {0, 0, 0})});
    const Regions flat(ground.program);
    const Nearest n = nearest_surface(flat, {3, -200, 7}, std::numeric_limits<double>::infinity(), kTolerance);
    EXPECT_NEAR(n.distance, 200, 1e-5);
}

TEST(Nearest, LooksNoFartherThanAsked) {
    const Judged scene({edit(Sphere{.radius = 1}, {-0.6f, 0, 0}), edit(Sphere{.radius = 1}, {0.6f, 0, 0})});
    const Regions regions(scene.program);
    EXPECT_FALSE(nearest_surface(regions, {0, 0, 0}, 0.799, 1e-5).found);
    EXPECT_TRUE(nearest_surface(regions, {0, 0, 0}, 0.801, 1e-5).found);
    EXPECT_FALSE(nearest_surface(regions, {0, 9, 0}, 1, 1e-5).found);
    EXPECT_FALSE(nearest_surface(Regions(Judged({}).program), {0, 0, 0}, 1, 1e-5).found);
}

TEST(Regions, GiveTheWholeProgramsValueEverywhereFromAnyThread) {
    std::mt19937 random(8);
    std::uniform_real_distribution<float> at(-1, 1);
    std::vector<Edit> edits;
    for (int i = 0; i < 300; ++i)
        edits.push_back(edit(Sphere{.radius = 0.1f}, {at(random), at(random), at(random)},
                             i % 5 == 4 ? Op::Subtract : Op::Union, i % 3 == 0 ? 0.05f : 0.0f));
    const Judged scene(edits);
    const Regions regions(scene.program);
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (unsigned t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            std::mt19937 own(100 + t / 2);
            std::uniform_real_distribution<double> in(-1.5, 1.5);
            Regions::Cursor cursor = nullptr;
            for (int i = 0; i < 2000; ++i) {
                const double far = i % 50 == 0 ? 200 : 1;
                const dvec3 p{in(own)*far, in(own), in(own)};
                wrong += regions.at(p, cursor) != evaluate(view(scene.program), p);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

TEST(Regions, AskTheEditsAroundAPointNotAllOfThem) {
    std::mt19937 random(8);
    std::uniform_real_distribution<float> at(-1, 1);
    std::vector<Edit> edits;
    for (int i = 0; i < 3000; ++i) edits.push_back(edit(Sphere{.radius = 0.03f}, {at(random), at(random), at(random)}));
    const Judged scene(edits);
    const Regions regions(scene.program);
    size_t instructions = 0;
    for (int i = 0; i < 200; ++i) {
        const dvec3 p{double(at(random)), double(at(random)), double(at(random))};
        Regions::Cursor cursor = nullptr;
        instructions += regions.tape(p, cursor).code.size();
    }
    EXPECT_LT(instructions / 200, scene.program.tape().size() / 100);
}

TEST(SolidInBox, IsTrueWhereTheBoxHoldsASolidPoint) {
    const Judged scene(
        {edit(Sphere{.radius = 0.5f}, {0, 0, 0}), edit(Sphere{.radius = 0.3f}, {0, 0, 0}, Op::Subtract)});
    const Regions regions(scene.program);
    const auto box = [&](dvec3 c, vec3 h, quat q = {}) { return solid_in_box(regions, c, h, q, 1e-4); };
    EXPECT_TRUE(box({0.6, 0, 0}, {0.11f, 0.1f, 0.1f}));
    EXPECT_FALSE(box({0.6, 0, 0}, {0.09f, 0.1f, 0.1f}));
    EXPECT_FALSE(box({0, 0, 0}, {0.17f, 0.17f, 0.17f}));  // in the hollow
    EXPECT_TRUE(box({0, 0, 0}, {0.18f, 0.18f, 0.18f}));
    EXPECT_TRUE(box({0, 0, 0}, {5, 5, 5}));
    // Turned by 45 degrees about z, a corner edge reaches sqrt(2) as far.
    EXPECT_TRUE(box({0.63, 0, 0}, {0.1f, 0.1f, 0.1f}, axis_angle({0, 0, 1}, 0.785398f)));
    EXPECT_FALSE(box({0.65, 0, 0}, {0.1f, 0.1f, 0.1f}, axis_angle({0, 0, 1}, 0.785398f)));
}

}  // namespace
}  // namespace kiln::sdf
