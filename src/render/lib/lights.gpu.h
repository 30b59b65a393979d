// SPDX-License-Identifier: MIT
// Punctual lights as glTF 2.0 KHR_lights_punctual has them, each with a disc for soft shadows.
// Illuminance in lux, intensity in candela, radiance in cd/m²: a white Lambert surface under 1 lux has radiance 1/pi.

#ifndef KILN_RENDER_LIB_LIGHTS_GPU_H
#define KILN_RENDER_LIB_LIGHTS_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Values of kiln::Light::Kind.
KILN_CONST uint kLightDirectional = 0u;
KILN_CONST uint kLightPoint = 1u;
KILN_CONST uint kLightSpot = 2u;

// One light in a storage buffer (64 bytes); made by light_record() in pack.h.
struct LightRecord {
    vec4
        position;  // world metres; w: radius of its disc in metres; directional: tangent of the half angle the disc is seen under
    vec4 direction;  // unit, the way the light goes; w: 1 / range², 0 where no range ends it
    vec4 color;      // lux or candela, times colour; w: not 0 where maps hold the shadows of meshes, see lamp_faces.h
    uint kind;
    float spot_scale, spot_offset;  // brightness of a spot: saturate(cosine * scale + offset)²
    float pad_0;
};

// A light as one point sees it.
struct LightSample {
    vec3 l;            // unit, towards the light's centre
    float distance;    // metres to it; 1e30 for directional lights
    vec3 illuminance;  // across l, before shadow
    float tan_radius;  // radius of its disc over its distance; 0: a hard shadow
};

// Windowed inverse square: 1 / d², brought to 0 at the range. Inside the light's own radius it grows no more.
KILN_FN float light_falloff(float distance2, float radius, float inverse_range2) {
    float q = distance2 * inverse_range2;
    float window = saturate(1.0f - q * q);
    return window / max(distance2, max(radius * radius, 1e-6f));
}

KILN_FN float spot_falloff(float cosine, float scale, float offset) {
    return square(saturate(cosine * scale + offset));
}

KILN_FN LightSample sample_light(LightRecord light, vec3 p_world) {
    LightSample s;
    vec3 color = vec3(light.color.x, light.color.y, light.color.z);
    vec3 along = vec3(light.direction.x, light.direction.y, light.direction.z);
    if (light.kind == kLightDirectional) {
        s.l = splat3(0.0f) - along;
        s.distance = 1e30f;
        s.illuminance = color;
        s.tan_radius = light.position.w;
        return s;
    }
    vec3 to_light = vec3(light.position.x - p_world.x, light.position.y - p_world.y, light.position.z - p_world.z);
    float distance2 = dot(to_light, to_light);
    float reach = sqrt(max(distance2, 1e-12f));
    s.l = to_light * (1.0f / reach);
    s.distance = reach;
    float power = light_falloff(distance2, light.position.w, light.direction.w);
    if (light.kind == kLightSpot) power = power * spot_falloff(-dot(along, s.l), light.spot_scale, light.spot_offset);
    s.illuminance = color * power;
    s.tan_radius = light.position.w / max(reach, light.position.w);
    return s;
}

#ifdef __cplusplus
static_assert(sizeof(LightRecord) == 64);
}  // namespace kiln::render::shade
#endif

#endif
