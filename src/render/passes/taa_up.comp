#version 460
// SPDX-License-Identifier: MIT
// Temporal upscaling: as taa.comp, but the history has the pixels that are shown, and each frame's rays, one through another place of each of its
// larger pixels, count in those that they fall into.
//   Karis, "High Quality Temporal Supersampling", 2014; Lottes and Wronski, "Temporal upscaling" in "Unreal Engine 4.25", 2020, and Thomas and
//   Tatarinov, "A Survey of Temporal Upsampling", 2020 for the parts that all share: samples weighted by how near the shown pixel's middle they are,
//   a history that counts weights, a neighbourhood of rays that bounds it, the motion of the nearest of them.
// A pixel keeps the sum of its weights in frames' worth: what rays give on average. Where nothing is known yet, rays are interpolated.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/taa.gpu.h"
#include "render/passes/taa_up.gpu.h"

layout(local_size_x = kTaaGroup, local_size_y = kTaaGroup) in;

layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1) uniform texture2D depth;    // metres along the ray
layout(set = 0, binding = 2) uniform texture2D motion;   // in its own pixels
layout(set = 0, binding = 3) uniform texture2D history;  // a: frames' worth of what it is made of
layout(set = 0, binding = 4) uniform texture2D depth_before;
layout(set = 0, binding = 5, rgba16f) writeonly uniform image2D history_now;
layout(set = 0, binding = 6, rgba16f) writeonly uniform image2D smoothed;
layout(push_constant) uniform Push { TaaUpPush push; };

ivec2 inside(ivec2 p) { return clamp(p, ivec2(0), ivec2(push.width_rays, push.height_rays) - 1); }
ivec2 inside_history(ivec2 p) { return clamp(p, ivec2(0), ivec2(push.width, push.height) - 1); }
#include "render/passes/taa_history.glsl"

const float kSharpness = 4.0;    // of a ray's weight, exp(-kSharpness d²), d in shown pixels
const float kFirstGuess = 0.05;  // frames' worth of what is interpolated

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec2 rays = vec2(push.width_rays, push.height_rays);
    vec2 scale = rays / vec2(push.width, push.height);
    vec2 middle = (vec2(pixel) + 0.5) * scale;  // in pixels of rays
    vec2 jitter = vec2(push.jitter_x, push.jitter_y);
    ivec2 nearest = inside(ivec2(floor(middle - jitter)));  // whose ray is nearest
    vec4 here = texelFetch(radiance, nearest, 0);
    float here_depth = texelFetch(depth, nearest, 0).r;
    float near_depth = here_depth;
    ivec2 front = nearest;
    vec3 sum = vec3(0.0);
    vec3 squares = vec3(0.0);
    vec3 least = vec3(1e30);
    vec3 most = vec3(-1e30);
    vec3 weighted = vec3(0.0);
    float weights = 0.0;
    vec3 guessed = vec3(0.0);
    float guesses = 0.0;
    for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
            ivec2 p = nearest + ivec2(i, j);
            ivec2 q = inside(p);
            vec3 full = texelFetch(radiance, q, 0).rgb;
            vec3 c = bounded(full);
            sum += c;
            squares += c * c;
            least = min(least, c);
            most = max(most, c);
            float d = texelFetch(depth, q, 0).r;
            if (d < near_depth) {
                near_depth = d;
                front = q;
            }
            if (p != q) continue;
            vec2 away = vec2(p) + 0.5 + jitter - middle;  // in pixels of rays
            vec2 shown = away / scale;
            float w = exp(-kSharpness * dot(shown, shown));
            weighted += w * full;
            weights += w;
            float g = exp(-2.0 * dot(away, away));
            guessed += g * c;
            guesses += g;
        }
    }
    // A frame's worth: rays are scale.x scale.y a shown pixel, and their weights' integral is pi / kSharpness.
    float worth = 3.141593 / kSharpness * scale.x * scale.y;
    weights /= worth;
    weighted /= worth;
    vec3 moved = texelFetch(motion, front, 0).xyz;
    vec2 at = vec2(pixel) + 0.5 + moved.xy / scale;
    bool known = push.valid != 0u && all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(push.width, push.height))) && length(moved.xy) <= kFastest * rays.y;
    float frames = 0.0;
    if (known && was_as_far(ivec2(floor(at * scale)), here_depth * texelFetch(motion, nearest, 0).z))
        frames = texelFetch(history, inside_history(ivec2(floor(at))), 0).a;
    vec3 kept = unbounded(guessed / max(guesses, 1e-20));
    float kept_frames = kFirstGuess;
    if (frames > 0.0) {
        vec3 mean = sum / 9.0;
        vec3 spread = kDeviations * sqrt(max(squares / 9.0 - mean * mean, vec3(0.0)));
        // What stands still keeps all that its neighbourhood shows: rays of other frames fell between these.
        bool still = moved.xy == vec2(0.0);
        vec3 low = still ? min(mean - spread, least) : mean - spread;
        vec3 high = still ? max(mean + spread, most) : mean + spread;
        vec3 old = history_at(at);
        vec3 centre = 0.5 * (low + high);
        vec3 half_size = max(0.5 * (high - low), vec3(1e-4));
        vec3 away = abs(old - centre) / half_size;
        float farthest = max(max(away.x, away.y), away.z);
        if (farthest > 1.0) {
            old = centre + (old - centre) / farthest;
            frames /= farthest;  // light has changed, too
        }
        kept = unbounded(old);
        kept_frames = frames;
    }
    vec3 result = (kept * kept_frames + weighted) / (kept_frames + weights);
    result = nearest_half(min(result, vec3(kBrightestStored)));
    imageStore(history_now, pixel, vec4(result, min(kept_frames + weights, push.most_frames)));
    imageStore(smoothed, pixel, vec4(result, here.a));
}
