// SPDX-License-Identifier: MIT
// Gate G16: many lights by the lists of their tiles against every light at every pixel, bit for bit.
#include "gpu_worlds.h"
#include "render/lib/pack.h"
#include "render/light_rects.h"
#include "render/passes/cluster.gpu.h"

#include <bit>
#include <cmath>
#include <random>

namespace kiln::render {
namespace {

// Lamps and spots of all sizes round the origin, a few without a range among them; many too small to reach anything.
std::vector<Light> many_lights(int count, uint32_t seed) {
    std::mt19937 random(seed);
    const auto in = [&](float low, float high) { return low + (high - low) * float(random() >> 8) / float(1 << 24); };
    std::vector<Light> out;
    for (int i = 0; i < count; ++i) {
        Light light{.kind = i % 3 == 0 ? Light::Kind::Spot : Light::Kind::Point,
                    .color = {in(0.2f, 1), in(0.2f, 1), in(0.2f, 1)},
                    .direction = {in(-1, 1), in(-1, 1), in(-1, 1)},
                    .position = {in(-2, 2), in(-0.6f, 1.5f), in(-2, 2)},
                    .intensity = in(0.05f, 0.5f),
                    .range = in(0.05f, 0.9f),
                    .radius = i % 2 == 0 ? 0.0f : in(0, 0.05f),
                    .inner_deg = 10,
                    .outer_deg = in(11, 89)};
        if (i % 97 == 5) light.range = 0;
        if (i % 131 == 7) light = Light{.illuminance = 0.2f};
        out.push_back(light);
    }
    return out;
}

struct ClusterGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    void compare(const Frame& frame, int width, int height) {
        const Picture lists = rhi::must(renderer->render(frame, {.width = width, .height = height}));
        const Picture all =
            rhi::must(renderer->render(frame, {.width = width, .height = height, .cull_lights = false}));
        EXPECT_EQ(lists.rgba, all.rgba);
        EXPECT_EQ(lists.srgb, all.srgb);
    }
    std::unique_ptr<Renderer> renderer;
};

TEST_F(ClusterGpu, ListsGiveTheSumsOfAllLights) {
    Frame frame = frame_of(on_ground());
    for (const int count : {0, 1, 16, 17, 33, 300}) {
        frame.lights = many_lights(count, uint32_t(count));
        SCOPED_TRACE(count);
        compare(frame, 72, 56);
    }
    // Without lights that reach everything, some tiles are out of reach of all; the camera is among them.
    frame.lights = many_lights(60, 9);
    std::erase_if(frame.lights, [](const Light& l) { return l.range == 0; });
    frame.camera.position = {0.4f, 0.6f, 0.5f};
    compare(frame, 72, 56);
}

// Lamps whose reach ends on borders of tiles, or whose middle is on one, and depths where a tile's nearest and farthest end.
TEST_F(ClusterGpu, LightsOnBordersOfTilesAreInBoth) {
    Frame frame = frame_of(on_ground());
    const shade::CameraParams eye = shade::camera_params(frame.camera, 64, 48);
    frame.lights.clear();
    for (int y = 0; y <= 48; y += kClusterSide) {
        for (int x = 0; x <= 64; x += kClusterSide) {
            const vec3 d = shade::camera_direction_at(eye, float(x), float(y));
            for (const float far : {1.0f, 2.5f, 3.5f}) {
                const float pixel = far * length(vec3{eye.up.x, eye.up.y, eye.up.z}) / 24;
                for (const float reach : {0.5f * pixel, float(kClusterSide) * pixel})
                    frame.lights.push_back({.kind = Light::Kind::Point,
                                            .position = frame.camera.position + d * far,
                                            .intensity = 0.05f,
                                            .range = reach});
            }
        }
    }
    compare(frame, 64, 48);
}

TEST_F(ClusterGpu, FourThousandLightsLoseNone) {
    Frame frame = frame_of(on_ground());
    frame.lights = many_lights(4096, 4096);
    compare(frame, 40, 24);
}

// What a light adds is there, whichever of the batches of its tile it is in.
TEST_F(ClusterGpu, TheLastOfManyLightsStillShines) {
    Frame frame = frame_of(on_ground());
    frame.lights.assign(40, Light{.kind = Light::Kind::Point, .position = {0, 3, 0}, .intensity = 0, .range = 20});
    const Picture dark = rhi::must(renderer->render(frame, {.width = 24, .height = 16}));
    frame.lights.back().intensity = 20;
    const Picture lit = rhi::must(renderer->render(frame, {.width = 24, .height = 16}));
    frame.lights = {frame.lights.back()};
    const Picture alone = rhi::must(renderer->render(frame, {.width = 24, .height = 16}));
    EXPECT_NE(lit.rgba, dark.rgba);
    EXPECT_EQ(lit.rgba, alone.rgba);
}

struct MasksGpu : GpuTest {
    // Words of the tiles of a wall at z = 0 that fills a picture of 64 x 32 pixels, a voxel each, seen straight on.
    std::vector<uint32_t> of(const std::vector<Light>& lights) {
        FrameParams p{};
        p.grid.voxel_size = 1.0f / 16;
        p.width = p.tile_width = 64;
        p.height = p.tile_height = 32;
        p.flags = kFrameRays;
        p.light_count = uint32_t(lights.size());
        std::vector<FrameRay> rays;
        std::vector<uint32_t> seen;
        for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 64; ++x) {
                FrameRay ray{};
                ray.whole_x = x, ray.whole_y = y, ray.whole_z = 10;
                ray.direction_z = -1;
                rays.push_back(ray);
                const bool sky = x >= 48;  // the last column of tiles sees nothing
                seen.insert(seen.end(), {std::bit_cast<uint32_t>(10.0f), sky ? 0u : kSeenBrick << 28u, 0u, 0u});
            }
        }
        std::vector<shade::LightRecord> records;
        for (const Light& light : lights) records.push_back(shade::light_record(light));
        const LightRects rects = all_light_rects(lights.size(), 64, 32);
        Graph g(*runner_);
        TileInputs in;
        in.frame = g.block(p);
        in.rays = g.upload("rays", std::span<const FrameRay>(rays));
        in.lights = g.upload("lights", std::span<const shade::LightRecord>(records));
        in.light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects));
        in.light_count = uint32_t(lights.size());
        in.local_lights = true;
        in.size = {64, 32};
        Image words = g.create("seen", {.size = in.size, .format = rhi::Format::Rgba32Uint});
        const CopyRegion all{.bytes_per_row = 64 * 16, .rows_per_layer = 32, .size = in.size};
        g.copy(g.upload("seen", std::span<const uint32_t>(seen)), words, std::span(&all, 1));
        const Readback masks = g.readback(cluster(g, in, words));
        rhi::must(runner_->execute(g));
        return rhi::must(masks.get_as<uint32_t>());
    }
};

