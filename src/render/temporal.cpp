// SPDX-License-Identifier: MIT
#include "render/temporal.h"

#include "render/lib/pack.h"

#include <cmath>

namespace kiln::render {

namespace {

// Digits of n in that base, mirrored at the point.
float mirrored(uint32_t n, uint32_t base) {
    double out = 0, digit = 1;
    for (; n != 0; n /= base) out += double(n % base) * (digit /= base);
    return float(out);
}

}  // namespace

uint32_t jitter_round(float scale) { return uint32_t(std::ceil(float(kJitterRound) / (scale * scale) - 1e-3f)); }

vec2 jitter_of(uint64_t frame, uint32_t round) {
    const uint32_t n = uint32_t(frame % round) + 1;
    return {mirrored(n, 2) - 0.5f, mirrored(n, 3) - 0.5f};
}

shade::CameraParams jittered(shade::CameraParams camera, vec2 offset_px) {
    // A shift on the picture's plane is one of the direction to its middle.
    const float x = 2 * offset_px.x * camera.right.w, y = -2 * offset_px.y * camera.up.w;
    camera.forward.x += x * camera.right.x + y * camera.up.x;
    camera.forward.y += x * camera.right.y + y * camera.up.y;
    camera.forward.z += x * camera.right.z + y * camera.up.z;
    return camera;
}

bool follows(const Camera& now, const Camera& before) {
    const vec3 ahead = now.target - now.position, was_ahead = before.target - before.position;
    constexpr float kCosine = 0.966f;  // 15 degrees
    const bool turned = dot(ahead, was_ahead) < kCosine * length(ahead) * length(was_ahead);
    return !turned && length(now.position - before.position) < 0.25f * length(was_ahead);
}

MotionParams motion_params(const Camera& now, const Camera& before, int width, int height) {
    MotionParams m{};
    m.now = shade::camera_params(now, width, height);
    m.before = shade::camera_params(before, width, height);
    const auto moved = [](float to, float from) { return float(double(to) - double(from)); };
    m.moved_x = moved(now.position.x, before.position.x);
    m.moved_y = moved(now.position.y, before.position.y);
    m.moved_z = moved(now.position.z, before.position.z);
    m.still = now.position == before.position && now.target == before.target && now.up == before.up &&
                      now.fov_y_deg == before.fov_y_deg
                  ? 1
                  : 0;
    return m;
}

}  // namespace kiln::render
