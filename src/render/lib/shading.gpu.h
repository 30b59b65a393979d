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

// Share of light from all around that a point still gets which sees the sky by `visible` of its hemisphere and else surfaces like its own
// that send `albedo` of what they get: R = v + (1 - v) albedo R (Stewart and Langer, "Toward Accurate Recovery of Shape from Shading Under
// Diffuse Lighting", 1997). White things in white light stay white.
KILN_FN float ambient_share(float visible, float albedo) {
    return visible / max(1.0f - saturate(albedo) * (1.0f - visible), 1e-4f);
}

// What of a reflection lobe is open where `visible` of the hemisphere is: 1 where all of it is, and for smooth surfaces seen at a slant
// still much of it (Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014).
KILN_FN float reflection_visible(float n_v, float visible, float alpha) {
    return saturate(pow(n_v + visible, exp(-0.69314718f * (16.0f * alpha + 1.0f))) - 1.0f + visible);
}

// shade_around(), of what `visible` of the hemisphere leaves.
KILN_FN vec3 shade_around_seen(SurfaceView s, vec3 ambient, vec3 reflection, float visible) {
    vec3 albedo = s.base_ambient + s.reflected;
    float mirror = reflection_visible(s.n_v, visible, s.alpha);
    vec3 base =
        vec3(ambient_share(visible, albedo.x), ambient_share(visible, albedo.y), ambient_share(visible, albedo.z));
    vec3 lobe = vec3(ambient_share(mirror, albedo.x), ambient_share(mirror, albedo.y), ambient_share(mirror, albedo.z));
    return s.base_ambient * base * ambient + s.reflected * lobe * reflection;
}

// Unoccluded sky light.
KILN_FN vec3 shade_sky(SurfaceView s, SkyParams sky) {
    return shade_around(s, sky_ambient(sky, s.n), sky_reflection(sky, reflected_view(s), s.alpha));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
