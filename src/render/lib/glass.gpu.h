// SPDX-License-Identifier: MIT
// Light at a smooth border between two clear materials. `ratio`: index of refraction on the side that light comes from over that of the other.

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

// What the surface of glass reflects at right angles.
KILN_FN float glass_f0(float ior) {
    float r = (ior - 1.0f) / (ior + 1.0f);
    return r * r;
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
