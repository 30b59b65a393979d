// SPDX-License-Identifier: MIT
// Bounds of the values along segments.
#include "sdf/eval.h"
#include "sdf/prune.h"

#include "random_scenes.h"
#include "rounds.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kiln::sdf {
namespace {

struct Segment {
    dvec3 middle, half;
    dvec3 at(double s) const {  // s: -1 ... 1
        return {middle.x + half.x * s, middle.y + half.y * s, middle.z + half.z * s};
    }
    double half_length() const { return std::sqrt(half.x * half.x + half.y * half.y + half.z * half.z); }
};

// Around the origin, from a centimetre to a hundred metres long, some along an axis.
Segment random_segment(Random& random) {
    const vec3 middle = random.point(6);
    vec3 direction = normalize(random.point(1) + vec3{0, 0, 0.01f});
    if (random.below(4) == 0) direction = {1, 0, 0};
    const float half = std::pow(10.0f, random.in(-2, 2));
    return {{double(middle.x), double(middle.y), double(middle.z)},
            {double(direction.x * half), double(direction.y * half), double(direction.z * half)}};
}

// A random world with half-spaces, turned, mirrored, rounded and inside objects, and rows without end.
Scene endless_scene(uint32_t seed) {
    Scene scene = random_scene(seed, 6);
    Random random(seed + 1000);
    const auto plane = [&] {
        Node n;
        n.shape = Plane{};
        n.transform = random.transform(2);
        if (random.below(3) == 0) n.domain.push_back(Mirror{});
        if (random.below(3) == 0) n.domain.push_back(Round{.radius = 0.1f});
        return n;
    };
    for (Object& object : scene.objects) {
        if (random.below(2) == 0) continue;
        Node root = object.nodes.front();
        root.children.push_back(uint32_t(object.nodes.size()));
        object.nodes.push_back(plane());
        if (random.below(2) == 0) root.domain.push_back(Mirror{});
        object.nodes.front() = root;
    }
    const auto add = [&](const Node& node) {
        Edit edit;
        edit.node = node;
        edit.op = Op(random.below(3));
        edit.blend_radius = random.below(2) == 0 ? 0.0f : random.in(0.01f, 0.4f);
        scene.edits.insert(scene.edits.begin() + random.below(int(scene.edits.size())), edit);
        scene.edits.front().op = Op::Union;
    };
    add(plane());
    if (random.below(2) == 0) add(plane());
    Node row;
    row.shape = Sphere{.radius = 0.4f};
    row.transform = random.transform(2);
    row.domain.push_back(Repeat{.spacing = {1.5f, 0, random.below(2) == 0 ? 2.0f : 0.0f}});
    add(row);
    return scene;
}

TEST(Segment, NoValueOnItIsBelowItsBound) {
    int useful = 0;
    for (int seed = 0; seed < rounds(48); ++seed) {
        const Scene scene = endless_scene(uint32_t(seed));
        const auto program = compile(scene.source());
        if (!program) continue;  // a repeat whose child does not fit, or a warp of what has no end
        Random random(uint32_t(seed) + 7);
        std::vector<Instruction> kept;
        PruneScratch scratch;
        for (int k = 0; k < 40; ++k) {
            const Segment segment = random_segment(random);
            const double bound = least_on_segment(*program, program->tape(), segment.middle, segment.half);
            const double length = segment.half_length();
            prune(view(*program), {float(segment.middle.x), float(segment.middle.y), float(segment.middle.z)},
                  float(length * 1.001 + 1e-4), kept, scratch);
            const double pruned = least_on_segment(*program, kept, segment.middle, segment.half);
            double least = INFINITY;
            for (int i = -50; i <= 50; ++i) least = std::min(least, evaluate(view(*program), segment.at(i * 0.02)));
            ASSERT_LE(bound, least + 1e-9) << "seed " << seed << ", segment " << k;
            ASSERT_LE(pruned, least + 1e-9) << "seed " << seed << ", segment " << k << ", pruned";
            // Sphere tracing knows the value at the middle less the way.
            const double plain = evaluate(view(*program), segment.middle) - length;
            ASSERT_GE(bound, plain - 1e-5 * length - 1e-9) << "seed " << seed << ", segment " << k;
            useful += bound > plain + 0.5 * length ? 1 : 0;
        }
    }
    EXPECT_GT(useful, rounds(48));
}

TEST(Segment, AlongAHalfSpaceItIsTheNearerEnds) {
    Scene scene;
    Edit floor;
    floor.node.shape = Plane{};
    floor.node.transform.rotation = axis_angle({0, 0, 1}, 0.5f);
    scene.edits = {floor};
    const Program program = *compile(scene.source());
    const double c = std::cos(0.5), s = std::sin(0.5);
    const auto bound = [&](double height, double falls, double way) {  // along the floor, from `height` above it
        return least_on_segment(program, program.tape(), {-s * height, c * height, 0},
                                {c * way + s * falls, s * way - c * falls, 3 * way});
    };
    EXPECT_NEAR(bound(0.01, 0, 1e4), 0.01, 1e-3);  // the floor's own floats turn it by 6e-8
    EXPECT_NEAR(bound(2, 1.5, 1e4), 0.5, 2e-3);
    EXPECT_NEAR(bound(1e4, 5e3, 1), 5e3, 1e-3);
    EXPECT_LT(bound(2, 2.1, 1e4), 0);
}

TEST(Segment, AboveARowWithoutEndItIsTheHeight) {
    Scene scene;
    Edit row;
    row.node.shape = Sphere{.radius = 0.5f};
    row.node.domain.push_back(Repeat{.spacing = {2, 0, 2}});
    scene.edits = {row};
    const Program program = *compile(scene.source());
    EXPECT_NEAR(least_on_segment(program, program.tape(), {0, 0.6, 0}, {1e4, 0, 3e4}), 0.1, 1e-6);
    EXPECT_NEAR(least_on_segment(program, program.tape(), {0, 0.6, 0}, {1e4, 0.05, 3e4}), 0.05, 1e-6);
    EXPECT_LT(least_on_segment(program, program.tape(), {0, 0.6, 0}, {1e4, 0.2, 3e4}), 0);
}

}  // namespace
}  // namespace kiln::sdf
