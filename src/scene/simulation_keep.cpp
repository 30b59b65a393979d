// SPDX-License-Identifier: MIT
// Simulation: what it has become, as a scene that starts there. Ground and parts are commands that there are already; where things are and
// how fast they are is said as the scene says it: by the edits and meshes that they are seen by, and by the sections of bodies and
// characters. What came loose, or was thrown, and has not settled is a body of that scene.

#include "scene/command.h"
#include "scene/simulation.h"

#include "base/format.h"

#include <algorithm>
#include <utility>

namespace kiln::scene {

namespace {

vec3 without_minus_zero(vec3 v) { return v + vec3{}; }

}  // namespace

std::vector<SceneMesh> Simulation::meshes_now() const {
    std::vector<SceneMesh> out = start_.impl_->data.meshes;
    const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
    for (size_t i = 0; i < bodies.size(); ++i) {
        const Member& m = members_[i];
        const physics::Pose pose = state(m).pose;
        if (bodies[i].mesh.empty() || (m.edit.empty() && pose == m.began)) continue;
        for (SceneMesh& mesh : out) {
            if (mesh.id != bodies[i].mesh) continue;
            mesh.hidden = mesh.hidden || !m.edit.empty() || m.gone;
            mesh.transform.position = without_minus_zero(pose.position);
            mesh.transform.rotation = pose.rotation;
        }
    }
    return out;
}

// Those of the start but for what was cut away whole or has settled, then what is loose.
std::vector<SceneBody> Simulation::bodies_now() const {
    std::vector<SceneBody> out;
    const auto moving = [&](SceneBody body, const Member& m) {
        const physics::BodyState now = world_->state(m.body);
        body.numbers.linear_velocity = without_minus_zero(now.linear_velocity);
        body.numbers.angular_velocity = without_minus_zero(now.angular_velocity);
        out.push_back(std::move(body));
    };
    const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
    for (size_t i = 0; i < bodies.size(); ++i)
        if (!members_[i].gone && !members_[i].rest) {
            SceneBody body = bodies[i];
            // Cut, it is its solid.
            if (!body.mesh.empty() && !members_[i].edit.empty()) body.edits = {members_[i].edit}, body.mesh.clear();
            moving(std::move(body), members_[i]);
        }
    for (const Part& part : loose_) {
        if (part.member < bodies.size()) continue;
        const Member& m = members_[part.member];
        const physics::BodySettings& s = *world_->settings(m.body);
        moving({.id = m.id,
                .edits = {m.edit},
                .mesh = {},
                .motion = SceneBody::Motion(s.motion),
                .continuous = s.continuous,
                .numbers = {.density = s.density,
                            .friction = s.friction,
                            .restitution = s.restitution,
                            .linear_damping = s.linear_damping,
                            .angular_damping = s.angular_damping,
                            .linear_velocity = {},
                            .angular_velocity = {},
                            .rolling_friction = s.rolling_friction},
                .of_materials = !s.surfaces.empty(),
                .settles = true},
               m);
    }
    return out;
}

// Time begins anew: what is wished now is wished from 0 on.
std::vector<SceneCharacter> Simulation::characters_now() const {
    std::vector<SceneCharacter> out;
    for (const Walker& w : walkers_) {
        SceneCharacter c = *w.of;
        c.numbers.position = without_minus_zero(w.character.position() - vec3{0, 0.5f * c.numbers.height, 0});
        c.numbers.linear_velocity = without_minus_zero({0, w.character.fall(), 0});
        c.path.clear();
        if (w.next > 0) c.path.push_back({.time = 0, .direction = w.of->path[w.next - 1].direction, .jump = 0});
        for (size_t k = w.next; k < w.of->path.size(); ++k) {
            SceneCharacter::Wish wish = w.of->path[k];
            wish.time = float(std::max(double(wish.time) - time(), 0.0));
            c.path.push_back(wish);
        }
        out.push_back(std::move(c));
    }
    return out;
}

Result<void> Simulation::keep_motion(World& world) const {
    // A body's edits move with its first.
    const auto put = [&](const Member& m, const std::string& name) -> Result<void> {
        const auto id = world.find_edit(name);
        if (!id) return Error{formatted("keep: there is no edit \"{}\"", name), ErrorKind::Usage};
        const physics::Pose pose = state(m).pose;
        if (pose == m.began) return {};
        Edit edit = *world.find(*id);
        const physics::Pose frame = frame_of(edit);
        const physics::Pose now = frame == m.began ? pose : pose * inverse(m.began) * frame;
        edit.node.transform.position = now.position;
        edit.node.transform.rotation = now.rotation;
        return world.change(*id, edit);
    };
    const std::vector<SceneBody>& bodies = start_.impl_->data.bodies;
    for (size_t i = 0; i < bodies.size(); ++i) {
        if (members_[i].gone || members_[i].rest) continue;
        std::vector<std::string> names = bodies[i].edits;
        if (!bodies[i].mesh.empty() && !members_[i].edit.empty()) names = {members_[i].edit};
        for (const std::string& name : names)
            if (auto done = put(members_[i], name); !done) return done;
    }
    for (const Part& part : loose_)
        if (part.member >= bodies.size())
            if (auto done = put(members_[part.member], members_[part.member].edit); !done) return done;
    // A section is a command where it is not what the world has.
    SceneData now;
    now.meshes = meshes_now();
    now.bodies = bodies_now();
    now.characters = characters_now();
    for (const CommandKind kind : {CommandKind::Meshes, CommandKind::Bodies, CommandKind::Characters}) {
        const std::string text = write_command(now, {}, {.kind = kind});
        if (text == write_command(world.impl_->data, {}, {.kind = kind})) continue;
        if (auto done = world.apply(text, "keep"); !done) return done;
    }
    return {};
}

Result<void> Simulation::keep(World& world) const {
    History history = world.history();
    history.begin_group("play");
    const auto all = [&]() -> Result<void> {
        for (const std::string& command : made_)
            if (auto applied = world.apply(command, "keep"); !applied) return applied;
        return keep_motion(world);
    };
    if (auto done = all(); !done) {
        (void)history.cancel_group();
        return done;
    }
    return history.end_group();
}

}  // namespace kiln::scene
