// SPDX-License-Identifier: MIT
// Triangle meshes beside the field, under validation: where they meet, what they look like, what they shadow.
#include "drawables.h"
#include "gpu_worlds.h"
#include "rgb_of.h"
#include "image/metrics.h"
#include "render/lib/pack.h"
#include "render/lib/shadow_march.h"
#include "render/mesh_trace.h"
#include "render/reference.h"

#include <cmath>

namespace kiln::render {
namespace {

struct MeshGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, View view = View::Shaded, int width = 160, int height = 120) {
        return rhi::must(renderer->render(frame, {.width = width, .height = height, .view = view}));
    }
    std::unique_ptr<Renderer> renderer;
};

field::worlds::World ball_at(vec3 center, float radius) {
    field::worlds::World w;
    w.name = "ball";
    w.edits = {field::worlds::of_material(field::worlds::edit(Sphere{.radius = radius}, center), 0)};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};
    return w;
}
// Nothing that the camera sees, on the same grid.
field::worlds::World speck() { return ball_at({-1.4f, -1.4f, -1.4f}, 0.02f); }

const Material kClay{.base_color = {0.7f, 0.3f, 0.2f}, .roughness = 0.4f};

Frame frame_with(const field::worlds::World& world) {
    Frame frame = frame_of(world, {0.6f, 1.0f, 3.6f});
    frame.materials[0] = frame.materials[1] = kClay;
    return frame;
}

double angle_deg(const float* a, const float* b) {
    double dot = 0, aa = 0, bb = 0;
    for (int c = 0; c < 3; ++c) {
        const double u = 2.0 * double(a[c]) - 1, v = 2.0 * double(b[c]) - 1;
        dot += u * v, aa += u * u, bb += v * v;
    }
    return std::acos(std::clamp(dot / std::sqrt(aa * bb), -1.0, 1.0)) * 180 / std::numbers::pi;
}

// Gate G15, first half. Triangles stay within 4e-5 m of the sphere, far below a tenth of a pixel; at the rim a ray meets that so much
// deeper that there the distance across the surface counts.
TEST_F(MeshGpu, AMeshSphereIsTheFieldsSphere) {
    const Frame field = frame_with(ball_at({0, 0, 0}, 1));
    Frame mesh = frame_with(speck());
    mesh.meshes.push_back(meshes::at(meshes::sphere(1, 512, meshes::of_material(kClay))));
    const Picture a = picture(field, View::Normal), b = picture(mesh, View::Normal);
    const shade::CameraParams eye = shade::camera_params(field.camera, a.width, a.height);
    double far = 0, turned = 0;
    int both = 0, one = 0;
    for (size_t i = 0; i < a.depth.size(); ++i) {
        const bool in_a = std::isfinite(a.depth[i]), in_b = std::isfinite(b.depth[i]);
        one += in_a != in_b;
        if (!in_a || !in_b) continue;
        ++both;
        const double apart = std::fabs(double(a.depth[i]) - double(b.depth[i])) / double(a.depth[i]);
        const vec3 d = shade::camera_direction_at(eye, float(i % 160) + 0.5f, float(i / 160) + 0.5f);
        const float* n = &a.rgba[4 * i];
        const double facing = -2 * (double(d.x) * (double(n[0]) - 0.5) + double(d.y) * (double(n[1]) - 0.5) +
                                    double(d.z) * (double(n[2]) - 0.5));
        far = std::max(far, apart * std::min(1.0, facing / 0.15));
        turned = std::max(turned, angle_deg(&a.rgba[4 * i], &b.rgba[4 * i]));
    }
    EXPECT_GT(both, 2500);
    EXPECT_LE(one, 2) << "pixels of the rim";
    EXPECT_LE(far, 1e-4) << "relative depth";
    EXPECT_LE(turned, 0.5) << "degrees";
    const Picture lit_a = picture(field), lit_b = picture(mesh);
    const double flip = image::flip(rgb_of(lit_a), rgb_of(lit_b));
    EXPECT_LE(flip, 0.005);
    RecordProperty("depth", std::to_string(far));
    RecordProperty("normal", std::to_string(turned));
    RecordProperty("flip", std::to_string(flip));
}

