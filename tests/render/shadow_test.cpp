// SPDX-License-Identifier: MIT
// Gate G14 through bricks: the shadow buffer against closed forms, also where the light's cone is far wider than the band of
// distances that bricks store.
#include "gpu_worlds.h"
#include "render/lib/pack.h"
#include "render/light_rects.h"
#include "render/passes/materials.gpu.h"

#include <cmath>
#include <numbers>

namespace kiln::render {
namespace {

constexpr float kVoxel = 0.02f;
constexpr float kLightHeight = 5, kLightRadius = 0.5f;

struct ShadowGpu : GpuTest {
    // Visible fractions of the lamp above the origin from points (x, 0, 0) of a slab that ends at y = 0.
    std::vector<float> fractions(const field::worlds::World& world, const std::vector<float>& places) {
        const auto f = world.field();
        GpuField gpu(*runner_);
        rhi::must(gpu.update(f, Baker::Host));
        FrameParams p{};
        p.grid = gpu.grid();
        p.distance_scale = gpu.distance_scale();
        p.width = p.tile_width = int(places.size());
        p.height = p.tile_height = 1;
        p.flags = kFrameRays | kFrameAccelerate;
        p.light_count = 1;
        p.material_count = 1;
        std::vector<FrameRay> rays;
        for (const float x : places) {
            // Down from a few voxels above the slab.
            const float at = x / kVoxel;
            FrameRay ray{};
            ray.whole_x = int(std::floor(at)), ray.part_x = at - std::floor(at);
            ray.whole_y = 6;
            ray.direction_y = -1;
            rays.push_back(ray);
        }
        const shade::LightRecord lamp = shade::light_record(
            {.kind = Light::Kind::Point, .position = {0, kLightHeight, 0}, .intensity = 1, .radius = kLightRadius});
        const MaterialEntry material{};
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu.import(g);
        in.frame = g.block(p);
        in.rays = g.upload("rays", std::span<const FrameRay>(rays));
        in.materials = g.upload("materials", std::span<const MaterialEntry>(&material, 1));
        in.lights = g.upload("lights", std::span<const shade::LightRecord>(&lamp, 1));
        in.light_count = in.lights_of_tile = 1;
        const LightRects rects = all_light_rects(1, p.tile_width, p.tile_height);
        in.light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects));
        in.size = {uint32_t(places.size()), 1};
        const Visibility seen = march(g, in);
        const Surface surface = resolve(g, in, seen.words, seen.words);
        const Readback bytes = g.readback(shadow(g, in, surface.seen, surface, cluster(g, in, surface.seen), {}));
        const Readback depth = g.readback(depth_of(g, in, surface.seen));
        rhi::must(runner_->execute(g));
        for (const float d : rhi::must(depth.get_as<float>())) EXPECT_NEAR(d, 6 * kVoxel, 0.1f * kVoxel);
        std::vector<float> out;
        const std::vector<uint32_t> words = rhi::must(bytes.get_as<uint32_t>());
        for (size_t i = 0; i < words.size(); i += 4) out.push_back(float(words[i] & 255u) / 255);
        return out;
    }
};

Edit box_of(vec3 low, vec3 high) {
    return field::worlds::edit(Box{.half_extents = (high - low) * 0.5f}, (low + high) * 0.5f);
}

field::worlds::World slab_with(const std::string& name, const Edit& edit, vec3 low, vec3 high) {
    return {name,
            {box_of({low.x, -0.2f, low.z}, {high.x, 0, high.z}), edit},
            {.voxel_size = kVoxel, .bounds = {{low.x, -0.2f, low.z}, high}}};
}

// Share of a disc past a straight edge at signed distance x from its middle, in radii.
double past_edge(double x) {
    const double c = std::clamp(x, -1.0, 1.0);
    return 0.5 + (c * std::sqrt(1 - c * c) + std::asin(c)) / std::numbers::pi;
}

// Area that discs of radii r and s have in common, d apart.
double common_area(double r, double s, double d) {
    if (d >= r + s) return 0;
    if (d <= std::fabs(r - s)) return std::numbers::pi * std::pow(std::min(r, s), 2);
    const double a = (d * d + r * r - s * s) / (2 * d * r), b = (d * d + s * s - r * r) / (2 * d * s);
    return r * r * (std::acos(a) - a * std::sqrt(1 - a * a)) + s * s * (std::acos(b) - b * std::sqrt(1 - b * b));
}

