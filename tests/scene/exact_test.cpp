// SPDX-License-Identifier: MIT
// Starts threads.
// Exact queries against the judge, which prunes nothing.
#include "scene/exact.h"

#include "scene/bundled.h"
#include "sdf/judge.h"

#include "scene_text.h"
#include "rounds.h"

#include <gtest/gtest.h>

#include <random>

namespace kiln::scene {
namespace {

struct Compiled {
    SceneData data;
    sdf::Source source;
    sdf::Program program;
};

Compiled compiled(const std::string& text) {
    Compiled c{*read_scene(text, "s.json"), {}, {}};
    c.source = {c.data.edits, c.data.objects, {}};
    c.program = *sdf::compile(c.source);
    return c;
}

TEST(Exact, PrunedAnswersAreTheFullListsOnTheBundledScenes) {
    for (const BundledScene& scene : bundled_files()) {
        const Compiled c = compiled(std::string(scene.json));
        const sdf::Judge judge = *sdf::Judge::create(c.source);
        const ExactField exact(c.program);
        std::mt19937 random(3);
        const Box3 box = c.program.bounds.inflated(0.1f);
        for (int i = 0; i < rounds(150); ++i) {
            std::uniform_real_distribution<float> x(box.min.x, box.max.x), y(box.min.y, box.max.y),
                z(box.min.z, box.max.z);
            const vec3 p{x(random), y(random), z(random)};
            const double truth = judge.distance({double(p.x), double(p.y), double(p.z)});
            const double size = double(length(box.max - box.min));
            EXPECT_NEAR(double(exact.sample(p).distance), truth, 2e-6 * size)
                << scene.name << " " << p.x << " " << p.y << " " << p.z;
        }
    }
}

TEST(Exact, RaysEndOnTheSurfaceAndPassNothing) {
    const Compiled c = compiled(scene_with(
        "{\"shape\": \"plane\"}, {\"shape\": \"sphere\", \"radius\": 0.5, \"position\": [0, 0.5, 0], \"blend_radius\": "
        "0.3},"
        "{\"shape\": \"box\", \"op\": \"subtract\", \"half_extents\": [0.2, 0.2, 2], \"position\": [0, 0.6, 0]}"));
    const sdf::Judge judge = *sdf::Judge::create(c.source);
    const ExactField exact(c.program);
    std::mt19937 random(5);
    std::normal_distribution<float> gauss;
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
        // Origins near the middle as well: a ray's first pruned ball must be made, not assumed.
        const vec3 o{gauss(random), 0.2f + std::abs(gauss(random)), gauss(random)},
            d = normalize(vec3{gauss(random), gauss(random), gauss(random)});
        const RayHit hit = exact.cast({.origin = o, .direction = d, .t_max = 50});
        const auto at = [&](double t) {
            return judge.distance(
                {double(o.x) + t * double(d.x), double(o.y) + t * double(d.y), double(o.z) + t * double(d.z)});
        };
        const double end = hit.hit ? double(hit.t) : 50.0;
        if (hit.hit) {
            ++hits;
            EXPECT_LE(at(end), 1e-5);
        }
        if (at(0) <= 0) continue;
        for (int k = 1; k < 200; ++k)
            EXPECT_GT(at(end * k / 200), -1e-6)
                << "ray " << i << " passed a surface at " << end * k / 200 << " of " << end;
    }
    EXPECT_GT(hits, 100);
}

TEST(Exact, RaysAlongThingsWithoutEndReachWhatStandsFarAway) {
    // Millions of the steps that the plane allows.
    const std::string wall = ",{\"shape\": \"box\", \"position\": [5000, 0, 0], \"half_extents\": [1, 5, 5]}";
    const std::string row =
        "{\"shape\": \"sphere\", \"radius\": 0.5, \"position\": [0, -0.5, 0], \"domain\": [{\"warp\": \"repeat\", "
        "\"spacing\": [1.5, 0, 1.5]}]}";
    for (const std::string& endless : {std::string("{\"shape\": \"plane\"}"), row}) {
        const Compiled c = compiled(scene_with(endless + wall));
        const ExactField exact(c.program);
        const RayHit hit = exact.cast({.origin = {0, 2e-3f, 0}, .direction = {1, 0, 0}});
        ASSERT_TRUE(hit.hit) << endless;
        EXPECT_NEAR(double(hit.t), 4999, 1e-3);
        EXPECT_EQ(hit.edit.index, 1u);
        const RayHit ball = exact.cast_sphere({.origin = {0, 0.252f, 0}, .direction = {1, 0, 0}}, 0.25f);
        ASSERT_TRUE(ball.hit) << endless;
        EXPECT_NEAR(double(ball.t), 4998.75, 2e-3);
        EXPECT_FALSE(exact.cast({.origin = {0, 2e-3f, 0}, .direction = {-1, 0, 0}}).hit);
        EXPECT_FALSE(exact.cast({.origin = {0, 2e-3f, 0}, .direction = {-1, 1e-9f, 0}}).hit);
    }
    const Compiled plain = compiled(scene_with("{\"shape\": \"plane\"}"));
    const RayHit down = ExactField(plain.program).cast({.origin = {0, 1, 0}, .direction = {1, -1e-5f, 0}});
    ASSERT_TRUE(down.hit);
    EXPECT_NEAR(double(down.t), 1e5, 10);
}

// Worlds of many edits, so that space is halved, on a floor and beside a row without end; rays that mostly run along them.
TEST(Exact, LeapsLoseNoHit) {
    std::mt19937 random(11);
    const auto in = [&](float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random); };
    const auto number = [](float v) { return std::to_string(v); };
    int hits = 0, misses = 0;
    for (int world = 0; world < rounds(8); ++world) {
        std::string edits =
            "{\"shape\": \"plane\"}, {\"shape\": \"box\", \"half_extents\": [0.2, 0.6, 0.2], "
            "\"position\": [4, 0, -3], \"domain\": [{\"warp\": \"repeat\", \"spacing\": [0, 0, 1.5]}]}";
        for (int i = 0; i < 30; ++i) {
            edits += std::string(",{\"shape\": \"") + (i % 2 == 0 ? "sphere" : "torus") + "\", \"op\": \"" +
                     (i % 5 == 4 ? "subtract" : "union") + "\", \"blend_radius\": " + (i % 3 == 0 ? "0.2" : "0") +
                     ", \"position\": [" + number(in(-3, 3)) + "," + number(in(-0.4f, 1)) + "," + number(in(-3, 3)) +
                     "]}";
        }
        const Compiled c = compiled(scene_with(edits));
        const sdf::Judge judge = *sdf::Judge::create(c.source);
        const ExactField exact(c.program);
        for (int k = 0; k < 60; ++k) {
            const float angle = in(0, 6.28f), rise = k % 3 == 0 ? 0 : in(-0.1f, 0.03f);
            const Ray ray{.origin = {in(-6, 6), in(0.02f, 1.2f), in(-6, 6)},
                          .direction = normalize(vec3{std::cos(angle), rise, std::sin(angle)}),
                          .t_max = 40};
            const auto at = [&](double t) {
                return judge.distance({double(ray.origin.x) + t * double(ray.direction.x),
                                       double(ray.origin.y) + t * double(ray.direction.y),
                                       double(ray.origin.z) + t * double(ray.direction.z)});
            };
            // The slow way: into solid, by steps that are never longer than what is free.
            double solid = 0;
            while (solid <= 40) {
                const double d = at(solid);
                if (d < -1e-6) break;
                solid += std::max(0.5 * d, 1e-4);
            }
            const RayHit hit = exact.cast(ray);
            if (solid <= 40) {
                ASSERT_TRUE(hit.hit) << "world " << world << ", ray " << k << ": solid at " << solid;
                EXPECT_LE(double(hit.t), solid + 1e-5) << "world " << world << ", ray " << k;
            }
            if (hit.hit) {
                EXPECT_LE(at(double(hit.t)), 1e-5) << "world " << world << ", ray " << k;
            }
            ++(hit.hit ? hits : misses);
        }
    }
    EXPECT_GT(hits, rounds(100));
    EXPECT_GT(misses, rounds(20));
}

