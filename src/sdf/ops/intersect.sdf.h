// SPDX-License-Identifier: MIT
// Intersect: what a and b share.

KILN_SDF real op_intersect(real a, real b, param k) { return -smooth_min(-a, -b, k); }
KILN_SDF real share_intersect(real a, real b, param k) { return share_min(-a, -b, k); }
