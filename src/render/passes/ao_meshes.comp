#version 460
// SPDX-License-Identifier: MIT
// Closes the rays of ambient occlusion that meet a triangle of a mesh, through the trees of boxes.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/ao.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 5, std430) readonly buffer Surfaces { MeshSurface mesh_surfaces[]; };
layout(set = 0, binding = 6, std430) readonly buffer Nodes { MeshNode nodes[]; };
layout(set = 0, binding = 7) uniform utexture2D visibility;
layout(set = 0, binding = 8) uniform utexture2D points_before;
layout(set = 0, binding = 9, rgba32ui) writeonly uniform uimage2D ao_points;
#define KILN_PAGES 10
#include "render/passes/mesh_textures.glsl"
layout(push_constant) uniform Push { AoPush push; };

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/mesh_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/mesh_shadow_start.glsl"
#include "render/passes/ao_rays.glsl"

const float kFarMetres = 1e7;

ivec2 texel;
vec3 normal;
uint open;   // of the rays, a bit each
uint ray_of_walk;

// The next open ray from `ray_of_walk` on.
bool aim_ray(inout vec3 d) {
    uint left = open & (kAoOpen << ray_of_walk);
    if (left == 0u) return false;
    ray_of_walk = uint(findLSB(left));
    d = ao_direction(texel, ray_of_walk, normal);
    return true;
}

bool next_mesh_ray(MeshWalkHit met, inout vec3 d) {
    if (met.triangle != kNoTriangle) open &= ~(1u << ray_of_walk);
    ++ray_of_walk;
    return aim_ray(d);
}

void main() {
    ao_make_directions();
    texel = ivec2(gl_GlobalInvocationID.xy);
    if (texel.x * int(push.every) >= frame.tile_width || texel.y * int(push.every) >= frame.tile_height) return;
    uvec4 point = texelFetch(points_before, texel, 0);
    open = point.x & kAoOpen;
    if (open != 0u) {
        ivec2 pixel = ao_pixel(texel);
        normal = unpack_unit(point.y);
        ShadowStart start = shadow_start(texelFetch(visibility, pixel, 0), pixel_ray(pixel), normal);
        ray_of_walk = 0u;
        vec3 d;
        if (aim_ray(d)) walk_meshes(start.from, d, kFarMetres, MeshWalk(false, true, start.part, start.triangle));
    }
    imageStore(ao_points, texel, uvec4((point.x & ~kAoOpen) | open, point.yzw));
}
