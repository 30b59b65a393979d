// SPDX-License-Identifier: MIT
#pragma once

#include <kiln/math.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace kiln::physics {

inline constexpr int kFacingBits = 14;  // of a number

/// Numbers the directions that a surface may face. Directions more than five degrees apart have different numbers: cells are at most 3.82
/// degrees wide. The direction as a point of an octahedron, unfolded (Meyer, Süßmuth, Sußner, Stamminger and Greiner, "On Floating-Point
/// Normal Vectors", 2010). `n` is not zero; its length does not matter.
inline uint32_t facing(vec3 n) {
    const float size = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    float u = n.x / size, v = n.z / size;
    if (n.y < 0) {
        const float folded = (1 - std::abs(v)) * std::copysign(1.0f, u);
        v = (1 - std::abs(u)) * std::copysign(1.0f, v);
        u = folded;
    }
    static constexpr int kHalf = kFacingBits / 2;
    static constexpr float kSteps = float((1 << kHalf) - 1);
    const auto step = [](float w) {
        return uint32_t(std::clamp(std::round((w * 0.5f + 0.5f) * kSteps), 0.0f, kSteps));
    };
    return step(u) << kHalf | step(v);
}

}  // namespace kiln::physics
