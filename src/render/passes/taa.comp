#version 460
// SPDX-License-Identifier: MIT
// Temporal anti-aliasing: each frame looks through other places of its pixels, and what came before is fetched from where it was.
//   Karis, "High Quality Temporal Supersampling", 2014 (neighbourhood in YCoCg, motion of the nearest neighbour, weights by
//   luminance); Salvi, "An Excursion in Temporal Supersampling", 2016 (variance clipping); Jimenez, "Filmic SMAA", 2016 (Catmull-Rom).
// A pixel counts the frames it is made of: the first 16 have equal shares, so a still picture becomes the mean of a whole round of the
// jitter; from then on each has a sixteenth. What was hidden in the frame before begins anew.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/taa.gpu.h"

layout(local_size_x = kTaaGroup, local_size_y = kTaaGroup) in;

layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1) uniform texture2D depth;         // metres along the ray
layout(set = 0, binding = 2) uniform texture2D motion;
layout(set = 0, binding = 3) uniform texture2D history;       // a: frames it is made of
layout(set = 0, binding = 4) uniform texture2D depth_before;
layout(set = 0, binding = 5, rgba16f) writeonly uniform image2D history_now;
layout(set = 0, binding = 6, r32f) writeonly uniform image2D depth_now;
layout(set = 0, binding = 7, rgba16f) writeonly uniform image2D smoothed;
layout(push_constant) uniform Push { TaaPush push; };

const float kMostFrames = 16.0;

ivec2 inside(ivec2 p) { return clamp(p, ivec2(0), ivec2(push.width, push.height) - 1); }
ivec2 inside_history(ivec2 p) { return inside(p); }
#include "render/passes/taa_history.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 now = texelFetch(radiance, pixel, 0);
    float here_depth = texelFetch(depth, pixel, 0).r;
    imageStore(depth_now, pixel, vec4(here_depth));
    float near_depth = here_depth;
    ivec2 nearest = pixel;
    vec3 sum = vec3(0.0);
    vec3 squares = vec3(0.0);
    for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
            ivec2 p = inside(pixel + ivec2(i, j));
            vec3 c = bounded(texelFetch(radiance, p, 0).rgb);
            sum += c;
            squares += c * c;
            float d = texelFetch(depth, p, 0).r;
            if (d < near_depth) {
                near_depth = d;
                nearest = p;
            }
        }
    }
    vec3 moved = texelFetch(motion, nearest, 0).xyz;
    vec2 at = vec2(pixel) + 0.5 + moved.xy;
    bool known = push.valid != 0u && all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(push.width, push.height))) && length(moved.xy) <= kFastest * float(push.height);
    float frames = 0.0;
    ivec2 place = ivec2(floor(at));
    if (known && was_as_far(place, here_depth * texelFetch(motion, pixel, 0).z)) frames = texelFetch(history, inside(place), 0).a;
    vec3 result = now.rgb;
    if (frames > 0.0) {
        vec3 mean = sum / 9.0;
        vec3 spread = kDeviations * sqrt(max(squares / 9.0 - mean * mean, vec3(0.0)));
        vec3 here = bounded(now.rgb);
        vec3 low = min(mean - spread, here);
        vec3 high = max(mean + spread, here);
        // Towards the middle of the box, until inside.
        vec3 old = history_at(at);
        vec3 middle = 0.5 * (low + high);
        vec3 half_size = max(0.5 * (high - low), vec3(1e-7));
        vec3 away = abs(old - middle) / half_size;
        float farthest = max(max(away.x, away.y), away.z);
        if (farthest > 1.0) {
            old = middle + (old - middle) / farthest;
            frames /= farthest;  // light has changed, too
        }
        vec3 kept = unbounded(old);
        result = kept + (now.rgb - kept) / (frames + 1.0);
    }
    result = nearest_half(min(result, vec3(kBrightestStored)));
    imageStore(history_now, pixel, vec4(result, min(frames + 1.0, kMostFrames - 1.0)));
    imageStore(smoothed, pixel, vec4(result, now.a));
}
