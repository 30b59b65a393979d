// SPDX-License-Identifier: MIT
// The surface model: Cook-Torrance with GGX and height-correlated Smith shadowing, Schlick's Fresnel term, the energy that
// single scattering loses given back, and a Lambert base that receives exactly what the reflection leaves. A white surface
// under a constant sky looks exactly as bright as the sky, at every roughness and angle (white furnace).
//   Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; Heitz, "Understanding the
//   Masking-Shadowing Function", 2014; Karis, "Real Shading in Unreal Engine 4", 2013 (split sum); Turquin, "Practical
//   multiple scattering compensation for microfacet models", 2019; Kulla and Conty, "Revisiting Physically Based Shading
//   at Imageworks", 2017 (the base under a reflection).
// A text that includes this first declares `uint ggx_table_word(uint i)`: word i of ggx_albedo_table() (ggx_table.h).
// All directions are unit and point away from the surface: n normal, v to the eye, l to the light.

#ifndef KILN_RENDER_LIB_BRDF_GPU_H
#define KILN_RENDER_LIB_BRDF_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
#include "render/lib/ggx_table.h"
namespace kiln::render::shade {
using namespace kiln::gpu;
inline uint ggx_table_word(uint i) { return ggx_albedo_table()[i]; }
#else
#define kGgxTableSide 32
#endif

// Below this a highlight is narrower than 32-bit floats resolve (alpha 0.002).
KILN_CONST float kMinRoughness = 0.045f;
// Reflectance of a dielectric along its normal (refractive index 1.5).
KILN_CONST float kDielectricF0 = 0.04f;

// What light sees of a surface: glTF 2.0 metallic-roughness, a mix of a metal and of a Lambert base under a clear dielectric.
struct SurfaceOptics {
    vec3 base_color;      // [0, 1]: reflectance of the metal along its normal, albedo of the base
    float metallic;       // [0, 1]
    float roughness;      // perceptual, [kMinRoughness, 1]; alpha = roughness²
    float dielectric_f0;  // kDielectricF0; 0 with f90 = 0 is a bare Lambert surface
    float f90;            // reflectance at grazing angles: 1
};

KILN_FN SurfaceOptics surface_optics(vec3 base_color, float metallic, float roughness) {
    SurfaceOptics s;
    s.base_color = base_color;
    s.metallic = saturate(metallic);
    s.roughness = clamp(roughness, kMinRoughness, 1.0f);
    s.dielectric_f0 = kDielectricF0;
    s.f90 = 1.0f;
    return s;
}

// Distribution of microfacet normals. n_h: cosine of normal and half vector; n_cross_h2: squared length of their cross
// product, which keeps the digits that 1 - n_h² loses near the peak.
KILN_FN float ggx_distribution(float n_h, float n_cross_h2, float alpha) {
    float a2 = alpha * alpha;
    float d = n_cross_h2 + n_h * n_h * a2;
    return a2 / (kPi * d * d);
}

// G2 / (4 n_v n_l), height-correlated.
KILN_FN float ggx_visibility(float n_v, float n_l, float alpha) {
    float a2 = alpha * alpha;
    float from_view = n_l * sqrt(n_v * n_v * (1.0f - a2) + a2);
    float from_light = n_v * sqrt(n_l * n_l * (1.0f - a2) + a2);
    return 0.5f / max(from_view + from_light, 1e-7f);
}

KILN_FN float schlick_weight(float cosine) {
    float m = saturate(1.0f - cosine);
    float m2 = m * m;
    return m2 * m2 * m;
}

// Share of light from every direction that single-scattering GGX sends to v: the integral of D V F cos is f0 * x + f90 * y.
// Bilinear in a table over roughness and sqrt(n_v), made by integration (tests/render/brdf_test.cpp).
KILN_FN vec2 ggx_directional_albedo(float roughness, float n_v) {
    float last = float(kGgxTableSide - 1);
    float row = clamp((roughness - kMinRoughness) * (last / (1.0f - kMinRoughness)), 0.0f, last);
    float column = clamp(sqrt(max(n_v, 0.0f)) * last, 0.0f, last);
    float row_0 = min(floor(row), last - 1.0f);
    float column_0 = min(floor(column), last - 1.0f);
    uint at = uint(row_0) * uint(kGgxTableSide) + uint(column_0);
    uint w00 = ggx_table_word(at);
    uint w01 = ggx_table_word(at + 1u);
    uint w10 = ggx_table_word(at + uint(kGgxTableSide));
    uint w11 = ggx_table_word(at + uint(kGgxTableSide) + 1u);
    float s = column - column_0;
    float t = row - row_0;
    float x =
        mix(mix(float(w00 & 0xffffu), float(w01 & 0xffffu), s), mix(float(w10 & 0xffffu), float(w11 & 0xffffu), s), t);
    float y = mix(mix(float(w00 >> 16u), float(w01 >> 16u), s), mix(float(w10 >> 16u), float(w11 >> 16u), s), t);
    return vec2(x / 65535.0f, y / 65535.0f);
}

// Mean of ggx_directional_albedo() over the hemisphere, weighted by 2 n_v: a row of the table behind the first.
KILN_FN vec2 ggx_average_albedo(float roughness) {
    float last = float(kGgxTableSide - 1);
    float row = clamp((roughness - kMinRoughness) * (last / (1.0f - kMinRoughness)), 0.0f, last);
    float row_0 = min(floor(row), last - 1.0f);
    uint at = uint(kGgxTableSide * kGgxTableSide) + uint(row_0);
    uint w0 = ggx_table_word(at);
    uint w1 = ggx_table_word(at + 1u);
    float t = row - row_0;
    return vec2(mix(float(w0 & 0xffffu), float(w1 & 0xffffu), t) / 65535.0f,
                mix(float(w0 >> 16u), float(w1 >> 16u), t) / 65535.0f);
}

// What depends on the surface and the eye alone, once a pixel.
struct SurfaceView {
    SurfaceOptics optics;
    vec3 n;
    vec3 v;
    float n_v;  // > 0
    float alpha;
    vec3 f0;
    vec3 gain;          // what single scattering is multiplied by, so that nothing is lost between microfacets
    vec3 reflected;     // share of a constant sky that the reflection sends to v
    vec3 base_in;       // base / pi, times the share that leaves towards v, over the mean share
    vec3 base_ambient;  // base, times the share that leaves towards v
};

// Share of a constant sky that a surface of reflectance f0 reflects. What single scattering loses, 1/E - 1 of what it
// keeps, bounces on between microfacets and meets f0 once more.
KILN_FN float reflected_share(float f0, float f90, vec2 albedo) {
    float lost = 1.0f / max(albedo.x + albedo.y, 1e-3f) - 1.0f;
    return min((f0 * albedo.x + f90 * albedo.y) * (1.0f + f0 * lost), 1.0f);
}

KILN_FN SurfaceView surface_view(SurfaceOptics optics, vec3 n, vec3 v) {
    SurfaceView s;
    s.optics = optics;
    s.n = n;
    s.v = v;
    s.n_v = max(abs(dot(n, v)), 1e-4f);
    s.alpha = optics.roughness * optics.roughness;
    vec2 albedo = ggx_directional_albedo(optics.roughness, s.n_v);
    s.f0 = mix(splat3(optics.dielectric_f0), optics.base_color, optics.metallic);
    float clear = reflected_share(optics.dielectric_f0, optics.f90, albedo);
    vec3 metal = vec3(reflected_share(optics.base_color.x, optics.f90, albedo),
                      reflected_share(optics.base_color.y, optics.f90, albedo),
                      reflected_share(optics.base_color.z, optics.f90, albedo));
    s.reflected = mix(splat3(clear), metal, optics.metallic);
    vec3 single = s.f0 * albedo.x + splat3(optics.f90 * albedo.y);
    s.gain = vec3(s.reflected.x / max(single.x, 1e-6f), s.reflected.y / max(single.y, 1e-6f),
                  s.reflected.z / max(single.z, 1e-6f));
    float mean = reflected_share(optics.dielectric_f0, optics.f90, ggx_average_albedo(optics.roughness));
    s.base_ambient = optics.base_color * ((1.0f - optics.metallic) * (1.0f - clear));
    s.base_in = s.base_ambient * (1.0f / (kPi * (1.0f - mean)));
    return s;
}

// Radiance towards v for one unit of illuminance measured across l: the BRDF times n·l. 0 from behind.
KILN_FN vec3 brdf_times_cosine(SurfaceView s, vec3 l) {
    float n_l = dot(s.n, l);
    if (n_l <= 0.0f) return splat3(0.0f);
    vec3 h = normalize(s.v + l);
    float n_h = saturate(dot(s.n, h));
    float v_h = saturate(dot(s.v, h));
    vec3 n_cross_h = cross(s.n, h);
    float d = ggx_distribution(n_h, dot(n_cross_h, n_cross_h), s.alpha);
    float reflection = d * ggx_visibility(s.n_v, n_l, s.alpha);
    float grazing = schlick_weight(v_h);
    vec3 fresnel = s.f0 * (1.0f - grazing) + splat3(s.optics.f90 * grazing);
    float passed =
        1.0f - reflected_share(s.optics.dielectric_f0, s.optics.f90, ggx_directional_albedo(s.optics.roughness, n_l));
    return (fresnel * s.gain * reflection + s.base_in * passed) * n_l;
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
