// SPDX-License-Identifier: MIT
// Questions a program can ask of a world's field: distance, normal, material, ray.
// Exact answers come from the edits themselves; no mesh, no GPU. Every function here may be called from any thread.
#pragma once

#include <kiln/edit.h>
#include <kiln/math.h>

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
    vec3 normal;
    EditId edit;  ///< the edit with the largest share at the hit, ties to the later
};

/// Where a question is answered from.
enum class FieldSource : uint8_t {
    Exact,   ///< the full ordered list of edits
    Bricks,  ///< the baked bricks (trilinear), exact edits where no brick is
};

}  // namespace kiln
