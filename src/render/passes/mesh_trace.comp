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
    uint i = 0u;
    uint next_part = 0u;  // of a leaf of the parts' tree
    uint end_part = 0u;
    bool more = true;
    // Loops are nested as in march.gpu.h: all go on to a part that they meet; in it to a triangle that they meet; then all look for its holes.
    while (more) {
        uint which = 0u;
        bool found = false;
        do {
            if (next_part < end_part) {
                which = next_part++;
                found = ((mesh_parts[which].flags & kMeshBlend) != 0u) == (push.through != 0u);
            } else if (i < top) {
                MeshNode box = nodes[i];
                bool meets_it = meets(box, from, inverse, nearest);
                next_part = box.leaf >> 3u;
                end_part = next_part + (meets_it ? box.leaf & 7u : 0u);
                i = meets_it ? i + 1u : box.skip;
            } else {
                more = false;
            }
        } while (more && !found);
        MeshPart part = mesh_parts[which];
        vec3 o = local_point(part, from);
        vec3 v = local_vector(part, d);
        vec3 local_inverse = inverse_of(v);
        uint j = found ? 0u : part.node_count;
        uint triangle = 0u;
        uint end_triangle = 0u;
        bool in_part = found;
        while (in_part) {
            bool candidate = false;
            float t = 0.0;
            vec3 w = vec3(0.0);
            do {
                while (triangle == end_triangle && j < part.node_count) {
                    MeshNode node = nodes[part.first_node + j];
                    bool meets_it = meets(node, o, local_inverse, nearest);
                    triangle = node.leaf >> 3u;
                    end_triangle = triangle + (meets_it ? node.leaf & 7u : 0u);
                    j = meets_it ? j + 1u : node.skip;
                }
                in_part = triangle < end_triangle;
                if (in_part) {
                    vec3 a = vertex_position(mesh_corner(part, triangle, 0u)) - o;
                    vec3 b = vertex_position(mesh_corner(part, triangle, 1u)) - o;
                    vec3 c = vertex_position(mesh_corner(part, triangle, 2u)) - o;
                    w = vec3(dot(v, cross(b, c)), dot(v, cross(c, a)), dot(v, cross(a, b)));
                    float volume = w.x + w.y + w.z;
                    candidate = !(min(min(w.x, w.y), w.z) < 0.0 && max(max(w.x, w.y), w.z) > 0.0) && volume != 0.0;
                    w /= volume;
                    t = dot(w.x * a + w.y * b + w.z * c, v) / dot(v, v);
                    candidate = candidate && t > 0.0 && t < nearest;
                    // Corners turn to the left as seen from the front, whether the part is mirrored or not.
                    vec3 face = cross(mesh_vector(part, b - a), mesh_vector(part, c - a));
                    candidate = candidate && ((part.flags & kMeshDoubleSided) != 0u || !(dot(face, d) > 0.0));
                    ++triangle;
                }
            } while (in_part && !candidate);
            bool holes = (part.flags & (kMeshBlend | kMeshMask)) == kMeshMask;
            if (candidate && !(holes && opacity_at(part, triangle - 1u, w) < mesh_surfaces[part.surface].alpha_cutoff)) {
                nearest = t;
                seen = uvec4(floatBitsToUint(t / h), (kSeenMesh << 28u) | (triangle - 1u), which, seen.w);
            }
        }
    }
    imageStore(visibility_now, pixel, seen);
}
