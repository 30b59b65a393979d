// SPDX-License-Identifier: MIT
// Public camera, lights and environment as the records that shaders read.
#pragma once

#include "render/lib/camera.gpu.h"
#include "render/lib/lights.gpu.h"
#include "render/lib/sky.gpu.h"

#include <kiln/renderer.h>

namespace kiln::render::shade {

inline constexpr float kNearPlane = 0.01f;  // metres, of reversed depth

// Any camera gives finite rays: an `up` along the view is replaced, a target at the eye looks along -Z.
CameraParams camera_params(const Camera& camera, int width_px, int height_px);

LightRecord light_record(const Light& light);

// A constant sky.
SkyParams sky_params(const Environment& environment);

// What a scene without lights and environment gets: a warm sun 42 degrees high, behind the left shoulder of a camera that
// looks along -Z, under a clear sky over pale ground. Together they light a white horizontal surface to about radiance 1.
Light default_sun();
SkyParams default_sky();

}  // namespace kiln::render::shade
