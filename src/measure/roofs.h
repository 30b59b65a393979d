// SPDX-License-Identifier: MIT
// What one core of this machine can do at best with its widest instructions, measured: the roofs that rows are compared with.
#pragma once

namespace kiln::measure {

struct Roofs {
    double roots = 0;    ///< square roots a second: one a lane and edit is what distance fields cannot do without
    double flops = 0;    ///< multiplications and additions a second, fused
    double gathers = 0;  ///< 32-bit numbers a second gathered from the nearest cache
};

/// Measured once, a tenth of a second.
const Roofs& roofs();

}  // namespace kiln::measure
