// SPDX-License-Identifier: MIT
// Where a ray is on its way through the voxels of one brick: what march.gpu.h hands from one of its steps to the next. Lengths are in voxels.

#ifndef KILN_FIELD_BRICK_WALK_GPU_H
#define KILN_FIELD_BRICK_WALK_GPU_H

#include "field/cubic.gpu.h"

KILN_FIELD_BEGIN

// A walk through the voxels of one brick (brick_walk() of march.gpu.h): `voxel` from `enter` to `exit`, along the ray from t_base.
struct BrickWalk {
    BrickRay ray;
    float enter, exit;
    float leave;                  // where it ends
    float out_x, out_y, out_any;  // where the ray leaves the voxel: by x, by y, by any
    ivec3 voxel;
    int looks;      // at voxels
    bool in_brick;  // else it has ended
};

KILN_FN BrickWalk ended_walk() {
    BrickWalk walk;
    walk.ray.high = walk.ray.low = walk.ray.lead = walk.ray.rest = walk.ray.inverse = vec3(0.0f, 0.0f, 0.0f);
    walk.ray.t_base = 0.0f;
    walk.enter = walk.exit = walk.leave = 0.0f;
    walk.out_x = walk.out_y = walk.out_any = 0.0f;
    walk.voxel = ivec3(0, 0, 0);
    walk.looks = 0;
    walk.in_brick = false;
    return walk;
}

KILN_FIELD_END

#endif
