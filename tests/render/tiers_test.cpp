// SPDX-License-Identifier: MIT
// Tiers above compute give what compute gives. On a device without them the same tests see that they are refused, and say what is missing;
// tools/tiers runs them on a driver that has them (KILN_TIERS=1: then a device without fails).
#include "drawables.h"
#include "field/brick_set.h"
#include "field/clipmap.h"
#include "gpu_worlds.h"
#include "render/graph_plan.h"

#include <bit>
#include <cmath>
#include <cstdlib>

namespace kiln::render {
namespace {

bool tiers_wanted() {
    const char* wanted = std::getenv("KILN_TIERS");
    return wanted && std::string_view(wanted) == "1";
}

struct TiersGpu : GpuTest {
    void SetUp() override {
        GpuTest::SetUp();
        renderer = renderer_or_skip();
        if (!device_ || !renderer) return;
        if (tiers_wanted()) {
            EXPECT_TRUE(device_->caps().rt_pipeline && device_->caps().mesh_shader) << device_->info().name;
        }
    }
    void TearDown() override {
        renderer.reset();
        GpuTest::TearDown();
    }
    // Drivers of hardware may fuse a multiplication and an addition in one stage and not in another; then places agree within rounding.
    bool exact() const { return device_->info().kind == rhi::DeviceKind::Cpu; }
    Result<Picture> picture(const Frame& frame, Tier tier, View view = View::Shaded) {
        return renderer->render(frame, {.width = 96, .height = 72, .view = view, .tier = tier});
    }
    // Both pictures, which must be one to the bit; or the refusal.
    void same(const Frame& frame, Tier tier, bool has, const char* lacks) {
        const auto one = picture(frame, tier);
        if (!has) {
            ASSERT_FALSE(one);
            EXPECT_EQ(one.error().kind, ErrorKind::NoDevice);
            EXPECT_NE(one.error().message.find(lacks), std::string::npos) << one.error().message;
            return;
        }
        const Picture a = rhi::must(one);
        const std::string march = renderer->stats().march_tier, mesh = renderer->stats().mesh_tier;
        EXPECT_EQ(march, tier == Tier::Rt ? "rt" : "compute");
        EXPECT_EQ(mesh, tier == Tier::Mesh ? "mesh" : "vertex");
        const Picture b = rhi::must(picture(frame, Tier::Compute));
        size_t differ = 0, apart = 0, hits = 0;
        for (size_t i = 0; i < b.depth.size(); ++i) {
            hits += std::isfinite(b.depth[i]);
            bool equal = std::bit_cast<uint32_t>(a.depth[i]) == std::bit_cast<uint32_t>(b.depth[i]);
            for (size_t c = 0; c < 4; ++c)
                equal =
                    equal && std::bit_cast<uint32_t>(a.rgba[4 * i + c]) == std::bit_cast<uint32_t>(b.rgba[4 * i + c]);
            differ += !equal;
            apart += a.depth[i] != b.depth[i] && !(std::fabs(a.depth[i] - b.depth[i]) <= 1e-4f * b.depth[i]);
        }
        if (exact()) {
            EXPECT_EQ(differ, 0u);
        }
        EXPECT_LE(apart, exact() ? 0u : b.depth.size() / 500);
        EXPECT_GT(hits, 500u);
    }
    std::unique_ptr<Renderer> renderer;
};

// From outside and within, parallel to axes, along planes, edges and diagonals of the lattice.
std::vector<FrameRay> some_rays(const field::GridParams& g, int count) {
    field::worlds::Random r(5);
    std::vector<FrameRay> out;
    for (int i = 0; i < count; ++i) {
        const auto inside = [&](int first, int size) { return float(first * 7) + r.in(0, float(size * 7)); };
        vec3 target{inside(g.cell_x, g.size_x), inside(g.cell_y, g.size_y), inside(g.cell_z, g.size_z)};
        vec3 d = r.direction();
        const int kind = r.below(8);
        if (kind == 0) d = {r.below(2) == 0 ? 1.0f : -1.0f, 0, 0};
        if (kind == 1) d = normalize(vec3{0, r.in(-1, 1), r.in(-1, 1)});
        if (kind == 2) d = normalize(vec3{1, 1, -1});
        if (kind <= 2) target = {std::round(target.x), std::round(target.y), std::round(target.z)};
        const vec3 from = target - d * (kind == 3 ? 0.0f : r.in(50, 400));
        const vec3 whole{std::floor(from.x), std::floor(from.y), std::floor(from.z)};
        FrameRay ray{};
        ray.whole_x = int(whole.x), ray.whole_y = int(whole.y), ray.whole_z = int(whole.z);
        ray.part_x = from.x - whole.x, ray.part_y = from.y - whole.y, ray.part_z = from.z - whole.z;
        ray.direction_x = d.x, ray.direction_y = d.y, ray.direction_z = d.z;
        out.push_back(ray);
    }
    return out;
}

TEST_F(TiersGpu, RaysThroughBoxesSeeTheWordsOfTheMarch) {
    if (!device_->caps().rt_pipeline) {
        EXPECT_FALSE(device_->create_buffer({.size = 64, .usage = rhi::BufferUsage::BoxTree, .label = "tree"}));
        EXPECT_TRUE(complained("usages Boxes and BoxTree need the capability rt_pipeline"));
        return;
    }
    for (const auto& world :
         {field::worlds::sphere_of(10), field::worlds::boxes(), field::worlds::blends(), field::worlds::thin_walls()}) {
        const auto f = world.field();
        GpuField gpu(*runner_);
        rhi::must(gpu.update(f, Baker::Host));
        GpuBoxes boxes(*runner_);
        rhi::must(boxes.update(f));
        const std::vector<FrameRay> rays = some_rays(f->grid(), 4096);
        const auto words = [&](bool rt) {
            FrameParams p{};
            p.grid = gpu.grid();
            p.distance_scale = gpu.distance_scale();
            p.width = p.tile_width = 64;
            p.height = p.tile_height = int(rays.size() / 64);
            p.flags = kFrameRays | kFrameAccelerate;
            Graph g(*runner_);
            TileInputs in;
            in.field = gpu.import(g);
            in.frame = g.block(p);
            in.rays = g.upload("rays", std::span<const FrameRay>(rays));
            in.size = {64, uint32_t(rays.size() / 64)};
            in.rt = rt;
            if (rt) in.boxes = boxes.import(g);
            const Visibility seen = march(g, in);
            const Readback back = g.readback(seen.words), counted = g.readback(seen.evaluations[0]);
            rhi::must(runner_->execute(g));
            uint64_t sum = 0;
            for (const uint32_t n : rhi::must(counted.get_as<uint32_t>())) sum += n;
            EXPECT_GT(sum, rays.size() / 8) << world.name;
            return rhi::must(back.get_as<uint32_t>());
        };
        const std::vector<uint32_t> compute = words(false), traced = words(true);
        size_t hits = 0, differ = 0, apart = 0;
        for (size_t i = 0; i < compute.size(); i += 4) {
            hits += compute[i + 1] >> 28 != kSeenNothing;
            differ += compute[i] != traced[i] || compute[i + 1] != traced[i + 1] || compute[i + 2] != traced[i + 2];
            const float a = std::bit_cast<float>(compute[i]), b = std::bit_cast<float>(traced[i]);
            apart += a != b && !(std::fabs(a - b) <= 1e-4f * std::max(1.0f, a));
        }
        if (exact()) {
            EXPECT_EQ(differ, 0u) << world.name;
        }
        EXPECT_LE(apart, exact() ? 0u : rays.size() / 500) << world.name;
        EXPECT_GT(hits, 100u) << world.name;
    }
}

TEST_F(TiersGpu, PicturesByRaysAreThoseOfCompute) {
    same(frame_of(on_ground()), Tier::Rt, device_->caps().rt_pipeline, "has no ray-tracing pipelines");
    Frame within = frame_of(field::worlds::blends());
    within.camera.position = {0.05f, 0.02f, 0.03f};  // in solid, or close to it
    if (device_->caps().rt_pipeline) {
        const Picture a = rhi::must(picture(within, Tier::Rt, View::Depth));
        const Picture b = rhi::must(picture(within, Tier::Compute, View::Depth));
        if (exact()) {
            EXPECT_EQ(a.depth, b.depth);
        }
    }
}

// What the tier does not march, compute does, and the report says so.
TEST_F(TiersGpu, LevelsAndInstancesAreMarchedByCompute) {
    if (!device_->caps().rt_pipeline) return;
    const auto check = [&](const Frame& frame) {
        const Picture a = rhi::must(picture(frame, Tier::Rt, View::Depth));
        EXPECT_EQ(renderer->stats().march_tier, "compute");
        EXPECT_EQ(renderer->stats().boxes, 0u);
        EXPECT_EQ(a.depth, rhi::must(picture(frame, Tier::Compute, View::Depth)).depth);
    };
    const field::worlds::World world = field::worlds::blends();
    Frame levels = frame_of(world);
    auto map =
        field::Clipmap::make(levels.field->shared_program(), {.voxel_size = 0.05f, .levels = 2, .cells = 32}, {});
    ASSERT_TRUE(map);
    map->work();
    levels.levels = std::make_shared<const field::Clipmap>(std::move(*map));
    levels.field = nullptr;
    check(levels);
    Frame moving = frame_of(world);
    const auto ball = field::worlds::compiled({field::worlds::edit(Sphere{.radius = 0.2f})});
    moving.instances.push_back({.bricks = rhi::must(field::BrickSet::make(ball, 0.05f)),
                                .pose = {.position = {0.4f, 0.3f, 0.5f}},
                                .before = {.position = {0.4f, 0.3f, 0.5f}}});
    check(moving);
}

// An edit that changes what bricks hold, and not where they are, builds nothing.
TEST_F(TiersGpu, TheTreeIsBuiltAgainOnlyForOtherCells) {
    if (!device_->caps().rt_pipeline) return;
    GpuBoxes boxes(*runner_);
    const field::worlds::World world = field::worlds::sphere_of(10);
    const auto first = world.field();
    rhi::must(boxes.update(first));
    rhi::must(boxes.update(first));
    EXPECT_EQ(boxes.builds(), 1u);
    rhi::must(boxes.update(world.field()));  // another field with the same cells
    EXPECT_EQ(boxes.builds(), 1u);
    EXPECT_EQ(boxes.build_ms(), 0.0);
    const uint32_t before = boxes.boxes();
    rhi::must(boxes.update(field::worlds::boxes().field()));
    EXPECT_EQ(boxes.builds(), 2u);
    EXPECT_NE(boxes.boxes(), before);
    EXPECT_EQ(boxes.boxes(), box_cells(*field::worlds::boxes().field()).size());
}

// Rays end behind the triangles that are drawn before them, as those of compute do; what they would find there changes no pixel.
TEST_F(TiersGpu, RaysThroughBoxesEndBehindTriangles) {
    if (!device_->caps().rt_pipeline) return;
    Frame frame = frame_of(on_ground());
    model::Surface both = meshes::matte({0.6f, 0.6f, 0.6f});
    both.double_sided = true;
    const vec3 before = frame.camera.position * 0.6f;  // most of what the camera would see
    frame.meshes = {meshes::at(meshes::sheet(-0.7f, -0.7f, 0.7f, 0.7f, both), before,
                               axis_angle(normalize(cross(vec3{0, 1, 0}, before)), 0.9f))};
    same(frame, Tier::Rt, true, "");
    const uint64_t ended = renderer->stats().evaluations;
    (void)rhi::must(renderer->render(frame, {.width = 96, .height = 72, .tier = Tier::Rt}));
    const uint64_t by_rays = renderer->stats().evaluations;
    (void)rhi::must(renderer->render(frame, {.width = 96, .height = 72, .tier = Tier::Rt, .cull_meshes = false}));
    EXPECT_LT(by_rays, renderer->stats().evaluations);
    EXPECT_GT(ended, 0u);
}

TEST_F(TiersGpu, MeshesByAMeshShaderAreThoseOfTheVertexShader) {
    Frame frame = frame_of(on_ground());
    frame.meshes.push_back(meshes::at(meshes::sphere(0.5f, 48, meshes::matte({0.8f, 0.3f, 0.2f})), {0.6f, 0.4f, 0.7f}));
    model::Surface thin = meshes::matte({0.2f, 0.3f, 0.8f});
    thin.double_sided = true;
    frame.meshes.push_back(meshes::at(meshes::sphere(0.4f, 24, thin), {-0.7f, 0.5f, 0.6f}));
    model::Surface holes = meshes::matte({0.2f, 0.8f, 0.3f});
    holes.mask = true;
    frame.meshes.push_back(meshes::at(meshes::sphere(0.3f, 16, holes), {0.1f, 0.9f, 0.9f}));
    same(frame, Tier::Mesh, device_->caps().mesh_shader, "has no mesh shaders");
}

// ---- the graph, without a device

TEST(Tiers, ATreeIsBuiltAndThenReadAcrossABarrierOfTheGraph) {
    Graph g;
    Buffer tree = g.import("tree", rhi::BufferHandle{1, 1}, 4096, rhi::Access::BoxTreeRead);
    Buffer cells = g.import("cells", rhi::BufferHandle{2, 1}, 4096, rhi::Access::StorageReadCompute);
    const std::vector<rhi::Box> boxes(3);
    g.build_boxes(g.upload("boxes", std::span<const rhi::Box>(boxes)), tree, 3);
    TileInputs in;
    in.size = {16, 16};
    in.frame = g.block(FrameParams{});
    in.field.cells = cells;
    in.rays = g.upload("rays", std::span<const uint32_t>());
    in.field.distances = g.import("distances", rhi::TextureHandle{1, 1},
                                  {.size = {8, 8, 8}, .format = rhi::Format::R16Float, .dimension = rhi::Dimension::D3},
                                  rhi::Access::SampledReadCompute);
    in.field.tables = g.import("tables", rhi::BufferHandle{3, 1}, 4096, rhi::Access::StorageReadCompute);
    in.boxes = {tree, cells};
    in.rt = true;
    const Visibility seen = march(g, in);
    g.output(seen.words);
    const Plan plan = rhi::must(g.compile({}));
    const std::string text = plan.text();
    EXPECT_NE(text.find("'tree': BoxTreeRead -> BoxTreeWrite"), std::string::npos) << text;
    EXPECT_NE(text.find("'tree': BoxTreeWrite -> BoxTreeRead"), std::string::npos) << text;
    EXPECT_NE(text.find("BoxesRead 'boxes'"), std::string::npos) << text;
}

TEST(Tiers, BuildingWhatIsNotThereIsAnError) {
    const auto first_error = [](uint32_t count, bool imported) {
        Graph g;
        Buffer tree = imported ? g.import("tree", rhi::BufferHandle{1, 1}, 4096, rhi::Access::Undefined)
                               : g.create_buffer("tree", 4096);
        const std::vector<rhi::Box> boxes(3);
        g.build_boxes(g.upload("boxes", std::span<const rhi::Box>(boxes)), tree, count);
        return g.errors().empty() ? std::string() : g.errors().front();
    };
    EXPECT_EQ(first_error(3, true), "");
    EXPECT_EQ(first_error(4, true), "pass 'build tree': 4 boxes of 'boxes', which has room for 3");
    EXPECT_EQ(first_error(0, true), "pass 'build tree': 0 boxes of 'boxes', which has room for 3");
    EXPECT_EQ(first_error(3, false), "pass 'build tree': a box tree is imported, in memory of its own");
}

}  // namespace
}  // namespace kiln::render
