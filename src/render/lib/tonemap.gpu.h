// SPDX-License-Identifier: MIT
// Tone maps: scene-linear light (already times exposure) to display-linear in [0, 1]. The sRGB curve comes after (color.gpu.h).
// Every one is monotone on greys, gives no NaN and stays in gamut for any input, infinite ones too.

#ifndef KILN_RENDER_LIB_TONEMAP_GPU_H
#define KILN_RENDER_LIB_TONEMAP_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Values of kiln::ToneMap.
KILN_CONST uint kToneMapNone = 0u;
KILN_CONST uint kToneMapExponential = 1u;
KILN_CONST uint kToneMapAces = 2u;
KILN_CONST uint kToneMapNeutral = 3u;

// Beyond this every curve is white; keeps squares finite in 32-bit floats.
KILN_CONST float kBrightest = 65504.0f;

// Negative light and NaN become 0.
KILN_FN float tone_input(float x) { return x > 0.0f ? min(x, kBrightest) : 0.0f; }

KILN_FN float tone_exponential(float x) { return 1.0f - exp(-x); }

// The rational curve of the ACES reference and output transforms, fitted by Stephen Hill (2016).
KILN_FN float aces_curve(float v) {
    return (v * (v + 0.0245786f) - 0.000090537f) / (v * (0.983729f * v + 0.4329510f) + 0.238081f);
}

// ACES, Hill's fit: sRGB -> AP1 with the reference transform's desaturation, the curve, and back. Skews hues of bright
// saturated lights, as ACES does.
KILN_FN vec3 tone_aces(vec3 c) {
    vec3 v = vec3(0.59719f * c.x + 0.35458f * c.y + 0.04823f * c.z, 0.07600f * c.x + 0.90834f * c.y + 0.01566f * c.z,
                  0.02840f * c.x + 0.13383f * c.y + 0.83777f * c.z);
    v = vec3(aces_curve(v.x), aces_curve(v.y), aces_curve(v.z));
    return vec3(saturate(1.60475f * v.x - 0.53108f * v.y - 0.07367f * v.z),
                saturate(-0.10208f * v.x + 1.10813f * v.y - 0.00605f * v.z),
                saturate(-0.00327f * v.x - 0.07276f * v.y + 1.07602f * v.z));
}

// Khronos PBR Neutral (2024): base colours below 0.8 come out as they went in, minus the 4 % of Fresnel reflection that a
// white light adds to them; above, brightness is compressed and desaturates slowly towards white, so hues hold.
KILN_FN vec3 tone_neutral(vec3 c) {
    float start = 0.8f - 0.04f;
    float lowest = smallest3(c);
    float offset = lowest < 0.08f ? lowest - 6.25f * lowest * lowest : 0.04f;
    vec3 v = c - splat3(offset);
    float peak = largest3(v);
    if (peak < start) return v;
    float room = 1.0f - start;
    float new_peak = 1.0f - room * room / (peak + room - start);
    v = v * (new_peak / peak);
    float toward_white = 1.0f - 1.0f / (0.15f * (peak - new_peak) + 1.0f);
    v = mix(v, splat3(1.0f), toward_white);
    return vec3(saturate(v.x), saturate(v.y), saturate(v.z));
}

KILN_FN vec3 tone_map(uint kind, vec3 exposed) {
    vec3 c = vec3(tone_input(exposed.x), tone_input(exposed.y), tone_input(exposed.z));
    if (kind == kToneMapExponential) return vec3(tone_exponential(c.x), tone_exponential(c.y), tone_exponential(c.z));
    if (kind == kToneMapAces) return tone_aces(c);
    if (kind == kToneMapNeutral) return tone_neutral(c);
    return vec3(min(c.x, 1.0f), min(c.y, 1.0f), min(c.z, 1.0f));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
