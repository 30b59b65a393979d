// SPDX-License-Identifier: MIT
// Questions a program can ask of a world's field: distance, normal, material, rays, moving balls, overlaps, the nearest point.
// Exact answers come from the edits themselves; no mesh, no GPU. Everything here is plain data or may be called from any thread.
// World units: metres. Numbers that are not finite are answered like places where nothing is.
#pragma once

#include <kiln/edit.h>
#include <kiln/math.h>

#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace kiln {

/// Answer at one point, world space.
struct FieldSample {
    float distance = 0;   ///< metres, negative inside; the ordered program's value, a lower bound of the true distance
    vec3 normal;          ///< unit gradient of the distance; (0, 0, 0) where it vanishes or nothing exists
    MaterialId material;  ///< the heaviest material at the point; none in an empty world
};

struct Ray {
    vec3 origin;
    vec3 direction{0, 0, -1};  ///< unit length
    float t_max = 1e30f;       ///< metres
};

struct RayHit {
    bool hit = false;
    float t = 0;  ///< metres along the ray
    vec3 position;
    vec3 normal;  ///< unit; (0, 0, 0) where the gradient vanishes
    EditId edit;  ///< the edit with the largest share at the hit, ties to the later
};

/// The surface point nearest to another point.
struct NearestPoint {
    bool found = false;  ///< false: the world has no surface, or none as near as was asked
    float distance =
        0;  ///< metres, negative when the point asked is inside; the true distance, on both sides of the surface
    float error =
        0;  ///< metres: no surface point is nearer than |distance| - error; at most 5e-5 for worlds of some metres
    vec3 position;          ///< on the surface
    vec3 normal;            ///< unit gradient of the true distance at the point asked
    MaterialId material{};  ///< the heaviest at `position`
    EditId edit{};          ///< the edit with the largest share at `position`
};

/// Where a question is answered from.
enum class FieldSource : uint8_t {
    Exact,   ///< the full ordered list of edits
    Bricks,  ///< the baked bricks (points: trilinear), exact edits where no brick is
};

/// A world's field as it was when the view was taken: changes to the world do not reach it. Cheap to copy; every function may be
/// called from any thread, also while the world changes. Distances are those of the ordered program except where `nearest` is said.
class WorldView {
public:
    /// +infinity in an empty world.
    float distance(vec3 p_world) const;
    /// out.size() must be p_world.size().
    void distance(std::span<const vec3> p_world, std::span<float> out) const;
    FieldSample sample(vec3 p_world) const;
    std::vector<FieldSample> sample(std::span<const vec3> p_world) const;

    /// First solid point along the ray; t = 0 where it starts in solid.
    RayHit cast(const Ray& ray) const;
    std::vector<RayHit> cast(std::span<const Ray> rays) const;
    /// A ball of `radius` metres whose centre moves along the ray until it touches solid: `t` is the centre's way, `position` the
    /// point touched, `normal` points from there to the centre. Radius 0 is cast().
    RayHit cast_sphere(const Ray& ray, float radius) const;

    /// True nearest surface point within `within` metres, inside and outside. Searches: microseconds where the program's value is
    /// the true distance, milliseconds deep inside unions and in blends.
    NearestPoint nearest(vec3 p_world, float within = std::numeric_limits<float>::infinity()) const;
    std::vector<NearestPoint> nearest(std::span<const vec3> p_world,
                                      float within = std::numeric_limits<float>::infinity()) const;

    /// Whether a solid point lies in the ball, or in the box (its half extents turned by `rotation`). Gaps below 5e-5 m (ball) or a
    /// thousandth of the box's diagonal may count as touching, never the other way round.
    bool overlaps_sphere(vec3 center, float radius) const;
    bool overlaps_box(vec3 center, vec3 half_extents, quat rotation = {}) const;

    struct Impl;

private:
    friend class World;
    explicit WorldView(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
    std::shared_ptr<const Impl> impl_;
};

}  // namespace kiln
