// SPDX-License-Identifier: MIT
// A small grid of the shape `mesh`, made by hand: a ball, 27 bricks of samples and nine places of the coarse lattice alone.
#pragma once

#include "sdf/program.h"

#include <cmath>

namespace kiln::sdf {

/// Bricks at x = 0, 1 and 2; at x = 3 there is the coarse lattice. The bricks at x = 2 go over from one to the other.
inline MeshGrid ball_grid() {
    MeshGrid out;
    out.lo = {-1.2f, -1, -1.1f};
    out.hi = {1.45f, 1.05f, 0.95f};
    out.cell = 0.1f;
    out.columns = 4;
    out.rows = out.layers = 3;
    // A third of a distance: its interpolants are 1-Lipschitz in both levels.
    const auto ball = [](float i, float j, float k) {
        return (std::hypot(i - 12.1f, j - 10.3f, k - 10.4f) - 2) * 0.1f / 3;
    };
    const auto lattice = [](int x, int y, int z) { return size_t(2 * (x + 5 * (y + 4 * z))); };
    out.values.assign(28 * MeshGrid::kBlock, 0.0f);
    for (int z = 0; z <= 3; ++z)
        for (int y = 0; y <= 3; ++y)
            for (int x = 0; x <= 4; ++x) {
                out.values[lattice(x, y, z)] = ball(float(7 * x), float(7 * y), float(7 * z));
                const bool brick = x < 3 && y < 3 && z < 3;
                out.values[lattice(x, y, z) + 1] = brick ? float(1 + x + 3 * (y + 3 * z)) : -1.0f;
            }
    for (int brick = 0; brick < 27; ++brick) {
        const int x = brick % 3, y = brick / 3 % 3, z = brick / 9;
        for (int s = 0; s < 512; ++s) {
            const int i = s & 7, j = s >> 3 & 7, k = s >> 6;
            float coarse = 0;
            for (int c = 0; c < 8; ++c) {
                const float wx = (c & 1) ? float(i) / 7 : 1 - float(i) / 7;
                const float wy = (c & 2) ? float(j) / 7 : 1 - float(j) / 7;
                const float wz = (c & 4) ? float(k) / 7 : 1 - float(k) / 7;
                coarse += wx * wy * wz * out.values[lattice(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
            }
            const float fine = ball(float(7 * x + i), float(7 * y + j), float(7 * z + k));
            const float over = x == 2 ? float(i) / 7 : 0;
            out.values[size_t(1 + brick) * MeshGrid::kBlock + size_t(s)] = fine + (coarse - fine) * over;
        }
    }
    return out;
}

}  // namespace kiln::sdf