TEST(Exact, ShadowRayFromTheTableIsFree) {
    // Was blocked: an empty pruned tape reads as solid.
    const Compiled c = compiled(
        scene_with("{\"shape\": \"plane\"}, {\"shape\": \"sphere\", \"radius\": 0.1, \"position\": [0, 0.1, 0]}"));
    EXPECT_FALSE(ExactField(c.program).cast({.origin = {0.5f, 0.01f, 0.2f}, .direction = {0, 1, 0}}).hit);
}

TEST(Exact, TheHitNamesTheEditWithTheLargestShareTiesToTheLater) {
    const Compiled c =
        compiled(scene_with("{\"shape\": \"box\"}, {\"shape\": \"box\"}, {\"shape\": \"sphere\", \"radius\": 0.2, "
                            "\"op\": \"subtract\", \"position\": [0, 0.5, 0]}"));
    const ExactField exact(c.program);
    EXPECT_EQ(exact.cast({.origin = {0.4f, 2, 0}, .direction = {0, -1, 0}}).edit.index, 1u);
    EXPECT_EQ(exact.cast({.origin = {0, 2, 0}, .direction = {0, -1, 0}}).edit.index, 2u);
}

TEST(Exact, EditsBeyondSixtyFiveThousandAreNamed) {
    std::string edits;
    for (int i = 0; i < 70000; ++i)
        edits += (i ? "," : "") + std::string("{\"shape\": \"sphere\", \"radius\": 0.4, \"position\": [") +
                 std::to_string(i % 300) + ", 0, " + std::to_string(i / 300) + "]}";
    const Compiled c = compiled(scene_with(edits));
    const int last = 69999;
    const RayHit hit =
        ExactField(c.program).cast({.origin = {float(last % 300), 2, float(last / 300)}, .direction = {0, -1, 0}});
    ASSERT_TRUE(hit.hit);
    EXPECT_EQ(hit.edit.index, uint32_t(last));
}