TEST_F(MasksGpu, ALightIsInTheTilesThatItReachesAndNoOthers) {
    // Tiles are a metre wide; the points of tile (i, j) are from (i, j) to (i + 15/16, j + 15/16).
    const auto lamp = [](vec3 at, float range) {
        return Light{.kind = Light::Kind::Point, .position = at, .range = range};
    };
    // 4 x 2 tiles: bits of the first row, of the second.
    const std::pair<Light, std::array<int, 8>> cases[] = {
        {lamp({0.5f, 0.5f, 0.2f}, 0.3f), {1, 0, 0, 0, 0, 0, 0, 0}},
        {lamp({0.5f, 0.5f, 0.4f}, 0.3f), {0, 0, 0, 0, 0, 0, 0, 0}},  // its ball ends before the wall
        {lamp({1, 0.5f, 0}, 0.05f), {0, 1, 0, 0, 0, 0, 0, 0}},       // on a border: points there are the right tile's
        {lamp({1, 0.5f, 0}, 0.07f), {1, 1, 0, 0, 0, 0, 0, 0}},
        {lamp({1, 1, 0}, 0.2f), {1, 1, 0, 0, 1, 1, 0, 0}},
        {lamp({3, 1, 0}, 0), {1, 1, 1, 0, 1, 1, 1, 0}},  // no range: wherever there is a surface
        {Light{}, {1, 1, 1, 0, 1, 1, 1, 0}},
        // A cone of 30 degrees from two metres off reaches 1.16 m to each side.
        {{.kind = Light::Kind::Spot, .direction = {0, 0, -1}, .position = {0, 0.5f, 2}, .outer_deg = 30},
         {1, 1, 0, 0, 1, 1, 0, 0}},
        {{.kind = Light::Kind::Spot, .direction = {0, 0, 1}, .position = {0, 0.5f, 2}, .outer_deg = 30},
         {0, 0, 0, 0, 0, 0, 0, 0}},
    };
    std::vector<Light> lights;
    for (const auto& [light, tiles] : cases) lights.push_back(light);
    lights.resize(300, lamp({0, 0, 9}, 1));  // out of reach, so that a bit beyond 256 is the only one of its word
    lights.push_back(lamp({2.5f, 1.5f, 0}, 0.1f));
    const std::vector<uint32_t> words = of(lights);
    const size_t count = (lights.size() + 31) / 32;
    ASSERT_EQ(words.size(), 8 * count);
    for (size_t i = 0; i < lights.size(); ++i) {
        for (size_t tile = 0; tile < 8; ++tile) {
            const int expected = i < std::size(cases) ? cases[i].second[tile] : i == 300 && tile == 6 ? 1 : 0;
            // A ball round a tile's box is wider than the box: cones may be in a tile too many, never in one too few.
            const int bit = int(words[tile * count + i / 32] >> (i % 32) & 1);
            if (i == 7)
                EXPECT_GE(bit, expected) << tile;
            else
                EXPECT_EQ(bit, expected) << "light " << i << " in tile " << tile;
        }
    }
}

