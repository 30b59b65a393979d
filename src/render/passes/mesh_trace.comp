#version 460
// SPDX-License-Identifier: MIT
// Triangles along rays that no rasteriser can follow: those behind glass, and those of surfaces that blend, which may lie one behind the other.
// The nearest through the parts' trees of boxes, if it is nearer than what was found before; of equals the first.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 5, std430) readonly buffer Surfaces { MeshSurface mesh_surfaces[]; };
layout(set = 0, binding = 6, std430) readonly buffer Nodes { MeshNode nodes[]; };
layout(set = 0, binding = 7) uniform utexture2D visibility;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D visibility_now;
#define KILN_PAGES 9
#include "render/passes/mesh_textures.glsl"
layout(push_constant) uniform Push { MeshTracePush push; };

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/mesh_walk.glsl"

const float kFarMetres = 1e7;

bool next_mesh_ray(MeshWalkHit met, inout vec3 d) { return false; }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    TexelRay ray = pixel_ray(pixel);
    float h = frame.grid.voxel_size;
    MeshWalkHit hit = walk_meshes(ray_origin(ray), ray.direction, min(uintBitsToFloat(seen.x) * h, kFarMetres),
                                  MeshWalk(push.through != 0u, false, kNoTriangle, kNoTriangle));
    if (hit.triangle != kNoTriangle) seen = uvec4(floatBitsToUint(hit.t / h), (kSeenMesh << 28u) | hit.triangle, hit.part, seen.w);
    imageStore(visibility_now, pixel, seen);
}