// First hit of a ray from `o` along `d` with a sphere; infinity: none.
double sphere_hit(dvec3 o, dvec3 d, dvec3 c, double r) {
    const dvec3 q{o.x - c.x, o.y - c.y, o.z - c.z};
    const double b = q.x * d.x + q.y * d.y + q.z * d.z, e = q.x * q.x + q.y * q.y + q.z * q.z - r * r;
    return b * b < e ? INFINITY : -b - std::sqrt(b * b - e);
}

// Gate G15, second half: a pixel all of whose neighbourhood of half a pixel belongs to one of them shows that one.
TEST_F(MeshGpu, MeshAndFieldCutEachOtherOnTheTrueCurve) {
    const dvec3 c_field{-0.25, 0, 0}, c_mesh{0.35, 0.1, 0.2};
    const double r_field = 0.8, r_mesh = 0.7;
    Frame frame = frame_with(ball_at({-0.25f, 0, 0}, 0.8f));
    for (Material& m : frame.materials) m.base_color = {0.8f, 0, 0};
    frame.meshes.push_back(meshes::at(meshes::sphere(0.7f, 384, meshes::matte({0, 0, 0.8f})), {0.35f, 0.1f, 0.2f}));
    const Picture p = picture(frame, View::Albedo);
    const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
    const dvec3 o{frame.camera.position.x, frame.camera.position.y, frame.camera.position.z};
    int judged = 0, wrong = 0, near_curve = 0;
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            int owner = -1;
            bool sure = true;
            for (int k = 0; k < 9; ++k) {
                const vec3 f =
                    shade::camera_direction_at(eye, float(x) + 0.5f * float(k % 3), float(y) + 0.5f * float(k / 3));
                const double size = std::sqrt(double(f.x) * f.x + double(f.y) * f.y + double(f.z) * f.z);
                const dvec3 d{f.x / size, f.y / size, f.z / size};
                const double a = sphere_hit(o, d, c_field, r_field), b = sphere_hit(o, d, c_mesh, r_mesh);
                const int here = std::isinf(a) && std::isinf(b) ? 0 : a < b ? 1 : 2;
                sure = sure && (owner < 0 || owner == here);
                owner = here;
            }
            near_curve += !sure;
            if (!sure) continue;
            ++judged;
            const float* c = &p.rgba[4 * size_t(y * p.width + x)];
            const int shows = c[0] > 0.4f ? 1 : c[2] > 0.4f ? 2 : 0;
            wrong += shows != owner;
        }
    }
    EXPECT_GT(near_curve, 100);
    EXPECT_GT(judged, 10000);
    EXPECT_EQ(wrong, 0);
}

// A share of a disc that a straight edge leaves: what is seen of it beyond x, in radii from its middle.
double disc_beyond(double x) {
    x = std::clamp(x, -1.0, 1.0);
    return 0.5 - (x * std::sqrt(1 - x * x) + std::asin(x)) / std::numbers::pi;
}

