#version 460
// SPDX-License-Identifier: MIT
// Triangles of meshes, an instance a cluster of them; vertices are pulled.
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
#include "render/passes/mesh_clip.glsl"

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
    gl_Position = mesh_clip(mesh_point(part, vertex_position(v)));
}
