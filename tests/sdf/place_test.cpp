// SPDX-License-Identifier: MIT
// A placed program is the object seen through the inverse of its pose, united with the world: by values, materials, pruned code, index.
#include "sdf/place.h"

#include "sdf/eval.h"
#include "sdf/prune.h"

#include "random_scenes.h"

#include <gtest/gtest.h>

#include <kiln/shapes.h>

#include <cmath>

namespace kiln::sdf {
namespace {

Edit made(const Shape& shape, vec3 at, Op op = Op::Union, float blend = 0, MaterialId material = {}) {
    Edit e;
    e.node.shape = shape;
    e.node.transform.position = at;
    e.node.material = material;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

Program compiled(std::span<const Edit> edits) {
    auto out = compile({edits, {}, {}});
    EXPECT_TRUE(out) << (out ? "" : out.error().message);
    return std::move(*out);
}

std::vector<Edit> object_edits() {
    Edit turned = made(Box{.half_extents = {0.3f, 0.2f, 0.5f}}, {0.4f, 0.1f, 0}, Op::Union, 0.15f, MaterialId{2, 0});
    turned.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 0.5f}), 0.8f);
    turned.node.transform.scale = {1.2f, 0.8f, 1};
    return {made(Sphere{.radius = 0.5f}, {}, Op::Union, 0, {}), turned,
            made(Cylinder{.half_height = 1, .radius = 0.15f}, {0.1f, 0, 0}, Op::Subtract, 0.05f),
            made(Torus{.major_radius = 0.4f, .minor_radius = 0.1f}, {0, 0.4f, 0}, Op::Union, 0, MaterialId{4, 0})};
}

const Pose kPose{{3, -1, 2}, axis_angle(normalize(vec3{0.3f, 1, -0.4f}), 2.1f)};

TEST(Place, IsTheObjectThroughTheInverseOfItsPoseInAHardUnion) {
    const std::vector<Edit> ground{made(Plane{}, {0, -1.2f, 0}),
                                   made(Sphere{.radius = 1}, {2, -1, 2}, Op::Union, 0.3f, MaterialId{1, 0})};
    const Program object = compiled(object_edits());
    for (const Pose& pose : {kPose, Pose{{0.5f, 0.25f, -2}, {}}}) {
        Program world = compiled(ground);
        const Program alone = world;
        const auto row = place(world, object, pose, 6, order_at(ground.size()));
        ASSERT_TRUE(row);
        EXPECT_EQ(world.index.size(), alone.index.size() + 1);
        Random random(7);
        int inside = 0, own = 0;
        for (int i = 0; i < 4000; ++i) {
            const dvec3 p{pose.position.x + random.in(-2, 2), pose.position.y + random.in(-2, 2),
                          pose.position.z + random.in(-2, 2)};
            // In double, and through no code of place()'s.
            const quat q = conjugate(pose.rotation);
            const vec3 local =
                rotate(q, vec3{float(p.x - double(pose.position.x)), float(p.y - double(pose.position.y)),
                               float(p.z - double(pose.position.z))});
            const double expected_object =
                evaluate(view(object), dvec3{double(local.x), double(local.y), double(local.z)});
            const double expected = std::min(evaluate(view(alone), p), expected_object);
            MaterialMix mix;
            const double d = evaluate(view(world), p, &mix);
            ASSERT_NEAR(d, expected, 3e-6) << i;
            inside += expected_object < 0;
            // Outside its bounds the value is at least rate times the distance to them.
            const EditSpan& span = world.edits[*row];
            const Box3& b = span.bounds;
            const vec3 at{float(p.x), float(p.y), float(p.z)};
            const vec3 gap = max(max(b.min - at, at - b.max), vec3{});
            if (length(gap) > 0) {
                EXPECT_GE(expected_object, double(span.rate * length(gap)) - 1e-5);
            }
            if (expected_object < evaluate(view(alone), p) - 1e-4) {
                ++own;
                MaterialMix in_object;
                (void)evaluate(view(object), dvec3{double(local.x), double(local.y), double(local.z)}, &in_object);
                EXPECT_EQ(mix.id0, in_object.id0 == 0 ? 6 : in_object.id0);
            }
        }
        EXPECT_GT(inside, 20);
        EXPECT_GT(own, 500);
    }
}

TEST(Place, PrunesLikeAnyEditAndKnowsItsParts) {
    Program world = compiled(std::vector<Edit>{made(Plane{}, {0, -1.2f, 0})});
    std::vector<Edit> edits = object_edits();
    const std::vector<uint32_t> owners{10, 11, 12, 13};
    Source source{edits, {}, {}};
    source.owners = owners;
    auto object = compile(source);
    ASSERT_TRUE(object);
    const auto row = place(world, *object, kPose, 0, order_at(1));
    ASSERT_TRUE(row);
    EXPECT_EQ(world.edits[*row].owner, 10u);
    for (uint32_t i = 0; i < 4; ++i) EXPECT_EQ(world.edits[*row + 1 + i].owner, 10 + i);
    Random random(3);
    for (int i = 0; i < 300; ++i) {
        const vec3 c = kPose.position + vec3{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
        const float radius = 0.2f;
        std::vector<Instruction> code;
        PruneScratch scratch;
        prune(view(world), c, radius, code, scratch);
        for (int k = 0; k < 8; ++k) {
            const vec3 p = c + vec3{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)} * (radius / 1.8f);
            float whole, pruned;
            evaluate(view(world), {&p.x, &p.y, &p.z, 1}, &whole);
            evaluate(view(world, code), {&p.x, &p.y, &p.z, 1}, &pruned);
            EXPECT_EQ(whole, pruned);
        }
    }
}

TEST(Place, RefusesShapesWhoseNumbersTheWorldHasNot) {
    Program object = compiled(std::vector<Edit>{made(Sphere{}, {})});
    object.samples.push_back(1);
    Program world = compiled(std::vector<Edit>{made(Sphere{}, {})});
    EXPECT_FALSE(place(world, object, {}, 0, order_at(1)));
    world.samples = object.samples;
    world.samples.push_back(2);
    EXPECT_TRUE(place(world, object, {}, 0, order_at(1)));
}

}  // namespace
}  // namespace kiln::sdf
