// SPDX-License-Identifier: MIT
// Ambient occlusion against closed forms (renderer.md 1.20): what of the hemisphere over a point of a plane a ball that rests on it, a wall, an inside
// corner hides; and against the judge, who counts rays in double precision.
#include "drawables.h"
#include "field/brick_set.h"
#include "field/clipmap.h"
#include "gpu_worlds.h"
#include "rgb_of.h"
#include "image/metrics.h"
#include "render/lib/color.gpu.h"
#include "render/lib/pack.h"
#include "render/lib/shading.gpu.h"
#include "render/mesh_trace.h"
#include "render/passes/ao.gpu.h"
#include "render/reference.h"
#include "sdf/eval.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

namespace kiln::render {
namespace {

using field::worlds::edit;

constexpr float kFar = std::numeric_limits<float>::infinity();
const Box3 kEverywhere{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};

// How much of a ball's light-free share is left at x radii from where it touches the plane: 1 - (1 + x²)^(-3/2), the ball being above the
// horizon of every point of the plane, so that its form factor is (r / d)² times the cosine r / d.
double beside_ball(double x) { return 1 - std::pow(1 + x * x, -1.5); }

TEST(Ao, DirectionsOfEveryFourByFourPointsAreSpreadByTheCosine) {
    for (const uint32_t picture : {0u, 5u, 15u}) {
        for (int i = 0; i < 2 * kAoSide * kAoSide; ++i) {
            // Any window of points has each number once; rings and sectors of equal share of the light have as many directions.
            const int x = i % kAoSide, y = i / kAoSide % kAoSide;
            const uint32_t rays = i < kAoSide * kAoSide ? 4 : 8, set = rays * kAoPoints;
            std::vector<int> numbers(size_t(set * kAoPictures)), rings(4), sectors(8);
            double height = 0;
            vec3 sum{};
            for (int k = 0; k < kAoSide * kAoSide; ++k) {
                for (uint32_t ray = 0; ray < rays; ++ray) {
                    const uint32_t n = ao_number(x + k % kAoSide, y + k / kAoSide, picture, rays, ray);
                    EXPECT_EQ(++numbers[n], 1);
                    EXPECT_EQ(n / set, picture);
                    const vec3 d = ao_local_direction(n, rays);
                    EXPECT_NEAR(length(d), 1, 1e-5);
                    const double r2 = double(d.x) * double(d.x) + double(d.y) * double(d.y);
                    ++rings[size_t(std::min(4 * r2, 3.999))];
                    ++sectors[size_t((std::atan2(double(d.y), double(d.x)) / (2 * std::numbers::pi) + 0.5) * 7.9999)];
                    height += double(d.z);
                    sum = sum + d;
                }
            }
            EXPECT_NEAR(height / set, 2.0 / 3, 0.01);
            EXPECT_LE(std::hypot(sum.x, sum.y) / float(set), 0.03f) << "to no side";
            for (const int n : rings) EXPECT_NEAR(n, set / 4, 4);
            for (const int n : sectors) EXPECT_NEAR(n, set / 8, 4);
        }
    }
}

TEST(Ao, WhiteThingsInWhiteLightStayWhite) {
    for (float visible = 0.05f; visible <= 1; visible += 0.05f) {
        EXPECT_NEAR(shade::ambient_share(visible, 1), 1, 1e-5);
        EXPECT_EQ(shade::ambient_share(visible, 0), visible);
        for (const float n_v : {0.05f, 0.5f, 1.0f}) {
            const float mirror = shade::reflection_visible(n_v, visible, 0.2f);
            EXPECT_GE(mirror, 0);
            EXPECT_LE(mirror, 1);
        }
    }
    EXPECT_EQ(shade::ambient_share(1, 0.3f), 1);
    EXPECT_EQ(shade::reflection_visible(0.3f, 1, 0.5f), 1);
}

struct AoGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture open(const Frame& frame, RenderSettings settings = {.width = 128, .height = 96}) {
        settings.view = View::Ao;
        return rhi::must(renderer->render(frame, settings));
    }
    // Of the pixels that see the plane y = height, where `truth` is not negative: |what is open - what should be| at the worst, away from jumps of
    // depth and beside them, and in the mean; and the mean with its sign.
    struct Apart {
        double worst = 0, worst_by_edge = 0, mean = 0, bias = 0;
        int judged = 0;
    };
    static Apart apart(const Picture& p, const Camera& camera, float height, const std::function<double(vec3)>& truth) {
        const shade::CameraParams eye = shade::camera_params(camera, p.width, p.height);
        Apart out;
        const auto by_edge = [&](int x, int y) {
            const float d = p.depth[size_t(y * p.width + x)];
            for (int k = 0; k < 49; ++k) {
                const int u = x + k % 7 - 3, v = y + k / 7 - 3;
                if (u < 0 || v < 0 || u >= p.width || v >= p.height) return true;
                if (!(std::fabs(p.depth[size_t(v * p.width + u)] - d) < 0.06f * d)) return true;
            }
            return false;
        };
        for (int y = 0; y < p.height; ++y) {
            for (int x = 0; x < p.width; ++x) {
                const size_t i = size_t(y * p.width + x);
                if (!std::isfinite(p.depth[i])) continue;
                const vec3 at =
                    camera.position + shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f) * p.depth[i];
                if (std::fabs(at.y - height) > 2e-3f) continue;
                const double should = truth(at);
                if (should < 0) continue;
                const double off = std::fabs(double(p.rgba[4 * i]) - should);
                double& worst = by_edge(x, y) ? out.worst_by_edge : out.worst;
                worst = std::max(worst, off);
                out.mean += off;
                out.bias += double(p.rgba[4 * i]) - should;
                ++out.judged;
            }
        }
        out.mean /= std::max(out.judged, 1);
        out.bias /= std::max(out.judged, 1);
        return out;
    }
    // A ball of radius r on y = 0 that touches it at (x, z).
    static std::function<double(vec3)> beside(float x, float z, float r, double from = 0.6, double to = 5) {
        return [=](vec3 p) {
            const double at = std::hypot(double(p.x - x), double(p.z - z)) / double(r);
            return at < from || at > to ? -1 : beside_ball(at);
        };
    }
    static Frame looking_down(const field::worlds::World& w, vec3 target = {0, 0, 0}) {
        Frame frame = frame_of(w, target + vec3{0.02f, 2.1f, 1.4f});
        frame.camera.target = target;
        frame.camera.fov_y_deg = 45;
        return frame;
    }
    std::unique_ptr<Renderer> renderer;
};

