#version 460
// SPDX-License-Identifier: MIT
// Which clusters of casters each shadow map needs, and how many: arguments of its draws. A workgroup a cluster, a thread a triangle. Lists come in
// any order; maps keep the highest, so their texels do not depend on it.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/cascades.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0, std140) uniform Cascades { CascadesBlock cascades; };
layout(set = 0, binding = 1, std430) readonly buffer Casters { MeshClusterRef casters[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 5, std430) readonly buffer CascadeParts { CascadePart cascade_parts[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Drawn { MeshClusterRef drawn[]; };  // of each map: solid ones, those with holes
layout(set = 0, binding = 7, std430) buffer Draws { uint draws[]; };                      // arguments, likewise; cleared before
layout(push_constant) uniform Push { CascadeCullPush push; };

#include "render/passes/cascade_place.glsl"
#include "render/passes/mesh.glsl"

shared uint low[2];  // of the cluster's box, as ordered bits
shared uint high[2];

#include "render/passes/ordered_bits.glsl"

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint number = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (thread < 2u) {
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
            vec3 at = cascade_place(cluster.part, vertex_position(mesh_corner(part, triangle, i)));
            for (int axis = 0; axis < 2; ++axis) {
                atomicMin(low[axis], ordered_bits(at[axis]));
                atomicMax(high[axis], ordered_bits(at[axis]));
            }
        }
    }
    barrier();
    if (thread < kMostCascades) {
        uint holes = number < push.solid ? 0u : 1u;
        uint draw = kDrawWords * (2u * thread + holes);
        if (number == 0u) {
            draws[kDrawWords * 2u * thread] = 3u * kMeshCluster;
            draws[kDrawWords * (2u * thread + 1u)] = 3u * kMeshCluster;
        }
        if (is && thread < cascades.count) {
            vec3 square = cascades.casters[thread].xyz;
            vec2 box_low = vec2(float_of_ordered(low[0]), float_of_ordered(low[1]));
            vec2 box_high = vec2(float_of_ordered(high[0]), float_of_ordered(high[1]));
            if (all(lessThanEqual(box_low, square.xy + square.z)) && all(greaterThanEqual(box_high, square.xy - square.z))) {
                uint place = atomicAdd(draws[draw + 1u], 1u);
                drawn[thread * push.clusters + (holes == 0u ? place : push.solid + place)] = cluster;
            }
        }
    }
}
