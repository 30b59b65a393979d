// SPDX-License-Identifier: MIT
// Simulation: the scene's characters, which walk by what they wish. Pictures show them as capsules.

#include "scene/simulation.h"

#include <kiln/shapes.h>

#include <algorithm>

namespace kiln::scene {

Result<void> Simulation::add_characters() {
    const SceneData& data = start_.impl_->data;
    for (const SceneCharacter& c : data.characters) {
        const SceneCharacter::Numbers& n = c.numbers;
        const vec3 center = n.position + vec3{0, 0.5f * n.height, 0};
        auto made = physics::Character::make(*world_,
                                             {.radius = n.radius,
                                              .half_height = 0.5f * n.height - n.radius,
                                              .step_height = n.step_height,
                                              .steepest_deg = n.steepest_deg,
                                              .gravity = data.physics.gravity},
                                             center);
        if (!made) return fault(c.place, c.id, made.error().message);
        names_.emplace(made->body(), c.id);
        walkers_.push_back({.id = c.id, .character = std::move(*made), .of = &c, .before = center});
    }
    return {};
}

// In the live world each is a body's only edit, so that it stands apart whatever is dug and built.
Result<void> Simulation::show_characters() {
    for (Walker& w : walkers_) {
        const SceneCharacter::Numbers& n = w.of->numbers;
        Edit edit;
        edit.name = w.id + " (character)";
        while (live_->find_edit(edit.name)) edit.name += '\'';
        edit.node.shape = Capsule{.half_height = 0.5f * n.height - n.radius, .radius = n.radius};
        edit.node.transform.position = n.position + vec3{0, 0.5f * n.height, 0};
        w.shown = edit.name;
        owned_.insert(edit.name);
        live_->impl_->data.bodies.push_back(
            {.id = w.id, .edits = {edit.name}, .mesh = {}, .motion = SceneBody::Motion::Kinematic, .numbers = {}});
        if (const auto added = live_->add(std::move(edit)); !added) return added.error();
    }
    return {};
}

void Simulation::walk() {
    const double now = time();
    for (Walker& w : walkers_) {
        w.before = w.character.position();
        float jump = 0;
        for (; w.next < w.of->path.size() && double(w.of->path[w.next].time) <= now + 1e-6; ++w.next) {
            const SceneCharacter::Wish& wish = w.of->path[w.next];
            const vec3 level{wish.direction.x, 0, wish.direction.z};
            w.walk = level * (w.of->numbers.speed / std::max(1.0f, length(level)));
            jump = wish.jump;
        }
        w.character.move(w.walk, jump, seconds_);
    }
}

}  // namespace kiln::scene
