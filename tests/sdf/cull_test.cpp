// SPDX-License-Identifier: MIT
// Culling 64 balls at a time against pruning one, and whole bricks against points.

#include "sdf/cull.h"

#include "random_scenes.h"
#include "sdf/prune.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace kiln::sdf {
namespace {

Balls random_balls(Random& r, vec3 around, float spread, float radius) {
    Balls balls;
    for (int i = 0; i < 64; ++i) {
        const vec3 c = around + r.point(spread);
        balls.x[i] = c.x;
        balls.y[i] = c.y;
        balls.z[i] = c.z;
    }
    balls.radius = radius;
    balls.half_side = radius;
    balls.live = ~uint64_t(0);
    return balls;
}

TEST(ListCuller, ItsCodeIsWhatPruneKeepsInstructionForInstruction) {
    for (uint32_t seed = 0; seed < 30; ++seed) {
        const Scene s = random_scene(seed, 14);
        const Result<Program> program = compile(s.source());
        ASSERT_TRUE(program) << program.error().message;
        Random r(seed);
        ListCuller culler(*program);
        ListCuller::Fold outer, inner;
        outer.list = culler.list_of(program->rows());
        outer.balls = random_balls(r, {0, 0, 0}, 4, r.in(0.3f, 1.0f));
        culler.fold(outer);
        culler.keep(outer, ~uint64_t(0));
        PruneScratch scratch;
        std::vector<Instruction> expected, expected_inner, got;
        for (int i = 0; i < 64; i += 3) {
            const float value = prune(view(*program), outer.balls.center(i), outer.balls.radius, expected, scratch);
            EXPECT_EQ(outer.value[i], value);
            culler.emit(outer, i, got);
            ASSERT_EQ(got, expected) << "seed " << seed << " ball " << i;
            // And from there to smaller balls inside.
            inner.list = culler.child(outer, i);
            inner.balls = random_balls(r, outer.balls.center(i), 0.3f * outer.balls.radius, 0.3f * outer.balls.radius);
            culler.fold(inner);
            culler.keep(inner, ~uint64_t(0));
            for (int k = 0; k < 64; k += 5) {
                prune(view(*program, expected), inner.balls.center(k), inner.balls.radius, expected_inner, scratch);
                culler.emit(inner, k, got);
                ASSERT_EQ(got, expected_inner) << "seed " << seed << " ball " << i << " " << k;
            }
            culler.drop(inner.list);
        }
    }
}

// What a brick would store: values clamped to `far`, and materials where they are nearer.
TEST(ListCuller, BeyondFarOnlyThatItIsBeyondIsKept) {
    size_t kept = 0, pruned = 0;
    for (uint32_t seed = 100; seed < 140; ++seed) {
        Scene s = random_scene(seed, 14);
        // A painted cut colours what lies under it; see field.h.
        for (Edit& e : s.edits)
            if (e.op == Op::Subtract) e.node.material = {};
        const Result<Program> program = compile(s.source());
        ASSERT_TRUE(program) << program.error().message;
        Random r(seed);
        ListCuller culler(*program);
        ListCuller::Fold fold;
        fold.list = culler.list_of(program->rows());
        const float half = r.in(0.05f, 0.3f);
        fold.balls = random_balls(r, {0, 0, 0}, 4, half * 1.7321f);
        fold.balls.half_side = half * 1.0001f;
        fold.balls.far = r.in(0.3f, 1.0f) * half;
        culler.fold(fold);
        culler.keep(fold, ~uint64_t(0));
        PruneScratch scratch;
        std::vector<Instruction> code, near;
        for (int i = 0; i < 64; ++i) {
            culler.emit(fold, i, code);
            prune(view(*program), fold.balls.center(i), fold.balls.radius, near, scratch);
            kept += code.size();
            pruned += near.size();
            Cloud cloud;
            for (int n = 0; n < 64; ++n) cloud.add(fold.balls.center(i) + r.point(half));
            std::vector<float> a(64), b(64);
            std::vector<MaterialMix> mix_a(64), mix_b(64);
            evaluate_materials(view(*program), cloud.points(), a.data(), mix_a.data());
            evaluate_materials(view(*program, code), cloud.points(), b.data(), mix_b.data());
            const float far = fold.balls.far;
            for (size_t k = 0; k < 64; ++k) {
                ASSERT_EQ(std::clamp(a[k], -far, far), std::clamp(b[k], -far, far)) << "seed " << seed << " ball " << i;
                if (std::fabs(a[k]) >= far) continue;
                ASSERT_EQ(mix_a[k].id0, mix_b[k].id0) << "seed " << seed << " ball " << i << " at " << a[k];
                ASSERT_EQ(mix_a[k].weight, mix_b[k].weight) << "seed " << seed << " ball " << i;
            }
        }
    }
    EXPECT_LT(kept, pruned * 9 / 10);
}

TEST(EvaluateBrick, HasTheBitsOfPointsOnEveryInstructionSet) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        Random r(seed);
        Scene s = random_scene(seed, 6);
        if (seed % 3 == 0) {  // the leaves that run over the whole brick
            for (Edit& e : s.edits) {
                e.node.kind = Node::Kind::Shape;
                e.node.domain.clear();
                if (r.below(2) == 0)
                    e.node.shape = Sphere{.radius = r.in(0.2f, 1)};
                else
                    e.node.shape = Box{.half_extents = {r.in(0.2f, 1), r.in(0.2f, 1), r.in(0.2f, 1)}};
                e.node.transform.rotation = {};
                e.node.transform.scale = vec3{1, 1, 1} * r.in(0.5f, 2);
                e.node.transform.position = r.below(5) == 0 ? vec3{} : r.point(1);
            }
        }
        const Result<Program> program = compile(s.source());
        ASSERT_TRUE(program) << program.error().message;
        float x[8], y[8], z[8];
        const vec3 from = r.point(2);
        const float step = r.in(0.01f, 0.2f);
        for (int i = 0; i < 8; ++i) {
            x[i] = from.x + step * float(i);
            y[i] = from.y + step * float(i);
            z[i] = from.z + step * float(i);
        }
        Cloud cloud;
        for (int i = 0; i < 512; ++i) cloud.add({x[i & 7], y[i >> 3 & 7], z[i >> 6]});
        std::vector<Instruction> pruned;
        PruneScratch scratch;
        prune(view(*program), {x[4], y[4], z[4]}, 7 * step, pruned, scratch);
        for (const TapeView& tape : {view(*program), view(*program, pruned)}) {
            std::vector<float> expected(512), got(512);
            evaluate(tape, cloud.points(), expected.data(), Isa::Scalar);
            float least = INFINITY;
            for (const float v : expected) least = std::min(least, std::fabs(v));
            for (const Isa isa : {Isa::Scalar, Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
                if (!has_isa(isa)) continue;
                EXPECT_EQ(evaluate_brick(tape, x, y, z, got.data(), isa), least) << "seed " << seed;
                for (size_t i = 0; i < 512; ++i)
                    ASSERT_EQ(got[i], expected[i]) << "seed " << seed << " isa " << int(isa);
            }
        }
    }
}

}  // namespace
}  // namespace kiln::sdf
