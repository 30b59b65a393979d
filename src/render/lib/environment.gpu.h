// SPDX-License-Identifier: MIT
// An image of everything far away, as light: radiance by direction, what a Lambert surface receives of it, and its mean over
// reflection lobes. Made by environment_map.h; equirectangular: -Z in the middle, +Y on top, +X right of the middle.
//   Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", 2001 (nine harmonics);
//   Karis, "Real Shading in Unreal Engine 4", 2013 (lobes ahead of time, around the reflected ray).
//
// A text that includes this first declares `uint environment_word(uint i)`: word i of EnvironmentMap::words.
// C++ includes it through environment_map.h, inside a class; so it has no guard.
//   words 0 - 26   nine harmonics, red green blue each, as floats, each times what a Lambert surface keeps of it
//   words 28 - 63  first word, width, height and 0 of the image and of its kEnvironmentLobes lobes
//   then           texels: red, green, blue as floats, rows from the top

#ifndef __cplusplus
#include "math/math.gpu.h"
const uint kEnvironmentLevels = 28u;
const uint kEnvironmentLobes = 8u;
#endif

KILN_FN vec3 environment_color(uint at) {
    return vec3(uintBitsToFloat(environment_word(at)), uintBitsToFloat(environment_word(at + 1u)),
                uintBitsToFloat(environment_word(at + 2u)));
}

// A texel of a level. Round it goes on; beyond a pole, half a turn farther.
KILN_FN vec3 environment_texel(uint first, int width, int height, int x, int y) {
    if (y < 0 || y >= height) {
        y = y < 0 ? -1 - y : 2 * height - 1 - y;
        x = x + width / 2;
    }
    x = x < 0 ? x + width : x;
    x = x >= width ? x - width : x;
    return environment_color(first + 3u * uint(y * width + x));
}

// Level 0 is the image, level i the mean over the lobe of roughness i / kEnvironmentLobes. Between texels: bilinear.
KILN_FN vec3 environment_sample(uint level, vec3 direction) {
    uint first = environment_word(kEnvironmentLevels + 4u * level);
    int width = int(environment_word(kEnvironmentLevels + 4u * level + 1u));
    int height = int(environment_word(kEnvironmentLevels + 4u * level + 2u));
    float turn = atan(direction.x, -direction.z) / kTwoPi + 0.5f;
    float fall = acos(clamp(direction.y, -1.0f, 1.0f)) / kPi;
    float x = turn * float(width) - 0.5f;
    float y = clamp(fall * float(height), 0.0f, float(height)) - 0.5f;
    int x_0 = int(floor(x));
    int y_0 = int(floor(y));
    float s = x - float(x_0);
    float t = y - float(y_0);
    vec3 top = mix(environment_texel(first, width, height, x_0, y_0),
                   environment_texel(first, width, height, x_0 + 1, y_0), s);
    vec3 low = mix(environment_texel(first, width, height, x_0, y_0 + 1),
                   environment_texel(first, width, height, x_0 + 1, y_0 + 1), s);
    return mix(top, low, t);
}

// What a ray that hits nothing sees.
KILN_FN vec3 environment_radiance(vec3 direction) { return environment_sample(0u, direction); }

// Mean radiance that a surface of normal n gathers, weighted by the cosine: irradiance over pi. Unoccluded.
KILN_FN vec3 environment_ambient(vec3 n) {
    vec3 sum = environment_color(0u);
    sum = sum + environment_color(3u) * n.y + environment_color(6u) * n.x + environment_color(9u) * n.z;
    sum = sum + environment_color(12u) * (n.x * n.y) + environment_color(15u) * (n.y * n.z) +
          environment_color(18u) * (n.x * n.z);
    sum = sum + environment_color(21u) * (3.0f * n.y * n.y - 1.0f) + environment_color(24u) * (n.x * n.x - n.z * n.z);
    return vec3(max(sum.x, 0.0f), max(sum.y, 0.0f), max(sum.z, 0.0f));
}

// Mean radiance over the reflection lobe around r.
KILN_FN vec3 environment_reflection(vec3 r, float roughness) {
    float level = saturate(roughness) * float(kEnvironmentLobes);
    uint sharper = uint(min(floor(level), float(kEnvironmentLobes) - 1.0f));
    return mix(environment_sample(sharper, r), environment_sample(sharper + 1u, r), level - float(sharper));
}
