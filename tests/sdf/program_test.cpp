// SPDX-License-Identifier: MIT
// The tape against the judge, its pruned pieces against the whole, and every instruction set against the scalar one.

#include "sdf/eval.h"
#include "sdf/judge.h"
#include "sdf/prune.h"
#include "random_scenes.h"
#include "sdf/tables.h"
#include "rounds.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace kiln::sdf {
namespace {

TEST(Program, TapeEqualsTheJudge) {
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const Scene s = random_scene(seed, 12);
        const auto program = compile(s.source());
        const auto judge = Judge::create(s.source());
        ASSERT_TRUE(program && judge) << seed;
        Random r(1000 + seed);
        for (int i = 0; i < 300; ++i) {
            const vec3 p = r.point(i % 3 == 0 ? 30.0f : 4.0f);
            const double expected = judge->distance({p.x, p.y, p.z});
            EXPECT_NEAR(evaluate(view(*program), dvec3{p.x, p.y, p.z}), expected, 2e-6 * (1 + std::abs(expected)))
                << "seed " << seed << " at " << p.x << ' ' << p.y << ' ' << p.z;
        }
    }
}

TEST(Program, WorldDistanceIsOneLipschitz) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        const Scene s = random_scene(seed, 10);
        const auto program = compile(s.source());
        ASSERT_TRUE(program) << seed << program.error().message;
        Random r(2000 + seed);
        for (int i = 0; i < rounds(2000); ++i) {
            const vec3 p = r.point(i % 4 == 0 ? 20.0f : 4.0f);
            const vec3 q = p + r.point(i % 2 == 0 ? 0.05f : 1.0f);
            const double gap = std::sqrt(double(dot(p - q, p - q)));
            const double a = evaluate(view(*program), dvec3{p.x, p.y, p.z});
            const double b = evaluate(view(*program), dvec3{q.x, q.y, q.z});
            EXPECT_LE(std::abs(a - b), gap * (1 + 1e-5) + 1e-6)
                << "seed " << seed << " at " << p.x << ' ' << p.y << ' ' << p.z;
        }
    }
}

TEST(Program, EveryInstructionSetGivesTheSameBytes) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
        const auto program = compile(random_scene(seed, 12).source());
        ASSERT_TRUE(program);
        Random r(3000 + seed);
        Cloud cloud;
        for (int i = 0; i < 1003; ++i) cloud.add(r.point(i % 3 == 0 ? 30.0f : 4.0f));
        std::vector<float> one(1003), other(1003);
        std::vector<MaterialMix> one_mix(1003), other_mix(1003);
        evaluate(view(*program), cloud.points(), one.data(), Isa::Scalar);
        evaluate_materials(view(*program), cloud.points(), other.data(), one_mix.data(), false, Isa::Scalar);
        EXPECT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0) << "materials change no distance";
        for (Isa isa : {Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
            if (!has_isa(isa)) continue;
            evaluate(view(*program), cloud.points(), other.data(), isa);
            EXPECT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0)
                << "isa " << int(isa) << " seed " << seed;
            evaluate_materials(view(*program), cloud.points(), other.data(), other_mix.data(), false, isa);
            for (size_t i = 0; i < one.size(); ++i) {
                ASSERT_EQ(one_mix[i].id0, other_mix[i].id0);
                ASSERT_EQ(one_mix[i].id1, other_mix[i].id1);
                ASSERT_EQ(one_mix[i].weight, other_mix[i].weight);
            }
        }
    }
}