field::worlds::World plane_world(float h = 0.025f, float size = 1.2f) {
    return {"plane", {edit(Plane{})}, {.voxel_size = h, .bounds = {{-size, -0.2f, -size}, {size, 0.8f, size}}}};
}

void expect_all_open(const Picture& p, const std::string& what) {
    int shut = 0, hits = 0;
    float least = 1;
    for (size_t i = 0; i < p.depth.size(); ++i) {
        hits += std::isfinite(p.depth[i]);
        shut += p.rgba[4 * i] != 1;
        least = std::min(least, p.rgba[4 * i]);
    }
    EXPECT_GT(hits, 300) << what;
    EXPECT_EQ(shut, 0) << what << ": of " << hits << " points, the least " << least;
}

TEST_F(AoGpu, APlaneAndABallAloneAreOpen) {
    const field::worlds::World plane = plane_world(), tilted = [] {
        field::worlds::World w = plane_world();
        w.edits[0].node.transform.rotation = axis_angle(normalize(vec3{1, 0.2f, 0.4f}), 0.35f);
        return w;
    }();
    for (const AmbientOcclusion ao : {AmbientOcclusion::Full, AmbientOcclusion::Half}) {
        for (const vec3 eye : {vec3{0.3f, 1, 0.8f}, vec3{2, 0.12f, 0.1f}}) {
            for (const bool refine : {true, false}) {
                expect_all_open(open(frame_of(plane, eye), {.width = 64, .height = 48, .refine = refine, .ao = ao}),
                                "plane");
                expect_all_open(open(frame_of(tilted, eye + vec3{0, 1.5f, 0}),
                                     {.width = 64, .height = 48, .refine = refine, .ao = ao}),
                                "tilted");
            }
        }
        Frame ball = frame_of(field::worlds::sphere_of(10));
        ball.camera.fov_y_deg = 20;
        expect_all_open(open(ball, {.width = 64, .height = 48, .ao = ao}), "ball");
        ball.meshes = {meshes::at(meshes::sphere(0.3f, 16, meshes::matte({1, 1, 1})), {500, 0.9f, 0.6f})};
        ball.camera.position = {500, 1.2f, 2.4f}, ball.camera.target = {500, 0.9f, 0.6f};
        expect_all_open(open(ball, {.width = 64, .height = 48, .ao = ao}), "mesh");
    }
}

