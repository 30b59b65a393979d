#version 460
// SPDX-License-Identifier: MIT
// Bakes bricks, distance codes to a buffer that is then copied to the atlas: for devices without 16-bit storage textures.
// Rows of 256 bytes hold as many bricks side by side as fit; a group of bricks is 8 x 8 such rows.
#extension GL_GOOGLE_include_directive : require
#include "field/brick.gpu.h"
#include "field/codes.gpu.h"
#include "render/passes/bake.gpu.h"
#include "render/passes/bake.glsl"

layout(set = 0, binding = 7, std430) writeonly buffer Distances { uint distance_words[]; };
layout(constant_id = 0) const bool kSnorm8 = false;

void store_row(uvec3 atlas_texel, uint job, uint row, float d_voxels[8]) {
    uint row_words = kSnorm8 ? 2u : 4u;
    uint bricks = uint(kBakeCopyBytes) / 4u / row_words;
    uint at = ((job / bricks) * uint(kBakeCopyRows) + row) * uint(kBakeCopyBytes / 4) + (job % bricks) * row_words;
    if (kSnorm8) {
        for (int w = 0; w < 2; ++w) {
            uint word = 0u;
            for (int x = 0; x < 4; ++x) word |= snorm8_code(d_voxels[4 * w + x]) << (8 * x);
            distance_words[at + w] = word;
        }
    } else {
        for (int w = 0; w < 4; ++w) {
            distance_words[at + w] = half_code(d_voxels[2 * w]) | (half_code(d_voxels[2 * w + 1]) << 16u);
        }
    }
}
