#version 460
// SPDX-License-Identifier: MIT
// Particles over a picture: balls of fog, thickest in the middle, that the pixel's ray meets from near to far; each counts as far as it lies
// before what is solid, so that none is cut by a surface. Those behind something transparent are seen through it as if it were not bent.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/motion.gpu.h"
#include "render/passes/particles.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std140) uniform Motion { MotionParams cameras; };  // not read where nothing moves
layout(set = 0, binding = 2, std430) readonly buffer Particles { ParticleRecord particles[]; };
layout(set = 0, binding = 3, std430) readonly buffer Light { vec4 light[]; };
layout(set = 0, binding = 4, std430) readonly buffer Ends { uint ends[]; };
layout(set = 0, binding = 5, std430) readonly buffer Numbers { uint numbers[]; };
layout(set = 0, binding = 6) uniform texture2D radiance;
layout(set = 0, binding = 7) uniform texture2D depth;        // of what is solid
layout(set = 0, binding = 8) uniform texture2D front_depth;  // of what is seen first, transparent or not
layout(set = 0, binding = 9) uniform texture2D front_light;  // of that alone; not read where nothing is transparent
layout(set = 0, binding = 10) uniform texture2D front_left;  // what it leaves of light from behind
layout(set = 0, binding = 11) uniform texture2D motion;
layout(set = 0, binding = 12, rgba16f) writeonly uniform image2D radiance_now;
layout(set = 0, binding = 13, r32f) writeonly uniform image2D depth_now;  // written with push.moves, as the motion
layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D motion_now;
layout(push_constant) uniform Push { ParticlePush push; };

const float kNothingLeft = 1.0 / 1024.0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    ivec2 whole = pixel + ivec2(frame.tile_x, frame.tile_y);
    vec3 d = camera_direction_at(frame.camera, float(whole.x) + 0.5, float(whole.y) + 0.5);
    vec4 now = texelFetch(radiance, pixel, 0);
    float solid = texelFetch(depth, pixel, 0).r;
    float front = texelFetch(front_depth, pixel, 0).r;
    bool veiled = push.behind != 0u && front < solid;
    // One list a level, merged by number, which is the order of distance.
    uint at[kParticleLevels];
    uint last[kParticleLevels];
    uint first_level[kParticleLevels] = uint[](push.first_0, push.first_1, push.first_2, push.first_3, push.first_4);
    uint across_level[kParticleLevels] = uint[](push.across_0, push.across_1, push.across_2, push.across_3, push.across_4);
    for (int level = 0; level < kParticleLevels; ++level) {
        uint side = uint(kParticleBin) << uint(2 * level);
        uint bin = first_level[level] + (uint(pixel.y) / side) * across_level[level] + uint(pixel.x) / side;
        at[level] = bin == 0u ? 0u : ends[bin - 1u];
        last[level] = ends[bin];
    }
    float left = 1.0;         // of light from behind what was looked at, before the transparent surface
    float left_behind = 1.0;  // and behind it
    vec3 before = vec3(0.0);
    vec3 behind = vec3(0.0);
    vec3 moved = vec3(0.0);
    float far = 0.0;
    float weight = 0.0;
    while (left * left_behind > kNothingLeft) {
        uint next = 0xffffffffu;
        int of = 0;
        for (int level = 0; level < kParticleLevels; ++level) {
            if (at[level] >= last[level]) continue;
            uint number = numbers[at[level]];
            if (number < next) {
                next = number;
                of = level;
            }
        }
        if (next == 0xffffffffu) break;
        for (int level = 0; level < kParticleLevels; ++level)
            if (level == of) at[level] += 1u;
        ParticleRecord p = particles[next];
        vec3 middle = vec3(p.x, p.y, p.z);
        float along = dot(middle, d);
        vec3 across = middle - d * along;
        float inside = 1.0 - dot(across, across) / (p.radius * p.radius);
        if (inside <= 0.0) continue;
        float half_way = p.radius * sqrt(inside);
        float first = max(along - half_way, 0.0);
        float end = along + half_way;
        float seen = end > first ? clamp((solid - first) / (end - first), 0.0, 1.0) * min(end / (2.0 * half_way), 1.0) : 0.0;
        float covers = clamp(p.opacity * inside * inside * seen, 0.0, 1.0);
        if (covers <= 0.0) continue;
        vec3 color = light[next].rgb;
        float shows = left * covers;
        if (veiled && along > front) {
            behind += left_behind * covers * color;
            left_behind *= 1.0 - covers;
        } else {
            before += left * covers * color;
            left *= 1.0 - covers;
            weight += shows;
            moved += shows * vec3(p.moved_x, p.moved_y, p.moved_z);
            far += shows * max(along, 1e-3);
        }
    }
    vec3 c = now.rgb;
    if (left_behind < 1.0) {
        vec3 own = texelFetch(front_light, pixel, 0).rgb;
        c = own + (c - own) * left_behind + texelFetch(front_left, pixel, 0).rgb * behind;
    }
    c = before + c * left;
    imageStore(radiance_now, pixel, vec4(min(c, vec3(65000.0)), left * left_behind < 1.0 ? 1.0 : now.a));
    if (push.moves == 0u) return;
    // Where particles hide more than half, taa follows them.
    vec4 motion_here = texelFetch(motion, pixel, 0);
    float depth_here = front;
    if (weight > 0.5) {
        depth_here = far / weight;
        vec3 to = d * depth_here;
        vec3 was = to + moved / weight + vec3(cameras.moved_x, cameras.moved_y, cameras.moved_z);
        vec2 by = vec2(60000.0);
        if (dot(was, cameras.before.forward.xyz) > 0.0) by = clamp(camera_pixel(cameras.before, was) - camera_pixel(cameras.now, to), vec2(-60000.0), vec2(60000.0));
        motion_here = vec4(by, min(length(was) / max(depth_here, 1e-20), 60000.0), 0.0);
    }
    imageStore(depth_now, pixel, vec4(depth_here));
    imageStore(motion_now, pixel, motion_here);
}