// Nothing else of a picture changes where nothing is hidden; and what is hidden changes no direct light.
TEST_F(AoGpu, OnlyLightFromAllAroundIsHidden) {
    Frame frame = frame_of(field::worlds::sphere_of(10));
    const RenderSettings on{.width = 48, .height = 36}, off{.width = 48, .height = 36, .ao = AmbientOcclusion::Off};
    const Picture a = rhi::must(renderer->render(frame, on)), b = rhi::must(renderer->render(frame, off));
    for (size_t i = 0; i < a.rgba.size(); ++i) ASSERT_NEAR(a.rgba[i], b.rgba[i], 2e-3f * b.rgba[i]);
    Frame corner = looking_down(plane_world());
    corner.field = [] {
        field::worlds::World w = plane_world();
        w.edits.push_back(edit(Box{.half_extents = {0.1f, 0.6f, 0.6f}}));
        return w.field();
    }();
    EXPECT_NE(rhi::must(renderer->render(corner, on)).rgba, rhi::must(renderer->render(corner, off)).rgba);
    corner.environment = Environment{.color = {0, 0, 0}};
    EXPECT_EQ(rhi::must(renderer->render(corner, on)).rgba, rhi::must(renderer->render(corner, off)).rgba);
}

TEST_F(AoGpu, ABallOnAPlaneHidesWhatItsFormFactorSays) {
    const float r = 0.3f;
    field::worlds::World w = plane_world();
    w.edits.push_back(edit(Sphere{.radius = r}, {0, r, 0}));
    const Frame frame = looking_down(w);
    struct Case {
        AmbientOcclusion ao;
        int width;
        double worst, by_edge, mean;
    };
    for (const Case& c :
         {Case{AmbientOcclusion::Full, 128, 0.032, 0.075, 0.006}, Case{AmbientOcclusion::Full, 256, 0.04, 0.065, 0.005},
          Case{AmbientOcclusion::Half, 128, 0.05, 0.19, 0.011}}) {
        const bool full = c.ao == AmbientOcclusion::Full;
        const Picture p = open(frame, {.width = c.width, .height = c.width * 3 / 4, .ao = c.ao});
        const Apart all = apart(p, frame.camera, 0, beside(0, 0, r));
        EXPECT_GT(all.judged, 700);
        EXPECT_LE(all.worst, c.worst) << c.width << ", half: " << !full;
        EXPECT_LE(all.worst_by_edge, c.by_edge) << c.width << ", half: " << !full;
        EXPECT_LE(all.mean, c.mean) << c.width << ", half: " << !full;
        for (const double x : {1.0, 2.0, 4.0}) {
            const Apart at = apart(p, frame.camera, 0, beside(0, 0, r, x - 0.08, x + 0.08));
            EXPECT_GT(at.judged, 90) << x;
            EXPECT_LE(std::fabs(at.bias), full ? 0.005 : 0.03) << x;
            EXPECT_LE(at.worst, full ? 0.03 : c.worst) << "at " << x << ", every pixel of " << c.width;
        }
        EXPECT_GT(renderer->stats().pass_evaluations.back().second, 1000u);
        EXPECT_TRUE(renderer->stats().pass_evaluations.back().first.starts_with("ao"));
    }
}

