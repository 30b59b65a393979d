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

INSTANTIATE_TEST_SUITE_P(Kinds, EachKind, testing::Values(0, 1, 2));

}  // namespace
}  // namespace kiln::measure
