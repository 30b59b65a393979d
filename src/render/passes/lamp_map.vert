#version 460
// SPDX-License-Identifier: MIT
// Casters into one face of a light's shadow map, an instance a cluster; nearness is depth.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/lamps.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 0, std430) readonly buffer Drawn { MeshClusterRef drawn[]; };
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 2, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 3, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 4, std430) readonly buffer Faces { LampFace faces[]; };
layout(push_constant) uniform Push { LampDrawPush push; };

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
    LampFace face = faces[push.face];
    vec3 p = mesh_point(part, vertex_position(v)) - face.at.xyz;
    // Rows of the map follow v.
    gl_Position = vec4(dot(p, face.u.xyz) / face.u.w, -dot(p, face.v.xyz) / face.u.w, kLampNear, dot(p, face.w.xyz));
}