// The top of a plate over a plane is open up to its rim, though what is seen past it is not.
TEST_F(AoGpu, TheMeanCrossesNoEdge) {
    field::worlds::World w = plane_world();
    w.edits.push_back(edit(Box{.half_extents = {0.5f, 0.05f, 0.4f}}, {0, 0.3f, 0}));
    const Frame frame = looking_down(w);
    for (const AmbientOcclusion ao : {AmbientOcclusion::Full, AmbientOcclusion::Half}) {
        const Picture p = open(frame, {.width = 128, .height = 96, .ao = ao});
        const Apart top = apart(p, frame.camera, 0.35f, [](vec3) { return 1.0; });
        EXPECT_GT(top.judged, 1000);
        EXPECT_LE(std::max(top.worst, top.worst_by_edge), 0.02);
        const Apart below = apart(p, frame.camera, 0, [](vec3) { return 1.0; });
        EXPECT_GE(below.worst_by_edge, 0.3) << "there is something to cross to";
    }
}

// The exact path has the same.
TEST_F(AoGpu, TheExactPathSeesTheSame) {
    const float r = 0.3f;
    field::worlds::World w = plane_world(0.05f);
    w.edits.push_back(edit(Sphere{.radius = r}, {0, r, 0}));
    const Frame frame = looking_down(w);
    const Apart all =
        apart(open(frame, {.width = 128, .height = 96, .analytic = true}), frame.camera, 0, beside(0, 0, r));
    EXPECT_GT(all.judged, 700);
    EXPECT_LE(all.worst, 0.055) << "the ball has six voxels";
    EXPECT_LE(all.mean, 0.007);
}

// A wall without an end hides half of what a point at its foot sees, however far off: (1 + cos of its top's height) / 2.
TEST_F(AoGpu, AnInsideCornerOfTwoPlanesIsHalfOpen) {
    field::worlds::World w = plane_world();
    Edit wall = edit(Plane{}, {-0.3f, 0, 0});
    wall.node.transform.rotation = axis_angle({0, 0, 1}, -0.5f * std::numbers::pi_v<float>);
    w.edits.push_back(wall);
    Frame frame = looking_down(w, {0.3f, 0, 0});
    for (const AmbientOcclusion ao : {AmbientOcclusion::Full, AmbientOcclusion::Half}) {
        const Apart all = apart(open(frame, {.width = 128, .height = 96, .ao = ao}), frame.camera, 0,
                                [](vec3 p) { return p.x < -0.2f ? -1 : 0.5; });
        EXPECT_GT(all.judged, 1000);
        EXPECT_LE(all.worst, 0.02) << "also where the wall is met outside the grid alone";
    }
    // … and one of height 0.4 that is 40 times as long, (1 + x / sqrt(x² + h²)) / 2.
    w = plane_world(0.04f, 0.8f);
    w.edits.push_back(edit(Box{.half_extents = {0.2f, 0.4f, 8}}, {-0.5f, 0, 0}));
    w.options.bounds = {{-0.8f, -0.2f, -8.2f}, {1.6f, 0.6f, 8.2f}};
    frame.field = w.field();
    const Apart all = apart(open(frame), frame.camera, 0, [](vec3 p) {
        const double x = double(p.x) + 0.3;
        return x < 0.06 ? -1 : 0.5 + 0.5 * x / std::hypot(x, 0.4);
    });
    EXPECT_GT(all.judged, 1000);
    EXPECT_LE(all.worst, 0.055);
    EXPECT_LE(all.mean, 0.013) << "rays begin half a voxel up, a twentieth of the wall";
}

// The ball is behind the eye: a depth buffer would know nothing of it.
TEST_F(AoGpu, WhatIsOffTheScreenHidesToo) {
    const float r = 0.3f;
    field::worlds::World w = plane_world();
    w.edits.push_back(edit(Sphere{.radius = r}, {0, r, 0}));
    Frame frame = frame_of(w, {0.36f, 0.35f, 0});
    frame.camera.target = {0.8f, 0, 0};
    const Apart all = apart(open(frame), frame.camera, 0, beside(0, 0, r));
    EXPECT_GT(all.judged, 1500);
    EXPECT_LE(all.worst, 0.03);
}

