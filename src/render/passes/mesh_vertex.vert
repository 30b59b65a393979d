#version 460
// SPDX-License-Identifier: MIT
// Triangles of meshes, an instance a cluster of them; vertices are pulled. Clip space is that of the tile: what a pixel's middle shows is on
// the ray that pixel_ray() gives it.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Clusters { MeshClusterRef clusters[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(push_constant) uniform Push { MeshDrawPush push; };

#include "render/passes/mesh.glsl"

layout(location = 0) flat out uvec2 id;  // triangle of the part, part
layout(location = 1) out vec4 uv;        // both sets
layout(location = 2) out float alpha;

void main() {
    MeshClusterRef cluster = clusters[push.first + gl_InstanceIndex];
    MeshPart part = mesh_parts[cluster.part];
    uint triangle = cluster.first + uint(gl_VertexIndex) / 3u;
    id = uvec2(triangle, cluster.part);
    uv = vec4(0.0);
    alpha = 1.0;
    if (triangle >= part.triangle_count) {
        gl_Position = vec4(0.0, 0.0, 0.0, 1.0);  // of no size
        return;
    }
    uint v = mesh_corner(part, triangle, uint(gl_VertexIndex) % 3u);
    if ((part.flags & kMeshMask) != 0u) {
        uv = vec4(vertex_uv(v, false), vertex_uv(v, true));
        alpha = vertex_color(v).a;
    }
    vec3 p = mesh_point(part, vertex_position(v));
    float w = dot(p, frame.camera.forward.xyz);
    // In the picture, -w to w; then in the tile.
    float x = dot(p, frame.camera.right.xyz) / dot(frame.camera.right.xyz, frame.camera.right.xyz);
    float y = dot(p, frame.camera.up.xyz) / dot(frame.camera.up.xyz, frame.camera.up.xyz);
    vec2 wider = vec2(frame.width, frame.height) / vec2(frame.tile_width, frame.tile_height);
    vec2 moved = 2.0 * vec2(frame.tile_x, frame.tile_y) / vec2(frame.tile_width, frame.tile_height);
    gl_Position = vec4((x + w) * wider.x - (moved.x + 1.0) * w, (y - w) * wider.y + (moved.y + 1.0) * w, kMeshNear, w);
}