// The device's lists are cut to these rectangles, and batches are counted by them.
TEST(LightRects, HoldEveryPixelThatTheRangeReaches) {
    std::mt19937 random(3);
    const auto in = [&](double low, double high) {
        return float(low + (high - low) * double(random() >> 8) / double(1 << 24));
    };
    const int width = 203, height = 117, left = 48, top = 16, part_width = 101, part_height = 77;
    for (int turn = 0; turn < 60; ++turn) {
        Camera camera{.position = {in(-3, 3), in(-3, 3), in(-3, 3)},
                      .target = {in(-3, 3), in(-3, 3), in(-3, 3)},
                      .fov_y_deg = in(10, 160)};
        const shade::CameraParams eye = shade::camera_params(camera, width, height);
        std::vector<Light> lights(40, Light{.kind = Light::Kind::Point});
        for (Light& light : lights) {
            light.position = {in(-4, 4), in(-4, 4), in(-4, 4)};
            light.range = in(0.01, turn % 2 == 0 ? 0.6 : 4);
        }
        const LightRects rects = light_rects(lights, eye, left, top, part_width, part_height);
        const int across = (part_width + kClusterSide - 1) / kClusterSide;
        std::vector<uint32_t> of_tile(size_t(across * ((part_height + kClusterSide - 1) / kClusterSide)));
        for (const LightRect& r : rects.rects)
            for (uint32_t y = r.y & 0xffffu; y < r.y >> 16; ++y)
                for (uint32_t x = r.x & 0xffffu; x < r.x >> 16; ++x) ++of_tile[y * size_t(across) + x];
        EXPECT_EQ(rects.most, *std::max_element(of_tile.begin(), of_tile.end()));
        int reached = 0;
        for (int ray = 0; ray < 400; ++ray) {
            const int x = int(random() % part_width), y = int(random() % part_height);
            const vec3 direction = shade::camera_direction_at(eye, float(left + x) + 0.5f, float(top + y) + 0.5f);
            for (size_t i = 0; i < lights.size(); ++i) {
                const vec3 to = lights[i].position - camera.position;
                const float along = std::max(dot(to, direction), 0.0f);
                if (length(to - direction * along) > lights[i].range) continue;
                ++reached;
                const LightRect& r = rects.rects[i];
                const uint32_t tx = uint32_t(x / kClusterSide), ty = uint32_t(y / kClusterSide);
                EXPECT_TRUE(tx >= (r.x & 0xffffu) && tx < r.x >> 16 && ty >= (r.y & 0xffffu) && ty < r.y >> 16)
                    << "turn " << turn << " light " << i << " pixel " << x << ", " << y;
            }
        }
        if (turn % 2 == 1) {
            EXPECT_GT(reached, 50);
        }
    }
}

// Small lights leave most of a picture alone.
TEST(LightRects, AreNarrow) {
    const shade::CameraParams eye = shade::camera_params({.position = {0, 0, 10}, .target = {0, 0, 0}}, 640, 480);
    const Light lamp{.kind = Light::Kind::Point, .position = {0, 0, 0}, .range = 0.1f};
    const LightRects one = light_rects(std::span(&lamp, 1), eye, 0, 0, 640, 480);
    // Its disc is 11.6 pixels wide, round the middle of the picture: a border of tiles.
    EXPECT_EQ(one.rects[0], (LightRect{19u | 21u << 16, 14u | 16u << 16}));
    Light behind = lamp;
    behind.position = {0, 0, 11};
    EXPECT_EQ(light_rects(std::span(&behind, 1), eye, 0, 0, 640, 480).most, 0u);
}

}  // namespace
}  // namespace kiln::render