// An instance stands apart, hides what its ball hides wherever it goes, and nothing is left behind.
TEST_F(AoGpu, WhatMovesTakesItsContactShadowWithIt) {
    const float r = 0.25f;
    const auto set = rhi::must(field::BrickSet::make(field::worlds::compiled({edit(Sphere{.radius = r})}), 0.025f));
    Frame frame = looking_down(plane_world());
    for (int i = 0; i < 6; ++i) {
        const vec3 at{-0.4f + 0.137f * float(i), r, 0.3f - 0.051f * float(i)};
        const Pose pose{at, axis_angle({0.6f, 0.8f, 0}, 0.7f * float(i))};
        frame.instances = {Instance{.bricks = set, .pose = pose, .before = pose}};
        const Picture p = open(
            frame, {.width = 128, .height = 96, .ao = i % 2 == 0 ? AmbientOcclusion::Full : AmbientOcclusion::Half});
        const Apart all = apart(p, frame.camera, 0, beside(at.x, at.z, r, 0.7, 20));
        EXPECT_GT(all.judged, 1200);
        EXPECT_LE(all.worst, i % 2 == 0 ? 0.04 : 0.1) << i;
        EXPECT_LE(all.mean, i % 2 == 0 ? 0.006 : 0.01) << i;
    }
    frame.instances[0].pose = frame.instances[0].before = {{4000, 1, 0}, {}};
    expect_all_open(open(frame), "far off");
    Frame alone = frame_of(field::worlds::sphere_of(4), {500, 1.3f, 1});
    alone.instances = frame.instances;
    alone.instances[0].pose = alone.instances[0].before = {{500, 1, 0}, {}};
    alone.camera.target = {500, 1, 0};
    alone.camera.fov_y_deg = 40;
    expect_all_open(open(alone), "an instance alone");
}

// Points of meshes are hidden by the field and by meshes, points of the field by meshes.
TEST_F(AoGpu, MeshesHideAndAreHidden) {
    const float r = 0.3f;
    field::worlds::World ball = plane_world();
    ball.edits = {edit(Sphere{.radius = r}, {0, r, 0})};
    field::worlds::World speck = plane_world();
    speck.edits = {edit(Sphere{.radius = 0.05f}, {0, -3, 0})};
    speck.options.bounds = {{-0.2f, -3.2f, -0.2f}, {0.2f, -2.8f, 0.2f}};
    const MeshInstance sheet = meshes::at(meshes::sheet(-3, -3, 3, 3, meshes::matte({0.5f, 0.5f, 0.5f})));
    const MeshInstance sphere = meshes::at(meshes::sphere(r, 48, meshes::matte({0.5f, 0.5f, 0.5f})), {0, r, 0});
    struct Case {
        const char* what;
        const field::worlds::World world;
        std::vector<MeshInstance> meshes;
        bool at_half;  // is it met there?
    };
    for (const Case& c :
         {Case{"field hides mesh", ball, {sheet}, true}, Case{"mesh hides field", plane_world(), {sphere}, false},
          Case{"mesh hides mesh", speck, {sheet, sphere}, false}}) {
        Frame frame = looking_down(c.world);
        frame.meshes = c.meshes;
        const Apart full = apart(open(frame), frame.camera, 0, beside(0, 0, r));
        EXPECT_GT(full.judged, 700) << c.what;
        EXPECT_LE(full.worst, 0.045) << c.what;
        EXPECT_LE(full.mean, 0.01) << c.what;
        const Apart half = apart(
            open(frame, {.width = 128, .height = 96, .ao = AmbientOcclusion::Half}), frame.camera, 0,
            c.at_half ? beside(0, 0, r) : [](vec3 p) { return std::hypot(p.x, p.z) < 0.2f ? -1.0 : 1.0; });
        EXPECT_LE(half.worst, c.at_half ? 0.07 : 0) << c.what << ", half";
    }
}

