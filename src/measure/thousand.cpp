// SPDX-License-Identifier: MIT
#include "measure/thousand.h"

#include "measure/recipes.h"

#include "field/brick_set.h"
#include "field/field.h"
#include "sdf/program.h"

namespace kiln {
namespace {

using measure::uniform;

constexpr uint32_t kThings = 1000, kHills = 9, kSeed = 11;
constexpr float kVoxel = 0.03f;

Edit edit_of(Shape shape) {
    Edit out;
    out.node.shape = std::move(shape);
    return out;
}

Pose pose_of(uint32_t i) {
    const auto in = [&](uint32_t k, float least, float most) { return least + (most - least) * uniform(kSeed, i, k); };
    const vec3 axis{in(3, -1, 1), in(4, -1, 1), in(5, 0.1f, 1)};
    return {{in(0, -3.8f, 3.8f), in(1, 0.05f, 0.8f), in(2, -3.8f, 3.8f)}, axis_angle(normalize(axis), in(6, -3, 3))};
}

Result<std::shared_ptr<const field::Field>> field_of(const std::vector<Edit>& edits) {
    auto program = sdf::compile({edits, {}, {}});
    if (!program) return program.error();
    return field::Field::build(std::make_shared<const sdf::Program>(std::move(*program)),
                               {.voxel_size = kVoxel, .bounds = {{-4, -0.5f, -4}, {4, 1.5f, 4}}});
}

}  // namespace

Result<Thousand> thousand(bool from_above) {
    std::vector<Edit> edits{edit_of(Plane{})};
    for (uint32_t i = 0; i < kHills; ++i) {
        Edit hill = edit_of(Ellipsoid{.radii = {0.5f, 0.4f, 0.9f}});
        hill.node.transform.position = {-3.2f + 0.8f * float(i), 0, i % 2 == 0 ? 0.6f : -0.8f};
        edits.push_back(std::move(hill));
    }
    const Edit kinds[] = {edit_of(Sphere{.radius = 0.09f}), edit_of(Box{.half_extents = {0.1f, 0.06f, 0.08f}}),
                          edit_of(Torus{.major_radius = 0.08f, .minor_radius = 0.03f})};
    Thousand out;
    auto ground = field_of(edits);
    if (!ground) return ground.error();
    std::vector<std::shared_ptr<const field::BrickSet>> sets;
    for (const Edit& kind : kinds) {
        auto program = sdf::compile({std::span(&kind, 1), {}, {}});
        if (!program) return program.error();
        auto set = field::BrickSet::make(std::make_shared<const sdf::Program>(std::move(*program)), kVoxel);
        if (!set) return set.error();
        sets.push_back(*set);
    }
    for (uint32_t i = 0; i < kThings; ++i) {
        const Pose pose = pose_of(i);
        Edit thing = kinds[i % 3];
        thing.node.transform.position = pose.position;
        thing.node.transform.rotation = pose.rotation;
        edits.push_back(std::move(thing));
        out.moving.instances.push_back({.bricks = sets[i % 3], .pose = pose, .before = pose});
    }
    auto all = field_of(edits);
    if (!all) return all.error();
    for (Frame* frame : {&out.still, &out.moving}) {
        frame->field = frame == &out.still ? *all : *ground;
        frame->materials.resize(1);
        frame->lights.emplace_back();
        frame->environment = Environment{};
        frame->camera.position = from_above ? vec3{0, 5, 4.5f} : vec3{0.3f, 0.7f, 3.9f};
        frame->camera.target = {0, 0.2f, 0};
    }
    return out;
}

}  // namespace kiln