TEST(Prune, PrunedTapeHasTheFullTapesBitsInItsBall) {
    size_t full = 0, kept = 0;
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const auto program = compile(random_scene(seed, 30).source());
        ASSERT_TRUE(program);
        Random r(4000 + seed);
        PruneScratch scratch;
        std::vector<Instruction> coarse, fine;
        for (int ball = 0; ball < 60; ++ball) {
            const vec3 center = r.point(4);
            const float radius = r.in(0.05f, 0.8f);
            prune(view(*program), center, radius, coarse, scratch);
            // A ball inside the ball, pruned from the pruned.
            const vec3 inner = center + r.point(0.3f * radius);
            const float inner_radius = 0.4f * radius;
            prune(view(*program, coarse), inner, inner_radius, fine, scratch);
            full += program->tape().size();
            kept += fine.size();
            Cloud cloud;
            while (cloud.x.size() < 64) {
                const vec3 offset = r.point(inner_radius);
                if (length(offset) <= inner_radius) cloud.add(inner + offset);
            }
            std::vector<float> a(64), b(64);
            std::vector<MaterialMix> mix_a(64), mix_b(64);
            evaluate_materials(view(*program), cloud.points(), a.data(), mix_a.data());
            evaluate_materials(view(*program, fine), cloud.points(), b.data(), mix_b.data());
            EXPECT_EQ(std::memcmp(a.data(), b.data(), 4 * a.size()), 0) << "seed " << seed << " ball " << ball;
            for (size_t i = 0; i < a.size(); ++i) {
                ASSERT_EQ(mix_a[i].id0, mix_b[i].id0) << "seed " << seed << " ball " << ball;
                ASSERT_EQ(mix_a[i].id1, mix_b[i].id1);
                ASSERT_EQ(mix_a[i].weight, mix_b[i].weight);
            }
        }
    }
    EXPECT_LT(kept, full / 4) << "pruning should keep little of " << full;
}

TEST(Program, RepeatIsTheNearestOfAllCopiesAlsoOffCentreAndTurned) {
    // A bar turned by 45 degrees that just fits its spacing: the copy whose cell the point is in is often not the nearest.
    Node bar;
    bar.shape = Box{.half_extents = {0.5f, 0.05f, 0.05f}};
    bar.transform.position = {0.3f, 0.1f, -0.2f};
    bar.transform.rotation = axis_angle({0, 1, 0}, 0.7853982f);
    Object object;
    object.nodes.emplace_back();
    object.nodes[0].kind = Node::Kind::Fold;
    object.nodes[0].children = {1};
    object.nodes.push_back(bar);
    object.nodes[0].domain = {Repeat{.spacing = {0.8f, 0, 0.8f}, .count = {0, 0, 5}}};
    Scene s;
    s.objects = {object};
    Edit e;
    e.node.kind = Node::Kind::Object;
    e.node.object = ObjectId{0, 0};
    s.edits = {e};
    Scene one = s;
    one.objects[0].nodes[0].domain.clear();
    const auto many = compile(s.source());
    const auto single = compile(one.source());
    ASSERT_TRUE(many && single);
    Random r(7);
    int other_copy = 0;
    for (int i = 0; i < 3000; ++i) {
        const vec3 p{r.in(-1, 1), r.in(-0.3f, 0.5f), r.in(-2.5f, 2.5f)};
        double nearest = 1e30, own = 1e30;
        for (int x = -4; x <= 4; ++x) {
            for (int z = -2; z <= 2; ++z) {
                const double d = evaluate(view(*single), dvec3{p.x - 0.8f * float(x), p.y, p.z - 0.8f * float(z)});
                nearest = std::min(nearest, d);
                if (std::abs(p.x - 0.3f - 0.8f * float(x)) <= 0.4f && std::abs(p.z + 0.2f - 0.8f * float(z)) <= 0.4f)
                    own = d;
            }
        }
        other_copy += own < 1e29 && nearest < own - 1e-3;
        // Farther than half a spacing the bound by boxes may be less; near the surface it is the distance.
        const double d = evaluate(view(*many), dvec3{p.x, p.y, p.z});
        EXPECT_LE(d, nearest + 1e-6);
        if (nearest < 0.2) {
            EXPECT_NEAR(d, nearest, 1e-6) << p.x << ' ' << p.y << ' ' << p.z;
        }
        const vec3 q = p + r.point(0.1f);
        EXPECT_LE(std::abs(d - evaluate(view(*many), dvec3{q.x, q.y, q.z})), double(length(p - q)) * (1 + 1e-5) + 1e-6);
    }
    EXPECT_GT(other_copy, 100);
}