TEST(Exact, EmptySpaceIsInfinitelyFar) {
    const Compiled c = compiled(scene_with(""));
    const ExactField exact(c.program);
    EXPECT_TRUE(std::isinf(exact.distance({0, 0, 0})));
    EXPECT_TRUE(std::isinf(exact.sample({1, 2, 3}).distance));
    EXPECT_FALSE(exact.cast({}).hit);
}

TEST(Exact, AMovingBallStopsWhereItTouches) {
    const Compiled c = compiled(scene_with(
        "{\"id\": \"ball\", \"shape\": \"sphere\", \"radius\": 1}, {\"id\": \"hole\", \"shape\": \"box\", \"op\": "
        "\"subtract\", \"half_extents\": [0.3, 0.3, 2]}"));
    const ExactField exact(c.program);
    // Beside the hole: on the sphere. In front of it, too large: on the hole's rim. Small enough: straight through.
    const RayHit side = exact.cast_sphere({.origin = {0.6f, 0, 5}, .direction = {0, 0, -1}}, 0.1f);
    ASSERT_TRUE(side.hit);
    EXPECT_NEAR(double(length(side.position)), 1, 1e-4);
    EXPECT_NEAR(double(side.t), 5 - std::sqrt(1.1 * 1.1 - 0.36), 1e-4);
    EXPECT_NEAR(double(dot(side.normal, vec3{0.6f / 1.1f, 0, std::sqrt(1.1f * 1.1f - 0.36f) / 1.1f})), 1, 1e-3);
    EXPECT_EQ(side.edit.index, 0u);
    const RayHit rim = exact.cast_sphere({.origin = {0, 0, 5}, .direction = {0, 0, -1}}, 0.5f);
    ASSERT_TRUE(rim.hit);
    const double z = std::sqrt(1 - 0.3 * 0.3);  // the rim's middles are the parts nearest to the axis
    EXPECT_NEAR(double(rim.t), 5 - (z + std::sqrt(0.25 - 0.09)), 2e-4);
    EXPECT_FALSE(exact.cast_sphere({.origin = {0, 0, 5}, .direction = {0, 0, -1}}, 0.29f).hit);
    EXPECT_FALSE(exact.cast_sphere({.origin = {0, 0, 5}, .direction = {0, 0, -1}, .t_max = 3}, 0.5f).hit);
    EXPECT_NEAR(double(exact.cast_sphere({.origin = {0.7f, 0, 5}, .direction = {0, 0, -1}}, 0).t),
                double(exact.cast({.origin = {0.7f, 0, 5}, .direction = {0, 0, -1}}).t), 0);
    // It starts in solid.
    EXPECT_EQ(exact.cast_sphere({.origin = {0.7f, 0, 0}, .direction = {1, 0, 0}}, 0.1f).t, 0);
}

