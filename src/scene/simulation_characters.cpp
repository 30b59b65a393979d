// SPDX-License-Identifier: MIT
// Simulation: the scene's characters, which walk by what they wish. Pictures show them as capsules.

#include "scene/simulation.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <cmath>
#include <utility>

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
                                              .gravity = data.physics.gravity,
                                              .fall = n.linear_velocity.y},
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
    if (!visitor_) return;
    visitor_->before = visitor_->character.position();
    visitor_->character.move(visitor_->walk, std::exchange(visitor_->jump, 0.0f), seconds_);
}

Result<void> Simulation::enter(vec3 feet) {
    leave();
    const physics::CharacterSettings settings{.gravity = start_.impl_->data.physics.gravity};
    const vec3 center = feet + vec3{0, settings.half_height + settings.radius, 0};
    auto made = physics::Character::make(*world_, settings, center);
    if (!made) return made.error();
    std::string name = "player";
    while (is_body(name)) name += '\'';
    names_.emplace(made->body(), name);
    visitor_.emplace(Visitor{.character = std::move(*made), .before = center});
    return {};
}

void Simulation::wish(vec3 velocity, float jump) {
    if (!visitor_) return;
    const auto number = [](float v) { return std::isfinite(v) ? v : 0; };
    visitor_->walk = {number(velocity.x), 0, number(velocity.z)};
    visitor_->jump = std::max(visitor_->jump, number(jump));
}

void Simulation::leave() {
    if (visitor_) visitor_->character.leave();
    visitor_.reset();
}

std::optional<PlayWalker> Simulation::visitor(float between) const {
    if (!visitor_) return std::nullopt;
    const physics::CharacterSettings settings;
    const physics::Character& c = visitor_->character;
    const vec3 center = visitor_->before * (1 - between) + c.position() * between;
    return PlayWalker{center - vec3{0, settings.half_height + settings.radius, 0}, c.on_floor()};
}

}  // namespace kiln::scene
