#version 460
// SPDX-License-Identifier: MIT
// Of the triangles drawn early and those drawn late, the one that drawing all at once would have left: the nearer; of equals the one that
// comes first in the list of clusters.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 2) uniform utexture2D early_ids;
layout(set = 0, binding = 3) uniform texture2D early_depth;
layout(set = 0, binding = 4) uniform utexture2D late_ids;
layout(set = 0, binding = 5) uniform texture2D late_depth;
layout(set = 0, binding = 6, rgba32ui) writeonly uniform uimage2D ids;

uint kind_of(uint part) {
    uint flags = mesh_parts[part].flags;
    return (flags & kMeshMask) != 0u ? 2u : (flags & kMeshDoubleSided) != 0u ? 1u : 0u;
}

bool comes_first(uvec2 a, uvec2 b) {
    uint kind_a = kind_of(a.y);
    uint kind_b = kind_of(b.y);
    if (kind_a != kind_b) return kind_a < kind_b;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec2 found = texelFetch(early_ids, pixel, 0).xy;
    uvec2 late = texelFetch(late_ids, pixel, 0).xy;
    if (late.x != 0u) {
        float a = texelFetch(early_depth, pixel, 0).x;
        float b = texelFetch(late_depth, pixel, 0).x;
        if (found.x == 0u || b > a || (b == a && comes_first(late, found))) found = late;
    }
    imageStore(ids, pixel, uvec4(found, 0u, 0u));
}
