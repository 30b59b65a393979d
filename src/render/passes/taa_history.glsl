// SPDX-License-Identifier: MIT
// Colours as histories are kept and compared, and when one is of what is seen now. The including kernel declares first: texture2D history,
// depth_before, ivec2 inside(ivec2), inside_history(ivec2).

#include "render/passes/brightest.glsl"

const float kDeviations = 1.25;  // of the neighbourhood that history may differ by
const float kSameDepth = 0.005;  // share of the distance
const float kFastest = 0.125;    // of the picture's height, a frame: nothing is kept of what moves faster

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

vec4 catmull_rom(float f) {
    return vec4(f * (f * (1.0 - 0.5 * f) - 0.5), 1.0 + f * f * (1.5 * f - 2.5), f * (0.5 + f * (2.0 - 1.5 * f)), f * f * (0.5 * f - 0.5));
}

// History round `at`, in pixels; exactly a texel's where `at` is its middle.
vec3 history_at(vec2 at) {
    vec2 corner = floor(at - 0.5);
    vec2 part = at - 0.5 - corner;
    ivec2 first = ivec2(corner);
    if (part == vec2(0.0)) return bounded(texelFetch(history, inside_history(first), 0).rgb);
    vec4 x = catmull_rom(part.x);
    vec4 y = catmull_rom(part.y);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) sum += x[i] * y[j] * bounded(texelFetch(history, inside_history(first + ivec2(i - 1, j - 1)), 0).rgb);
    return sum;
}

// Was something round the place (a pixel of rays) as far as `was`?
bool was_as_far(ivec2 place, float was) {
    float nearest = 1e30;
    float farthest = 0.0;
    for (int k = 0; k < 9; ++k) {
        float d = texelFetch(depth_before, inside(place + ivec2(k % 3 - 1, k / 3 - 1)), 0).r;
        nearest = min(nearest, d);
        farthest = max(farthest, d);
    }
    return was >= nearest * (1.0 - kSameDepth) && was <= farthest * (1.0 + kSameDepth);
}
