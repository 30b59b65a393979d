// SPDX-License-Identifier: MIT
// Shapes that a program registers: the same on every instruction set, in trees, pruned, and refused where what they say of themselves
// does not hold.

#include "sdf/custom.h"
#include "sdf/eval.h"
#include "sdf/judge.h"
#include "sdf/prune.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <stdexcept>

namespace kiln::sdf {
namespace {

// A ball by another name: whatever a ball answers, this must.
Shape ball_of_our_own() {
    static const Shape shape = [] {
        auto made = register_shape({.name = "test_ball",
                                    .description = "A ball.",
                                    .parameters = {{.name = "radius", .value = 0.5f, .least = 0.01f, .most = 10}},
                                    .distance =
                                        [](const CustomShape::Points& p, const float* w, double* d) {
                                            for (int i = 0; i < p.count; ++i)
                                                d[i] = std::sqrt(p.x[i] * p.x[i] + p.y[i] * p.y[i] + p.z[i] * p.z[i]) -
                                                       double(w[0]);
                                        },
                                    .half_extents =
                                        [](const float* w) {
                                            return vec3{1, 1, 1} * (1.5f * w[0]);
                                        }});
        EXPECT_TRUE(made) << made.error().message;
        return *made;
    }();
    return shape;
}

std::vector<Edit> world_of(const Shape& ball) {
    std::vector<Edit> edits(3);
    edits[0].node.shape = ball;
    edits[1].node.shape = Box{.half_extents = {0.4f, 0.2f, 0.3f}};
    edits[1].node.transform.position = {0.4f, 0.1f, 0};
    edits[1].op = Op::Subtract;
    edits[1].blend_radius = 0.1f;
    edits[2].node.shape = ball;
    edits[2].node.transform.position = {-0.7f, 0.3f, 0.2f};
    edits[2].node.transform.scale = {0.5f, 0.5f, 0.5f};
    edits[2].node.domain.push_back(Mirror{});
    edits[2].node.material = MaterialId{3, 0};
    return edits;
}

TEST(Custom, AnswersLikeTheBuiltInShapeItCopies) {
    const std::vector<Edit> edits = world_of(ball_of_our_own());
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program) << program.error().message;
    const auto judge = Judge::create({edits, {}, {}});
    ASSERT_TRUE(judge);
    const std::vector<Edit> built_in = world_of(Sphere{.radius = 0.5f});
    const auto reference = compile({built_in, {}, {}});
    ASSERT_TRUE(reference);
    std::mt19937 random(1);
    const auto in = [&](double size) { return size * (2 * double(random()) / 4294967296.0 - 1); };
    for (int i = 0; i < 500; ++i) {
        const dvec3 p{in(1), in(1), in(1)};
        const double d = evaluate(view(*program), p);
        ASSERT_NEAR(d, judge->distance(p), 1e-6);
        const double expected = evaluate(view(*reference), p);
        // Near the solid the same; farther out only the box around it is known.
        ASSERT_NEAR(d, expected, std::fabs(expected) < 0.05 ? 1e-6 : 10) << p.x << ' ' << p.y << ' ' << p.z;
        ASSERT_LE(d, expected + 1e-6);
        ASSERT_EQ(d < 0, expected < 0);
    }
}

TEST(Custom, EveryInstructionSetGivesTheSameBytesAlsoPruned) {
    const std::vector<Edit> edits = world_of(ball_of_our_own());
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program);
    std::mt19937 random(2);
    const auto in = [&](float size) { return float(size * (2 * double(random()) / 4294967296.0 - 1)); };
    std::vector<float> x(203), y(203), z(203), one(203), other(203);
    std::vector<MaterialMix> mix(203), other_mix(203);
    for (size_t i = 0; i < x.size(); ++i) {
        x[i] = in(1.5f);
        y[i] = in(1.5f);
        z[i] = in(1.5f);
    }
    const Points points{x.data(), y.data(), z.data(), int(x.size())};
    evaluate_materials(view(*program), points, one.data(), mix.data(), false, Isa::Scalar);
    for (Isa isa : {Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
        if (!has_isa(isa)) continue;
        evaluate(view(*program), points, other.data(), isa);
        EXPECT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0) << int(isa);
        evaluate_materials(view(*program), points, other.data(), other_mix.data(), false, isa);
        EXPECT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0) << int(isa);
        for (size_t i = 0; i < mix.size(); ++i) ASSERT_EQ(mix[i].id0, other_mix[i].id0);
    }
    PruneScratch scratch;
    std::vector<Instruction> code;
    size_t shorter = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        prune(view(*program), {x[i], y[i], z[i]}, 0.05f, code, scratch);
        shorter += code.size() < program->tape().size();
        float d = 0;
        evaluate(view(*program, code), Points{&x[i], &y[i], &z[i], 1}, &d);
        ASSERT_EQ(d, one[i]);
    }
    EXPECT_GT(shorter, 100u);
}