// A plane through all levels is open at every border of theirs, and a ball near one hides what it should.
TEST_F(AoGpu, BordersOfLevelsDoNotShow) {
    Frame frame = looking_down(plane_world());
    frame.field = nullptr;
    for (const bool with_ball : {false, true}) {
        std::vector<Edit> edits{edit(Plane{})};
        const float r = 0.3f;
        if (with_ball) edits.push_back(edit(Sphere{.radius = r}, {0, r, 0}));
        auto map = field::Clipmap::make(field::worlds::compiled(edits), {.voxel_size = 0.01f, .levels = 4, .cells = 32},
                                        {0.5, 0.1, 0.2});
        ASSERT_TRUE(map);
        map->work();
        frame.levels = std::make_shared<const field::Clipmap>(std::move(*map));
        frame.camera.position = {0.02f, 2.1f, 1.4f}, frame.camera.target = {0, 0, 0};
        if (with_ball) {
            const Apart all = apart(open(frame), frame.camera, 0, beside(0, 0, r, 0.7));
            EXPECT_GT(all.judged, 700);
            EXPECT_LE(all.worst, 0.04);
            EXPECT_LE(all.mean, 0.01);
        } else {
            for (const vec3 eye : {vec3{0.5f, 0.1f, 0.2f}, vec3{4, 0.6f, 3}})
                for (const bool refine : {true, false}) {
                    frame.camera.position = eye, frame.camera.target = {0, -0.2f, 0};
                    expect_all_open(open(frame, {.width = 64, .height = 48, .refine = refine}), "plane of levels");
                }
        }
    }
}

// Sixteen pictures over time look along sixteen sets; without time it is always the first.
TEST_F(AoGpu, PicturesOverTimeComeNearer) {
    const float r = 0.3f;
    field::worlds::World w = plane_world();
    w.edits.push_back(edit(Sphere{.radius = r}, {0, r, 0}));
    Frame frame = looking_down(w);
    frame.lights.clear();
    frame.environment = Environment{.color = {1, 1, 1}};
    const RenderSettings one{.width = 128, .height = 96}, over_time{.width = 128, .height = 96, .taa = true};
    const Picture single = rhi::must(renderer->render(frame, one));
    Picture many = rhi::must(renderer->render(frame, over_time));
    for (int i = 1; i < 16; ++i) many = rhi::must(renderer->render(frame, over_time));
    EXPECT_EQ(rhi::must(renderer->render(frame, one)).rgba, single.rgba);
    // Round the ball all that is as far off is as bright, by the true light: how far pixels are off their ring's mean.
    const shade::CameraParams eye = shade::camera_params(frame.camera, 128, 96);
    double spread[2] = {};
    int judged = 0;
    for (const double from : {1.1, 1.3, 1.6, 2.0, 2.5}) {
        std::vector<double> ring[2];
        for (int y = 0; y < 96; ++y) {
            for (int x = 0; x < 128; ++x) {
                const size_t i = size_t(y * 128 + x);
                const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f);
                const vec3 at = frame.camera.position + d * single.depth[i];
                const double radii = std::hypot(double(at.x), double(at.z)) / double(r);
                if (!(std::fabs(at.y) < 2e-3f) || radii < from || radii > from + 0.1) continue;
                ring[0].push_back(double(single.rgba[4 * i + 1]) / (beside_ball(radii)));
                ring[1].push_back(double(many.rgba[4 * i + 1]) / (beside_ball(radii)));
            }
        }
        for (int k = 0; k < 2; ++k) {
            const double mean = std::accumulate(ring[k].begin(), ring[k].end(), 0.0) / double(ring[k].size());
            for (const double v : ring[k]) spread[k] += std::fabs(v / mean - 1);
        }
        judged += int(ring[0].size());
    }
    EXPECT_GT(judged, 500);
    EXPECT_LE(spread[0] / judged, 0.03);
    EXPECT_LE(spread[1], 0.85 * spread[0]);
}