// A half-plane over a floor under a disc of a sun overhead, whoever of them is a mesh. renderer.md 1.8: within 0.02, and an 8-bit step.
TEST_F(MeshGpu, SoftShadowsAreTheVisibleShareOfTheDisc) {
    const float height = 0.6f, diameter_deg = 20;
    const double radius = std::tan(0.5 * double(diameter_deg) * std::numbers::pi / 180);
    for (int quarter = 0; quarter < 4; ++quarter) {
        const bool floor_is_mesh = quarter % 2 == 1;
        field::worlds::World w = speck();
        w.options.bounds = Box3{{-1.5f, -0.5f, -1.5f}, {1.5f, 0.5f, 1.5f}};
        w.edits = {field::worlds::edit(Box{.half_extents = {1.2f, 0.1f, 1.2f}}, {0, floor_is_mesh ? -0.3f : -0.1f, 0})};
        Frame open = frame_of(w, {0.01f, 0.5f, 0.02f});
        open.camera.target = {0, 0, 0.01f};
        open.camera.fov_y_deg = 80;
        open.environment = Environment{.color = {0, 0, 0}};
        open.lights = {
            {.kind = Light::Kind::Directional, .direction = {0, -1, 0}, .angular_diameter_deg = diameter_deg}};
        if (floor_is_mesh)
            open.meshes.push_back(
                meshes::at(meshes::sheet(-1.2f, -1.2f, 1.2f, 1.2f, meshes::matte({0.5f, 0.5f, 0.5f}))));
        Frame shaded = open;
        // It hides the half-space towards `hidden`.
        const quat turned = axis_angle({0, 1, 0}, 0.5f * std::numbers::pi_v<float> * float(quarter));
        const vec3 hidden = rotate(turned, {-1, 0, 0});
        shaded.meshes.push_back(
            meshes::at(meshes::sheet(-40, -20, 0, 20, meshes::matte({0.5f, 0.5f, 0.5f})), {0, height, 0}, turned));
        const Picture a = picture(open, View::Shaded, 96, 72), b = picture(shaded, View::Shaded, 96, 72);
        const shade::CameraParams eye = shade::camera_params(open.camera, a.width, a.height);
        double worst = 0;
        int judged = 0;
        for (int y = 6; y < a.height - 6; ++y) {
            for (int x = 0; x < a.width; ++x) {
                const size_t i = size_t(y * a.width + x);
                if (!(a.rgba[4 * i] > 0.02f)) continue;
                const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f);
                const double at = -double(dot(hidden, open.camera.position + d * a.depth[i]));
                const double seen = double(b.rgba[4 * i]) / double(a.rgba[4 * i]);
                worst = std::max(worst, std::fabs(seen - disc_beyond(-at / (double(height) * radius))));
                ++judged;
            }
        }
        EXPECT_GT(judged, 3000);
        EXPECT_LE(worst, 0.022) << (floor_is_mesh ? "on a mesh, " : "on the field, ") << quarter;
    }
}

// The renderer's picture and the judge's, with point, spot and sun lights, meshes and the field in each other's shadows.
TEST_F(MeshGpu, PicturesAreThoseOfTheJudge) {
    field::worlds::World w = ball_at({0, 0, 0}, 0.5f);
    w.edits.push_back(field::worlds::edit(Box{.half_extents = {1.3f, 0.1f, 1.3f}}, {0, -0.8f, 0}));
    Frame frame = frame_with(w);
    frame.meshes.push_back(meshes::at(meshes::sphere(0.4f, 24, meshes::of_material(kClay)), {0.75f, -0.2f, 0.4f}));
    frame.meshes.back().transform.scale = {0.9f, 0.5f, 1.3f};
    frame.meshes.push_back(meshes::at(meshes::sheet(-0.6f, -0.6f, 0.6f, 0.6f, meshes::matte({0.2f, 0.5f, 0.3f})),
                                      {-0.7f, -0.6f, 0.3f}, axis_angle({0, 0, 1}, 0.2f)));
    frame.lights = {
        {.kind = Light::Kind::Directional, .direction = {-0.5f, -1, -0.4f}, .angular_diameter_deg = 4},
        {.kind = Light::Kind::Point, .position = {1.5f, 1.2f, 1}, .intensity = 4, .radius = 0.1f},
        {.kind = Light::Kind::Spot, .direction = {0.5f, -1, -0.2f}, .position = {-1, 1.2f, 0.8f}, .intensity = 6}};
    const MeshSet set = make_mesh_set(frame);
    const MeshTrace trace(set);
    const auto program = frame.field->program();
    const ReferenceField judge{.distance = [&](dvec3 p) { return sdf::evaluate(sdf::view(program), p); },
                               .normal = {},
                               .material = [&](dvec3) { return frame.materials[0]; },
                               .bounds = program.bounds,
                               .meshes = &trace};
    Frame plain = frame;
    for (Material& m : plain.materials) m = kClay;
    const Picture drawn = rhi::must(renderer->render(plain, {.width = 96, .height = 72, .ao = AmbientOcclusion::Off}));
    const ReferencePicture truth = render_reference(judge, frame.lights, shade::sky_params(frame), frame.camera,
                                                    {.width = 96, .height = 72, .shadow_samples = 256});
    int off = 0, hits = 0;
    double sum = 0;
    for (size_t i = 0; i < truth.depth.size(); ++i) {
        if (!std::isfinite(truth.depth[i]) || !std::isfinite(drawn.depth[i])) continue;
        ++hits;
        const double a = double(truth.rgba[4 * i + 1]), b = double(drawn.rgba[4 * i + 1]);
        sum += std::fabs(a - b) / (a + 0.05);
        off += std::fabs(a - b) > 0.15 * a + 0.03;
    }
    EXPECT_GT(hits, 2000);
    EXPECT_LE(sum / hits, 0.02) << "mean relative difference";
    EXPECT_LE(off, hits / 50) << "of " << hits;
}

