// SPDX-License-Identifier: MIT
// Exact answers: the compiled list of edits evaluated in double precision. A question costs the edits around it: their code is kept
// by regions of space (sdf/regions.h), which does not change the answer. Any thread.
#pragma once

#include "sdf/eval.h"
#include "sdf/program.h"
#include "sdf/regions.h"

#include <kiln/query.h>

#include <span>

namespace kiln::scene {

class ExactField {
public:
    /// Keeps a reference to `program`, which must outlive it.
    explicit ExactField(const sdf::Program& program);

    /// Metres; +infinity where nothing exists.
    double distance(dvec3 p) const;
    void distance(std::span<const vec3> points, float* out) const;
    FieldSample sample(vec3 p) const;
    void sample(std::span<const vec3> points, FieldSample* out) const;
    /// RayHit::edit.index is the edit's row in the program; its generation is 0.
    RayHit cast(const Ray& ray) const;
    void cast(std::span<const Ray> rays, RayHit* out) const;
    /// Normals and edits of hits whose positions are given.
    void describe(std::span<RayHit* const> hits) const;
    /// The centre of a ball of `radius` that moves along the ray until it touches solid.
    RayHit cast_sphere(const Ray& ray, float radius) const;
    NearestPoint nearest(vec3 p, float within) const;
    void nearest(std::span<const vec3> points, float within, NearestPoint* out) const;
    bool overlaps_sphere(vec3 center, float radius) const;
    bool overlaps_box(vec3 center, vec3 half_extents, quat rotation) const;

private:
    double distance(dvec3 p, sdf::Regions::Cursor& cursor) const;
    RayHit cast(const Ray& ray, sdf::Regions::Cursor& cursor) const;
    void describe(dvec3 p, RayHit& hit, sdf::Regions::Cursor& cursor) const;
    NearestPoint nearest(vec3 p, float within, sdf::Regions::Cursor& cursor) const;
    uint32_t edit_near(dvec3 p, sdf::Regions::Cursor& cursor) const;

    const sdf::Program& program_;
    sdf::Regions regions_;
    double reach_ = 0;  // metres: the largest of the edits'; smooth unions bulge beyond their operands
};

/// Material of a number in tapes and bricks; none for the default grey.
inline MaterialId material_of(uint32_t number) {
    return number == sdf::kDefaultMaterial || number == sdf::kNoMaterial ? MaterialId{} : MaterialId{number - 1, 0};
}

}  // namespace kiln::scene
