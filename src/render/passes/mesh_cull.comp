#version 460
// SPDX-License-Identifier: MIT
// Which clusters are drawn: early those that the picture before showed, late all others that no pixel's depth hides. What was seen is only a
// hint of what to draw first: whatever it says, each cluster is drawn early or looked at late.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/depth_pyramid.gpu.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh_cull.gpu.h"

layout(local_size_x = kMeshCullGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Clusters { MeshClusterRef clusters[]; };
layout(set = 0, binding = 2, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 3, std430) readonly buffer Boxes { MeshBox boxes[]; };
layout(set = 0, binding = 4, std430) readonly buffer Pyramid { float pyramid[]; };  // not read early
layout(set = 0, binding = 5, std430) buffer Seen { uint cluster_seen[]; };          // of all clusters, by number
layout(set = 0, binding = 6, std430) readonly buffer Early { uint drawn_early[]; };  // a word a listed cluster; not read early
layout(set = 0, binding = 7, std430) writeonly buffer Drawn { uint drawn[]; };       // likewise
layout(push_constant) uniform Push { MeshCullPush push; };

#include "render/passes/mesh_clip.glsl"

const uint kOutside = 0u;
const uint kMayBeSeen = 1u;
const uint kUnbounded = 2u;  // too near to say where

// Where in the tile the box is, pixels, and the greatest depth that any of its points has.
uint place_of(MeshPart part, MeshBox box, out ivec2 low, out ivec2 high, out float nearest) {
    low = ivec2(0);
    high = ivec2(0);
    nearest = 1.0;
    vec3 middle = 0.5 * vec3(box.min_x + box.max_x, box.min_y + box.max_y, box.min_z + box.max_z);
    vec3 size = 0.5 * vec3(box.max_x - box.min_x, box.max_y - box.min_y, box.max_z - box.min_z);
    vec3 center = vec3(dot(part.eye_x.xyz, middle) + part.eye_x.w, dot(part.eye_y.xyz, middle) + part.eye_y.w,
                       dot(part.eye_z.xyz, middle) + part.eye_z.w);
    vec3 along_x = vec3(part.eye_x.x, part.eye_y.x, part.eye_z.x) * size.x;
    vec3 along_y = vec3(part.eye_x.y, part.eye_y.y, part.eye_z.y) * size.y;
    vec3 along_z = vec3(part.eye_x.z, part.eye_y.z, part.eye_z.z) * size.z;
    // How far rounding may have put a corner, or a vertex in the box, from where it is.
    vec3 reach = abs(center) + abs(along_x) + abs(along_y) + abs(along_z) + abs(vec3(part.eye_x.w, part.eye_y.w, part.eye_z.w));
    float slack = 4e-6 * max(max(reach.x, reach.y), reach.z);
    bvec4 outside = bvec4(true);  // left, right, above, below
    vec2 first = vec2(1e30);
    vec2 last = vec2(-1e30);
    float ahead_least = 1e30;
    float ahead_most = -1e30;
    for (int corner = 0; corner < 8; ++corner) {
        vec3 p = center + ((corner & 1) != 0 ? along_x : -along_x) + ((corner & 2) != 0 ? along_y : -along_y) + ((corner & 4) != 0 ? along_z : -along_z);
        vec4 clip = mesh_clip(p);
        float edge = clip.w + 1e-3 * abs(clip.w) + 4.0 * slack;
        outside.x = outside.x && clip.x < -edge;
        outside.y = outside.y && clip.x > edge;
        outside.z = outside.z && clip.y < -edge;
        outside.w = outside.w && clip.y > edge;
        ahead_least = min(ahead_least, clip.w);
        ahead_most = max(ahead_most, clip.w);
        vec2 at = vec2(clip.x, -clip.y) / max(clip.w, 1e-20);  // rows count downwards
        first = min(first, at);
        last = max(last, at);
    }
    if (any(outside) || ahead_most < -slack) return kOutside;
    if (ahead_least <= 1e3 * slack || ahead_least <= 2.0 * kMeshNear) return kUnbounded;
    // A pixel for how rasterisers snap, and what rounding may have moved.
    vec2 pixels = 0.5 * vec2(frame.tile_width, frame.tile_height);
    float margin = 1.0 + 2.0 * slack / (ahead_least * frame.pixel_angle);
    low = ivec2(clamp(floor((first + 1.0) * pixels - margin), vec2(0.0), 2.0 * pixels - 1.0));
    high = ivec2(clamp(floor((last + 1.0) * pixels + margin), vec2(0.0), 2.0 * pixels - 1.0));
    nearest = kMeshNear / ahead_least * 1.003;
    return kMayBeSeen;
}

bool hidden(ivec2 low, ivec2 high, float nearest) {
    int level = 1;
    int levels = pyramid_levels(frame.tile_width, frame.tile_height);
    while (level < levels && any(greaterThan((high >> level) - (low >> level), ivec2(3)))) ++level;
    int first = pyramid_first(frame.tile_width, frame.tile_height, level);
    int across = pyramid_side(frame.tile_width, level);
    low >>= level;
    high >>= level;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x)
            if (pyramid[first + y * across + x] <= nearest) return false;
    return true;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.one_sided + push.double_sided + push.masked) return;
    MeshClusterRef cluster = clusters[i];
    MeshPart part = mesh_parts[cluster.part];
    uint number = part.first_cluster + cluster.first / kMeshCluster;
    if (push.late == 0u && cluster_seen[number] == 0u) {
        drawn[i] = 0u;
        return;
    }
    ivec2 low;
    ivec2 high;
    float nearest;
    uint place = place_of(part, boxes[part.first_box + cluster.first / kMeshCluster], low, high, nearest);
    if (push.late == 0u || place == kOutside) {  // what is out of the tile is remembered as it was
        drawn[i] = place != kOutside ? 1u : 0u;
        return;
    }
    bool seen = place == kUnbounded || !hidden(low, high, nearest);
    drawn[i] = seen && drawn_early[i] == 0u ? 1u : 0u;
    cluster_seen[number] = seen ? 1u : 0u;
}
