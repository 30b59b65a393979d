// SPDX-License-Identifier: MIT

#include "render/lib/pack.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::render::shade {

static float radians(float degrees) { return degrees * std::numbers::pi_v<float> / 180; }

static vec3 unit_or(vec3 v, vec3 fallback) {
    const float size = length(v);
    return std::isfinite(size) && size > 1e-20f ? v / size : fallback;
}

CameraParams camera_params(const Camera& camera, int width_px, int height_px) {
    const vec3 forward = unit_or(camera.target - camera.position, {0, 0, -1});
    vec3 right = cross(forward, unit_or(camera.up, {0, 1, 0}));
    if (length(right) < 1e-4f) right = cross(forward, std::fabs(forward.y) < 0.9f ? vec3{0, 1, 0} : vec3{0, 0, -1});
    right = normalize(right);
    const vec3 up = cross(right, forward);
    const float half_height = std::tan(0.5f * radians(std::clamp(camera.fov_y_deg, 0.01f, 179.0f)));
    const float half_width = half_height * float(width_px) / float(height_px);
    return {.eye = {camera.position.x, camera.position.y, camera.position.z, kNearPlane},
            .right = {right.x * half_width, right.y * half_width, right.z * half_width, 1.0f / float(width_px)},
            .up = {up.x * half_height, up.y * half_height, up.z * half_height, 1.0f / float(height_px)},
            .forward = {forward.x, forward.y, forward.z, 0}};
}

LightRecord light_record(const Light& light) {
    LightRecord r{};
    const vec3 direction = unit_or(light.direction, {0, -1, 0});
    const bool directional = light.kind == Light::Kind::Directional;
    const vec3 color = light.color * (directional ? light.illuminance : light.intensity);
    r.color = {color.x, color.y, color.z, 0};
    r.direction = {direction.x, direction.y, direction.z, light.range > 0 ? 1 / (light.range * light.range) : 0};
    if (directional) {
        r.position = {0, 0, 0, std::tan(0.5f * radians(std::clamp(light.angular_diameter_deg, 0.0f, 170.0f)))};
        r.direction.w = 0;
        return r;
    }
    r.kind = light.kind == Light::Kind::Point ? kLightPoint : kLightSpot;
    r.position = {light.position.x, light.position.y, light.position.z, std::max(light.radius, 0.0f)};
    // Brightness runs from 1 to 0 in the cosine, squared (KHR_lights_punctual).
    const float inner = std::cos(radians(light.inner_deg)), outer = std::cos(radians(light.outer_deg));
    r.spot_scale = 1 / std::max(inner - outer, 1e-3f);
    r.spot_offset = -outer * r.spot_scale;
    return r;
}

// The parabola through three colours, as zonal harmonics (sky.gpu.h).
static SkyParams sky_through(vec3 zenith, vec3 horizon, vec3 nadir) {
    const vec3 c1 = (zenith - nadir) * 0.5f;
    const vec3 c2 = ((zenith + nadir) * 0.5f - horizon) * (2.0f / 3.0f);
    const vec3 c0 = horizon + c2 * 0.5f;
    return {.c0 = {c0.x, c0.y, c0.z, 0}, .c1 = {c1.x, c1.y, c1.z, 0}, .c2 = {c2.x, c2.y, c2.z, 0}, .sun = {0, 1, 0, 2}};
}

SkyParams sky_params(const Environment& environment) {
    const vec3 c = (environment.file.empty() ? environment.color : vec3{1, 1, 1}) * environment.intensity;
    return sky_through(c, c, c);
}

SkyParams sky_params(const Frame& frame) {
    if (frame.environment) return sky_params(*frame.environment);
    for (const Light& light : frame.lights)
        if (light.kind == Light::Kind::Directional && light.angular_diameter_deg > 0)
            return with_disc(default_sky(), light);
    return default_sky();
}

Light default_sun() {
    Light sun;
    sun.direction = {0.21f, -0.67f, -0.71f};
    sun.color = {1.0f, 0.94f, 0.84f};
    sun.illuminance = 3.0f;
    sun.angular_diameter_deg = 0.53f;
    return sun;
}

SkyParams default_sky() { return sky_through({0.16f, 0.30f, 0.62f}, {0.62f, 0.72f, 0.84f}, {0.20f, 0.18f, 0.16f}); }

SkyParams with_disc(SkyParams sky, const Light& sun) {
    const vec3 to_sun = unit_or(sun.direction * -1.0f, {0, 1, 0});
    const float cosine = std::cos(0.5f * radians(sun.angular_diameter_deg));
    // Illuminance over the disc's solid angle.
    const vec3 radiance = sun.color * (sun.illuminance / (2 * std::numbers::pi_v<float> * (1 - cosine)));
    sky.sun = {to_sun.x, to_sun.y, to_sun.z, cosine};
    sky.c0.w = radiance.x, sky.c1.w = radiance.y, sky.c2.w = radiance.z;
    return sky;
}

}  // namespace kiln::render::shade
