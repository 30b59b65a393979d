// SPDX-License-Identifier: MIT
// Simulation: what whoever plays asks of it and brings into it. A body that is launched is a part that came loose from nothing: an edit of
// the live world of its own, which settles where it comes to rest.

#include "scene/body_shapes.h"
#include "scene/format.h"
#include "scene/simulation.h"

#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln::scene {

namespace {

constexpr float kDensity = 2000;  // kg/m³, stone

}  // namespace

Result<void> Simulation::launch(Edit edit, vec3 velocity) {
    if (!std::isfinite(velocity.x) || !std::isfinite(velocity.y) || !std::isfinite(velocity.z))
        return Error{"launch: the velocity is not finite", ErrorKind::Usage};
    if (edit.op != Op::Union) return Error{"launch: a body is a union edit", ErrorKind::Usage};
    if (const auto world = live(); !world) return world.error();
    do edit.name = formatted("thrown{}", ++launched_);
    while (live_->find_edit(edit.name) || is_body(edit.name));
    edit.dynamic = true;
    const auto take_back = [&](const Error& error) {
        owned_.erase(edit.name);
        std::erase_if(live_->impl_->data.bodies, [&](const SceneBody& b) { return b.id == edit.name; });
        return error;
    };
    // A body of the live world first, so that it stands apart from the ground.
    owned_.insert(edit.name);
    live_->impl_->data.bodies.push_back({.id = edit.name, .edits = {edit.name}, .mesh = {}, .numbers = {}});
    if (auto done = change({.kind = CommandKind::Add, .edit = &edit}); !done) return take_back(done.error());
    const auto added = [&]() -> Result<Box3> {
        const Edit placed = *live_->find(*live_->find_edit(edit.name));
        const physics::Pose pose = frame_of(placed);
        const std::vector<Edit> own = in_frame_of_first({placed});
        auto field = field_of(*live_->impl_, own);
        if (!field) return field.error();
        const Box3 box = (*field)->bounds();
        if (!box.finite() || box.empty())
            return Error{"launch: a body has an end on every side; use a shape with one", ErrorKind::Usage};
        const SceneData& data = start_.impl_->data;
        physics::BodySettings s{.pose = pose,
                                .density = kDensity,
                                .friction = data.physics.friction,
                                .restitution = data.physics.restitution,
                                .surfaces = surfaces_of(data),
                                .continuous = true,
                                .linear_velocity = velocity};
        if (const auto convex = convex_of(own)) {
            s.shape = *convex;
        } else {
            auto bricks = field::BrickField::of_body(*field, voxel_size_);
            auto shape = physics::SdfShape::moving(std::move(*field), std::move(bricks));
            if (!shape) return shape.error();
            s.shape = std::move(*shape);
        }
        if (auto body = add(s, edit.name); !body) return body.error();
        members_.back().edits = own;
        members_.back().edit = edit.name;
        loose_.push_back({members_.size() - 1, placed, box});
        return box;
    }();
    if (added) return {};
    if (auto removed = change({.kind = CommandKind::Remove, .id = edit.name}); !removed)
        return take_back(removed.error());
    return take_back(added.error());
}

Result<RayHit> Simulation::cast(const Ray& ray) {
    const auto world = live();
    if (!world) return world.error();
    return (*world)->cast(ray);
}

// Bodies of meshes are in the engine alone, where the last step has them.
Result<PlayHit> Simulation::pick(const Ray& ray) {
    auto hit = cast(ray);
    if (!hit) return hit.error();
    PlayHit out{*hit};
    const auto own = [&](const Member& m) {
        const auto names = edits_of(m);
        const Edit* const edit = live_->find(out.hit.edit);
        return edit != nullptr && std::find(names.begin(), names.end(), edit->name) != names.end();
    };
    if (out.hit.hit)
        for (const Member& m : members_)
            if (!m.rest && !m.gone && own(m)) out.body = m.id;
    const float far = out.hit.hit ? out.hit.t : std::min(ray.t_max, kFarthest);
    const auto met =
        world_->cast_ray(ray.origin, ray.direction * far, visitor_ ? visitor_->character.body() : physics::BodyId{});
    if (!met) return out;
    const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
    for (size_t i = 0; i < bodies.size(); ++i) {
        if (bodies[i].mesh.empty() || members_[i].gone || members_[i].body != met->body) continue;
        out.body = members_[i].id;
        out.hit.hit = true;
        out.hit.t = met->fraction * far;
        out.hit.position = met->position;
        out.hit.normal = met->normal;
        out.hit.edit = {};
    }
    return out;
}

PlayCounts Simulation::counts() const {
    PlayCounts out{.parts = parts_};
    for (const Member& m : members_) {
        if (m.rest || m.gone || !(m.mass.mass > 0)) continue;
        ++out.bodies;
        if (!world_->state(m.body).asleep) ++out.awake;
    }
    return out;
}

}  // namespace kiln::scene
