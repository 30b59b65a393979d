// SPDX-License-Identifier: MIT
// The functions of formulas that are more than one word of the shape language. Shared with GLSL.

KILN_SDF real fn_sqrt(real a) { return sqrt(max(a, real(0.0f))); }
// The polynomials lose their way far from the origin; the result never leaves [-1, 1].
KILN_SDF real fn_sin(real a) { return clamp(sin_of(a), real(-1.0f), real(1.0f)); }
KILN_SDF real fn_cos(real a) { return clamp(cos_of(a), real(-1.0f), real(1.0f)); }
KILN_SDF real fn_mod(real a, real b) { return a - b * floor(a / b); }
