// SPDX-License-Identifier: MIT
// Bricks whose code is cut up by octants against the whole code at each point.

#include "sdf/octants.h"

#include "random_scenes.h"
#include "sdf/prune.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace kiln::sdf {
namespace {

struct Brick {
    float x[8], y[8], z[8];
};

Brick random_brick(Random& r) {
    Brick out;
    const vec3 from = r.point(2);
    const float step = r.in(0.005f, 0.1f);
    for (int i = 0; i < 8; ++i) {
        out.x[i] = from.x + step * float(i);
        out.y[i] = from.y + step * float(i);
        out.z[i] = from.z + step * float(i);
    }
    return out;
}

TEST(OctantCodes, HaveTheBitsOfTheWholeCodeInDistanceAndMaterials) {
    int cut = 0;
    size_t whole = 0, kept = 0;
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const Scene s = random_scene(seed, 40);
        const Result<Program> program = compile(s.source());
        ASSERT_TRUE(program) << program.error().message;
        Random r(seed);
        const Brick brick = random_brick(r);
        Cloud cloud;
        for (int i = 0; i < 512; ++i) cloud.add({brick.x[i & 7], brick.y[i >> 3 & 7], brick.z[i >> 6]});
        std::vector<Instruction> pruned;
        PruneScratch scratch;
        prune(view(*program), {brick.x[4], brick.y[4], brick.z[4]}, 7 * (brick.x[1] - brick.x[0]), pruned, scratch);
        for (const TapeView& tape : {view(*program), view(*program, pruned)}) {
            std::vector<float> expected(512), got(512);
            std::vector<MaterialMix> mixes(512);
            evaluate_materials(tape, cloud.points(), expected.data(), mixes.data());
            float least = INFINITY;
            for (const float v : expected) least = std::min(least, std::fabs(v));
            for (const Isa isa : {Isa::Scalar, Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
                if (!has_isa(isa)) continue;
                OctantCodes codes;
                if (!codes.cut(tape, brick.x, brick.y, brick.z, isa)) continue;
                ++cut;
                EXPECT_EQ(codes.evaluate(got.data()), least) << "seed " << seed;
                EXPECT_EQ(std::memcmp(got.data(), expected.data(), 512 * sizeof(float)), 0)
                    << "seed " << seed << " isa " << int(isa);
                for (int octant = 0; octant < OctantCodes::kOctants; ++octant) {
                    const std::span<const Instruction> code = codes.material_code(octant);
                    whole += tape.code.size();
                    kept += code.size();
                    Cloud part;
                    for (int t = 0; t < OctantCodes::kTexels; ++t) {
                        const int texel = texel_of_octant(octant, t);
                        part.add({brick.x[texel & 7], brick.y[texel >> 3 & 7], brick.z[texel >> 6]});
                    }
                    float values[OctantCodes::kTexels];
                    MaterialMix found[OctantCodes::kTexels];
                    evaluate_materials(view(*program, code), part.points(), values, found, false, isa);
                    for (int t = 0; t < OctantCodes::kTexels; ++t) {
                        const size_t texel = size_t(texel_of_octant(octant, t));
                        ASSERT_EQ(values[t], expected[texel]) << "seed " << seed << " octant " << octant;
                        ASSERT_EQ(found[t].id0, mixes[texel].id0) << "seed " << seed << " octant " << octant;
                        ASSERT_EQ(found[t].id1, mixes[texel].id1) << "seed " << seed << " octant " << octant;
                        ASSERT_EQ(found[t].weight, mixes[texel].weight) << "seed " << seed << " octant " << octant;
                    }
                }
            }
        }
    }
    EXPECT_GT(cut, 100);
    EXPECT_LT(kept, whole * 3 / 4);
}

TEST(OctantCodes, EveryTexelIsInOneOctant) {
    std::array<int, 512> seen{};
    for (int octant = 0; octant < OctantCodes::kOctants; ++octant) {
        for (int t = 0; t < OctantCodes::kTexels; ++t) ++seen[size_t(texel_of_octant(octant, t))];
    }
    for (const int n : seen) EXPECT_EQ(n, 1);
}

TEST(OctantCodes, ShortCodeIsNotCut) {
    const Scene s = random_scene(1, 2);
    const Result<Program> program = compile(s.source());
    ASSERT_TRUE(program) << program.error().message;
    Random r(1);
    const Brick brick = random_brick(r);
    OctantCodes codes;
    EXPECT_FALSE(codes.cut(view(*program, program->tape().first(2)), brick.x, brick.y, brick.z));
}

}  // namespace
}  // namespace kiln::sdf
