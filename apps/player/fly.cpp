// SPDX-License-Identifier: MIT
#include "player/fly.h"

#include <algorithm>
#include <cmath>

namespace kiln::player {

namespace {

constexpr float kRadiansAPixel = 0.003f;
constexpr float kSteepest = 1.55f;  // radians, a little less than straight up
constexpr float kPi = 3.14159265f;

}  // namespace

FlyCamera::FlyCamera(const Camera& start) : lens_(start), position_(start.position) {
    lens_.up = {0, 1, 0};
    const vec3 d = start.target - start.position;
    if (const float far = length(d); far > 0) {
        yaw_ = std::atan2(d.x, -d.z);
        pitch_ = std::clamp(std::asin(std::clamp(d.y / far, -1.0f, 1.0f)), -kSteepest, kSteepest);
    }
}

vec3 FlyCamera::forward() const {
    return {std::sin(yaw_) * std::cos(pitch_), std::sin(pitch_), -std::cos(yaw_) * std::cos(pitch_)};
}

Camera FlyCamera::camera() const {
    Camera out = lens_;
    out.position = position_;
    out.target = position_ + forward();
    return out;
}

void FlyCamera::move(float right, float up, float ahead) {
    position_ = position_ + vec3{std::cos(yaw_), 0, std::sin(yaw_)} * right + vec3{0, up, 0} + forward() * ahead;
}

vec3 FlyCamera::along_ground(float right, float ahead) const {
    return vec3{std::cos(yaw_), 0, std::sin(yaw_)} * right + vec3{std::sin(yaw_), 0, -std::cos(yaw_)} * ahead;
}

void FlyCamera::look(float x, float y) {
    yaw_ = std::remainder(yaw_ + x * kRadiansAPixel, 2 * kPi);
    pitch_ = std::clamp(pitch_ - y * kRadiansAPixel, -kSteepest, kSteepest);
}

Ray FlyCamera::ray(float x, float y, int width, int height) const {
    const float tall = std::tan(lens_.fov_y_deg * kPi / 360);
    const float wide = tall * float(width) / float(height);
    const vec3 ahead = forward(), right{std::cos(yaw_), 0, std::sin(yaw_)}, up = cross(right, ahead);
    const float u = 2 * (x + 0.5f) / float(width) - 1, v = 1 - 2 * (y + 0.5f) / float(height);
    return {.origin = position_, .direction = normalize(ahead + right * (u * wide) + up * (v * tall))};
}

}  // namespace kiln::player
