// SPDX-License-Identifier: MIT
// Shadow maps of meshes: squares that hold what they must and move by whole texels; maps that keep their bits; pictures against those of the rays.
#include "drawables.h"
#include "gpu_worlds.h"
#include "rgb_of.h"
#include "image/metrics.h"
#include "render/lib/pack.h"
#include "render/passes/cascades.h"
#include "render/passes/lamps.h"
#include "render/shadow_cascades.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace kiln::render {
namespace {

double dotted(dvec3 a, vec3 b) { return a.x * double(b.x) + a.y * double(b.y) + a.z * double(b.z); }

struct Draw {
    std::mt19937 random{7};
    float in(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); }
    vec3 way() {
        for (;;) {
            const vec3 v{in(-1, 1), in(-1, 1), in(-1, 1)};
            if (dot(v, v) > 0.05f && dot(v, v) < 1) return normalize(v);
        }
    }
};

TEST(ShadowCascades, HoldAllThatCastsAndAllThatTheCameraSeesUpToTheirReach) {
    Draw draw;
    for (int round = 0; round < 300; ++round) {
        std::vector<Box3> casters;
        const float wide = std::exp2(draw.in(-2, 9));
        for (int i = 0; i < 5; ++i) {
            const vec3 at = draw.way() * (wide * draw.in(0, 1)),
                       half = vec3{1, 1, 1} * (0.1f * wide * draw.in(0.1f, 1));
            casters.push_back({at - half, at + half});
        }
        Camera camera;
        camera.position = draw.way() * (wide * draw.in(0.1f, 1.5f));
        camera.target = camera.position + draw.way() * std::exp2(draw.in(-2, 4));
        camera.fov_y_deg = draw.in(15, 120);
        const double aspect = double(draw.in(0.5f, 2.4f));
        const int side = 256 << (round % 4);
        const ShadowCascades c = fit_cascades(casters, draw.way(), camera, aspect, side);
        ASSERT_GE(c.squares.size(), 1u);
        ASSERT_LE(c.squares.size(), size_t(kMostCascades));
        for (const Box3& box : casters) {
            for (int corner = 0; corner < 8; ++corner) {
                const vec3 p{corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                             corner & 4 ? box.max.z : box.min.z};
                const double most = c.half - 1.5 * c.texel(c.squares.size() - 1);
                EXPECT_LE(std::fabs(dotted(c.u, p) - c.middle_u), most);
                EXPECT_LE(std::fabs(dotted(c.v, p) - c.middle_v), most);
                EXPECT_GE(dotted(c.w, p), c.low);
                EXPECT_LE(dotted(c.w, p), c.low + c.range);
            }
        }
        // The corners of the picture at the distance where a square's sphere ends, and what is nearer.
        const shade::CameraParams eye = shade::camera_params(camera, int(1000 * aspect), 1000);
        const double tan_y = std::tan(double(camera.fov_y_deg) * 3.14159265358979 / 360);
        const double tan2 = tan_y * tan_y * (1 + aspect * aspect);
        for (size_t k = 0; k + 1 < c.squares.size(); ++k) {
            EXPECT_EQ(std::exp2(std::round(std::log2(c.half / c.squares[k].half))), c.half / c.squares[k].half);
            const double reach = c.squares[k].half / (tan2 < 1 ? 0.5 * (1 + tan2) : std::sqrt(tan2));
            for (int i = 0; i < 8; ++i) {
                const auto along = [&](const vec4& v) { return vec3{v.x, v.y, v.z}; };
                const vec3 corner = along(eye.forward) + along(eye.right) * (i & 1 ? 1.0f : -1.0f) +
                                    along(eye.up) * (i & 2 ? 1.0f : -1.0f);
                const vec3 p = camera.position + corner * float(reach * (i & 4 ? 1 : 0.3));
                const double most = c.squares[k].half + 1.01 * c.texel(k) + 1e-5 * double(wide);
                EXPECT_LE(std::fabs(dotted(c.u, p) - c.squares[k].u), most) << round << " " << k;
                EXPECT_LE(std::fabs(dotted(c.v, p) - c.squares[k].v), most) << round << " " << k;
            }
        }
    }
}

