// SPDX-License-Identifier: MIT
// Planet: a ball with hills and craters that rise and fall by at most `relief`; another seed, another planet.
#pragma once

#include "sdf/library/tree.h"

#include <algorithm>
#include <cmath>

namespace kiln::sdf {

struct PlanetRecord {
    param radius;  // = 0.5 m, > 0: mean radius
    param seed;    // = 0 1, integer [0, 16777215]: where hills and craters are
    param relief;  // = 0.05 m, >= 0: highest hill above and deepest valley below the mean radius, at most half of it
};

inline Object planet_object(const PlanetRecord& s) {
    // In units of the radius. Hills use 0.9 of the relief in two octaves; what is left covers the rims that blending moves.
    const float relief = std::clamp(s.relief / s.radius, 0.0f, 0.5f);
    Tree tree("planet", Op::Subtract, 0.25f * relief, s.radius);
    tree.leaf(0, Sphere{.radius = 1}, {},
              {Displace{.amplitude = 0.6f * relief, .frequency = 1.5f, .seed = s.seed},
               Displace{.amplitude = 0.3f * relief, .frequency = 4.0f, .seed = s.seed + 1}});
    if (relief == 0) return tree.take();

    // Numbers in [0, 1): a Weyl sequence of the golden ratio, started by the seed.
    float state = std::fmod(s.seed * 0.7548777f, 1.0f);
    const auto next = [&state] {
        state = std::fmod(state + 0.6180340f, 1.0f);
        return state;
    };
    for (int i = 0; i < 12; ++i) {
        // Evenly over the sphere: uniform height, uniform longitude (Archimedes).
        const float y = 2 * ((float(i) + next()) / 12) - 1;
        const float longitude = 6.2831853f * next();
        const float ring = std::sqrt(std::max(1 - y * y, 0.0f));
        const float mouth = 0.1f + 0.2f * next();
        // A ball that cuts `depth` into the mean sphere over a disc of radius `mouth` (flat-disc approximation of the sphere).
        const float depth = 0.5f * relief;
        const float ball = (mouth * mouth + depth * depth) / (2 * depth);
        const float from = 1 - depth + ball;
        tree.leaf(0, Sphere{.radius = ball},
                  at({from * ring * std::cos(longitude), from * y, from * ring * std::sin(longitude)}));
    }
    return tree.take();
}

}  // namespace kiln::sdf
