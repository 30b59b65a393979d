// SPDX-License-Identifier: MIT
// Subtract: a without b.

KILN_SDF real op_subtract(real a, real b, param k) { return -smooth_min(-a, b, k); }
KILN_SDF real share_subtract(real a, real b, param k) { return share_min(-a, b, k); }
