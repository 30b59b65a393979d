#version 460
// SPDX-License-Identifier: MIT
// The classic outline by a stencil, for comparison: the back faces of a mesh made a fiftieth larger about its middle. Its faults are its own:
// gaps where a mesh is not convex, and lines that grow thin with distance.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/outline_hull.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Clusters { MeshClusterRef clusters[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(push_constant) uniform Push { HullPush push; };

#include "render/passes/mesh.glsl"

void main() {
    MeshClusterRef cluster = clusters[push.first + uint(gl_InstanceIndex)];
    MeshPart part = mesh_parts[cluster.part];
    uint triangle = cluster.first + uint(gl_VertexIndex) / 3u;
    if (triangle >= part.triangle_count) {
        gl_Position = vec4(0.0, 0.0, 0.0, 1.0);  // of no size
        return;
    }
    vec3 p = mesh_point(part, vertex_position(mesh_corner(part, triangle, uint(gl_VertexIndex) % 3u)));
    vec3 middle = vec3(push.middle_x, push.middle_y, push.middle_z);
    p = middle + (p - middle) * kHullScale;
    float w = dot(p, frame.camera.forward.xyz);
    float x = dot(p, frame.camera.right.xyz) / dot(frame.camera.right.xyz, frame.camera.right.xyz);
    float y = dot(p, frame.camera.up.xyz) / dot(frame.camera.up.xyz, frame.camera.up.xyz);
    vec2 wider = vec2(frame.width, frame.height) / vec2(frame.tile_width, frame.tile_height);
    vec2 moved = 2.0 * vec2(frame.tile_x, frame.tile_y) / vec2(frame.tile_width, frame.tile_height);
    gl_Position = vec4((x + w) * wider.x - (moved.x + 1.0) * w, (y - w) * wider.y + (moved.y + 1.0) * w, kMeshNear, w);
}
