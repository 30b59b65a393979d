// SPDX-License-Identifier: MIT
// Particles of a frame in order, and which part of a picture may show which. A particle lies in at most nine bins, whatever its size, so
// that many cost what their number says.
#pragma once

#include "render/lib/camera.gpu.h"
#include "render/passes/particles.gpu.h"

#include <kiln/renderer.h>

#include <array>
#include <span>
#include <vector>

namespace kiln::render {

struct ParticleBins {
    std::vector<ParticleRecord> records;  // nearest first; of equals the same whatever the order they came in
    std::vector<uint32_t> ends;     // of each bin's list in `numbers`, all bins of all levels; the first begins at 0
    std::vector<uint32_t> numbers;  // of records, ascending in each bin
    std::array<uint32_t, size_t(kParticleLevels)> first_level{}, across{};
};

// Of the part of the picture that begins at pixel (left, top). Particles behind the eye, or that are not finite, are left out.
ParticleBins particle_bins(std::span<const Particle> particles, const shade::CameraParams& camera, int left, int top,
                           int width, int height);

// The picture that passes of shadows look at for particles: a pixel each, row after row; `light` alone in every tile's list.
struct ParticleSun {
    FrameParams frame;
    std::vector<FrameRay> rays;   // from their middles
    std::vector<uint32_t> masks;  // as cluster.comp writes
};
ParticleSun particle_sun(std::span<const ParticleRecord> records, const FrameParams& frame, uint32_t light);

}  // namespace kiln::render