TEST(ShadowCascades, ACameraThatTurnsAndMovesSeesTheSameTexels) {
    Draw draw;
    const std::vector<Box3> casters{{{-30, -1, -30}, {30, 5, 30}}};
    const vec3 sun{0.3f, -1, 0.45f};
    Camera camera;
    camera.position = {1, 2, 3};
    camera.target = {1, 2, 1};
    const ShadowCascades first = fit_cascades(casters, sun, camera, 1.5, 512);
    ASSERT_EQ(first.squares.size(), 4u);
    int moved = 0;
    for (int round = 0; round < 200; ++round) {
        camera.position = camera.position + draw.way() * 0.02f;
        camera.target = camera.position + draw.way() * 2;
        const ShadowCascades c = fit_cascades(casters, sun, camera, 1.5, 512);
        ASSERT_EQ(c.squares.size(), first.squares.size());
        for (size_t k = 0; k < c.squares.size(); ++k) {
            EXPECT_EQ(c.squares[k].half, first.squares[k].half);
            const double u = (c.squares[k].u - first.squares[k].u) / c.texel(k);
            const double v = (c.squares[k].v - first.squares[k].v) / c.texel(k);
            EXPECT_NEAR(u, std::round(u), 1e-6);
            EXPECT_NEAR(v, std::round(v), 1e-6);
            moved += std::round(u) != 0;
        }
    }
    EXPECT_GT(moved, 100);
}

struct ShadowMapsGpu : GpuTest {
    // The maps of a frame as heights, one after the other.
    std::vector<std::vector<float>> maps(const Frame& frame, int side, ShadowCascades& fitted) {
        GpuMeshes meshes(*runner_);
        rhi::must(meshes.update(frame, shade::camera_params(frame.camera, 90, 60)));
        Graph g(*runner_);
        std::vector<Box3> boxes;
        for (const MeshCaster& caster : meshes.casters()) boxes.push_back(caster.bounds);
        fitted = fit_cascades(boxes, frame.lights[0].direction, frame.camera, 1.5, side);
        const MeshHandles handles = meshes.import(g);
        const CascadeHandles drawn =
            draw_cascades(g, handles, fitted, caster_lists(meshes.casters(), fitted), frame.camera.position, 0);
        std::vector<Readback> reads;
        for (uint32_t k = 0; k < fitted.squares.size(); ++k) reads.push_back(g.readback(drawn.maps, 0, k));
        rhi::must(runner_->execute(g));
        std::vector<std::vector<float>> out;
        for (const Readback& read : reads) out.push_back(rhi::must(read.get_as<float>()));
        return out;
    }
};

Frame hills_in_the_sun() {
    Frame frame;
    frame.lights = {{.kind = Light::Kind::Directional, .direction = {0.4f, -1, 0.25f}}};
    const model::Surface grey = meshes::matte({0.6f, 0.6f, 0.6f});
    Draw draw;
    for (int i = 0; i < 40; ++i)
        frame.meshes.push_back(meshes::at(meshes::sphere(draw.in(0.1f, 1.2f), 16, grey),
                                          {draw.in(-20, 20), draw.in(0, 2), draw.in(-20, 20)}));
    frame.meshes.push_back(meshes::at(meshes::sheet(-24, -24, 24, 24, grey), {0, -0.5f, 0}));
    frame.camera.position = {0.4f, 1.5f, 3.2f};
    frame.camera.target = {0.4f, 1.1f, 1.2f};
    return frame;
}

