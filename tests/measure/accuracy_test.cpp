// SPDX-License-Identifier: MIT
// How true the bricks' answers are on the published scene, against the exact edits: what the scene says of the engine, not of the machine.
#include "measure/recipes.h"

#include "field/host_bricks.h"
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

Baked baked(int kind) {
    const std::vector<Edit> edits = recipe(kind, 5, 1000);
    Baked out;
    out.program = std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
    field::FieldOptions options;
    options.voxel_size = 2.0f / 256;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    out.bricks = field::HostBricks::bake(*field::Field::build(out.program, options));
    return out;
}

class EachKind : public testing::TestWithParam<int> {};

TEST_P(EachKind, RaysHitWhatTheExactEditsShow) {
    const Baked b = baked(GetParam());
    const double voxel = 2.0 / 256;
    std::vector<Ray> rays;
    for (const Ray& ray : picture_rays(320, 180)) rays.push_back(ray);
    std::vector<field::MarchHit> hits(rays.size());
    b.bricks.march(rays, hits.data());
    std::vector<RayHit> truth(rays.size());
    scene::ExactField(*b.program).cast(rays, truth.data());
    int false_hits = 0, false_misses = 0;
    std::vector<double> errors;
    for (size_t i = 0; i < rays.size(); ++i) {
        const bool hit = hits[i].state == field::kMarchHit;
        false_hits += hit && !truth[i].hit;
        false_misses += !hit && truth[i].hit;
        if (hit && truth[i].hit) errors.push_back(std::abs(double(hits[i].t) - double(truth[i].t) / voxel));
    }
    std::sort(errors.begin(), errors.end());
    ASSERT_GT(errors.size(), rays.size() / 10);
    // Trilinear interpolation of a ball of radius r (voxels) loses 1 / (6 r) of it on average: half the sum of second derivatives, 2 / r,
    // times the mean of x (1 - x). These balls' mean radius is 6.4. What it loses at outlines are misses, never hits.
    EXPECT_LE(false_hits, 1e-4 * double(rays.size()));
    EXPECT_LE(errors[errors.size() / 2], 1 / (6 * 6.4));
    EXPECT_LE(false_misses, 6e-3 * double(rays.size()));
    std::printf("kind %d: %d false hits, %d false misses of %zu rays; error median %.4f voxel, p99 %.3f\n", GetParam(),
                false_hits, false_misses, rays.size(), errors[errors.size() / 2], errors[errors.size() * 99 / 100]);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachKind, testing::Values(0, 1, 2));

}  // namespace
}  // namespace kiln::measure
