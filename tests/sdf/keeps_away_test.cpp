// SPDX-License-Identifier: MIT
// An edit held against a brick's stored texels: what a loop over the texels says, on every instruction set.
#include "sdf/eval.h"

#include "random_scenes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace kiln::sdf {
namespace {

TEST(KeepsAway, SaysWhatALoopOverTheTexelsSaysOnEveryInstructionSet) {
    constexpr float kVoxel = 0.05f, kInfinite = std::numeric_limits<float>::infinity();
    int yes = 0, no = 0;
    for (uint32_t seed = 0; seed < 60; ++seed) {
        Scene scene = random_scene(seed, 4);
        if (seed % 2 == 0) scene.edits[0].node = Node{.shape = Sphere{.radius = 0.3f}};
        if (seed % 4 == 0) scene.edits[0].node.shape = Box{.half_extents = {0.3f, 0.2f, 0.4f}};
        scene.edits[0].hidden = false;
        const auto program = compile(scene.source());
        ASSERT_TRUE(program) << seed;
        const EditSpan& edit = program->edits[0];
        const std::span<const Instruction> code = program->code.subspan(edit.first, edit.count - 1);
        std::vector<Instruction> alone(code.begin(), code.end());
        alone.push_back(Instruction::make(Opcode::Move, 0, 0, 1, 0, 0));
        Random random(70 + seed);
        for (int place = 0; place < 12; ++place) {
            const vec3 at = random.point(1);
            std::array<float, 8> x, y, z;
            for (size_t i = 0; i < 8; ++i) {
                x[i] = at.x + kVoxel * float(i);
                y[i] = at.y + kVoxel * float(i);
                z[i] = at.z + kVoxel * float(i);
            }
            std::array<float, 512> value, near;
            evaluate_brick(view(*program, alone), x.data(), y.data(), z.data(), value.data(), Isa::Scalar);
            const float sign = place % 2 == 0 ? 1.0f : -1.0f, margin = 0.25f * float(place % 3);
            // Below the edit's by the margin and a step; but for one texel, often, and but for those at the floor.
            const size_t odd = size_t(random.below(512));
            const float floor = place % 4 < 2 ? -4.0f : -kInfinite;
            for (size_t i = 0; i < 512; ++i) {
                float w = value[i] / kVoxel - margin - 0.02f;
                if (i == odd && place % 3 != 0) w += 0.5f;
                near[i] = sign * std::fmin(std::fmax(w, -4.0f), 4.0f) * kVoxel;
            }
            std::array<uint16_t, 512> codes;
            std::array<uint64_t, 8> solid;
            store_halves(near, 1 / kVoxel, 4.0f, 6.103515625e-5f, codes.data(), solid.data(), Isa::Scalar);
            bool expected = true;
            for (size_t i = 0; i < 512; ++i) {
                const float size = codes[i] % 0x8000 == 0
                                       ? 0.0f
                                       : std::ldexp(float(codes[i] % 0x400 | 0x400), codes[i] / 0x400 % 32 - 25);
                const float w = sign * (codes[i] >= 0x8000 ? -size : size);
                expected = expected && (value[i] / kVoxel > w + margin || !(w > floor));
            }
            (expected ? yes : no) += 1;
            for (const Isa isa : {Isa::Scalar, Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
                if (!has_isa(isa)) continue;
                EXPECT_EQ(keeps_away(view(*program, code), x.data(), y.data(), z.data(),
                                     {codes.data(), 1 / kVoxel, sign, margin, floor}, isa),
                          expected)
                    << "seed " << seed << " place " << place << " isa " << int(isa);
            }
        }
    }
    EXPECT_GT(yes, 50);
    EXPECT_GT(no, 15);
}

}  // namespace
}  // namespace kiln::sdf