TEST(Program, AWarpedSolidIsTheImageOfTheBareOne) {
    Edit e;
    e.node.shape = Box{.half_extents = {0.4f, 1, 0.1f}};
    e.node.domain = {Twist{.rate = 2}};
    const std::vector<Edit> edits{e};
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program);
    Random r(11);
    for (int i = 0; i < 2000; ++i) {
        const vec3 bare{r.in(-0.8f, 0.8f), r.in(-1.5f, 1.5f), r.in(-0.3f, 0.3f)};
        const vec3 p = rotate(axis_angle({0, 1, 0}, 2 * bare.y), bare);  // right-handed about +Y
        const vec3 outside =
            max(vec3{std::abs(bare.x), std::abs(bare.y), std::abs(bare.z)} - vec3{0.4f, 1, 0.1f}, {-1, -1, -1});
        const float signed_max = std::max({outside.x, outside.y, outside.z});
        const double d = evaluate(view(*program), dvec3{p.x, p.y, p.z});
        EXPECT_EQ(d > 0, signed_max > 0) << bare.x << ' ' << bare.y << ' ' << bare.z;
    }
}

TEST(Program, ADeepChainOfReferencesCompiles) {
    Scene s;
    constexpr uint32_t kDepth = 100000;
    for (uint32_t i = 0; i < kDepth; ++i) {
        Node n;
        n.transform.position = {0.00001f, 0, 0};
        if (i == 0) {
            n.shape = Sphere{.radius = 1};
        } else {
            n.kind = Node::Kind::Object;
            n.object = ObjectId{i - 1, 0};
        }
        s.objects.push_back({"o" + std::to_string(i), {n}});
    }
    Edit e;
    e.node.kind = Node::Kind::Object;
    e.node.object = ObjectId{kDepth - 1, 0};
    s.edits.push_back(e);
    const auto program = compile(s.source());
    ASSERT_TRUE(program) << program.error().message;
    EXPECT_NEAR(evaluate(view(*program), dvec3{4, 0, 0}), 2.0, 1e-3);  // 1 m of steps, 1 m of radius
    EXPECT_NEAR(Judge::create(s.source())->distance({4, 0, 0}), 2.0, 1e-3);
}

TEST(Program, ATreeOfAnyShapeFitsTheRegisters) {
    for (bool left_deep : {true, false}) {
        Object object;
        constexpr uint32_t kLeaves = 5000;
        for (uint32_t i = 0; i < kLeaves; ++i) {
            Node fold;
            fold.kind = Node::Kind::Fold;
            const uint32_t leaf = 2 * i + 1, next = 2 * i + 2;
            if (i + 1 < kLeaves) {
                fold.children = left_deep ? std::vector{next, leaf} : std::vector{leaf, next};
            } else {
                fold.children = {leaf};
            }
            object.nodes.push_back(fold);
            Node ball;
            ball.shape = Sphere{.radius = 0.5f};
            ball.transform.position = {float(i), 0, 0};
            object.nodes.push_back(ball);
        }
        Scene s;
        s.objects.push_back(object);
        Edit e;
        e.node.kind = Node::Kind::Object;
        e.node.object = ObjectId{0, 0};
        s.edits.push_back(e);
        const auto program = compile(s.source());
        ASSERT_TRUE(program) << program.error().message;
        EXPECT_NEAR(evaluate(view(*program), dvec3{4999, 2, 0}), 1.5, 1e-5);
        EXPECT_NEAR(evaluate(view(*program), dvec3{2500.5, 0, 0}), 0.0, 1e-5);
    }
}

