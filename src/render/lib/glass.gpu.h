// SPDX-License-Identifier: MIT
// Light at a border between two clear materials. `ratio`: index of refraction on the side that light comes from over that of the other.

#ifndef KILN_RENDER_LIB_GLASS_GPU_H
#define KILN_RENDER_LIB_GLASS_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Share of unpolarised light that is reflected (Fresnel); 1 where all of it is. `cosine`: of the direction and the normal, 0 … 1.
KILN_FN float dielectric_reflectance(float cosine, float ratio) {
    float sine_squared = ratio * ratio * (1.0f - cosine * cosine);
    if (sine_squared >= 1.0f) return 1.0f;
    float other = sqrt(1.0f - sine_squared);
    float across = (ratio * cosine - other) / max(ratio * cosine + other, 1e-20f);
    float along = (ratio * other - cosine) / max(ratio * other + cosine, 1e-20f);
    return 0.5f * (across * across + along * along);
}

// Where light goes on (Snell); n looks against d, both unit. Not where all of it is reflected.
KILN_FN vec3 refracted(vec3 d, vec3 n, float ratio) {
    float cosine = -dot(d, n);
    float other = sqrt(max(1.0f - ratio * ratio * (1.0f - cosine * cosine), 0.0f));
    return normalize(d * ratio + n * (ratio * cosine - other));
}

// A rough surface is one of small smooth ones: a normal of those that v sees, GGX, each as often as it is seen; z is up, v.z > 0 (Dupuy and
// Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023). u in [0, 1), phi an angle.
KILN_FN vec3 visible_normal(vec3 v, float alpha, float u, float phi) {
    vec3 w = normalize(vec3(alpha * v.x, alpha * v.y, v.z));
    float z = (1.0f - u) * (1.0f + w.z) - w.z;
    float r = sqrt(max(1.0f - z * z, 0.0f));
    return normalize(vec3(alpha * (r * cos(phi) + w.x), alpha * (r * sin(phi) + w.y), max(z + w.z, 1e-7f)));
}

// That of a surface with normal n which a ray along d meets, dot(n, d) < 0. Whoever sends all light of a ray by such normals takes what small
// surfaces hide of each other's light to be sent on as well as the rest: nothing is lost, as with multiple scattering.
KILN_FN vec3 rough_normal(vec3 n, vec3 d, float alpha, float u, float phi) {
    Basis b = basis_around(n);
    vec3 h = visible_normal(vec3(-dot(b.tangent, d), -dot(b.bitangent, d), max(-dot(n, d), 1e-4f)), alpha, u, phi);
    return normalize(b.tangent * h.x + b.bitangent * h.y + n * h.z);
}

// What the surface of glass reflects at right angles.
KILN_FN float glass_f0(float ior) {
    float r = (ior - 1.0f) / (ior + 1.0f);
    return r * r;
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