// Gate (sub-texel moves too): a moving camera changes at most a thousandth of the texels; where the snapped square is the same, none.
TEST_F(ShadowMapsGpu, KeepTheirTexelsWhenTheCameraMoves) {
    constexpr int kSide = 256;
    Frame frame = hills_in_the_sun();
    ShadowCascades before;
    const auto first = maps(frame, kSide, before);
    ASSERT_GE(first.size(), 3u);
    size_t compared = 0, differ = 0, filled = 0;
    int shifted = 0, kept = 0;
    for (int step = 1; step <= 6; ++step) {
        const vec3 by = vec3{0.013f, 0.004f, -0.009f} * float(step * step);
        Frame moved = frame;
        moved.camera.position = frame.camera.position + by;
        moved.camera.target = frame.camera.target + by;
        ShadowCascades now;
        const auto next = maps(moved, kSide, now);
        for (size_t k = 0; k < first.size(); ++k) {
            const int du = int(std::lround((now.squares[k].u - before.squares[k].u) / now.texel(k)));
            const int dv = int(std::lround((now.squares[k].v - before.squares[k].v) / now.texel(k)));
            const bool same = du == 0 && dv == 0;
            (same ? kept : shifted) += 1;
            if (same) {
                EXPECT_EQ(first[k], next[k]) << step << " " << k;
            }
            for (int y = std::max(0, -dv); y < std::min(kSide, kSide - dv); ++y) {
                for (int x = std::max(0, -du); x < std::min(kSide, kSide - du); ++x) {
                    const float a = first[k][size_t((y + dv) * kSide + x + du)], b = next[k][size_t(y * kSide + x)];
                    ++compared;
                    filled += a > 0;
                    differ += std::fabs(a - b) > 1e-6f;
                }
            }
        }
    }
    EXPECT_GT(shifted, 6);
    EXPECT_GT(kept, 2);
    EXPECT_GT(filled, compared / 2);
    EXPECT_LE(double(differ), 0.001 * double(compared));
}

struct ShadowCascadesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, MeshShadows shadows, int side = 512) {
        return rhi::must(
            renderer->render(frame, {.width = 96, .height = 72, .mesh_shadows = shadows, .shadow_map_side = side}));
    }
    // Of the radiance, over the mean of the first.
    static double apart(const Picture& a, const Picture& b) {
        double sum = 0, of = 0;
        for (size_t i = 0; i < a.rgba.size(); ++i) {
            if (i % 4 == 3) continue;
            sum += std::fabs(double(a.rgba[i]) - double(b.rgba[i]));
            of += double(a.rgba[i]);
        }
        return sum / of;
    }
    std::unique_ptr<Renderer> renderer;
};

// A floor of the field with a block on it, meshes above and beside; the sun's disc is six degrees wide.
Frame yard(float sun_deg) {
    field::worlds::World w;
    w.name = "yard";
    w.edits = {field::worlds::edit(Box{.half_extents = {1.4f, 0.1f, 1.4f}}, {0, -0.6f, 0}),
               field::worlds::edit(Box{.half_extents = {0.15f, 0.5f, 0.15f}}, {-0.7f, -0.1f, 0.1f})};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};
    Frame frame = frame_of(w, {0.9f, 1.3f, 2.6f});
    frame.lights = {{.kind = Light::Kind::Directional, .direction = {0.5f, -1, 0.3f}, .angular_diameter_deg = sun_deg}};
    frame.environment = Environment{.color = {0.1f, 0.1f, 0.1f}};
    const model::Surface grey = meshes::matte({0.6f, 0.6f, 0.6f});
    frame.meshes = {meshes::at(meshes::sphere(0.25f, 32, grey), {-0.1f, 0.1f, -0.2f}),
                    meshes::at(meshes::sphere(0.12f, 24, grey), {0.5f, -0.38f, 0.5f}),
                    meshes::at(meshes::sheet(-0.2f, -0.2f, 0.2f, 0.2f, grey), {0.1f, 0.5f, 0.5f})};
    return frame;
}

TEST_F(ShadowCascadesGpu, DrawThePictureThatRaysDraw) {
    for (const float sun : {0.0f, 0.53f, 6.0f}) {
        const Frame frame = yard(sun);
        const Picture rays = picture(frame, MeshShadows::Rays);
        EXPECT_EQ(renderer->stats().mesh_shadows, "rays");
        const Picture maps = picture(frame, MeshShadows::Cascades);
        EXPECT_EQ(renderer->stats().mesh_shadows, "cascades");
        EXPECT_GE(renderer->stats().cascades, 1);
        const double off = apart(rays, maps);
        RecordProperty("off", std::to_string(off));
        EXPECT_LE(off, 0.012) << sun;
    }
}

