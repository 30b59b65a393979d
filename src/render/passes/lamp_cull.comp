#version 460
// SPDX-License-Identifier: MIT
// Which clusters of casters each face of the lights' shadow maps needs, and how many: arguments of its draws. A workgroup a cluster, a thread a
// triangle; then a thread a face. Lists come in any order; maps keep the nearest, so their texels do not depend on it.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/cascades.gpu.h"
#include "render/passes/lamps.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0, std430) readonly buffer Casters { MeshClusterRef casters[]; };
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 2, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 3, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 4, std430) readonly buffer Faces { LampFace faces[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Drawn { MeshClusterRef drawn[]; };  // of each face: solid ones, those with holes
layout(set = 0, binding = 6, std430) buffer Draws { uint draws[]; };                      // arguments, likewise; cleared before
layout(push_constant) uniform Push { LampCullPush push; };

#include "render/passes/mesh.glsl"

shared uint low[3];  // of the cluster's box from the eye, as ordered bits
shared uint high[3];

#include "render/passes/ordered_bits.glsl"

// Is all of the box on the far side of a plane through the origin?
bool beyond(vec3 middle, vec3 half_size, vec3 inwards) { return dot(middle, inwards) + dot(half_size, abs(inwards)) < 0.0; }

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint number = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (thread < 3u) {
        low[thread] = ~0u;
        high[thread] = 0u;
    }
    barrier();
    bool is = number < push.clusters;
    MeshClusterRef cluster = casters[is ? number : 0u];
    MeshPart part = mesh_parts[cluster.part];
    uint triangle = cluster.first + thread;
    if (is && triangle < part.triangle_count) {
        for (uint i = 0u; i < 3u; ++i) {
            vec3 p = mesh_point(part, vertex_position(mesh_corner(part, triangle, i)));
            for (int axis = 0; axis < 3; ++axis) {
                atomicMin(low[axis], ordered_bits(p[axis]));
                atomicMax(high[axis], ordered_bits(p[axis]));
            }
        }
    }
    barrier();
    if (thread >= push.faces) return;
    uint holes = number < push.solid ? 0u : 1u;
    uint draw = kDrawWords * (2u * thread + holes);
    if (number == 0u) {
        draws[kDrawWords * 2u * thread] = 3u * kMeshCluster;
        draws[kDrawWords * (2u * thread + 1u)] = 3u * kMeshCluster;
    }
    if (!is) return;
    LampFace face = faces[thread];
    vec3 box_low = vec3(float_of_ordered(low[0]), float_of_ordered(low[1]), float_of_ordered(low[2])) - face.at.xyz;
    vec3 box_high = vec3(float_of_ordered(high[0]), float_of_ordered(high[1]), float_of_ordered(high[2])) - face.at.xyz;
    vec3 middle = 0.5 * (box_low + box_high);
    vec3 half_size = 0.5 * (box_high - box_low);
    // Five sides; what is farther than the range hides nothing that is lit. A little wider for rounding.
    vec3 u = face.u.xyz;
    vec3 v = face.v.xyz;
    vec3 w = face.w.xyz * (face.u.w * 1.0001);
    bool out_of_it = beyond(middle, half_size, w + u) || beyond(middle, half_size, w - u) || beyond(middle, half_size, w + v) || beyond(middle, half_size, w - v) || beyond(middle, half_size, w);
    vec3 nearest = clamp(vec3(0.0), box_low, box_high);
    if (out_of_it || (face.v.w > 0.0 && dot(nearest, nearest) > face.v.w * face.v.w)) return;
    uint place = atomicAdd(draws[draw + 1u], 1u);
    drawn[thread * push.clusters + (holes == 0u ? place : push.solid + place)] = cluster;
}
