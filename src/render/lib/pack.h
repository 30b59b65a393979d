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

// A constant sky; of an image, what its radiance is multiplied by.
SkyParams sky_params(const Environment& environment);
// The sky of a frame: its environment's; the default sky, with the disc of the first sun among its lights, where it has none.
SkyParams sky_params(const Frame& frame);

// What a scene without lights gets: a warm sun 42 degrees high, behind the left shoulder of a camera that looks along
// (-3, -2, -4), as automatic cameras do. And what one without an environment gets: a clear sky over pale ground, without a sun's
// disc. Together they light a white horizontal surface to about radiance 1.
Light default_sun();
SkyParams default_sky();
// The sky with the disc of a directional light, which must not be a point.
SkyParams with_disc(SkyParams sky, const Light& sun);

}  // namespace kiln::render::shade
