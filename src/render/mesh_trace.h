// SPDX-License-Identifier: MIT
// Rays against a frame's meshes on the host, in double precision: the judge of what the renderer draws of them.
#pragma once

#include "render/mesh_set.h"

#include <kiln/edit.h>

#include <optional>

namespace kiln::render {

struct MeshHit {
    double t = 0;
    dvec3 normal;  // unit, towards the ray's origin: of the shading
    dvec3 face;    // of the triangle itself, likewise
    dvec3
        round;  // where rays start: the point moved onto the round surface that the normals tell of, see mesh_shadow.comp
    Material material;
    float ambient = 1;
};

class MeshTrace {
public:
    explicit MeshTrace(const MeshSet& set);
    // The first triangle that is seen; `direction` is unit. Single-sided ones are not seen from behind.
    std::optional<MeshHit> hit(dvec3 origin, dvec3 direction, double t_last) const;
    // Whether anything is in the way, from either side.
    bool hides(dvec3 origin, dvec3 direction, double t_last) const;

private:
    struct Found {
        uint32_t part = UINT32_MAX, triangle = 0;
        double t = 0;
        dvec3 weights;
    };
    bool walk(dvec3 origin, dvec3 direction, double t_last, bool seen_only, bool any, Found& found) const;
    MeshHit look(dvec3 origin, dvec3 direction, const Found& found) const;

    const MeshSet& set_;
    std::vector<model::Matrix> back_;  // of parts: local from world
};

}  // namespace kiln::render
