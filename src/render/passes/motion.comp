#version 460
// SPDX-License-Identifier: MIT
// Where each pixel's surface was on the screen: x, y: pixels from this frame to the frame before (x right, y down); z: its distance from
// the eye then over now. The sky turns with the camera and does not move. Half floats: 1/1024 of a motion. What was nowhere comes from
// off the screen.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/motion.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std140) uniform Motion { MotionParams cameras; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3) uniform utexture2D visibility;
layout(set = 0, binding = 4, rgba16f) writeonly uniform image2D motion;
layout(set = 0, binding = 5, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 6, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 7, std430) readonly buffer Moved { MovedRecord moved_edits[]; };
layout(set = 0, binding = 8, std430) readonly buffer Changed { ChangedBox changed_boxes[]; };
layout(set = 0, binding = 9) uniform utexture2D moved_owners;  // as outline_mask.comp writes

#include "render/passes/rays.glsl"
#include "render/passes/point_before.glsl"

const vec2 kOffScreen = vec2(60000.0);

bool was_nowhere(vec3 p) {
    for (uint i = 0u; i < cameras.changed_count; ++i) {
        ChangedBox b = changed_boxes[i];
        if (all(greaterThanEqual(p, vec3(b.low_x, b.low_y, b.low_z))) && all(lessThanEqual(p, vec3(b.high_x, b.high_y, b.high_z)))) return true;
    }
    return false;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    TexelRay ray = pixel_ray(pixel);
    vec3 now = ray.direction;
    vec3 before = ray.direction;
    vec3 moved = vec3(0.0);
    if (state != kSeenNothing) {
        now *= uintBitsToFloat(seen.x) * frame.grid.voxel_size;
        moved = point_before(state, seen, now) - now;
        bool of_field = state != kSeenInstance && state != kSeenMesh;
        if (of_field && cameras.moved_count != 0u) {
            uint owner = texelFetch(moved_owners, pixel, 0).r;
            if (owner != 0u) {
                MovedRecord edit = moved_edits[owner - 1u];
                moved = placed_by(edit.before_x, edit.before_y, edit.before_z, now) - now;
            }
        }
        if (state != kSeenMesh && was_nowhere(now)) {
            imageStore(motion, pixel, vec4(kOffScreen, 1.0, 0.0));
            return;
        }
        before = now + moved + vec3(cameras.moved_x, cameras.moved_y, cameras.moved_z);
    }
    vec2 by = vec2(0.0);
    // The same point through the same camera is no motion, whatever the compiler made of the two projections.
    if (cameras.still == 0u || moved != vec3(0.0)) {
        by = dot(before, cameras.before.forward.xyz) > 0.0 ? camera_pixel(cameras.before, before) - camera_pixel(cameras.now, now) : kOffScreen;
        by = clamp(by, -kOffScreen, kOffScreen);
    }
    float grown = state == kSeenNothing ? 1.0 : length(before) / max(length(now), 1e-20);
    imageStore(motion, pixel, vec4(by, min(grown, 60000.0), 0.0));
}