TEST(Exact, OverlapsFollowTheTrueDistance) {
    const Compiled c = compiled(
        scene_with("{\"shape\": \"sphere\", \"radius\": 1, \"position\": [-0.6, 0, 0]}, "
                   "{\"shape\": \"sphere\", \"radius\": 1, \"position\": [0.6, 0, 0], \"op\": \"intersect\"}"));
    const ExactField exact(c.program);
    // Above the lens' rim (radius 0.8 in x = 0) the program's value is less than the true distance.
    EXPECT_LT(exact.distance({0, 1.8, 0}), 0.92);
    EXPECT_FALSE(exact.overlaps_sphere({0, 1.8f, 0}, 0.999f));
    EXPECT_TRUE(exact.overlaps_sphere({0, 1.8f, 0}, 1.001f));
    EXPECT_TRUE(exact.overlaps_sphere({0, 0, 0}, 0));
    EXPECT_FALSE(exact.overlaps_box({0, 1.8f, 0}, {1, 0.98f, 1}, {}));
    EXPECT_TRUE(exact.overlaps_box({0, 1.8f, 0}, {1, 1.01f, 1}, {}));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(exact.overlaps_sphere({nan, 0, 0}, 1));
    EXPECT_FALSE(exact.nearest({nan, 0, 0}, 1).found);
    EXPECT_FALSE(exact.cast({.origin = {0, nan, 0}}).hit);
    EXPECT_FALSE(exact.cast_sphere({.origin = {0, 0, 5}, .direction = {0, 0, -1}}, nan).hit);
}

TEST(Exact, ABatchAnswersLikeOneByOne) {
    const BundledScene& scene = bundled_files().front();
    const Compiled c = compiled(std::string(scene.json));
    const ExactField many(c.program);
    std::mt19937 random(3);
    const Box3 box = c.program.bounds.inflated(0.1f);
    std::vector<vec3> points(500);
    for (vec3& p : points)
        p = {std::uniform_real_distribution<float>(box.min.x, box.max.x)(random),
             std::uniform_real_distribution<float>(box.min.y, box.max.y)(random),
             std::uniform_real_distribution<float>(box.min.z, box.max.z)(random)};
    std::vector<FieldSample> samples(points.size());
    std::vector<float> distances(points.size());
    many.sample(points, samples.data());
    many.distance(points, distances.data());
    for (size_t i = 0; i < points.size(); i += points.size() / size_t(rounds(40))) {
        const ExactField alone(c.program);  // whose regions nobody has asked
        const FieldSample one = alone.sample(points[i]);
        EXPECT_EQ(one.distance, samples[i].distance);
        EXPECT_EQ(one.distance, distances[i]);
        EXPECT_EQ(one.normal, samples[i].normal);
        EXPECT_EQ(one.material, samples[i].material);
    }
}

}  // namespace
}  // namespace kiln::scene