TEST(Custom, IsARowLikeAnyOther) {
    const Shape ball = ball_of_our_own();
    ASSERT_LT(ball.kind, shape_rows().size());
    const KindRow& row = shape_rows()[ball.kind];
    EXPECT_EQ(row.name, "test_ball");
    EXPECT_EQ(shape_kind("test_ball"), ball.kind);
    ASSERT_EQ(row.fields().size(), 1u);
    EXPECT_EQ(row.fields()[0].name, "radius");
    EXPECT_EQ(row.fields()[0].defaults[0], 0.5f);
    EXPECT_TRUE(out_of_range(row.fields()[0], 0));
    EXPECT_FALSE(out_of_range(row.fields()[0], 2));
    EXPECT_EQ(shape_rows()[0].name, "sphere");
}

void expect_refused(const char* name, CustomShape shape, const char* what) {
    shape.name = name;
    const auto made = register_shape(std::move(shape));
    ASSERT_TRUE(made) << made.error().message;
    Edit edit;
    edit.node.shape = *made;
    const auto program = compile({std::span(&edit, 1), {}, {}});
    ASSERT_FALSE(program) << name;
    EXPECT_NE(program.error().message.find(what), std::string::npos) << program.error().message;
}

TEST(Custom, WhatItSaysOfItselfIsChecked) {
    const auto sphere = [](double steep) {
        return [steep](const CustomShape::Points& p, const float*, double* d) {
            for (int i = 0; i < p.count; ++i) d[i] = steep * (std::hypot(p.x[i], p.y[i], p.z[i]) - 0.5);
        };
    };
    const auto box = [](float half) { return [half](const float*) { return vec3{half, half, half}; }; };
    expect_refused("test_steep", {.distance = sphere(1.2), .half_extents = box(1)}, "lipschitz 1 does not hold: at (");
    expect_refused("test_large", {.distance = sphere(1), .half_extents = box(0.4f)},
                   "reaches out of half_extents at (");
    expect_refused("test_flat", {.distance = sphere(1), .half_extents = box(0)}, "half_extents gives no size");
    expect_refused(
        "test_throws",
        {.distance = [](const CustomShape::Points&, const float*, double*) { throw std::runtime_error("no"); },
         .half_extents = box(1)},
        "not a finite number");
    expect_refused("test_jump",
                   {.distance =
                        [](const CustomShape::Points& p, const float*, double* d) {
                            for (int i = 0; i < p.count; ++i) d[i] = p.x[i] < 0 ? 0.1 : 0.4;
                        },
                    .half_extents = box(1),
                    .lipschitz = 3},
                   "does not hold");
}

TEST(Custom, RegistrationsThatCannotBeAreRefused) {
    const auto distance = [](const CustomShape::Points&, const float*, double*) {};
    const auto half = [](const float*) { return vec3{1, 1, 1}; };
    const auto refused = [](CustomShape shape, const char* what) {
        const auto made = register_shape(std::move(shape));
        ASSERT_FALSE(made) << what;
        EXPECT_NE(made.error().message.find(what), std::string::npos) << made.error().message;
    };
    refused({.name = "sphere", .distance = distance, .half_extents = half}, "there is a shape of this name");
    refused({.name = "Egg", .distance = distance, .half_extents = half}, "lower case");
    refused({.name = "test_none", .half_extents = half}, "no distance");
    refused({.name = "test_none", .distance = distance}, "no half_extents");
    refused({.name = "test_none", .distance = distance, .half_extents = half, .lipschitz = 0}, "lipschitz");
    refused(
        {.name = "test_none", .parameters = {{.name = "a"}, {.name = "a"}}, .distance = distance, .half_extents = half},
        "two parameters");
    refused({.name = "test_none",
             .parameters = {{.name = "a", .value = 2, .most = 1}},
             .distance = distance,
             .half_extents = half},
            "out of its range");
    (void)ball_of_our_own();
    refused({.name = "test_ball", .distance = distance, .half_extents = half}, "there is a shape of this name");
}

}  // namespace
}  // namespace kiln::sdf
