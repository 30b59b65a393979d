// SPDX-License-Identifier: MIT
// Light leaving a surface: one light, and the sky. What the lighting pass and the CPU reference both sum up.

#ifndef KILN_RENDER_LIB_SHADING_GPU_H
#define KILN_RENDER_LIB_SHADING_GPU_H

#include "render/lib/brdf.gpu.h"
#include "render/lib/lights.gpu.h"
#include "render/lib/sky.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
#endif

// visible: fraction of the light's disc.
KILN_FN vec3 shade_light(SurfaceView s, LightSample light, float visible) {
    return brdf_times_cosine(s, light.l) * light.illuminance * visible;
}

// Unoccluded sky light, off the base and by reflection. Under a constant sky of radiance 1 a white surface gives 1.
KILN_FN vec3 shade_sky(SurfaceView s, SkyParams sky) {
    float n_v = dot(s.n, s.v);
    vec3 r = s.n * (2.0f * n_v) - s.v;
    return s.base_ambient * sky_ambient(sky, s.n) + s.reflected * sky_reflection(sky, r, s.alpha);
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
