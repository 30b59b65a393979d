// SPDX-License-Identifier: MIT

#include "scene/framing.h"

#include <cmath>
#include <numbers>

namespace kiln::scene {

Camera framing_camera(const Box3& box) {
    Camera camera;
    if (box.empty() || !box.finite()) return camera;
    const float radius = std::max(length(box.half_extents()), 1e-4f);
    const float distance = radius / std::sin(0.5f * camera.fov_y_deg * std::numbers::pi_v<float> / 180.0f);
    camera.target = box.center();
    camera.position = camera.target + normalize(vec3{0.6f, 0.42f, 0.8f}) * distance;
    return camera;
}

}  // namespace kiln::scene
