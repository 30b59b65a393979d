#version 460
// SPDX-License-Identifier: MIT
// Bakes bricks, distances to a 16-bit float storage texture.
#extension GL_GOOGLE_include_directive : require
#include "field/brick.gpu.h"
#include "field/codes.gpu.h"
#include "render/passes/bake.gpu.h"
#include "render/passes/bake.glsl"

layout(set = 0, binding = 7, r16f) writeonly uniform image3D distances;  // voxels

void store_row(uvec3 atlas_texel, uint job, uint row, float d_voxels[8]) {
    for (int x = 0; x < 8; ++x) imageStore(distances, ivec3(atlas_texel) + ivec3(x, 0, 0), vec4(stored_half(d_voxels[x])));
}