model::Image checks(int size) {
    model::Image image{.name = "checks", .width = size, .height = size, .rgba = {}};
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            for (const uint8_t v : {uint8_t(x * 2 < size ? 188 : 20), uint8_t(y * 2 < size ? 188 : 20), uint8_t(90),
                                    uint8_t((x * 2 < size) == (y * 2 < size) ? 255 : 0)})
                image.rgba.push_back(v);
    return image;
}

Frame over_a_sheet(model::Surface surface, int texels) {
    Frame frame = frame_with(speck());
    surface.double_sided = true;
    frame.meshes.push_back(meshes::at(meshes::sheet(-1, -1, 1, 1, surface, {checks(texels)})));
    frame.camera.position = {0, 2, 0.001f};
    frame.camera.target = {0, 0, 0};
    frame.camera.up = {0, 0, -1};
    return frame;
}

TEST_F(MeshGpu, ColourTexturesAreSrgbAndStandUpright) {
    model::Surface s = meshes::matte({1, 1, 1});
    s.base_texture.image = 0;
    for (const int texels : {64, 48}) {  // 48 becomes 64
        const Picture p = picture(over_a_sheet(s, texels), View::Albedo);
        const auto at = [&](double x, double y) {
            return &p.rgba[4 * (size_t(y * p.height) * size_t(p.width) + size_t(x * p.width))];
        };
        const float bright = 0.5028f, dark = 0.00699f;  // of 188 and 20
        EXPECT_NEAR(at(0.4, 0.4)[0], bright, 0.006f);
        EXPECT_NEAR(at(0.4, 0.4)[1], bright, 0.006f);
        EXPECT_NEAR(at(0.6, 0.4)[0], dark, 0.002f);
        EXPECT_NEAR(at(0.6, 0.4)[1], bright, 0.006f);
        EXPECT_NEAR(at(0.4, 0.6)[0], bright, 0.006f);
        EXPECT_NEAR(at(0.4, 0.6)[1], dark, 0.002f);
    }
}

TEST_F(MeshGpu, FarTexturesAreTheMeanOfTheirLight) {
    model::Surface s = meshes::matte({1, 1, 1});
    s.base_texture.image = 0;
    Frame frame = over_a_sheet(s, 64);
    // Two hundred checks a side: several to a pixel.
    auto many = std::make_shared<model::Drawable>(*frame.meshes[0].model);
    many->surfaces[0].base_texture.map = {400, 0, 0, 400, 0, 0};
    frame.meshes[0].model = many;
    const Picture p = picture(frame, View::Albedo);
    const float mean = 0.5f * (0.5028f + 0.00699f);
    const float* middle = &p.rgba[4 * (size_t(p.height / 2) * size_t(p.width) + size_t(p.width / 2))];
    EXPECT_NEAR(middle[0], mean, 0.02f);
    EXPECT_NEAR(middle[1], mean, 0.02f);
}

