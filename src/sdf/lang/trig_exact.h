// SPDX-License-Identifier: MIT
// Sine and friends of the shape language for the double lane type: the standard library's. Included inside a namespace.

KILN_SDF real sin_of(real x) { return std::sin(x); }
KILN_SDF real cos_of(real x) { return std::cos(x); }
KILN_SDF real exp_of(real x) { return std::exp(clamp(x, -87.0, 88.0)); }
KILN_SDF real log_of(real x) { return std::log(max(x, 1e-37)); }
KILN_SDF real atan_of(real y, real x) { return x == 0 && y == 0 ? real(0) : std::atan2(y, x); }
