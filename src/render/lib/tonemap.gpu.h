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
KILN_CONST uint kToneMapAgx = 4u;

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

// AgX (Troy Sobotka, 2022): light is drawn together towards white, then 16.5 stops of it follow one curve, so bright saturated lights
// pale instead of turning to another hue. Matrices for linear sRGB by Benjamin Wrensch (2023); the curve is the polynomial of degree
// seven that Filament fits to the default contrast. What comes out is meant for a 2.2 power, which is taken off here.
KILN_FN float agx_curve(float light) {
    float x = (clamp(log2(max(light, 1e-10f)), -12.47393f, 4.026069f) + 12.47393f) / 16.5f;
    float y = (((((((-17.86f * x + 78.01f) * x - 126.7f) * x + 92.06f) * x - 28.72f) * x + 4.361f) * x - 0.1718f) * x +
               0.002857f);
    return max(y, 0.0f);
}

KILN_FN vec3 tone_agx(vec3 c) {
    vec3 v = vec3(0.842479062f * c.x + 0.0784336f * c.y + 0.0792237451f * c.z,
                  0.0423282423f * c.x + 0.878468636f * c.y + 0.0791661275f * c.z,
                  0.0423756549f * c.x + 0.0784336f * c.y + 0.879142974f * c.z);
    v = vec3(agx_curve(v.x), agx_curve(v.y), agx_curve(v.z));
    vec3 shown = vec3(1.19687901f * v.x - 0.0980208811f * v.y - 0.0990297441f * v.z,
                      -0.0528968518f * v.x + 1.15190313f * v.y - 0.0989611768f * v.z,
                      -0.0529716355f * v.x - 0.0980434501f * v.y + 1.15107367f * v.z);
    return vec3(pow(saturate(shown.x), 2.2f), pow(saturate(shown.y), 2.2f), pow(saturate(shown.z), 2.2f));
}

KILN_FN vec3 tone_map(uint kind, vec3 exposed) {
    vec3 c = vec3(tone_input(exposed.x), tone_input(exposed.y), tone_input(exposed.z));
    if (kind == kToneMapExponential) return vec3(tone_exponential(c.x), tone_exponential(c.y), tone_exponential(c.z));
    if (kind == kToneMapAces) return tone_aces(c);
    if (kind == kToneMapNeutral) return tone_neutral(c);
    if (kind == kToneMapAgx) return tone_agx(c);
    return vec3(min(c.x, 1.0f), min(c.y, 1.0f), min(c.z, 1.0f));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
