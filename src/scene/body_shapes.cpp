// SPDX-License-Identifier: MIT

#include "scene/body_shapes.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <limits>

namespace kiln::scene {

namespace {

Result<std::shared_ptr<const sdf::Program>> program_of(World::Impl& world, std::span<const Edit> edits) {
    const std::lock_guard lock(world.mutex);
    const auto source = with_grids(edits, world.data.objects, world.data.folder, world.grids);
    if (!source) return source.error();
    auto program = sdf::compile(source->source());
    if (!program) return program.error();
    return std::make_shared<const sdf::Program>(std::move(*program));
}

}  // namespace

std::optional<physics::Convex> convex_of(std::span<const Edit> edits) {
    if (edits.size() != 1) return std::nullopt;
    const Edit& e = edits[0];
    const vec3 scale = e.node.transform.scale;
    if (e.hidden || e.node.kind != Node::Kind::Shape || !e.node.domain.empty() || scale.x != scale.y ||
        scale.x != scale.z)
        return std::nullopt;
    // Parameters are a shape's fields in the order of their declaration.
    const auto& p = e.node.shape.params;
    const float s = scale.x;
    switch (ShapeKind(e.node.shape.kind)) {
    case ShapeKind::Sphere:
        return physics::Convex::sphere(s * p[0]);
    case ShapeKind::Box:
        return physics::Convex::box({s * p[0], s * p[1], s * p[2]});
    case ShapeKind::Capsule:
        return physics::Convex::capsule(s * p[0], s * p[1]);
    case ShapeKind::Cylinder:
        return physics::Convex::cylinder(s * p[0], s * p[1]);
    default:
        return std::nullopt;
    }
}

std::vector<physics::Surface> surfaces_of(const SceneData& data) {
    std::vector<physics::Surface> out{{data.physics.friction, data.physics.restitution, data.physics.rolling_friction}};
    for (size_t i = 0; i < data.materials.size(); ++i) {
        const SceneData::Silent silent = i < data.silent.size() ? data.silent[i] : SceneData::Silent{};
        const Material& m = data.materials[i].second;
        out.push_back({silent.friction ? data.physics.friction : m.friction,
                       silent.restitution ? data.physics.restitution : m.restitution,
                       silent.rolling_friction ? data.physics.rolling_friction : m.rolling_friction});
    }
    if (out.size() == 1) out.clear();
    return out;
}

std::vector<Edit> ground_of(const World::Impl& world, const std::unordered_set<std::string>& owned) {
    std::vector<Edit> out;
    world.edits.each([&](uint32_t slot) {
        const Edit& e = *world.edits[slot].edit;
        if (!owned.contains(e.name)) out.push_back(e);
    });
    return out;
}

Result<std::shared_ptr<const field::ProgramField>> field_of(World::Impl& world, std::span<const Edit> edits) {
    auto program = program_of(world, edits);
    if (!program) return program.error();
    return std::make_shared<const field::ProgramField>(std::move(*program));
}

Result<Box3> changed_box(World::Impl& world, std::span<const Edit> before, std::span<const Edit> after) {
    size_t same = 0, last = 0;
    const size_t fewest = std::min(before.size(), after.size());
    while (same < fewest && before[same] == after[same]) ++same;
    while (last < fewest - same && before[before.size() - 1 - last] == after[after.size() - 1 - last]) ++last;
    Box3 box;
    for (const std::span<const Edit> list : {before, after}) {
        std::vector<Edit> alone(list.begin() + ptrdiff_t(same), list.end() - ptrdiff_t(last));
        float reach = 0;
        bool everywhere = false;
        for (Edit& e : alone) {
            reach = std::max(reach, e.blend_radius);
            everywhere = everywhere || e.op == Op::Intersect;  // takes away what lies outside it
            e.op = Op::Union;
        }
        const auto program = program_of(world, alone);
        if (!program) return program.error();
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        if (everywhere) return Box3{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
        for (const sdf::EditSpan& edit : (*program)->edits) box = box_union(box, edit.bounds.inflated(reach));
    }
    return box;
}

}  // namespace kiln::scene
