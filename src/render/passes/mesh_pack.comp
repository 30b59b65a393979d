#version 460
// SPDX-License-Identifier: MIT
// The chosen clusters, close together and in the order of the list (which decides who of equals is seen), and the numbers that draws take. One
// workgroup: each thread has a stretch of the list, counts it, learns from the sums of the others where to write, and writes.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh_cull.gpu.h"

layout(local_size_x = kMeshPackGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Clusters { MeshClusterRef clusters[]; };
layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Drawn { uint drawn[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Packed { MeshClusterRef packed_clusters[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Numbers { uint numbers[]; };
layout(push_constant) uniform Push { MeshCullPush push; };

shared uint sums[kMeshPackGroup];
shared uint triangles;

void main() {
    uint thread = gl_LocalInvocationIndex;
    if (thread == 0u) triangles = 0u;
    uint begin = 0u;
    for (uint kind = 0u; kind < 3u; ++kind) {
        uint count = kind == 0u ? push.one_sided : kind == 1u ? push.double_sided : push.masked;
        uint each = (count + kMeshPackGroup - 1u) / kMeshPackGroup;
        uint first = begin + min(thread * each, count);
        uint last = begin + min((thread + 1u) * each, count);
        uint own = 0u;
        for (uint i = first; i < last; ++i) own += drawn[i];
        barrier();
        sums[thread] = own;
        barrier();
        for (uint step = 1u; step < kMeshPackGroup; step *= 2u) {
            uint before = thread >= step ? sums[thread - step] : 0u;
            barrier();
            sums[thread] += before;
            barrier();
        }
        uint at = begin + sums[thread] - own;
        uint own_triangles = 0u;
        for (uint i = first; i < last; ++i) {
            if (drawn[i] == 0u) continue;
            MeshClusterRef cluster = clusters[i];
            packed_clusters[at++] = cluster;
            own_triangles += min(mesh_parts[cluster.part].triangle_count - cluster.first, kMeshCluster);
        }
        if (own_triangles > 0u) atomicAdd(triangles, own_triangles);
        if (thread == kMeshPackGroup - 1u) {
            numbers[kMeshDrawWords * kind] = 3u * kMeshCluster;
            numbers[kMeshDrawWords * kind + 1u] = sums[thread];
            numbers[kMeshDrawWords * kind + 2u] = 0u;
            numbers[kMeshDrawWords * kind + 3u] = 0u;
        }
        begin += count;
    }
    barrier();
    if (thread == 0u) numbers[kMeshDrawnTriangles] = triangles;
}
