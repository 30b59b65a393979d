// SPDX-License-Identifier: MIT
// The camera: rays through pixel centres, and reversed depth (1 at the near plane, 0 at infinity) for what is rasterised.
// Pixel (0, 0) is the top left one. Rays start at the eye, not on the near plane: the distance field has no near plane.

#ifndef KILN_RENDER_LIB_CAMERA_GPU_H
#define KILN_RENDER_LIB_CAMERA_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// `right` and `up` reach from the middle of the picture plane at distance 1 to its right and upper edge.
struct CameraParams {
    vec4 eye;      // world metres; w: near plane of reversed depth, metres
    vec4 right;    // w: 1 / width in pixels
    vec4 up;       // w: 1 / height in pixels
    vec4 forward;  // unit; w: unused, 0
};

// Unit direction through (x, y) in pixels, (0, 0) the picture's upper left corner: a pixel's middle is at + 0.5.
KILN_FN vec3 camera_direction_at(CameraParams camera, float x_px, float y_px) {
    float x = 2.0f * x_px * camera.right.w - 1.0f;
    float y = 1.0f - 2.0f * y_px * camera.up.w;
    return normalize(vec3(camera.forward.x + x * camera.right.x + y * camera.up.x,
                          camera.forward.y + x * camera.right.y + y * camera.up.y,
                          camera.forward.z + x * camera.right.z + y * camera.up.z));
}

// Where a camera sees what lies at `to` from its eye (any length, in front of it), in pixels as above.
KILN_FN vec2 camera_pixel(CameraParams camera, vec3 to) {
    vec3 right = vec3(camera.right.x, camera.right.y, camera.right.z);
    vec3 up = vec3(camera.up.x, camera.up.y, camera.up.z);
    float ahead = dot(to, vec3(camera.forward.x, camera.forward.y, camera.forward.z));
    float x = dot(to, right) / (ahead * dot(right, right));
    float y = dot(to, up) / (ahead * dot(up, up));
    return vec2((x + 1.0f) / (2.0f * camera.right.w), (1.0f - y) / (2.0f * camera.up.w));
}

// Reversed depth with the far plane at infinity: near / (distance along `forward`).
KILN_FN float reversed_depth(float near_plane, float view_distance) { return near_plane / view_distance; }
KILN_FN float view_distance(float near_plane, float depth) { return near_plane / depth; }

#ifdef __cplusplus
static_assert(sizeof(CameraParams) == 64);
}  // namespace kiln::render::shade
#endif

#endif