// A white world in white light is white in its corners too; and every grey one is nearer to what paths say than without.
TEST_F(AoGpu, PicturesComeNearerToPaths) {
    field::worlds::World w = plane_world(0.03f);
    w.edits.push_back(edit(Box{.half_extents = {0.25f, 0.3f, 0.25f}}, {-0.2f, 0.3f, -0.1f}));
    w.edits.push_back(edit(Sphere{.radius = 0.2f}, {0.4f, 0.2f, 0.2f}));
    w.edits.push_back(edit(Torus{.major_radius = 0.22f, .minor_radius = 0.06f}, {0.1f, 0.06f, 0.6f}));
    Frame frame = frame_of(w, {0.9f, 1.1f, 1.7f});
    frame.camera.target = {0.05f, 0.15f, 0.1f};
    frame.camera.tone_map = ToneMap::None;
    frame.lights.clear();
    frame.environment = Environment{.color = {1, 1, 1}};
    const RenderSettings on{.width = 48, .height = 36};
    for (const float roughness : {0.3f, 1.0f}) {
        frame.materials.assign(2, Material{.base_color = {1, 1, 1}, .roughness = roughness});
        const Picture white = rhi::must(renderer->render(frame, on));
        float worst = 0;
        for (size_t i = 0; i < white.rgba.size(); ++i)
            if (i % 4 != 3) worst = std::max(worst, std::fabs(white.rgba[i] - 1));
        EXPECT_LE(worst, 0.01f) << "roughness " << roughness;
    }
    const float grey = 0.7f;
    frame.materials.assign(2, Material{.base_color = {grey, grey, grey}, .roughness = 0.8f});
    const auto program = frame.field->program();
    const ReferenceField judge{.distance = [&](dvec3 p) { return sdf::evaluate(sdf::view(program), p); },
                               .normal = {},
                               .material = [&](dvec3) { return frame.materials[0]; },
                               .bounds = kEverywhere};
    const image::Rgb truth = rgb_of(render_reference(judge, {}, shade::sky_params(frame), frame.camera,
                                                     {.width = 48, .height = 36, .samples = 48}));
    double flip[3];
    for (const AmbientOcclusion ao : {AmbientOcclusion::Off, AmbientOcclusion::Half, AmbientOcclusion::Full}) {
        RenderSettings s = on;
        s.ao = ao;
        flip[size_t(ao)] = image::flip(rgb_of(rhi::must(renderer->render(frame, s))), truth);
    }
    RecordProperty("flip", std::to_string(flip[0]) + " off, " + std::to_string(flip[1]) + " half, " +
                               std::to_string(flip[2]) + " full");
    EXPECT_LE(flip[2], 0.75 * flip[0]);
    EXPECT_LE(flip[1], 0.85 * flip[0]);
}

// Pixel by pixel what the judge counts, and the light of it.
TEST_F(AoGpu, PixelsAreThoseOfTheJudge) {
    field::worlds::World w = plane_world(0.025f);
    w.edits.push_back(edit(Box{.half_extents = {0.25f, 0.3f, 0.25f}}, {-0.2f, 0.3f, -0.1f}));
    w.edits.push_back(edit(Sphere{.radius = 0.2f}, {0.4f, 0.2f, 0.2f}));
    Frame frame = frame_of(w, {0.9f, 1.1f, 1.7f});
    frame.camera.target = {0.05f, 0.15f, 0.1f};
    frame.meshes = {
        meshes::at(meshes::sphere(0.15f, 32, meshes::of_material(frame.materials[0])), {-0.3f, 0.15f, 0.5f})};
    const MeshSet set = make_mesh_set(frame);
    const MeshTrace trace(set);
    const auto program = frame.field->program();
    const ReferenceField judge{.distance = [&](dvec3 p) { return sdf::evaluate(sdf::view(program), p); },
                               .normal = {},
                               .material = [&](dvec3) { return frame.materials[0]; },
                               .bounds = kEverywhere,
                               .meshes = &trace};
    const ReferencePicture truth = render_reference(judge, {}, shade::sky_params(frame), frame.camera,
                                                    {.width = 64, .height = 48, .sky_samples = 100});
    const Picture seen = open(frame, {.width = 64, .height = 48});
    frame.lights.clear();
    const Picture light = rhi::must(renderer->render(frame, {.width = 64, .height = 48}));
    int judged = 0, off = 0, dim = 0;
    double mean = 0;
    for (size_t i = 0; i < truth.depth.size(); ++i) {
        if (!std::isfinite(truth.depth[i]) || std::fabs(truth.depth[i] - seen.depth[i]) > 0.01f) continue;
        ++judged;
        const double by = std::fabs(double(seen.rgba[4 * i]) - double(truth.open[i]));
        mean += by;
        off += by > 0.1;
        dim += std::fabs(light.rgba[4 * i] - truth.rgba[4 * i]) > 0.1f * truth.rgba[4 * i] + 0.02f;
    }
    EXPECT_GT(judged, 1800);
    EXPECT_LE(mean / judged, 0.015);
    EXPECT_LE(off, judged / 30) << "in creases, where rays begin a voxel off";
    EXPECT_LE(dim, judged / 50);
}

}  // namespace
}  // namespace kiln::render
