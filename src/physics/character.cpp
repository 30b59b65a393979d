// SPDX-License-Identifier: MIT

#include "physics/character.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::physics {

namespace {

constexpr float kSkin = 0.01f;  // metres kept free around it, so that sweeps start clear
constexpr int kMostSlides = 5, kMostPushes = 8;
constexpr float kBehind = 0.03f;
constexpr float kMostPush = 0.1f;  // metres in a step: out of what was built over it, at a walking pace

vec3 level(vec3 v) { return {v.x, 0, v.z}; }

}  // namespace

Result<Character> Character::make(World& world, const CharacterSettings& settings, vec3 position) {
    Character out;
    out.world_ = &world;
    out.settings_ = settings;
    out.capsule_ = Convex::capsule(settings.half_height, settings.radius);
    auto body = world.add({.shape = out.capsule_, .motion = Motion::Kinematic, .pose = {position, {}}});
    if (!body) return body.error();
    out.body_ = *body;
    out.position_ = position;
    out.fall_ = settings.fall;
    if (settings.fall == 0) {
        std::optional<BodyHit> hit;
        (void)out.go(position, {0, -2 * kSkin, 0}, &hit);
        if (hit && out.holds(*hit)) out.floor_ = hit;
    }
    return out;
}

bool Character::walkable(vec3 normal) const {
    return normal.y > std::cos(settings_.steepest_deg * std::numbers::pi_v<float> / 180);
}

// Whether it can stand on what it came down on. The round end meets an edge at a slant: what counts is the floor behind the edge.
bool Character::holds(const BodyHit& hit) const {
    if (walkable(hit.normal)) return true;
    if (!(hit.normal.y > 0)) return false;
    const vec3 behind = level(-hit.normal), from = hit.position + behind * (kBehind / std::max(length(behind), 1e-4f));
    const auto floor = world_->cast_ray({from.x, from.y + 2 * kBehind, from.z}, {0, -3 * kBehind, 0}, body_);
    return floor && floor->fraction > 0 && walkable(floor->normal);
}

std::optional<BodyHit> Character::sweep(vec3 from, vec3 way) const {
    return world_->sweep(capsule_, {from, {}}, way, body_);
}

vec3 Character::go(vec3 from, vec3 way, std::optional<BodyHit>* hit) const {
    const float size = length(way);
    *hit = std::nullopt;
    if (!(size > 1e-6f)) return from;
    // As far as the skin further, then back by it.
    const vec3 along = way / size;
    const auto found = sweep(from, along * (size + kSkin));
    if (!found) return from + way;
    const float reach = found->fraction * (size + kSkin);
    // A wall met at a slant is nearer along the way than the skin is thick.
    const float against = std::max(-dot(found->normal, along), 0.1f);
    if (reach - kSkin / against >= size) return from + way;
    *hit = found;
    return from + along * std::max(reach - kSkin / against, 0.0f);
}

vec3 Character::slide(vec3 from, vec3 way) const {
    vec3 at = from, left = way;
    vec3 walls[kMostSlides];
    for (int i = 0; i < kMostSlides; ++i) {
        std::optional<BodyHit> hit;
        const vec3 next = go(at, left, &hit);
        left = left - (next - at);
        at = next;
        if (!hit) break;
        // What is too steep to stand on is a wall: it does not lift.
        vec3 n = hit->normal;
        if (!walkable(n) && n.y > 0) {
            const float across = length(level(n));
            if (across > 1e-4f) n = level(n) / across;
        }
        walls[i] = n;
        left = left - n * std::min(dot(left, n), 0.0f);
        for (int k = 0; k < i; ++k) {
            if (dot(left, walls[k]) >= -1e-6f) continue;
            // Into a corner: along the crease of both, or not at all.
            const vec3 crease = cross(n, walls[k]);
            const float size2 = dot(crease, crease);
            left = size2 > 1e-6f ? crease * (dot(left, crease) / size2) : vec3{};
        }
        if (dot(left, way) <= 0) break;
    }
    return at;
}

vec3 Character::step_over(vec3 from, vec3 way, vec3 slid) const {
    std::optional<BodyHit> hit;
    const vec3 up = go(from, {0, settings_.step_height, 0}, &hit);
    const vec3 there = slide(up, level(way));
    // It must get somewhere, and come down on something to stand on that is no higher than a step: not on the edge of a wall either.
    if (length(level(there - from)) < length(level(slid - from)) + 1e-3f) return slid;
    const vec3 down = go(there, {0, from.y - up.y - kSkin, 0}, &hit);
    const float feet = from.y - settings_.half_height - settings_.radius;
    return hit && hit->position.y <= feet + settings_.step_height && holds(*hit) ? down : slid;
}

vec3 Character::pushed_out(vec3 from) const {
    vec3 at = from;
    for (int i = 0; i < kMostPushes; ++i) {
        const auto contacts = world_->contacts(capsule_, {at, {}}, 0, body_);
        const BodyContact* deepest = nullptr;
        for (const BodyContact& c : contacts)
            if (c.depth > 1e-3f && (deepest == nullptr || c.depth > deepest->depth)) deepest = &c;
        if (deepest == nullptr) break;
        at = at + deepest->normal * std::min(deepest->depth + kSkin, kMostPush);
        const vec3 moved = at - from;
        if (length(moved) >= kMostPush) return from + moved * (kMostPush / length(moved));
    }
    return at;
}

void Character::move(vec3 walk, float jump, float seconds) {
    const vec3 before = position_;
    // What it stands on carries it: the velocity of the point under its feet.
    vec3 carried;
    if (floor_ && world_->contains(floor_->body)) carried = world_->velocity_at(floor_->body, floor_->position);
    const bool stood = floor_.has_value();
    if (stood) fall_ = 0;
    const bool leaps = stood && jump > 0;
    fall_ = (leaps ? jump : fall_) + (stood && !leaps ? 0 : settings_.gravity.y * seconds);
    vec3 at = pushed_out(position_);
    if (length(carried) > 0) at = slide(at, carried * seconds);
    if (const vec3 way = level(walk) * seconds; length(way) > 0) {
        const vec3 slid = slide(at, way);
        const bool blocked = length(level(slid - at)) < 0.99f * length(way);
        at = stood && blocked ? step_over(at, way, slid) : slid;
    }
    std::optional<BodyHit> hit;
    floor_ = std::nullopt;
    if (stood && !leaps) {
        // Keep to the floor, down a step too; where there is none it falls from the next step on, as bodies do.
        const vec3 down = go(at, {0, -settings_.step_height - 2 * kSkin, 0}, &hit);
        if (hit && holds(*hit)) {
            at = down;
            floor_ = hit;
        } else {
            fall_ += settings_.gravity.y * seconds;
            at = slide(at, {0, fall_ * seconds, 0});
        }
    } else {
        const vec3 next = go(at, {0, fall_ * seconds, 0}, &hit);
        const vec3 rest{0, fall_ * seconds - (next.y - at.y), 0};
        at = next;
        if (hit && fall_ <= 0 && holds(*hit)) {
            floor_ = hit;
            fall_ = 0;
        } else if (hit) {
            if (fall_ > 0) fall_ = 0;
            // Down along what is too steep.
            const vec3 n = hit->normal;
            at = slide(at, rest - n * std::min(dot(rest, n), 0.0f));
        }
    }
    position_ = at;
    velocity_ = (position_ - before) / seconds;
    world_->set_pose(body_, {before, {}});
    world_->set_velocity(body_, velocity_, {});  // the step takes the kinematic body there
}

}  // namespace kiln::physics