TEST_F(ShadowCascadesGpu, LeaveNoGapBetweenMapsAndNoStripesOnAPlane) {
    // Nothing hides anything of a lone plane, and a ball far away makes the widest map wide: several maps, and what they say is 1 everywhere.
    const model::Surface grey = meshes::matte({0.6f, 0.6f, 0.6f});
    field::worlds::World w;
    w.name = "speck";
    w.edits = {field::worlds::edit(Sphere{.radius = 0.1f}, {0, -3, 0})};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-0.2f, -3.2f, -0.2f}, {0.2f, -2.8f, 0.2f}};
    Frame frame = frame_of(w, {0, 1.2f, 3});
    frame.camera.target = {0, 0.3f, 0};
    frame.meshes = {meshes::at(meshes::sheet(-30, -30, 30, 30, grey), {0, 0, 0})};
    for (const float height : {0.05f, 0.2f, 1.0f, 5.0f}) {
        frame.lights = {
            {.kind = Light::Kind::Directional, .direction = {0.8f, -height, 0.6f}, .angular_diameter_deg = 2}};
        const Picture rays = picture(frame, MeshShadows::Rays, 256), maps = picture(frame, MeshShadows::Cascades, 256);
        EXPECT_GE(renderer->stats().cascades, 3);
        EXPECT_LE(apart(rays, maps), 1e-4) << height;
    }
    // With balls on it the maps agree with the rays from near to far.
    Draw draw;
    for (int i = 0; i < 30; ++i) {
        const float along = draw.in(0, 18);
        frame.meshes.push_back(meshes::at(meshes::sphere(0.1f + 0.03f * along, 16, grey),
                                          {draw.in(-0.5f, 0.5f) * (1 + along), 0.1f + 0.03f * along, 2 - along}));
    }
    frame.lights[0].direction = {0.8f, -1, 0.3f};
    const Picture rays = picture(frame, MeshShadows::Rays), maps = picture(frame, MeshShadows::Cascades);
    EXPECT_GE(renderer->stats().cascades, 3);
    EXPECT_LE(apart(rays, maps), 0.02);
}

// Gate: where one map ends and the next begins, nothing of it is seen, in light or inside a shadow that reaches over all maps: pixels that rays
// draw as flat as their neighbours are as flat, to one step of the screen's 255.
TEST_F(ShadowCascadesGpu, BandsWhereMapsMeetHaveNoStep) {
    const model::Surface grey = meshes::matte({0.6f, 0.6f, 0.6f});
    field::worlds::World w;
    w.name = "speck";
    w.edits = {field::worlds::edit(Sphere{.radius = 0.1f}, {0, -3, 0})};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-0.2f, -3.2f, -0.2f}, {0.2f, -2.8f, 0.2f}};
    Frame frame = frame_of(w, {0, 1.2f, 3});
    frame.camera.target = {0, 0.3f, 0};
    frame.environment = Environment{.color = {0.2f, 0.2f, 0.2f}};
    // A roof over the left half of all that is seen.
    frame.meshes = {meshes::at(meshes::sheet(-30, -30, 30, 30, grey), {0, 0, 0}),
                    meshes::at(meshes::sheet(-12, -27, -0.4f, 3, grey), {0, 4, 0})};
    frame.lights = {{.kind = Light::Kind::Directional, .direction = {0.1f, -1, 0.05f}, .angular_diameter_deg = 0.53f}};
    const Picture rays = picture(frame, MeshShadows::Rays), maps = picture(frame, MeshShadows::Cascades);
    ASSERT_GE(renderer->stats().cascades, 3);
    const auto luma = [](const Picture& p, int x, int y) {
        const uint8_t* c = &p.srgb[size_t(y * p.width + x) * 4];
        return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    };
    // Where all around a pixel is as bright, no shadow ends: what the maps' steps are then is theirs alone.
    constexpr int kAround = 3;
    int bright = 0, dark = 0;
    double worst = 0;
    std::string where;
    for (int y = kAround; y + kAround < rays.height; ++y) {
        for (int x = kAround; x + kAround < rays.width; ++x) {
            double uneven = 0;
            for (int j = -kAround; j <= kAround; ++j)
                for (int i = -kAround; i <= kAround; ++i)
                    uneven = std::max(uneven, std::fabs(luma(rays, x + i, y + j) - luma(rays, x, y)));
            if (uneven > 3 || std::isinf(rays.depth[size_t((y - kAround) * rays.width + x)])) continue;
            (luma(rays, x, y) > 128 ? bright : dark) += 1;
            const double here = luma(maps, x, y) - luma(rays, x, y);
            const double step = std::max(std::fabs(here - (luma(maps, x - 1, y) - luma(rays, x - 1, y))),
                                         std::fabs(here - (luma(maps, x, y - 1) - luma(rays, x, y - 1))));
            if (step <= worst) continue;
            worst = step;
            where = std::to_string(x) + ", " + std::to_string(y);
        }
    }
    EXPECT_GT(bright, 500);
    EXPECT_GT(dark, 500);
    EXPECT_LE(worst, 1.0) << "of 255, at " << where;
}

