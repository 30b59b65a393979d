#version 460
// SPDX-License-Identifier: MIT
// Bakes bricks, distances to an 8-bit signed normalised storage texture.
#extension GL_GOOGLE_include_directive : require
#include "field/brick.gpu.h"
#include "field/codes.gpu.h"
#include "render/passes/bake.gpu.h"
#include "render/passes/bake.glsl"

layout(set = 0, binding = 7, r8_snorm) writeonly uniform image3D distances;  // fractions of the band

void store_row(uvec3 atlas_texel, uint job, uint row, float d_voxels[8]) {
    for (int x = 0; x < 8; ++x) {
        imageStore(distances, ivec3(atlas_texel) + ivec3(x, 0, 0), vec4(stored_snorm8(d_voxels[x]) * (1.0 / kBandVoxels)));
    }
}
