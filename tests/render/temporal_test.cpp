// SPDX-License-Identifier: MIT
// Motion and temporal anti-aliasing, each against what it stands for: reprojected points, supersampled pictures, no history at all.
#include "over_time.h"
#include "render/lib/color.gpu.h"
#include "render/edit_motion.h"
#include "render/lib/pack.h"
#include "render/material_table.h"
#include "render/picture.h"
#include "render/temporal.h"

#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

TEST(Jitter, IsHaltonsAndItsCameraLooksThere) {
    EXPECT_EQ(jitter_of(0).x, 0.0f);
    EXPECT_EQ(jitter_of(1).x, -0.25f);
    EXPECT_EQ(jitter_of(2).x, 0.25f);
    EXPECT_NEAR(jitter_of(0).y, 1.0 / 3 - 0.5, 1e-6);
    EXPECT_NEAR(jitter_of(3).y, 1.0 / 9 + 1.0 / 3 - 0.5, 1e-6);
    EXPECT_EQ(jitter_of(kJitterRound), jitter_of(0));
    const shade::CameraParams eye = shade::camera_params({.fov_y_deg = 60}, kWidth, kHeight);
    for (uint64_t i = 0; i < kJitterRound; ++i) {
        const vec2 j = jitter_of(i);
        const vec3 a = shade::camera_direction_at(jittered(eye, j), 20.5f, 60.5f);
        const vec3 b = shade::camera_direction_at(eye, 20.5f + j.x, 60.5f + j.y);
        EXPECT_NEAR(length(a - b), 0, 1e-6);
        const vec2 back = shade::camera_pixel(eye, a * 7.0f);
        EXPECT_NEAR(back.x, 20.5f + j.x, 1e-3);
        EXPECT_NEAR(back.y, 60.5f + j.y, 1e-3);
    }
}

struct MotionGpu : GpuTest {};

TEST_F(MotionGpu, IsTheReprojectionOfAWorldThatStandsStill) {
    Frame frame = frame_of(on_ground());
    frame.camera.target.y = 0.8f;
    Camera before = frame.camera;
    before.position = before.position + vec3{0.11f, -0.07f, 0.16f};
    before.target = before.target + vec3{-0.04f, 0.09f, 0};
    before.fov_y_deg = 47;
    GpuField gpu(*runner_);
    rhi::must(gpu.update(frame.field, Baker::Host));
    FrameParams p = rhi::must(frame_params(frame, {.width = kWidth, .height = kHeight, .refine = false}, gpu));
    p.camera = jittered(p.camera, {0.3f, -0.2f});
    const shade::CameraParams now = shade::camera_params(frame.camera, kWidth, kHeight),
                              then = shade::camera_params(before, kWidth, kHeight);
    Graph g(*runner_);
    TileInputs in;
    in.field = gpu.import(g);
    in.exact = gpu.leaves_grid();
    in.horizons = gpu.outside_is_concave();
    in.use = gpu.use(true);
    in.use_of_bricks = gpu.use(false);
    in.frame = g.block(p);
    const FrameRay no_ray{};
    in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
    MaterialTable materials;
    materials.update(material_records(frame));
    in.materials = g.upload("materials", materials.entries());
    in.size = {kWidth, kHeight};
    in.motion = g.block(motion_params(frame.camera, before, kWidth, kHeight));
    const Visibility seen = march(g, in);
    const Surface surface = resolve(g, in, seen.words, seen.words);
    const Readback moved = g.readback(motion(g, in, surface.seen)), depth = g.readback(depth_of(g, in, surface.seen));
    rhi::must(runner_->execute(g));
    const std::vector<uint16_t> halves = rhi::must(moved.get_as<uint16_t>());
    const std::vector<float> metres = rhi::must(depth.get_as<float>());
    const auto value = [](uint16_t half) {
        const int exponent = (half >> 10) & 31;
        const double size = std::ldexp(exponent ? 1024 + (half & 1023) : half & 1023, std::max(exponent, 1) - 25);
        return half & 0x8000 ? -size : size;
    };
    // In double precision, of the same cameras.
    const auto pixel = [](const shade::CameraParams& c, const double(&to)[3]) {
        const auto along = [&](const vec4& v) {
            return to[0] * double(v.x) + to[1] * double(v.y) + to[2] * double(v.z);
        };
        const auto size2 = [](const vec4& v) {
            return double(v.x) * double(v.x) + double(v.y) * double(v.y) + double(v.z) * double(v.z);
        };
        const double ahead = along(c.forward);
        return std::pair{(1 + along(c.right) / (ahead * size2(c.right))) * kWidth / 2,
                         (1 - along(c.up) / (ahead * size2(c.up))) * kHeight / 2};
    };
    int hits = 0, sky = 0;
    double largest = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const size_t i = size_t(y * kWidth + x);
            const vec3 d = shade::camera_direction_at(p.camera, float(x) + 0.5f, float(y) + 0.5f);
            const bool hit = std::isfinite(metres[i]);
            (hit ? hits : sky) += 1;
            const double t = hit ? double(metres[i]) : 1;
            const double to_now[3] = {double(d.x) * t, double(d.y) * t, double(d.z) * t};
            const vec3 shift = frame.camera.position - before.position;
            const double to_then[3] = {to_now[0] + (hit ? double(shift.x) : 0), to_now[1] + (hit ? double(shift.y) : 0),
                                       to_now[2] + (hit ? double(shift.z) : 0)};
            const auto a = pixel(now, to_now), b = pixel(then, to_then);
            const double mx = b.first - a.first, my = b.second - a.second;
            largest = std::max(largest, std::hypot(mx, my));
            EXPECT_NEAR(value(halves[4 * i]), mx, 1e-3 + std::fabs(mx) / 1024) << x << ", " << y;
            EXPECT_NEAR(value(halves[4 * i + 1]), my, 1e-3 + std::fabs(my) / 1024) << x << ", " << y;
            const double grown = std::hypot(to_then[0], to_then[1], to_then[2]) / t;
            EXPECT_NEAR(value(halves[4 * i + 2]), hit ? grown : 1, 2e-3);
        }
    }
    EXPECT_GT(hits, 1000);
    EXPECT_GT(sky, 100);
    EXPECT_GT(largest, 2);
}

