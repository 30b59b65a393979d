// SPDX-License-Identifier: MIT
// Sixteen points or fewer run through code of their own (eval_entry.inl): it must not show.
#include "sdf/eval.h"

#include "random_scenes.h"

#include <gtest/gtest.h>

#include <bit>

namespace kiln::sdf {
namespace {

TEST(EvaluateFew, AFewPointsHaveTheBitsOfManyOnEveryInstructionSet) {
    constexpr int kPoints = 64;
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const Scene scene = random_scene(seed, 12);
        const auto program = compile(scene.source());
        ASSERT_TRUE(program) << seed;
        Random random(500 + seed);
        Cloud cloud;
        for (int i = 0; i < kPoints; ++i) cloud.add(random.point(i % 4 == 0 ? 30.0f : 3.0f));
        float expected[kPoints];
        evaluate(view(*program), cloud.points(), expected, Isa::Scalar);
        for (const Isa isa : {Isa::Scalar, Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
            if (!has_isa(isa)) continue;
            for (int first = 0, count = 1; first + count <= kPoints; first += count, count = count % 17 + 1) {
                float out[kPoints];
                evaluate(view(*program),
                         {cloud.x.data() + first, cloud.y.data() + first, cloud.z.data() + first, count}, out, isa);
                for (int i = 0; i < count; ++i)
                    ASSERT_EQ(std::bit_cast<uint32_t>(out[i]), std::bit_cast<uint32_t>(expected[first + i]))
                        << "seed " << seed << " isa " << int(isa) << " point " << first + i << " of " << count;
            }
        }
    }
}

}  // namespace
}  // namespace kiln::sdf
