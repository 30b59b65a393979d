// SPDX-License-Identifier: MIT
// Sixteen points or fewer run through code of their own (eval_entry.inl): it must not show.
#include "sdf/eval.h"

#include "random_scenes.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <bit>

namespace kiln::sdf {
namespace {

TEST(EvaluateFew, AFewPointsHaveTheBitsOfManyOnEveryInstructionSet) {
    constexpr int kPoints = 64;
    for (uint32_t seed = 0; seed < 40; ++seed) {
        Scene scene = random_scene(seed, 12);
        Random place(900 + seed);
        for (int i = 0; seed % 2 == 0 && i < 6; ++i) {  // as most edits are, not turned
            Edit edit;
            if (i % 2 == 0) {
                edit.node.shape = Sphere{.radius = 0.3f};
            } else {
                edit.node.shape = Box{.half_extents = {0.3f, 0.2f, 0.4f}};
            }
            edit.node.transform.position = place.point(2);
            scene.edits.push_back(edit);
        }
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
