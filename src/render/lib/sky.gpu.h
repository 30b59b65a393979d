// SPDX-License-Identifier: MIT
// The sky: radiance by direction as a parabola in the direction's height, so that three colours (zenith, horizon, nadir)
// are met exactly, and what a surface receives of it has a closed form; a constant environment is the special case of one
// colour. The sun's disc is drawn on it but not part of its ambient light: the sun is a light of its own.
// In height y the parabola is c0 + c1 y + c2 (3 y² - 1) / 2: the zonal harmonics that a Lambert surface keeps 1, 2/3 and
// 1/4 of (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", 2001).

#ifndef KILN_RENDER_LIB_SKY_GPU_H
#define KILN_RENDER_LIB_SKY_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// 64 bytes; made by sky_params() in pack.h. Radiance in cd/m²; w of c0, c1, c2: the sun's.
struct SkyParams {
    vec4 c0, c1, c2;
    vec4 sun;  // unit, towards the sun; w: cosine of its angular radius, 2 for no sun
};

KILN_FN vec3 sky_zonal(SkyParams sky, float height, float keep_1, float keep_2) {
    float p1 = height * keep_1;
    float p2 = (1.5f * height * height - 0.5f) * keep_2;
    return vec3(max(sky.c0.x + sky.c1.x * p1 + sky.c2.x * p2, 0.0f),
                max(sky.c0.y + sky.c1.y * p1 + sky.c2.y * p2, 0.0f),
                max(sky.c0.z + sky.c1.z * p1 + sky.c2.z * p2, 0.0f));
}

// What a ray that hits nothing sees.
KILN_FN vec3 sky_radiance(SkyParams sky, vec3 direction) {
    vec3 radiance = sky_zonal(sky, direction.y, 1.0f, 1.0f);
    float cosine = direction.x * sky.sun.x + direction.y * sky.sun.y + direction.z * sky.sun.z;
    if (cosine >= sky.sun.w) radiance = radiance + vec3(sky.c0.w, sky.c1.w, sky.c2.w);
    return radiance;
}

// Mean radiance that a surface of normal n gathers, weighted by the cosine: irradiance over pi. Unoccluded.
KILN_FN vec3 sky_ambient(SkyParams sky, vec3 n) { return sky_zonal(sky, n.y, 0.66666667f, 0.25f); }

// Mean radiance of the sky over the reflection lobe around r. A lobe of GGX keeps about exp(-l (l + 1) alpha² / 2) of
// harmonic l while it is narrow (a Gaussian on the sphere); exact for a constant sky and for a mirror.
KILN_FN vec3 sky_reflection(SkyParams sky, vec3 r, float alpha) {
    float a2 = alpha * alpha;
    return sky_zonal(sky, r.y, exp(-a2), exp(-3.0f * a2));
}

#ifdef __cplusplus
static_assert(sizeof(SkyParams) == 64);
}  // namespace kiln::render::shade
#endif

#endif
