// SPDX-License-Identifier: MIT
// Character: an upright capsule that walks. Its own code on sweeps and contacts of the world (physics.h), not an engine's, so it walks
// alike on all of them: it slides along walls, steps up, keeps to the floor going down, rides what moves, and falls where the floor goes.
// For bodies it is a kinematic capsule: they bounce off it, it does not feel their weight.
//
// Sliding: Fauerby, "Improved Collision Detection and Response", 2003.
#pragma once

#include "physics/physics.h"

namespace kiln::physics {

struct CharacterSettings {
    float radius = 0.3f;
    float half_height = 0.55f;  ///< of the capsule's segment
    float step_height = 0.3f;   ///< what it steps onto, metres
    float steepest_deg = 50;    ///< of a floor that it stands on
    vec3 gravity{0, -9.81f, 0};
    float fall = 0;  ///< vertical speed at the start, m/s; at 0 it stands where there is a floor under its feet
};

/// Owner's thread, between steps. The world must outlive it, or forget it first (leave()).
class Character {
public:
    /// `position` is the capsule's centre. Refused as any body is.
    static Result<Character> make(World& world, const CharacterSettings& settings, vec3 position);

    /// One step of `seconds`: `walk` is the wanted horizontal velocity, m/s; `jump` the speed upwards that it leaves the floor with, 0
    /// for none. Call it before World::step.
    void move(vec3 walk, float jump, float seconds);
    void leave() { world_->remove(body_); }

    vec3 position() const { return position_; }
    vec3 velocity() const { return velocity_; }        ///< of the last move, what carries it included
    float fall() const { return floor_ ? 0 : fall_; }  ///< its own vertical speed, m/s
    bool on_floor() const { return floor_.has_value(); }
    BodyId floor() const { return floor_ ? floor_->body : BodyId{}; }  ///< what it stands on
    BodyId body() const { return body_; }

private:
    Character() = default;
    bool walkable(vec3 normal) const;
    bool holds(const BodyHit& hit) const;
    std::optional<BodyHit> sweep(vec3 from, vec3 way) const;
    /// How far along `way` it gets before it touches, leaving the skin free; where it ends.
    vec3 go(vec3 from, vec3 way, std::optional<BodyHit>* hit) const;
    vec3 slide(vec3 from, vec3 way) const;
    vec3 step_over(vec3 from, vec3 way, vec3 slid) const;
    vec3 pushed_out(vec3 from) const;

    World* world_ = nullptr;
    CharacterSettings settings_;
    Convex capsule_;
    BodyId body_;
    vec3 position_, velocity_;
    float fall_ = 0;  // vertical speed of its own
    std::optional<BodyHit> floor_;
};

}  // namespace kiln::physics
