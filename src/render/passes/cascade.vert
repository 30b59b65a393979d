#version 460
// SPDX-License-Identifier: MIT
// Casters into one shadow map, an instance a cluster; height is depth.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/cascades.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 0, std430) readonly buffer Drawn { MeshClusterRef drawn[]; };
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 2, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 3, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 4, std430) readonly buffer CascadeParts { CascadePart cascade_parts[]; };
layout(push_constant) uniform Push { CascadeDrawPush push; };

#include "render/passes/cascade_place.glsl"
#include "render/passes/mesh.glsl"

layout(location = 0) flat out uint part_of;
layout(location = 1) out vec4 uv;  // both sets
layout(location = 2) out float alpha;

void main() {
    MeshClusterRef cluster = drawn[push.first + gl_InstanceIndex];
    MeshPart part = mesh_parts[cluster.part];
    uint triangle = cluster.first + uint(gl_VertexIndex) / 3u;
    part_of = cluster.part;
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
    vec3 at = cascade_place(cluster.part, vertex_position(v));
    precise float x = (at.x - push.u) * push.per_map;
    precise float y = (at.y - push.v) * push.per_map;
    gl_Position = vec4(x, -y, at.z, 1.0);  // rows of the map follow v
}
