// SPDX-License-Identifier: MIT
// Fields and bodies for the tests of physics.
#pragma once

#include "field/brick_field.h"
#include "physics/physics.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

namespace kiln::physics::worlds {

inline Edit edit(kiln::Shape shape, vec3 position = {}, Op op = Op::Union, float blend = 0) {
    Edit e;
    e.node.shape = std::move(shape);
    e.node.transform.position = position;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

inline std::shared_ptr<const field::ProgramField> field_of(const std::vector<Edit>& edits) {
    auto program = sdf::compile({edits, {}, {}});
    EXPECT_TRUE(program) << (program ? "" : program.error().message);
    return std::make_shared<field::ProgramField>(
        std::make_shared<const sdf::Program>(program ? std::move(*program) : sdf::Program{}));
}

/// As `simulate` makes them: contacts are found on bricks.
inline constexpr float kVoxel = 0.1f;
inline std::shared_ptr<const SdfShape> fixed(const std::vector<Edit>& edits, float voxel_size = kVoxel) {
    auto exact = field_of(edits);
    return SdfShape::fixed(exact, std::make_shared<field::BrickField>(
                                      exact, field::BrickFieldOptions{.voxel_size = voxel_size, .near = 0.5f}));
}
inline std::shared_ptr<const SdfShape> moving(const std::vector<Edit>& edits) {
    auto exact = field_of(edits);
    auto made = SdfShape::moving(exact, field::BrickField::of_body(exact, kVoxel));
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return made ? *made : nullptr;
}

/// Of every engine that runs here.
inline std::vector<std::string> engines() {
    std::vector<std::string> out;
    for (const Backend& b : backends())
        if (b.why_not.empty()) out.emplace_back(b.name);
    return out;
}

inline constexpr float kStep = 1.0f / 60;
inline constexpr float kGravity = 9.81f;
inline constexpr float kPi = std::numbers::pi_v<float>;

struct Scene {
    std::unique_ptr<World> world;
    explicit Scene(const std::string& engine, vec3 gravity = {0, -kGravity, 0}) {
        auto made = make_world(engine, {.gravity = gravity});
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        world = std::move(*made);
    }
    BodyId add(const BodySettings& s) {
        auto id = world->add(s);
        EXPECT_TRUE(id) << (id ? "" : id.error().message);
        return id ? *id : BodyId{};
    }
    BodyId ground(const std::vector<Edit>& edits, float friction = 0.5f, float restitution = 0) {
        return add({.shape = fixed(edits), .motion = Motion::Static, .friction = friction, .restitution = restitution});
    }
    void run(float seconds) {
        for (int i = 0; i < int(std::lround(seconds / kStep)); ++i) world->step(kStep);
    }
    float deepest() const {
        float out = 0;
        for (const World::Touch& t : world->touches()) out = std::max(out, t.depth);
        return out;
    }
};

/// Base of fixtures: the parameter is an engine's name.
struct Engines : testing::TestWithParam<std::string> {};
#define KILN_EACH_ENGINE(Suite)                                                                   \
    INSTANTIATE_TEST_SUITE_P(Engines, Suite, testing::ValuesIn(kiln::physics::worlds::engines()), \
                             [](const auto& i) { return i.param; })

// The same convex solid as an exact shape and as a field.
struct Solid {
    std::string name;
    Convex convex;
    kiln::Shape shape;
    BodyShape exact() const { return convex; }
    BodyShape field() const { return moving({edit(shape)}); }
};
inline std::vector<Solid> solids() {
    return {{"sphere", Convex::sphere(0.5f), kiln::Sphere{.radius = 0.5f}},
            {"box", Convex::box({0.5f, 0.5f, 0.5f}), kiln::Box{.half_extents = {0.5f, 0.5f, 0.5f}}},
            {"capsule", Convex::capsule(0.5f, 0.3f), kiln::Capsule{.half_height = 0.5f, .radius = 0.3f}},
            {"cylinder", Convex::cylinder(0.3f, 0.4f), kiln::Cylinder{.half_height = 0.3f, .radius = 0.4f}}};
}

inline Edit inclined_plane(float degrees) {
    // Falls towards +X.
    Edit e = edit(Plane{});
    e.node.transform.rotation = axis_angle({0, 0, 1}, -degrees * kPi / 180);
    return e;
}

// The lower half of a hollow ring, cut out of a block.
inline std::vector<Edit> ring_trough() {
    return {edit(kiln::Box{.half_extents = {6.5f, 1.5f, 6.5f}}, {0, -1.5f, 0}),
            edit(kiln::Torus{.major_radius = 4, .minor_radius = 2}, {}, Op::Subtract)};
}

// How far along the slope, and how fast.
inline vec3 downhill(float degrees) { return {std::cos(degrees * kPi / 180), -std::sin(degrees * kPi / 180), 0}; }
inline vec3 out_of(float degrees) { return {std::sin(degrees * kPi / 180), std::cos(degrees * kPi / 180), 0}; }

}  // namespace kiln::physics::worlds
