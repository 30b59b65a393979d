// SPDX-License-Identifier: MIT
// The same work done the slow way: every edit at every texel, no culling, no bricks. Benchmarks and tests compare with it.
#pragma once

#include "field/host_bricks.h"
#include "sdf/program.h"

#include <cstdint>

namespace kiln::measure {

/// What a field stores: each cell's texels, or its sign where it has none. Sums over cells, so any order and any slots give one number.
struct Stored {
    uint64_t checksum = 0;     ///< of the cells looked at
    uint64_t cells = 0;        ///< looked at: every `stride`-th
    uint64_t bricks = 0;       ///< of those
    uint64_t band_voxels = 0;  ///< lattice points of those with |d| < 3 voxels (brute_force() only)
    friend bool operator==(const Stored&, const Stored&) = default;
};

Stored stored(const field::HostBricks& bricks, uint64_t stride = 1);
/// The same of a program, on the grid of `field`, whose code and cells are not looked at. On all cores.
Stored brute_force(const sdf::Program& program, const field::Field& field, uint64_t stride = 1);

}  // namespace kiln::measure
