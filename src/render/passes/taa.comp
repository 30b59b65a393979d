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
const float kDeviations = 1.25;      // of the neighbourhood that history may differ by
const float kSameDepth = 0.005;      // share of the distance
const float kFastest = 0.125;        // of the picture's height, a frame: nothing is kept of what moves faster
const float kBrightestStored = 65000.0;

// Luminance and two differences of colour, after 1 / (1 + luminance): a spark does not outweigh all else.
vec3 bounded(vec3 c) {
    vec3 ycc = vec3(0.25 * c.r + 0.5 * c.g + 0.25 * c.b, 0.5 * c.r - 0.5 * c.b, -0.25 * c.r + 0.5 * c.g - 0.25 * c.b);
    return ycc / (1.0 + ycc.x);
}
vec3 unbounded(vec3 ycc) {
    ycc /= max(1.0 - ycc.x, 1e-5);
    float t = ycc.x - ycc.z;
    return max(vec3(t + ycc.y, ycc.x + ycc.z, t - ycc.y), vec3(0.0));
}

// To the nearest half float: some devices cut digits off when they store, which would darken a picture from frame to frame.
vec3 nearest_half(vec3 c) {
    uvec3 bits = floatBitsToUint(c);
    return mix(uintBitsToFloat((bits + 0xfffu + ((bits >> 13u) & 1u)) & ~0x1fffu), c, lessThan(c, vec3(6.2e-5)));
}

ivec2 inside(ivec2 p) { return clamp(p, ivec2(0), ivec2(push.width, push.height) - 1); }

vec4 catmull_rom(float f) {
    return vec4(f * (f * (1.0 - 0.5 * f) - 0.5), 1.0 + f * f * (1.5 * f - 2.5), f * (0.5 + f * (2.0 - 1.5 * f)), f * f * (0.5 * f - 0.5));
}

// History round `at`, in pixels; exactly a texel's where `at` is its middle.
vec3 history_at(vec2 at) {
    vec2 corner = floor(at - 0.5);
    vec2 part = at - 0.5 - corner;
    ivec2 first = ivec2(corner);
    if (part == vec2(0.0)) return bounded(texelFetch(history, inside(first), 0).rgb);
    vec4 x = catmull_rom(part.x);
    vec4 y = catmull_rom(part.y);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) sum += x[i] * y[j] * bounded(texelFetch(history, inside(first + ivec2(i - 1, j - 1)), 0).rgb);
    return sum;
}

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
    if (known) {
        // Something round the place was as far as this is now.
        ivec2 middle = ivec2(floor(at));
        float before_near = texelFetch(depth_before, inside(middle), 0).r;
        float before_far = before_near;
        for (int k = 0; k < 9; ++k) {
            float d = texelFetch(depth_before, inside(middle + ivec2(k % 3 - 1, k / 3 - 1)), 0).r;
            before_near = min(before_near, d);
            before_far = max(before_far, d);
        }
        float was = here_depth * texelFetch(motion, pixel, 0).z;
        if (was >= before_near * (1.0 - kSameDepth) && was <= before_far * (1.0 + kSameDepth)) frames = texelFetch(history, inside(middle), 0).a;
    }
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