// Two balls that blend; one of them has moved, turned and grown. Its points come from where its own transform had them, to the middle of
// the blend, and the other's have not moved. In a box that has changed nothing was anywhere.
TEST_F(MotionGpu, OfWhatBlendsIsThatOfTheNearestEdit) {
    const vec3 a{-0.25f, 0, 0};
    const Transform now{{0.3f, 0.1f, 0.1f}, axis_angle({0, 0, 1}, 0.3f), {1, 1, 1}};
    const Transform before{{0.24f, 0.13f, 0.07f}, axis_angle({0, 0, 1}, 0.2f), {0.9f, 0.9f, 0.9f}};
    field::worlds::World world{
        "two balls",
        {field::worlds::edit(Sphere{.radius = 0.45f}, a), field::worlds::edit(Sphere{.radius = 0.4f})},
        {.voxel_size = 0.03f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    world.edits[1].blend_radius = 0.2f;
    world.edits[1].node.transform = now;
    Frame frame = frame_of(world, {0.3f, 0.8f, 2.5f});
    frame.moved = {{frame.field->program().rows()[1], now, before}};
    for (const bool changed : {false, true}) {
        if (changed) frame.changed = {{{-1, 0.1f, -1}, {0, 1, 1}}};
        GpuField gpu(*runner_);
        rhi::must(gpu.update(frame.field, Baker::Host));
        const FrameParams p =
            rhi::must(frame_params(frame, {.width = kWidth, .height = kHeight, .refine = false}, gpu));
        const MovedEdits moved = moved_edits(frame, frame.field->program(), p);
        ASSERT_EQ(moved.records.size(), 1u);
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu.import(g);
        in.frame = g.block(p);
        const FrameRay no_ray{};
        in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
        in.size = {kWidth, kHeight};
        MotionParams params = motion_params(frame.camera, frame.camera, kWidth, kHeight);
        params.moved_count = 1;
        params.changed_count = uint32_t(moved.boxes.size());
        in.motion = g.block(params);
        in.moved.owners = {g.upload("moved edits", std::span<const OutlineRecord>(moved.code.records)),
                           g.upload("code of moved edits", std::span<const sdf::Instruction>(moved.code.code)), 1,
                           tape_use(moved.code.code)};
        in.moved.edits = g.upload("motions of edits", std::span<const MovedRecord>(moved.records));
        in.moved.has_boxes = changed;
        if (changed) in.moved.boxes = g.upload("changed boxes", std::span<const ChangedBox>(moved.boxes));
        const Visibility seen = march(g, in);
        const Readback words = g.readback(seen.words), read = g.readback(motion(g, in, seen.words));
        rhi::must(runner_->execute(g));
        const auto visible = rhi::must(words.get_as<uint32_t>());
        const auto halves = rhi::must(read.get_as<uint16_t>());
        int ours = 0, theirs = 0, nowhere = 0;
        for (size_t i = 0; i < visible.size(); i += 4) {
            if (visible[i + 1] >> 28 == kSeenNothing) continue;
            const int x = int(i / 4) % kWidth, y = int(i / 4) / kWidth;
            const vec3 d = shade::camera_direction_at(p.camera, float(x) + 0.5f, float(y) + 0.5f);
            const vec3 to = d * (std::bit_cast<float>(visible[i]) * p.grid.voxel_size);
            const vec3 at = frame.camera.position + to;
            const double mx = double(float_from_half(halves[i])), my = double(float_from_half(halves[i + 1]));
            if (changed && at.x < -0.01f && at.y > 0.11f) {
                EXPECT_GT(std::fabs(mx), 1e4);
                ++nowhere;
                continue;
            }
            const float to_a = length(at - a) - 0.45f, to_b = length(at - now.position) - 0.4f;
            if (std::fabs(to_a - to_b) < 0.045f || (changed && at.x < 0.01f && at.y > 0.09f)) continue;
            if (to_a < to_b) {
                EXPECT_EQ(std::hypot(mx, my), 0) << "it stood still";
                ++theirs;
                continue;
            }
            ++ours;
            const vec3 local = rotate(conjugate(now.rotation), at - now.position);
            const vec3 was = before.position + rotate(before.rotation, local * 0.9f);
            const vec2 from = shade::camera_pixel(p.camera, was - frame.camera.position);
            const vec2 is = shade::camera_pixel(p.camera, to);
            EXPECT_NEAR(mx, double(from.x - is.x), 0.01 + std::fabs(mx) / 512) << x << ", " << y;
            EXPECT_NEAR(my, double(from.y - is.y), 0.01 + std::fabs(my) / 512) << x << ", " << y;
        }
        EXPECT_GT(ours, 200);
        EXPECT_GT(theirs, 100);
        EXPECT_EQ(nowhere > 50, changed);
    }
}

struct TaaGpu : PicturesOverTime {
    static double apart(const Picture& a, const Picture& b) { return image::flip(rgb(a), rgb(b)); }
    // How much nearer to the truth, dB.
    static double gain(const Picture& truth, const Picture& p, const Picture& plain) {
        return image::psnr(rgb(truth), rgb(p)) - image::psnr(rgb(truth), rgb(plain));
    }
};

TEST_F(TaaGpu, WithoutJitterAStillPictureIsWhatItWas) {
    const Frame frame = scene();
    const Picture plain = picture(frame, {});
    for (int i = 0; i < 4; ++i) {
        const Picture p = picture(frame, {.taa = true, .taa_jitter = false});
        EXPECT_EQ(p.rgba, plain.rgba) << i;
        EXPECT_EQ(p.srgb, plain.srgb) << i;
    }
}

TEST_F(TaaGpu, SixteenPicturesComeNearSixtyFourRays) {
    const Frame frame = unlit();
    const Picture truth = supersampled(frame);
    Picture p;
    for (int i = 0; i < 16; ++i) p = picture(frame, {.taa = true});
    const Picture plain = picture(frame, {});
    RecordProperty("flip", std::to_string(apart(truth, p)));
    RecordProperty("gain_db", std::to_string(gain(truth, p, plain)));
    EXPECT_LE(apart(truth, p), 0.02);
    EXPECT_GT(gain(truth, p, plain), 8);
    for (int i = 0; i < 36; ++i) p = picture(frame, {.taa = true});
    EXPECT_LE(apart(truth, p), 0.02);
    EXPECT_GT(gain(truth, p, plain), 8);
}

TEST_F(TaaGpu, AMovingCameraIsSmoothToo) {
    Frame frame = unlit();
    Picture p;
    const Camera last = frame.camera;
    for (int i = 15; i >= 0; --i) {
        frame.camera.position = last.position + vec3{0.013f, 0.004f, -0.011f} * float(i);
        p = picture(frame, {.taa = true});
    }
    const Picture truth = supersampled(frame);
    const Picture plain = picture(frame, {});
    RecordProperty("gain_db", std::to_string(gain(truth, p, plain)));
    EXPECT_GT(gain(truth, p, plain), 2);
}

// Gate: gone within three pictures, wherever it was.
TEST_F(TaaGpu, NothingOfWhatWentAwayStays) {
    // A ball before a wall of edits, elsewhere in the next picture; and another view of the first.
    const auto ball_at = [&](vec3 at) {
        Frame out = scene();
        field::worlds::World world = on_ground();
        Edit ball = field::worlds::edit(Sphere{.radius = 0.25f}, at);
        ball.node.material = MaterialId{1, 0};
        world.edits.push_back(ball);
        world.options.bounds = {{-1.5f, -1, -1.5f}, {1.5f, 1.5f, 1.5f}};
        out.field = world.field();
        return out;
    };
    const Frame frame = ball_at({0.7f, 0.4f, 0.8f});
    const Frame moved = ball_at({-0.1f, 0.5f, 1.0f});
    Frame cut = frame;
    cut.camera.position = {-1.5f, 1.1f, 2.2f};
    const RenderSettings still{.taa = true, .taa_jitter = false};
    const auto settle = [&] {
        for (int i = 0; i < 16; ++i) (void)picture(frame, still);
    };
    const Picture first = picture(frame, {});
    // Pixels off by more than a twentieth: of those whose surface is another than before, as their neighbours' are; of all.
    const auto other_surface = [&](const Picture& truth, int x, int y) {
        for (int k = 0; k < 9; ++k) {
            const size_t i =
                size_t(std::clamp(y + k / 3 - 1, 0, kHeight - 1) * kWidth + std::clamp(x + k % 3 - 1, 0, kWidth - 1));
            if (!(std::fabs(first.depth[i] - truth.depth[i]) > 0.02f * truth.depth[i])) return false;
        }
        return true;
    };
    const auto ghost = [&](const Picture& p, const Picture& truth) {
        int other = 0, all = 0;
        for (size_t i = 0; i < truth.depth.size(); ++i) {
            float most = 0;
            for (size_t k = 4 * i; k < 4 * i + 3; ++k)
                most = std::max(most, std::fabs(p.rgba[k] - truth.rgba[k]) / std::max(truth.rgba[k], 0.05f));
            const bool there = other_surface(truth, int(i) % kWidth, int(i) / kWidth);
            other += there && most > 0.05f;
            all += most > 0.05f;
        }
        return std::pair{other, all};
    };
    for (const Frame* next : {&moved, static_cast<const Frame*>(&cut)}) {
        settle();
        Picture p;
        for (int i = 0; i < 3; ++i) p = picture(*next, still);
        const Picture truth = picture(*next, {});
        EXPECT_GT(ghost(first, truth).first, 200) << "the two must differ";
        EXPECT_EQ(ghost(p, truth).first, 0);
        EXPECT_LE(ghost(p, truth).second, kWidth * kHeight / 50);  // edges of shadows that have gone fade slower
    }
    // Told of the cut, at once.
    settle();
    RenderSettings told = still;
    told.cut = true;
    EXPECT_EQ(picture(moved, told).rgba, picture(moved, {}).rgba);
}

TEST_F(TaaGpu, APictureOfSeveralTilesIsRefused) {
    const auto p = renderer->render(scene(), {.width = 16384, .height = 1024, .taa = true});
    ASSERT_FALSE(p);
    EXPECT_EQ(p.error().kind, ErrorKind::Usage);
}

}  // namespace
}  // namespace kiln::render