// Gate: a caster of the field, whose shadow is marched, and its twin of triangles, whose shadow is in maps.
TEST_F(ShadowCascadesGpu, ACasterOfTrianglesIsItsTwinOfTheField) {
    for (const float sun : {0.53f, 3.0f}) {
        Picture pictures[2];
        for (const bool mesh : {false, true}) {
            field::worlds::World w;
            w.name = "twin";
            w.edits = {field::worlds::edit(Box{.half_extents = {1.4f, 0.1f, 1.4f}}, {0, -0.6f, 0})};
            if (!mesh) w.edits.push_back(field::worlds::edit(Sphere{.radius = 0.3f}, {-0.1f, 0.1f, 0}));
            w.options.voxel_size = 0.05f;
            w.options.bounds = Box3{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};
            Frame frame = frame_of(w, {0.9f, 1.3f, 2.6f});
            frame.materials = {{.base_color = {0.6f, 0.6f, 0.6f}, .roughness = 1},
                               {.base_color = {0.6f, 0.6f, 0.6f}, .roughness = 1}};
            frame.lights = {
                {.kind = Light::Kind::Directional, .direction = {0.5f, -1, 0.3f}, .angular_diameter_deg = sun}};
            frame.environment = Environment{.color = {0.1f, 0.1f, 0.1f}};
            if (mesh)
                frame.meshes = {
                    meshes::at(meshes::sphere(0.3f, 128, meshes::matte({0.6f, 0.6f, 0.6f}, 1)), {-0.1f, 0.1f, 0})};
            pictures[mesh ? 1 : 0] =
                rhi::must(renderer->render(frame, {.width = 96, .height = 72, .mesh_shadows = MeshShadows::Cascades}));
            EXPECT_EQ(renderer->stats().mesh_shadows, mesh ? "cascades" : "rays");
        }
        const double flip = image::flip(rgb_of(pictures[0]), rgb_of(pictures[1]));
        RecordProperty("flip", std::to_string(flip));
        EXPECT_LE(flip, 0.01) << sun;
    }
}

