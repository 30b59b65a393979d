// SPDX-License-Identifier: MIT
// Collision straight on a field: of convex bodies, of another field's surface, and sweeps. Both backends ask here, so they see the same
// contacts. Everything is in the field's own frame, metres. Any thread.
//
// A contact is a point of the body where the field is smallest, found by descent on the field over the body (Macklin, Erleben, Müller,
// Chentanez, Jeschke and Corse, "Local Optimization for Robust Signed Distance Field Collision", 2020; there by Frank-Wolfe steps, here
// by projected gradients, since our convex bodies have closed-form projections, which do not zigzag on a face). No triangles, so no
// inner edges to stumble over.
#pragma once

#include "field/sdf_field.h"
#include "physics/convex.h"
#include "physics/pose.h"
#include "physics/sdf_shape.h"

#include <optional>
#include <vector>

namespace kiln::physics {

struct FieldContact {
    vec3 point;       ///< on the body's surface
    vec3 normal;      ///< unit, out of the field's solid
    float depth = 0;  ///< metres into the solid, first order: -distance / |gradient|; negative where they are apart
};
/// How far apart contacts are looked for, metres: kMargin, and for two fields as far as they come nearer in a step, up to kMostReach.
inline constexpr float kMargin = 0.02f, kMostReach = 0.2f;
inline float reach_of(float way) { return way < kMargin ? kMargin : way < kMostReach ? way : kMostReach; }
/// Contacts deeper than this say this: a body that was built over is pushed out at a walking pace, not shot out.
inline constexpr float kMostDepth = 0.2f;
inline constexpr size_t kMostContacts = 24;
/// Two contacts nearer than this share of the body's radius, with normals whose cosine is larger (5 degrees), are one.
inline constexpr float kSamePlace = 0.02f, kSameNormal = 0.996f;

/// Contacts no farther apart than `margin`, deepest of each place first.
void collide(const field::SdfField& field, const Convex& body, const Pose& field_from_body, float margin,
             std::vector<FieldContact>& out);

/// The same of a shape: contacts are looked for on its bricks, then measured on its field, so that neither a voxel's facets nor its rounding
/// of edges is felt.
void collide(const SdfShape& shape, const Convex& body, const Pose& shape_from_body, float margin,
             std::vector<FieldContact>& out);

/// Contacts that were found on interpolated values, or on triangles, as the exact field has them; kMostContacts at most. Those farther apart
/// than the margin go.
void measure(const SdfShape& shape, float margin, std::vector<FieldContact>& contacts);
/// Moves contacts of a ball to where they are deepest, each from where it is; those that come to one place are one.
void settle_ball(const SdfShape& shape, vec3 center, float radius, float margin, std::vector<FieldContact>& contacts);

/// Of two shapes with surface points (a world without them may be `b`): in b's frame, points on a's surface for contacts from a's
/// points and on b's for b's; normals out of b's solid. At most kMostContacts, no two at one place.
void collide(const SdfShape& a, const SdfShape& b, const Pose& b_from_a, float margin, std::vector<FieldContact>& out);

struct FieldHit {
    float fraction = 0;  ///< of the way
    vec3 point, normal;
};
/// The first place on origin + fraction · way, fraction in [0, most], with distance <= 0.
std::optional<FieldHit> cast_ray(const field::SdfField& field, vec3 origin, vec3 way, float most = 1);
/// The same for a body that moves without turning, by conservative advancement; `point` is where they touch. A body that starts in
/// touch is hit at fraction 0 unless it moves away.
std::optional<FieldHit> sweep(const field::SdfField& field, const Convex& body, const Pose& field_from_body, vec3 way,
                              float most = 1);

}  // namespace kiln::physics
