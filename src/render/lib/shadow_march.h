// SPDX-License-Identifier: MIT
// soft_shadow.gpu.h for C++: a class that holds a field and has the text's functions as members.
//   SoftShadow shadow{[&](vec3 p) { return distance(p); }};   float seen = shadow.shadow_visible(p, l, tan_radius, march);
#pragma once

#include "math/math.gpu.h"

namespace kiln::render::shade {
using namespace kiln::gpu;

// Distance: callable, vec3 -> float, metres, a lower bound of the distance to the surface on both sides.
template <typename Distance>
struct SoftShadow {
    Distance distance;
    float band = 1e30f;  // metres: what a baked field would know

    vec3 shadow_field(vec3 p, vec3) {
        const float d = distance(p);
        return {d > band ? 1e30f : max(d, -band), min(std::fabs(d), band), 0};
    }
#include "render/lib/soft_shadow.gpu.h"
};

template <typename Distance>
SoftShadow(Distance, float = 0) -> SoftShadow<Distance>;

}  // namespace kiln::render::shade
