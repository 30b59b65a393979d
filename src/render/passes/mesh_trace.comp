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

const float kFarMetres = 1e7;

bool meets(MeshNode box, vec3 from, vec3 inverse, float t_last) {
    vec3 a = (vec3(box.min_x, box.min_y, box.min_z) - from) * inverse;
    vec3 b = (vec3(box.max_x, box.max_y, box.max_z) - from) * inverse;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    float first = max(max(low.x, low.y), max(low.z, 0.0));
    float last = min(min(high.x, high.y), min(high.z, t_last));
    return first <= last * 1.00001;
}

vec3 inverse_of(vec3 d) { return mix(1.0 / d, mix(vec3(-1e20), vec3(1e20), greaterThanEqual(d, vec3(0.0))), lessThan(abs(d), vec3(1e-20))); }

float opacity_at(MeshPart part, uint triangle, vec3 w) {
    MeshSurface s = mesh_surfaces[part.surface];
    uint a = mesh_corner(part, triangle, 0u);
    uint b = mesh_corner(part, triangle, 1u);
    uint c = mesh_corner(part, triangle, 2u);
    float alpha = s.alpha * (w.x * vertex_color(a).a + w.y * vertex_color(b).a + w.z * vertex_color(c).a);
    if ((s.base.where & kTextureIs) != 0u) {
        bool second = (s.base.where & kTextureSet1) != 0u;
        alpha *= mesh_texture(s.base, w.x * vertex_uv(a, second) + w.y * vertex_uv(b, second) + w.z * vertex_uv(c, second), vec2(0.0), vec2(0.0)).a;
    }
    return alpha;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    TexelRay ray = pixel_ray(pixel);
    float h = frame.grid.voxel_size;
    vec3 d = ray.direction;
    vec3 from = ray_origin(ray);
    float nearest = min(uintBitsToFloat(seen.x) * h, kFarMetres);
    vec3 inverse = inverse_of(d);
    uint top = nodes[0].skip;
    for (uint i = 0u; i < top;) {
        MeshNode box = nodes[i];
        if (!meets(box, from, inverse, nearest)) {
            i = box.skip;
            continue;
        }
        ++i;
        for (uint k = 0u; k < (box.leaf & 7u); ++k) {
            uint which = (box.leaf >> 3u) + k;
            MeshPart part = mesh_parts[which];
            bool blends = (part.flags & kMeshBlend) != 0u;
            if (blends != (push.through != 0u)) continue;
            vec3 o = local_point(part, from);
            vec3 v = local_vector(part, d);
            vec3 local_inverse = inverse_of(v);
            for (uint j = 0u; j < part.node_count;) {
                MeshNode node = nodes[part.first_node + j];
                if (!meets(node, o, local_inverse, nearest)) {
                    j = node.skip;
                    continue;
                }
                ++j;
                for (uint n = 0u; n < (node.leaf & 7u); ++n) {
                    uint triangle = (node.leaf >> 3u) + n;
                    vec3 a = vertex_position(mesh_corner(part, triangle, 0u)) - o;
                    vec3 b = vertex_position(mesh_corner(part, triangle, 1u)) - o;
                    vec3 c = vertex_position(mesh_corner(part, triangle, 2u)) - o;
                    vec3 w = vec3(dot(v, cross(b, c)), dot(v, cross(c, a)), dot(v, cross(a, b)));
                    if (min(min(w.x, w.y), w.z) < 0.0 && max(max(w.x, w.y), w.z) > 0.0) continue;
                    float volume = w.x + w.y + w.z;
                    if (volume == 0.0) continue;
                    w /= volume;
                    float t = dot(w.x * a + w.y * b + w.z * c, v) / dot(v, v);
                    if (!(t > 0.0 && t < nearest)) continue;
                    // Corners turn to the left as seen from the front, whether the part is mirrored or not.
                    vec3 face = cross(mesh_vector(part, b - a), mesh_vector(part, c - a));
                    if ((part.flags & kMeshDoubleSided) == 0u && dot(face, d) > 0.0) continue;
                    if (!blends && (part.flags & kMeshMask) != 0u && opacity_at(part, triangle, w) < mesh_surfaces[part.surface].alpha_cutoff) continue;
                    nearest = t;
                    seen = uvec4(floatBitsToUint(t / h), (kSeenMesh << 28u) | triangle, which, seen.w);
                }
            }
        }
    }
    imageStore(visibility_now, pixel, seen);
}
