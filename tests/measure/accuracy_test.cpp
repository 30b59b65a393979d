// SPDX-License-Identifier: MIT
// How true the bricks' answers are on the published scene, against the exact edits: what the scene says of the engine, not of the machine.
#include "measure/recipes.h"

#include "field/mesh_facts.h"
#include "field/meshing.h"
#include "field/self_crossings.h"
#include "scene/exact.h"
#include "sdf/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kiln::measure {
namespace {

struct Baked {
    std::shared_ptr<const sdf::Program> program;
    field::HostBricks bricks;
};

Baked baked(int kind, uint32_t seed = 5) {
    const std::vector<Edit> edits = recipe(kind, seed, 1000);
    Baked out;
    out.program = std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
    field::FieldOptions options;
    options.voxel_size = 2.0f / 256;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    out.bricks = field::HostBricks::bake(*field::Field::build(out.program, options));
    return out;
}

class EachKind : public testing::TestWithParam<int> {};

// Two pixels or less from where a picture's depth jumps.
std::vector<bool> outlines(const std::vector<RayHit>& picture, int width, int height, double jump) {
    constexpr int kNear = 2;
    const auto at = [&](int x, int y) -> const RayHit& { return picture[size_t(y) * size_t(width) + size_t(x)]; };
    std::vector<bool> out(picture.size());
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int v = std::max(y - kNear, 0); v <= std::min(y + kNear, height - 1); ++v) {
                for (int u = std::max(x - kNear, 0); u <= std::min(x + kNear, width - 1); ++u) {
                    const RayHit &a = at(x, y), &b = at(u, v);
                    if (a.hit != b.hit || (a.hit && std::abs(double(a.t) - double(b.t)) > jump))
                        out[size_t(y) * size_t(width) + size_t(x)] = true;
                }
            }
        }
    }
    return out;
}

TEST_P(EachKind, RefinedRaysHitWhatTheExactEditsShow) {
    constexpr int kWidth = 320, kHeight = 180;
    const Baked b = baked(GetParam());
    const double voxel = 2.0 / 256;
    const std::vector<Ray> rays = picture_rays(kWidth, kHeight);
    std::vector<field::MarchHit> hits(rays.size());
    b.bricks.march_refined(rays, hits.data());
    std::vector<RayHit> truth(rays.size());
    scene::ExactField(*b.program).cast(rays, truth.data());
    const std::vector<bool> outline = outlines(truth, kWidth, kHeight, 4 * voxel);
    int false_hits = 0, false_misses = 0;
    std::vector<double> errors, errors_within;
    for (size_t i = 0; i < rays.size(); ++i) {
        const bool hit = hits[i].state == field::kMarchHit;
        false_hits += hit && !truth[i].hit;
        false_misses += !hit && truth[i].hit;
        if (!hit || !truth[i].hit) continue;
        errors.push_back(std::abs(double(hits[i].t) - double(truth[i].t) / voxel));
        if (!outline[i]) errors_within.push_back(errors.back());
    }
    std::sort(errors.begin(), errors.end());
    std::sort(errors_within.begin(), errors_within.end());
    ASSERT_GT(errors.size(), rays.size() / 10);
    ASSERT_GT(errors_within.size(), errors.size() / 20);
    const double p99 = errors_within[errors_within.size() * 99 / 100];
    std::printf(
        "kind %d: %d false hits, %d false misses of %zu rays; error median %.5f voxel, p99 within outlines %.4f of "
        "%zu\n",
        GetParam(), false_hits, false_misses, rays.size(), errors[errors.size() / 2], p99, errors_within.size());
    EXPECT_LE(false_hits, 1e-4 * double(rays.size()));
    EXPECT_LE(false_misses, 1e-3 * double(rays.size()));
    EXPECT_LE(errors[errors.size() / 2], 0.02);
    EXPECT_LE(p99, 0.1);
}

class EachKindSlow : public testing::TestWithParam<int> {};

TEST_P(EachKindSlow, MeshesAreClosedNearTheSurfaceAndNeverCrossThemselves) {
    for (const uint32_t seed : {5u, 6u, 7u}) {
        const Baked b = baked(GetParam(), seed);
        const field::MeshBricks bricks(b.bricks);
        const float voxel = bricks.voxel_size();
        const scene::ExactField exact(*b.program);
        for (const bool sharp : {false, true}) {
            field::Mesh mesh;
            if (sharp)
                field::mesh_sharp(bricks, field::exact_of(b.bricks, bricks), mesh);
            else
                field::mesh_smooth(bricks, mesh);
            const field::MeshFacts facts = field::mesh_facts(mesh.positions.span(), mesh.triangles.span());
            EXPECT_GT(facts.triangles, 900000u);
            EXPECT_EQ(facts.open_edges, 0u);
            EXPECT_EQ(facts.non_manifold_edges, 0u);
            EXPECT_EQ(facts.vertices, mesh.vertex_count());
            const auto crossings =
                field::meshes::SelfCrossings(mesh.positions.span(), mesh.triangles.span()).count(voxel);
            EXPECT_EQ(crossings.apart + crossings.at_vertex, 0u) << "seed " << seed << (sharp ? " sharp" : " smooth");
            std::vector<float> off(mesh.vertex_count());
            exact.distance(mesh.positions.span(), off.data());
            double most = 0, squares = 0;
            for (const float d : off) {
                most = std::max(most, std::abs(double(d)) / voxel);
                squares += double(d) * double(d) / (voxel * voxel);
            }
            const double rms = std::sqrt(squares / double(off.size()));
            std::printf("kind %d seed %u %s: %zu triangles, %zu late vertices, off by %.4f rms, %.4f at most\n",
                        GetParam(), seed, sharp ? "sharp" : "smooth", size_t(facts.triangles), mesh.late_bricks.size(),
                        rms, most);
            if (!sharp) continue;
            EXPECT_LE(rms, 0.025);
            EXPECT_LE(most, 0.5);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachKindSlow, testing::Values(0, 1, 2));

INSTANTIATE_TEST_SUITE_P(Kinds, EachKind, testing::Values(0, 1, 2));

}  // namespace
}  // namespace kiln::measure
