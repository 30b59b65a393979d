#version 460
// SPDX-License-Identifier: MIT
// Where meshes and the field meet: the triangle that the rasteriser found is met by the pixel's own ray, in metres along it, and the nearer
// of it and what march (and refine) found is what the pixel shows.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 5) uniform utexture2D visibility;
layout(set = 0, binding = 6) uniform utexture2D refined;  // not read without kFrameRefine
layout(set = 0, binding = 7) uniform utexture2D mesh_ids;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D visibility_now;

#include "render/passes/mesh.glsl"
#include "render/passes/settle.glsl"
#include "render/passes/rays.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = settled(texelFetch(visibility, pixel, 0), pixel);
    uvec2 id = texelFetch(mesh_ids, pixel, 0).xy;
    if (id.x != 0u) {
        MeshPart part = mesh_parts[id.y];
        vec3 d = pixel_ray(pixel).direction;
        vec3 a = mesh_point(part, vertex_position(mesh_corner(part, id.x - 1u, 0u)));
        vec3 b = mesh_point(part, vertex_position(mesh_corner(part, id.x - 1u, 1u)));
        vec3 c = mesh_point(part, vertex_position(mesh_corner(part, id.x - 1u, 2u)));
        vec3 w = mesh_weights_inside(a, b, c, d);
        float t = dot(w.x * a + w.y * b + w.z * c, d) / frame.grid.voxel_size;
        if ((seen.y >> 28u) == kSeenNothing || t < uintBitsToFloat(seen.x)) {
            seen.x = floatBitsToUint(t);
            seen.y = (kSeenMesh << 28u) | (id.x - 1u);
            seen.z = id.y;
        }
    }
    imageStore(visibility_now, pixel, seen);
}