TEST_F(ShadowCascadesGpu, CastHolesAndLampsHaveMapsToo) {
    Frame frame = yard(1);
    model::Image checks{.name = "checks", .width = 4, .height = 4, .rgba = {}};
    for (int i = 0; i < 16; ++i)
        for (const int c : {200, 200, 200, (i / 4 + i) % 2 == 0 ? 255 : 0}) checks.rgba.push_back(uint8_t(c));
    model::Surface holes = meshes::matte({0.6f, 0.6f, 0.6f});
    holes.double_sided = holes.mask = true;
    holes.base_texture.image = 0;
    holes.base_texture.nearest = true;
    frame.meshes.push_back(meshes::at(meshes::sheet(-0.4f, -0.4f, 0.4f, 0.4f, holes, {checks}), {-0.3f, 0.6f, 0.4f}));
    frame.lights.insert(frame.lights.begin(),
                        {.kind = Light::Kind::Point, .position = {1.1f, 0.9f, 0.8f}, .intensity = 3, .radius = 0.1f});
    const Picture rays = picture(frame, MeshShadows::Rays), maps = picture(frame, MeshShadows::Cascades);
    EXPECT_LE(apart(rays, maps), 0.02);
    // Without the meshes' shadows it is another picture.
    Frame bare = frame;
    for (MeshInstance& m : bare.meshes) m.transform.position.y += 50;
    EXPECT_GT(apart(rays, picture(bare, MeshShadows::Cascades)), 0.06);
    // Without meshes nobody asks for maps.
    frame.meshes.clear();
    EXPECT_EQ(picture(frame, MeshShadows::Rays).rgba, picture(frame, MeshShadows::Cascades).rgba);
    EXPECT_EQ(renderer->stats().mesh_shadows, "rays");
}

// Six faces round a lamp, one before a spot; each alone, over the borders of faces too.
TEST_F(ShadowCascadesGpu, OfLampsDrawThePictureThatRaysDraw) {
    Frame frame = yard(1);
    const vec3 middle{0.2f, 0.3f, 0.3f};  // between the things
    const Light lamps[] = {
        {.kind = Light::Kind::Point, .position = middle, .intensity = 2},
        {.kind = Light::Kind::Point, .position = middle, .intensity = 2, .radius = 0.05f},
        {.kind = Light::Kind::Point, .position = {1.1f, 0.9f, 0.8f}, .intensity = 3, .range = 4, .radius = 0.1f},
        {.kind = Light::Kind::Spot, .direction = {0.4f, -1, -0.2f}, .position = {-0.6f, 1.4f, 0.6f}, .intensity = 9},
        {.kind = Light::Kind::Spot,
         .direction = {-0.4f, -1, -0.2f},
         .position = {0.6f, 1.4f, 0.6f},
         .intensity = 9,
         .radius = 0.1f,
         .inner_deg = 40,
         .outer_deg = 75}};
    for (const Light& lamp : lamps) {
        frame.lights = {lamp};
        const Picture rays = picture(frame, MeshShadows::Rays), maps = picture(frame, MeshShadows::Cascades);
        EXPECT_EQ(renderer->stats().mesh_shadows, "cascades");
        const double off = apart(rays, maps);
        RecordProperty("off", std::to_string(off));
        EXPECT_LE(off, 0.02) << &lamp - lamps;
    }
}

// More lamps than there are faces for: the others have rays.
TEST_F(ShadowCascadesGpu, LampsWithoutAMapHaveRays) {
    Frame frame = yard(1);
    frame.lights.clear();
    for (int i = 0; i < 12; ++i)
        frame.lights.push_back(
            {.kind = Light::Kind::Point, .position = {0.2f * float(i) - 1, 1.2f, 0.5f}, .intensity = 0.4f});
    const LampFaces faces = lamp_faces(frame.lights, frame.camera.position, kMostFaces);
    EXPECT_EQ(faces.faces.size(), size_t(kMostFaces));
    EXPECT_EQ(std::count(faces.of.begin(), faces.of.end(), 0.0f), 4);
    const Picture rays = picture(frame, MeshShadows::Rays), maps = picture(frame, MeshShadows::Cascades);
    EXPECT_LE(apart(rays, maps), 0.02);
}

TEST_F(ShadowCascadesGpu, ASideThatIsNoPowerOfTwoIsRefused) {
    for (const int side : {1, 32, 100, 16384, -512}) {
        const auto p = renderer->render(yard(1), {.width = 8, .height = 8, .shadow_map_side = side});
        ASSERT_FALSE(p) << side;
        EXPECT_EQ(p.error().kind, ErrorKind::Usage);
        EXPECT_NE(p.error().message.find("shadow_map_side"), std::string::npos);
    }
}

}  // namespace
}  // namespace kiln::render