// What is seen of the lamp's disc from (x, 0, 0) beside a plate over x < 0 at height h. Shadow rays start a voxel above the slab.
double beside_plate(double x, float h, float thickness) {
    const double height = double(h) - double(kVoxel), far = double(kLightHeight) - double(kVoxel);
    // The upper edge of the plate hides more than the lower one where the ray leans in.
    double hidden = 0;
    for (const double y : {height, height + double(thickness)})
        hidden = std::max(hidden, 1 - past_edge(x * (1 - y / far) / (double(kLightRadius) * y / far)));
    return 1 - hidden;
}

TEST_F(ShadowGpu, AnEdgeHidesItsShareOfTheDisc) {
    // The cone is 2.5, 5 and 17 voxels wide at the edge; the last solid has cells without bricks inside.
    for (const auto& [h, thickness] :
         {std::pair{0.5f, 0.06f}, std::pair{1.0f, 0.06f}, std::pair{2.0f, 0.06f}, std::pair{2.0f, 0.8f}}) {
        const auto world = slab_with("plate", box_of({-1.2f, h, -0.9f}, {0, h + thickness, 0.9f}), {-1.2f, 0, -0.9f},
                                     {1.2f, h + thickness + 0.14f, 0.9f});
        std::vector<float> places;
        std::vector<double> expected;
        const double height = double(h) - double(kVoxel), far = double(kLightHeight) - double(kVoxel);
        for (const double offset : {-1.3, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.3}) {
            places.push_back(float(offset * double(kLightRadius) * height / (far - height)));
            expected.push_back(beside_plate(double(places.back()), h, thickness));
        }
        const std::vector<float> seen = fractions(world, places);
        for (size_t i = 0; i < places.size(); ++i)
            EXPECT_NEAR(seen[i], expected[i], 0.02 + 0.005) << "edge at height " << h << ", from " << places[i];
    }
}

// From where a twentieth of the disc is seen to where a twentieth is hidden: within the published 5 % of what the light and the plate's two edges make.
TEST_F(ShadowGpu, HalfShadowsAreAsWideAsTheLightMakesThem) {
    for (const float h : {0.5f, 1.0f, 2.0f}) {
        const float thickness = 0.06f;
        const auto world = slab_with("plate", box_of({-1.2f, h, -0.9f}, {0, h + thickness, 0.9f}), {-1.2f, 0, -0.9f},
                                     {1.2f, h + 0.2f, 0.9f});
        std::vector<float> places;
        std::vector<float> expected;
        for (int i = -70; i <= 70; ++i) {
            places.push_back(0.02f * float(i) * kLightRadius * h / (kLightHeight - h));
            expected.push_back(float(beside_plate(double(places.back()), h, thickness)));
        }
        const auto width_of = [&](const std::vector<float>& fractions) {
            const auto place_of = [&](float fraction) {
                size_t i = 1;
                while (i + 1 < fractions.size() && fractions[i] < fraction) ++i;
                const float share = (fraction - fractions[i - 1]) / (fractions[i] - fractions[i - 1]);
                return double(places[i - 1] + (places[i] - places[i - 1]) * share);
            };
            return place_of(0.95f) - place_of(0.05f);
        };
        EXPECT_NEAR(width_of(fractions(world, places)) / width_of(expected), 1, 0.05) << "edge at height " << h;
    }
}

TEST_F(ShadowGpu, ABallHidesWhatItCoversOfTheDisc) {
    for (const float h : {1.0f, 2.0f}) {
        const float r = 0.6f;
        const auto world = slab_with("ball", field::worlds::edit(Sphere{.radius = r}, {0, h, 0}), {-1.6f, 0, -0.7f},
                                     {1.6f, h + r + 0.1f, 0.7f});
        std::vector<float> places;
        std::vector<double> expected;
        for (float x = 0; x < 1.5f; x += 0.1f) {
            places.push_back(x);
            // Angles seen from a voxel above the slab; discs on the sphere of directions, nearly flat at these sizes.
            const double y = double(kVoxel), to_ball = std::hypot(double(x), double(h) - y),
                         to_light = std::hypot(double(x), double(kLightHeight) - y);
            const double ball = std::asin(double(r) / to_ball), light = std::atan(double(kLightRadius) / to_light);
            const double apart =
                std::fabs(std::atan2(double(x), double(h) - y) - std::atan2(double(x), double(kLightHeight) - y));
            expected.push_back(1 - common_area(light, ball, apart) / (std::numbers::pi * light * light));
        }
        const std::vector<float> seen = fractions(world, places);
        // One straight edge stands for a round one.
        for (size_t i = 0; i < places.size(); ++i)
            EXPECT_NEAR(seen[i], expected[i], 0.06) << "ball at height " << h << ", from " << places[i];
    }
}

}  // namespace
}  // namespace kiln::render
