// SPDX-License-Identifier: MIT
// Colour: the exact sRGB curve (IEC 61966-2-1, not a power of 2.2) and luminance. Linear is Rec. 709 primaries.

#ifndef KILN_RENDER_LIB_COLOR_GPU_H
#define KILN_RENDER_LIB_COLOR_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Linear light in [0, 1] to the value stored in a picture. What lies outside is clamped; NaN becomes 0.
KILN_FN float srgb_from_linear(float x) {
    float c = x > 0.0f ? min(x, 1.0f) : 0.0f;
    return c <= 0.0031308f ? 12.92f * c : 1.055f * pow(c, 1.0f / 2.4f) - 0.055f;
}

KILN_FN float linear_from_srgb(float x) {
    float c = x > 0.0f ? min(x, 1.0f) : 0.0f;
    return c <= 0.04045f ? c / 12.92f : pow((c + 0.055f) / 1.055f, 2.4f);
}

KILN_FN vec3 srgb_from_linear3(vec3 c) {
    return vec3(srgb_from_linear(c.x), srgb_from_linear(c.y), srgb_from_linear(c.z));
}

KILN_FN vec3 linear_from_srgb3(vec3 c) {
    return vec3(linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z));
}

// Nearest of the 256 stored values.
KILN_FN uint byte_from_unit(float x) { return uint(clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f); }

KILN_FN float luminance(vec3 linear_rgb) {
    return 0.2126f * linear_rgb.x + 0.7152f * linear_rgb.y + 0.0722f * linear_rgb.z;
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
