#version 460
// SPDX-License-Identifier: MIT
// Where something hides an outlined mesh: pixels that no outlined thing is seen at, and where the outlined meshes alone would be.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/mesh.gpu.h"
#include "render/passes/outline.gpu.h"

layout(local_size_x = kOutlineGroup, local_size_y = kOutlineGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 1) uniform utexture2D ids;  // triangle + 1 (0: none), part
layout(set = 0, binding = 2) uniform utexture2D owners_seen;
layout(set = 0, binding = 3, r32ui) writeonly uniform uimage2D owners;
layout(set = 0, binding = 4, r32ui) writeonly uniform uimage2D seeds;
layout(push_constant) uniform Push { OutlinePush push; };  // count: records before those of meshes

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uint owner = texelFetch(owners_seen, pixel, 0).r;
    uvec4 id = texelFetch(ids, pixel, 0);
    if (owner == 0u && id.x != 0u) {
        uint outlined = mesh_parts[id.y].outline;
        if (outlined != 0u) owner = push.count + outlined;
    }
    imageStore(owners, pixel, uvec4(owner));
    imageStore(seeds, pixel, uvec4(owner == 0u ? kNoSeed : uint(pixel.x) | (uint(pixel.y) << 16u)));
}
