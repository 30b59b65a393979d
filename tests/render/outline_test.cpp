// SPDX-License-Identifier: MIT
// Outlines: lines of constant width against the exact distance to what they surround, and whose a point is against both operands.
#include "drawables.h"
#include "gpu_worlds.h"
#include "field/brick_set.h"
#include "render/lib/color.gpu.h"
#include "render/lib/pack.h"
#include "render/passes/outline.gpu.h"

#include <cmath>
#include <numbers>

namespace kiln::render {
namespace {

constexpr int kOutlineWidth = 96, kOutlineHeight = 80;

struct OutlineGpu : GpuTest {
    int width_ = kOutlineWidth, height_ = kOutlineHeight;  // of masks
    // Lines round `owner` (number + 1 of a record, 0 outside) as shares of pixels, drawn in red on black.
    std::vector<uint32_t> flooded_seeds;
    std::vector<float> covered(const std::vector<uint32_t>& owner, const std::vector<float>& widths) {
        std::vector<OutlineRecord> records;
        for (const float w : widths) {
            OutlineRecord& r = records.emplace_back();
            r.red = 1;
            r.width_px = w;
        }
        std::vector<uint32_t> seeds(owner.size());
        for (uint32_t i = 0; i < owner.size(); ++i)
            seeds[i] = owner[i] == 0 ? kNoSeed : i % uint32_t(width_) | i / uint32_t(width_) << 16;
        const rhi::Extent size{uint32_t(width_), uint32_t(height_)};
        Graph g(*runner_);
        const auto image_of = [&](std::string_view name, const std::vector<uint32_t>& words) {
            const size_t across = size_t(width_), row = (across + 63) / 64 * 64;  // rows of whole 256 bytes
            std::vector<uint32_t> rows(row * size_t(height_));
            for (size_t i = 0; i < words.size(); ++i) rows[i / across * row + i % across] = words[i];
            Image out = g.create(name, {.size = size, .format = rhi::Format::R32Uint});
            const CopyRegion all{.bytes_per_row = uint32_t(4 * row), .rows_per_layer = uint32_t(height_), .size = size};
            g.copy(g.upload(name, std::span<const uint32_t>(rows)), out, std::span(&all, 1));
            return out;
        };
        OutlineMask mask;
        mask.owners = image_of("owners", owner);
        mask.seeds = image_of("seeds", seeds);
        Buffer buffer = g.upload("outlines", std::span<const OutlineRecord>(records));
        const Image flooded = outline_flood(g, buffer, mask, *std::max_element(widths.begin(), widths.end()));
        Image shown = g.create("shown", {.size = size, .format = rhi::Format::Rgba8Unorm});
        g.clear(shown);
        Image drawn = g.create("drawn", {.size = size, .format = rhi::Format::Rgba8Unorm});
        g.dispatch(kOutlineDraw, shown.size,
                   {g.read(buffer), g.read(mask.owners), g.read(flooded), g.read(shown), g.write(drawn)},
                   OutlinePush{width_, height_, 0, 0});
        const Readback bytes = g.readback(drawn), ends = g.readback(flooded);
        rhi::must(runner_->execute(g));
        flooded_seeds = rhi::must(ends.get_as<uint32_t>());
        std::vector<float> out;
        for (const uint32_t pixel : rhi::must(bytes.get_as<uint32_t>()))
            out.push_back(shade::linear_from_srgb(float(pixel & 255u) / 255));
        return out;
    }
    template <typename Inside>
    std::vector<uint32_t> mask_of(Inside&& inside) const {
        std::vector<uint32_t> out;
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) out.push_back(uint32_t(inside(double(x) + 0.5, double(y) + 0.5)));
        return out;
    }
    // Every pixel's line and seed against the exact distance: to all pixels of the rims, of which the nearest pixel is one.
    void expect_exact(const std::vector<uint32_t>& owner, const std::vector<float>& widths) {
        const std::vector<float> seen = covered(owner, widths);
        std::vector<int> rim;
        for (int i = 0; i < width_ * height_; ++i) {
            const auto other = [&](int dx, int dy) {
                const int x = i % width_ + dx, y = i / width_ + dy;
                return x >= 0 && y >= 0 && x < width_ && y < height_ &&
                       owner[size_t(y * width_ + x)] != owner[size_t(i)];
            };
            if (owner[size_t(i)] != 0 && (other(-1, 0) || other(1, 0) || other(0, -1) || other(0, 1))) rim.push_back(i);
        }
        int off = 0, line = 0;
        for (int i = 0; i < width_ * height_; ++i) {
            const auto past = [&](int j) {
                return std::hypot(i % width_ - j % width_, i / width_ - j / width_) -
                       double(widths[owner[size_t(j)] - 1]);
            };
            const bool outside = owner[size_t(i)] == 0;
            double least = outside ? 1e9 : past(i);
            for (const int j : rim) least = std::min(least, past(j));
            // Nothing farther off is drawn, and what is drawn there may be half a pixel off where the mask has steps.
            if (least > 1) {
                EXPECT_EQ(seen[size_t(i)], 0) << i % width_ << ", " << i / width_;
                continue;
            }
            if (outside && least < -1) {
                EXPECT_EQ(seen[size_t(i)], 1) << i % width_ << ", " << i / width_;
            }
            ++line;
            const uint32_t seed = flooded_seeds[size_t(i)];
            ASSERT_NE(seed, kNoSeed) << i % width_ << ", " << i / width_;
            const double found = past(int(seed >> 16) * width_ + int(seed & 0xffffu));
            EXPECT_LE(found, least + 0.5) << i % width_ << ", " << i / width_;
            off += found > least + 1e-4;
        }
        EXPECT_GT(line, 200);
        EXPECT_LE(off, line / 500) << "of " << line;
    }
};

TEST_F(OutlineGpu, LinesEndWhereTheExactDistanceSays) {
    const auto star = [](double x, double y) {
        const double dx = x - 44, dy = y - 38;
        return std::hypot(dx, dy) < 14 + 8 * std::cos(5 * std::atan2(dy, dx)) ? 1 : 0;
    };
    const auto two = [&](double x, double y) {
        // A corner, a single pixel and a star, of two widths.
        if (std::fabs(x - 80) < 6 && std::fabs(y - 66) < 5) return 2;
        if (std::fabs(x - 10.5) < 0.5 && std::fabs(y - 70.5) < 0.5) return 2;
        return star(x, y);
    };
    for (const std::vector<float>& widths : {std::vector<float>{3, 5}, {1, 12}, {24, 2.5f}})
        expect_exact(mask_of(two), widths);
}

// Up to the widest that are asked for, round what is square, round, hollow and sharp.
TEST_F(OutlineGpu, LinesOfSixtyFourPixelsEndThereToo) {
    width_ = 200, height_ = 180;
    const auto shapes = [](double x, double y) {
        const double dx = x - 66, dy = y - 88;
        if (std::hypot(dx, dy) < 13 + 8 * std::cos(5 * std::atan2(dy, dx))) return 1;
        if (std::fabs(x - 190) < 4 && std::fabs(y - 6) < 5) return 2;
        if (std::fabs(std::hypot(x - 188, y - 170) - 6) < 1.5) return 2;
        return 0;
    };
    for (const std::vector<float>& widths : {std::vector<float>{64, 64}, {64, 40}, {33, 64}})
        expect_exact(mask_of(shapes), widths);
}

TEST_F(OutlineGpu, AnEdgeAndADiscHaveLinesOfTheirWidth) {
    for (const float width : {1.0f, 2.5f, 7.0f}) {
        const std::vector<float> edge = covered(mask_of([](double x, double) { return x < 40 ? 1 : 0; }), {width});
        double row = 0;
        for (int x = 0; x < kOutlineWidth; ++x) row += double(edge[size_t(20 * kOutlineWidth + x)]);
        EXPECT_NEAR(row, width, 0.02);
        // Straight edges of other slopes, measured along them.
        for (const double degrees : {10.0, 26.0, 45.0, 61.0}) {
            const double nx = std::cos(degrees * std::numbers::pi / 180),
                         ny = std::sin(degrees * std::numbers::pi / 180);
            double sum = 0;
            const std::vector<float> slope = covered(
                mask_of([&](double x, double y) { return nx * (x - 48) + ny * (y - 40) < 0.1 ? 1 : 0; }), {width});
            for (int y = 0; y < kOutlineHeight; ++y) {
                for (int x = 0; x < kOutlineWidth; ++x) {
                    const double along = -ny * (x + 0.5 - 48) + nx * (y + 0.5 - 40);
                    if (std::fabs(along) < 22) sum += double(slope[size_t(y * kOutlineWidth + x)]);
                }
            }
            EXPECT_NEAR(sum / 44, width, 0.2) << degrees << " degrees";
        }
        const std::vector<uint32_t> disc =
            mask_of([](double x, double y) { return std::hypot(x - 48, y - 40) < 25 ? 1 : 0; });
        double area = 0, ring = 0;
        for (const uint32_t o : disc) area += o;
        for (const float c : covered(disc, {width})) ring += double(c);
        const double radius = std::sqrt(area / std::numbers::pi);
        EXPECT_NEAR(std::sqrt((area + ring) / std::numbers::pi) - radius, width, 0.15);
    }
}

// Two balls: one outlined. Its points are those where its own distance is the lesser, through a blend too.
TEST_F(OutlineGpu, ABlendIsCutWhereBothAreEquallyNear) {
    for (const float blend : {0.0f, 0.3f}) {
        const vec3 a{-0.25f, 0, 0}, b{0.3f, 0.1f, 0.1f};
        const float ra = 0.45f, rb = 0.4f;
        field::worlds::World world{
            "two balls",
            {field::worlds::edit(Sphere{.radius = ra}, a), field::worlds::edit(Sphere{.radius = rb}, b)},
            {.voxel_size = 0.03f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
        world.edits[1].blend_radius = blend;
        Frame frame = frame_of(world, {0.3f, 0.8f, 2.5f});
        const sdf::Program& program = frame.field->program();
        const std::vector<EditOutline> outlined{{program.rows()[1], Outline{}}};
        const OutlineCode code = outline_code(outlined, program, {});
        ASSERT_EQ(code.records.size(), 1u);
        GpuField gpu(*runner_);
        rhi::must(gpu.update(frame.field, Baker::Host));
        const FrameParams p =
            rhi::must(frame_params(frame, {.width = kOutlineWidth, .height = kOutlineHeight, .refine = false}, gpu));
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu.import(g);
        in.frame = g.block(p);
        const FrameRay no_ray{};
        in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
        in.size = {kOutlineWidth, kOutlineHeight};
        in.outlines = g.upload("outlines", std::span<const OutlineRecord>(code.records));
        in.outline_code = g.upload("outline code", std::span<const sdf::Instruction>(code.code));
        in.outline_count = 1;
        in.use_of_outlines = tape_use(code.code);
        const Visibility seen = march(g, in);
        const OutlineMask mask = outline_mask(g, in, seen.words);
        const Readback owners = g.readback(mask.owners), words = g.readback(seen.words);
        rhi::must(runner_->execute(g));
        const std::vector<uint32_t> owner = rhi::must(owners.get_as<uint32_t>()),
                                    visibility = rhi::must(words.get_as<uint32_t>());
        int ours = 0, theirs = 0, close = 0;
        for (int i = 0; i < kOutlineWidth * kOutlineHeight; ++i) {
            const uint32_t* const w = visibility.data() + 4 * size_t(i);
            if (w[1] >> 28 == kSeenNothing) {
                EXPECT_EQ(owner[size_t(i)], 0u);
                continue;
            }
            float t = 0;
            std::memcpy(&t, w, 4);
            const vec3 d =
                shade::camera_direction_at(p.camera, float(i % kOutlineWidth) + 0.5f, float(i / kOutlineWidth) + 0.5f);
            const vec3 at = frame.camera.position + d * (t * p.grid.voxel_size);
            const float to_a = length(at - a) - ra, to_b = length(at - b) - rb;
            // Within a voxel of the border either answer will do.
            if (std::fabs(to_a - to_b) < 0.045f) {
                ++close;
                continue;
            }
            EXPECT_EQ(owner[size_t(i)], to_b < to_a ? 1u : 0u) << i % kOutlineWidth << ", " << i / kOutlineWidth;
            (to_b < to_a ? ours : theirs) += 1;
        }
        EXPECT_GT(ours, 200);
        EXPECT_GT(theirs, 200);
        EXPECT_LT(close, ours);
    }
}

// As users have it: the line is as wide near by as far off, and what is behind something has none there.
TEST_F(OutlineGpu, AreTheSameFromEveryDistance) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP() << "no Vulkan device";
    for (const float far : {1.0f, 2.0f, 6.0f, 10.0f, 50.0f}) {
        Frame frame = frame_of(field::worlds::sphere_of(10), {0, 0, far});
        frame.camera.target = {0, 0, 0};
        // So that it is seen at all from so far, and not larger than the picture from so near.
        frame.camera.fov_y_deg = std::clamp(170 / far, 4.5f, 85.0f);
        const Picture plain = rhi::must(renderer->render(frame, {.width = kOutlineWidth, .height = kOutlineHeight}));
        frame.outlines = {{frame.field->program().rows()[0], Outline{.color = {1, 0, 0}, .width_px = 4}}};
        const Picture lined = rhi::must(renderer->render(frame, {.width = kOutlineWidth, .height = kOutlineHeight}));
        EXPECT_EQ(lined.rgba, plain.rgba);
        double area = 0, changed = 0;
        for (size_t i = 0; i < plain.depth.size(); ++i) {
            const bool inside = std::isfinite(plain.depth[i]);
            area += inside;
            const bool same =
                std::equal(lined.srgb.begin() + ptrdiff_t(4 * i), lined.srgb.begin() + ptrdiff_t(4 * i + 4),
                           plain.srgb.begin() + ptrdiff_t(4 * i));
            if (inside) {
                EXPECT_TRUE(same) << i;
            }
            if (inside || same) continue;
            changed += lined.srgb[4 * i] == 255 && lined.srgb[4 * i + 1] == 0 ? 1.0 : 0.5;
        }
        const double radius = std::sqrt(area / std::numbers::pi);
        EXPECT_GT(radius, 3);
        EXPECT_NEAR(std::sqrt((area + changed) / std::numbers::pi) - radius, 4, 0.25) << far;
    }
}

// A ball behind a wall, as an edit, an instance and a mesh: no line, unless it is asked for; then as wide as that of a ball that is seen, round
// all of it.
TEST_F(OutlineGpu, WhatIsHiddenHasALineWhereItIsAskedFor) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP() << "no Vulkan device";
    const vec3 at{0.2f, 0.1f, -1};
    const float radius = 0.5f;
    const Outline line{.color = {1, 0, 0}, .width_px = 4};
    field::worlds::World wall{"wall",
                              {field::worlds::edit(Box{.half_extents = {1.5f, 1.5f, 0.1f}}, {0, 0, 0.4f})},
                              {.voxel_size = 0.05f, .bounds = {{-1.6f, -1.6f, -1.6f}, {1.6f, 1.6f, 0.6f}}}};
    field::worlds::World both = wall;
    both.edits.push_back(field::worlds::edit(Sphere{.radius = radius}, at));
    for (const int kind : {0, 1, 2}) {
        Frame frame = frame_of(kind == 0 ? both : wall, {0, 0, 3});
        frame.camera.target = {0, 0, 0};
        if (kind == 0) frame.outlines = {{frame.field->program().rows()[1], line}};
        if (kind == 1) {
            const Pose pose{at, axis_angle({0, 1, 0}, 0.7f)};
            frame.instances = {{.bricks = rhi::must(field::BrickSet::make(
                                    field::worlds::compiled({field::worlds::edit(Sphere{.radius = radius})}), 0.05f)),
                                .pose = pose,
                                .before = pose}};
            frame.outlines = {{frame.instances[0].bricks->program().rows()[0], line, 0}};
        }
        if (kind == 2) {
            frame.meshes = {meshes::at(meshes::sphere(radius, 64, meshes::matte({0.5f, 0.5f, 0.5f})), at)};
            frame.meshes[0].outline = line;
        }
        const auto drawn = [&](bool hidden) {
            return rhi::must(
                renderer->render(frame, {.width = kOutlineWidth, .height = kOutlineHeight, .outline_hidden = hidden}));
        };
        const Picture asked = drawn(true);
        EXPECT_EQ(asked.rgba, drawn(false).rgba) << kind;
        const auto red = [](const Picture& p) {
            double sum = 0;
            for (size_t i = 0; i < p.depth.size(); ++i) {
                const bool full = p.srgb[4 * i] == 255 && p.srgb[4 * i + 1] == 0 && p.srgb[4 * i + 2] == 0;
                const bool part = p.srgb[4 * i] > p.srgb[4 * i + 1] + 60;
                sum += full ? 1.0 : part ? 0.5 : 0.0;
            }
            return sum;
        };
        EXPECT_EQ(red(drawn(false)), 0) << kind;
        // The ring round its disc on the screen.
        const shade::CameraParams eye = shade::camera_params(frame.camera, kOutlineWidth, kOutlineHeight);
        const double far = std::sqrt(double(dot(at - frame.camera.position, at - frame.camera.position)));
        const double pixels =
            0.5 * kOutlineHeight / std::sqrt(double(eye.up.x * eye.up.x + eye.up.y * eye.up.y + eye.up.z * eye.up.z));
        const double disc = pixels * double(radius) / std::sqrt(far * far - double(radius * radius));
        const double ring = std::numbers::pi * ((disc + 4) * (disc + 4) - disc * disc);
        EXPECT_NEAR(red(asked), ring, 0.1 * ring) << kind << ", 0.4 pixels of its width";
    }
}

// One outlined box among others, as an edit of the field and as part of an instance that was moved there.
TEST_F(OutlineGpu, FollowWhatIsDrawnAsAnInstance) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP() << "no Vulkan device";
    const Pose pose{{0.4f, 0.1f, 0.3f}, axis_angle(normalize(vec3{1, 2, 0.5f}), 0.8f)};
    const auto at = [](Edit e, const Pose& to) {
        const vec3 p = e.node.transform.position;
        e.node.transform.position = to * p;
        e.node.transform.rotation = to.rotation;
        return e;
    };
    const Edit ball = field::worlds::edit(Sphere{.radius = 0.3f});
    const Edit box = field::worlds::edit(Box{.half_extents = {0.3f, 0.12f, 0.15f}}, {0.35f, 0, 0});
    field::worlds::World ground{"ground",
                                {field::worlds::edit(Box{.half_extents = {1, 0.1f, 1}}, {0, -0.6f, 0})},
                                {.voxel_size = 0.02f, .bounds = {{-1.2f, -1, -1.2f}, {1.2f, 1, 1.2f}}}};
    field::worlds::World all = ground;
    all.edits.push_back(at(ball, pose));
    all.edits.push_back(at(box, pose));
    const vec3 eye{0.6f, 1.2f, 2.6f};
    Frame of_edits = frame_of(all, eye), of_instances = frame_of(ground, eye);
    auto other = field::BrickSet::make(field::worlds::compiled({ball}), 0.02f);
    auto both = field::BrickSet::make(field::worlds::compiled({ball, box}), 0.02f);
    ASSERT_TRUE(other && both);
    const Pose aside{{-0.6f, -0.1f, 0}, {}};
    of_instances.instances = {{.bricks = *other, .pose = aside, .before = aside},
                              {.bricks = *both, .pose = pose, .before = aside}};
    all.edits.push_back(at(ball, aside));
    of_edits.field = all.field();
    const Outline line{.color = {1, 0, 0}, .width_px = 4};
    of_edits.outlines = {{of_edits.field->program().rows()[2], line}};
    of_instances.outlines = {{1, line, 1}};
    const auto lined = [&](const Frame& frame) {
        const Picture p = rhi::must(renderer->render(frame, {.width = kOutlineWidth, .height = kOutlineHeight}));
        std::vector<bool> red;
        for (size_t i = 0; i < p.depth.size(); ++i)
            red.push_back(p.srgb[4 * i] > 200 && p.srgb[4 * i + 1] < 60 && p.srgb[4 * i + 2] < 60);
        return red;
    };
    const std::vector<bool> a = lined(of_edits), b = lined(of_instances);
    const auto count = std::count(a.begin(), a.end(), true);
    int apart = 0;
    for (size_t i = 0; i < a.size(); ++i) apart += a[i] != b[i];
    EXPECT_GT(count, 150);
    EXPECT_LE(apart, count / 8) << "of " << count;
}

}  // namespace
}  // namespace kiln::render
