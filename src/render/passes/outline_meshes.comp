#version 460
// SPDX-License-Identifier: MIT
// Which pixels show an outlined mesh: by the part that is seen there, into the mask of outlined edits.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/outline.gpu.h"

layout(local_size_x = kOutlineGroup, local_size_y = kOutlineGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 1) uniform utexture2D visibility;
layout(set = 0, binding = 2, r32ui) writeonly uniform uimage2D owners;
layout(set = 0, binding = 3, r32ui) writeonly uniform uimage2D seeds;
layout(push_constant) uniform Push { OutlinePush push; };  // count: records before those of meshes

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    uint outlined = state == kSeenMesh ? mesh_parts[seen.z].outline : 0u;
    // Without outlined edits nobody else writes the mask.
    if (outlined == 0u && push.count > 0u) return;
    imageStore(owners, pixel, uvec4(outlined == 0u ? 0u : push.count + outlined));
    imageStore(seeds, pixel, uvec4(outlined == 0u ? kNoSeed : uint(pixel.x) | (uint(pixel.y) << 16u)));
}
