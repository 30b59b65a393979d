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

// Where a mirror would look.
KILN_FN vec3 reflected_view(SurfaceView s) { return s.n * (2.0f * dot(s.n, s.v)) - s.v; }

// Light from all around: its cosine-weighted mean off the base, its mean over the lobe by reflection. Where both are 1, a white
// surface gives 1.
KILN_FN vec3 shade_around(SurfaceView s, vec3 ambient, vec3 reflection) {
    return s.base_ambient * ambient + s.reflected * reflection;
}

// Unoccluded sky light.
KILN_FN vec3 shade_sky(SurfaceView s, SkyParams sky) {
    return shade_around(s, sky_ambient(sky, s.n), sky_reflection(sky, reflected_view(s), s.alpha));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