TEST_F(MeshGpu, HolesOfAMaskShowWhatIsBehindAndLetLightThrough) {
    model::Surface s = meshes::matte({1, 1, 1});
    s.base_texture.image = 0;
    s.base_texture.nearest = true;
    s.mask = true;
    Frame frame = over_a_sheet(s, 2);
    frame.camera.position = {0, 2.5f, 0.001f};
    frame.lights = {{.kind = Light::Kind::Directional, .direction = {0, -1, 0}, .angular_diameter_deg = 0}};
    frame.environment = Environment{.color = {0, 0, 0}};
    const Picture holes = picture(frame);
    frame.meshes.push_back(meshes::at(meshes::sheet(-1, -1, 1, 1, meshes::matte({0.5f, 0.5f, 0.5f})), {0, -0.5f, 0}));
    const Picture backed = picture(frame);
    const auto at = [](const Picture& p, double x, double y) {
        return size_t(y * p.height) * size_t(p.width) + size_t(x * p.width);
    };
    EXPECT_TRUE(std::isfinite(holes.depth[at(holes, 0.42, 0.42)]));
    EXPECT_TRUE(std::isinf(holes.depth[at(holes, 0.58, 0.42)]));
    EXPECT_NEAR(backed.depth[at(backed, 0.42, 0.42)], 2.5f, 0.1f);
    EXPECT_NEAR(backed.depth[at(backed, 0.55, 0.44)], 3.0f, 0.1f);
    EXPECT_GT(backed.rgba[4 * at(backed, 0.55, 0.44)], 0.1f) << "lit through the hole";
}

// A skinned strip whose upper joint turns a quarter: half of it lies down, with its normals.
TEST(MeshSet, SkinsFollowTheirJoints) {
    auto strip = std::make_shared<model::Drawable>(*meshes::sheet(-0.1f, 0, 0.1f, 1, meshes::matte({1, 1, 1})));
    strip->primitives[0].first_weights = 0;
    for (const model::Vertex& v : strip->vertices) {
        model::SkinWeights w;
        w.joints = {0, 1, 0, 0};
        w.weights = {1 - v.position.z, v.position.z, 0, 0};
        strip->weights.push_back(w);
    }
    const double h = std::sqrt(0.5);
    strip->nodes[0].skin = 0;
    strip->nodes[0].translation = {5, 5, 5};  // a skinned node's own place does not count
    strip->nodes.emplace_back();
    strip->nodes.emplace_back().rotation = {-h, 0, 0, h};  // z goes to +y
    strip->skins.push_back({{1, 2}, {model::kIdentity, model::kIdentity}});
    Frame frame;
    frame.meshes.push_back(meshes::at(strip, {0, 0, 10}));
    const MeshSet set = make_mesh_set(frame);
    ASSERT_EQ(set.parts.size(), 1u);
    ASSERT_EQ(set.moved.size(), 4u);
    for (size_t i = 0; i < 4; ++i) {
        const model::Vertex &was = strip->vertices[i], &is = set.moved[i];
        EXPECT_NEAR(is.position.x, was.position.x, 1e-6);
        EXPECT_NEAR(is.position.y, was.position.z, 1e-6);
        EXPECT_NEAR(is.position.z, 0, 1e-6);
        EXPECT_NEAR(is.normal.z, was.position.z > 0.5f ? -1 : 0, 1e-6);
        EXPECT_NEAR(is.normal.y, was.position.z > 0.5f ? 0 : 1, 1e-6);
    }
    const auto hit = MeshTrace(set).hit({0, 0.5, 20}, {0, 0, -1}, 100);
    EXPECT_FALSE(hit) << "its front looks the other way";
    const auto front = MeshTrace(set).hit({0, 0.5, 0}, {0, 0, 1}, 100);
    ASSERT_TRUE(front);
    EXPECT_NEAR(front->t, 10, 1e-6);
}