TEST(Program, CyclesAndHungryTreesAreRefused) {
    Scene s;
    Node a;
    a.kind = Node::Kind::Object;
    a.object = ObjectId{1, 0};
    Node b = a;
    b.object = ObjectId{0, 0};
    s.objects = {{"a", {a}}, {"b", {b}}};
    Edit e;
    e.node = a;
    s.edits = {e};
    Fault fault;
    auto program = compile(s.source(), &fault);
    ASSERT_FALSE(program);
    EXPECT_NE(program.error().message.find("contains itself"), std::string::npos) << program.error().message;

    // Each object unites two of the one before: 2^40 spheres.
    s.objects.clear();
    for (uint32_t i = 0; i < 40; ++i) {
        Object o;
        o.name = "o" + std::to_string(i);
        Node fold;
        fold.kind = Node::Kind::Fold;
        fold.children = {1, 2};
        Node child;
        if (i == 0) {
            child.shape = Sphere{};
        } else {
            child.kind = Node::Kind::Object;
            child.object = ObjectId{i - 1, 0};
        }
        o.nodes = {fold, child, child};
        s.objects.push_back(o);
    }
    s.edits[0].node.object = ObjectId{39, 0};
    program = compile(s.source(), &fault);
    ASSERT_FALSE(program);
    EXPECT_NE(program.error().message.find("4194304"), std::string::npos) << program.error().message;
}

TEST(Program, MaterialsFollowTheKernelAndCutsShowWhatWasThere) {
    const MaterialId red{0, 0}, blue{1, 0};
    Edit ball;
    ball.node.shape = Sphere{.radius = 1};
    ball.node.material = red;
    Edit other = ball;
    other.node.transform.position = {1, 0, 0};
    other.node.material = blue;
    other.blend_radius = 0.4f;
    Edit cut = ball;
    cut.node.transform.position = {0, 1, 0};
    cut.node.material = {};
    cut.op = Op::Subtract;
    const std::vector<Edit> edits{ball, other, cut};
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program);
    MaterialMix mix;
    // On the seam plane x = 0.5 both operands are equal: half and half, the lower number first.
    evaluate(view(*program), {0.5, -0.8, 0}, &mix);
    EXPECT_EQ(mix.id0, 1);
    EXPECT_EQ(mix.id1, 2);
    EXPECT_NEAR(mix.weight, 0.5f, 1e-6f);
    // Elsewhere the share is the kernel's own: h / 2 for the farther operand.
    const double a = std::hypot(0.45, 0.8) - 1, b = std::hypot(0.55, 0.8) - 1;
    evaluate(view(*program), {0.45, -0.8, 0}, &mix);
    EXPECT_NEAR(mix.weight, 0.5 * (0.4 - std::abs(a - b)) / 0.4, 1e-5);
    // On the cut's face, deep in the first ball: red shows, although the cut alone decides the distance.
    evaluate(view(*program), {-0.4, 0.2, 0}, &mix);
    EXPECT_EQ(mix.id0, 1);
    PruneScratch scratch;
    std::vector<Instruction> code;
    prune(view(*program), {-0.4f, 0.1f, 0}, 0.01f, code, scratch);
    EXPECT_LE(code.size(), 6u) << "the history is one constant";
    evaluate(view(*program, code), {-0.4, 0.1, 0}, &mix);
    EXPECT_EQ(mix.id0, 1);
}

TEST(Program, AnEmptyWorldIsEmptyAndCutsOfNothingAreNothing) {
    Edit cut;
    cut.node.shape = Sphere{};
    cut.op = Op::Subtract;
    cut.blend_radius = 0.2f;
    for (const std::vector<Edit>& edits : {std::vector<Edit>{}, std::vector<Edit>{cut}}) {
        const auto program = compile({edits, {}, {}});
        ASSERT_TRUE(program);
        const double d = evaluate(view(*program), dvec3{0, 0, 0});
        EXPECT_GE(d, double(kEmptyTest));
        EXPECT_FALSE(std::isnan(d));
    }
}

}  // namespace
}  // namespace kiln::sdf
