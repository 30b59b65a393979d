#version 460
// SPDX-License-Identifier: MIT
// Which pixels' rays meet something that lets light through before what is solid; all others show nothing here.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Glass { GlassRecord glass[]; };       // not read without glass
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };  // likewise
layout(set = 0, binding = 2) uniform utexture2D nearest;
layout(set = 0, binding = 3) uniform texture2D carried;
layout(set = 0, binding = 4, rgba32ui) writeonly uniform uimage2D found;
layout(set = 0, binding = 5, rgba32ui) writeonly uniform uimage2D surface_words;
layout(push_constant) uniform Push { ThroughPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uvec4 word = texelFetch(nearest, pixel, 0);
    uint state = word.y >> 28u;
    bool through = false;
    if (state == kSeenInstance) through = glass[word.y & 0x0fffffffu].ior > 0.0;
    if (state == kSeenMesh) through = (mesh_parts[word.z].flags & kMeshBlend) != 0u;
    if ((push.step & kThroughCamera) == 0u && texelFetch(carried, pixel, 0).a == kRayRests) through = false;
    if (!through) word = uvec4(0x7f800000u, kSeenNothing << 28u, 0u, 0u);
    imageStore(found, pixel, word);
    imageStore(surface_words, pixel, uvec4(0u));
}