// What the camera turns away from is not drawn, and nothing that it sees is lost.
TEST_F(MeshGpu, OnlyPartsOutOfSightAreNotDrawn) {
    Frame all = frame_with(speck());
    const auto ball = meshes::sphere(0.4f, 16, meshes::of_material(kClay));
    for (int i = 0; i < 24; ++i) {
        const float a = 0.2618f * float(i);
        all.meshes.push_back(meshes::at(ball, {3 * std::sin(a), 0.4f * float(i % 5) - 0.8f, 3 * std::cos(a)}));
    }
    all.camera.position = {0, 0, 0};
    uint64_t most = 0, least = ~uint64_t{0};
    for (int turn = 0; turn < 6; ++turn) {
        const float a = 1.1f * float(turn);
        all.camera.target = {std::sin(a), 0.3f * std::sin(2 * a), std::cos(a)};
        const Picture p = picture(all, View::Depth, 64, 48);
        const RenderStats stats = renderer->stats();
        EXPECT_EQ(stats.triangles, 24 * ball->triangle_count());
        most = std::max(most, stats.triangles_drawn), least = std::min(least, stats.triangles_drawn);
        const MeshSet set = make_mesh_set(all);
        const MeshTrace trace(set);
        const shade::CameraParams eye = shade::camera_params(all.camera, 64, 48);
        for (int y = 0; y < 48; ++y) {
            for (int x = 0; x < 64; ++x) {
                const vec3 d = normalize(shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f));
                const auto hit = trace.hit({0, 0, 0}, {d.x, d.y, d.z}, 1e3);
                const float seen = p.depth[size_t(64 * y + x)];
                if (hit && std::fabs(dot(d, {float(hit->face.x), float(hit->face.y), float(hit->face.z)})) > 0.05f) {
                    EXPECT_NEAR(seen, hit->t, 1e-4 * hit->t) << x << " " << y;
                }
            }
        }
    }
    EXPECT_LT(most, 24 * ball->triangle_count() / 2);
    EXPECT_GT(least, 0u);
    all.camera.target = {0, 9, 0.1f};
    const Picture up = picture(all, View::Depth, 64, 48);
    EXPECT_EQ(renderer->stats().triangles_drawn, 0u);
    for (const float d : up.depth) EXPECT_TRUE(std::isinf(d));
}

TEST_F(MeshGpu, TilesOfALargePictureJoin) {
    // 4100 pixels are two tiles, and the right half of the picture looks far to the right.
    Frame frame = frame_with(speck());
    frame.meshes.push_back(meshes::at(meshes::sphere(3, 256, meshes::of_material(kClay)), {10, 0, 0}));
    frame.camera.position = {0, 0, 0};
    frame.camera.target = {0, 0, -1};
    const Picture p = rhi::must(renderer->render(frame, {.width = 4100, .height = 8, .view = View::Depth}));
    const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
    int hits = 0;
    for (int x = 0; x < p.width; ++x) {
        const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, 4.5f);
        const double t = sphere_hit({0, 0, 0}, {d.x, d.y, d.z}, {10, 0, 0}, 2.99);
        if (std::isinf(t) || t < 0) continue;
        ++hits;
        EXPECT_NEAR(double(p.depth[size_t(4 * p.width + x)]), t, 0.2) << x;
    }
    EXPECT_GT(hits, 1900);
}

// A box of triangles just inside a box of the field: bricks round the edges of the field's, and yet nothing shows through, for what meets is
// what was refined.
TEST_F(MeshGpu, NothingInsideShowsThroughRoundedEdges) {
    field::worlds::World w = speck();
    w.options.voxel_size = 0.1f;
    w.edits = {field::worlds::edit(Box{.half_extents = {0.53f, 0.53f, 0.53f}})};
    Frame frame = frame_with(w);
    for (Material& m : frame.materials) m.base_color = {0.8f, 0, 0};
    frame.camera.position = {1.3f, 1.1f, 1.7f};
    model::Surface blue = meshes::matte({0, 0, 0.8f});
    blue.double_sided = true;
    std::vector<model::Vertex> v(8);
    for (size_t i = 0; i < 8; ++i)
        v[i].position = {i & 1 ? 0.526f : -0.526f, i & 2 ? 0.526f : -0.526f, i & 4 ? 0.526f : -0.526f};
    frame.meshes.push_back(meshes::at(meshes::of_surface(
        std::move(v),
        {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5},
        blue)));
    const Picture p = picture(frame, View::Albedo);
    // At the rim rays miss the rounded field altogether.
    const auto at_rim = [&](int x, int y) {
        for (int j = std::max(y - 3, 0); j <= std::min(y + 3, p.height - 1); ++j)
            for (int i = std::max(x - 3, 0); i <= std::min(x + 3, p.width - 1); ++i)
                if (std::isinf(p.depth[size_t(j * p.width + i)])) return true;
        return false;
    };
    int red = 0, through = 0;
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            const float* c = &p.rgba[4 * size_t(y * p.width + x)];
            red += c[0] > 0.4f;
            through += c[2] > 0.4f && !at_rim(x, y);
        }
    }
    EXPECT_GT(red, 1000);
    EXPECT_EQ(through, 0);
}

}  // namespace
}  // namespace kiln::render
