// SPDX-License-Identifier: MIT
// Convex bodies in their own frame: what collision with a field asks of them. Centred at the origin, +Y is the axis.
#pragma once

#include <kiln/math.h>

#include <array>
#include <cstdint>

namespace kiln::physics {

struct Convex {
    enum class Kind : uint8_t { Sphere, Box, Capsule, Cylinder };
    Kind kind = Kind::Sphere;
    /// Sphere: x is the radius. Box: half extents. Capsule and cylinder: x is the radius, y half the height (a capsule's: of its segment).
    vec3 size{0.5f, 0.5f, 0.5f};

    static Convex sphere(float radius) { return {Kind::Sphere, {radius, radius, radius}}; }
    static Convex box(vec3 half_extents) { return {Kind::Box, half_extents}; }
    static Convex capsule(float half_height, float radius) { return {Kind::Capsule, {radius, half_height, radius}}; }
    static Convex cylinder(float half_height, float radius) { return {Kind::Cylinder, {radius, half_height, radius}}; }
};

/// Half the box around it.
vec3 half_extents(const Convex& c);
/// Of the ball around it, and of the largest ball in it, both about the origin.
float outer_radius(const Convex& c);
float inner_radius(const Convex& c);
double volume(const Convex& c);
/// Principal moments about the origin for a mass of 1 kg, kg m².
dvec3 moments(const Convex& c);

/// How far the solid goes from the origin along the unit vector d: the largest dot product of d and a point of it.
float reach(const Convex& c, vec3 d);
/// The point of the solid nearest to p.
vec3 project(const Convex& c, vec3 p);

inline constexpr int kMostCorners = 8;
/// Corners of the face, edge or point that lies farthest towards the unit vector d, around it in order. Round faces have 8.
int face(const Convex& c, vec3 d, std::array<vec3, kMostCorners>& corners);

inline constexpr int kStarts = 7;
/// The origin, and where the axes leave the solid.
std::array<vec3, kStarts> starts(const Convex& c);

}  // namespace kiln::physics
