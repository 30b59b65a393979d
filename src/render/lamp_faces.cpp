// SPDX-License-Identifier: MIT
#include "render/lamp_faces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::render {

namespace {

constexpr float kWidestSpot = 60;  // degrees from its axis
constexpr float kOverlap = 1.1f;   // of a face's half side: at 256 texels a filter of 12 stays inside

vec4 with(vec3 v, float w) { return {v.x, v.y, v.z, w}; }

}  // namespace

LampFaces lamp_faces(std::span<const Light> lights, vec3 eye, uint32_t most) {
    LampFaces out;
    out.of.resize(lights.size(), 0.0f);
    most = std::min(most, kMostFaces);
    for (size_t i = 0; i < lights.size(); ++i) {
        const Light& light = lights[i];
        if (light.kind == Light::Kind::Directional) continue;
        const bool one = light.kind == Light::Kind::Spot && light.outer_deg <= kWidestSpot;
        if (out.faces.size() + (one ? 1 : 6) > most) continue;
        const float first = float(out.faces.size() + 1);
        out.of[i] = one ? -first : first;
        const vec4 at{float(double(light.position.x) - double(eye.x)), float(double(light.position.y) - double(eye.y)),
                      float(double(light.position.z) - double(eye.z)), 0};
        const auto add = [&](vec3 w, float half) {
            const vec3 aside = std::fabs(w.y) < 0.9f ? vec3{0, 1, 0} : vec3{1, 0, 0};
            const vec3 u = normalize(cross(aside, w));
            out.faces.push_back({with(u, half), with(cross(w, u), light.range), with(w, 0), at});
        };
        if (one) {
            const float angle = light.outer_deg * std::numbers::pi_v<float> / 180;
            add(normalize(light.direction), std::max(kOverlap * std::tan(angle), 0.01f));
            continue;
        }
        for (int face = 0; face < 6; ++face) {
            const float side = face % 2 == 0 ? 1.0f : -1.0f;
            add({face / 2 == 0 ? side : 0, face / 2 == 1 ? side : 0, face / 2 == 2 ? side : 0}, kOverlap);
        }
    }
    return out;
}

}  // namespace kiln::render
