// SPDX-License-Identifier: MIT
// Union: a or b.

KILN_SDF real op_union(real a, real b, param k) { return smooth_min(a, b, k); }
KILN_SDF real share_union(real a, real b, param k) { return share_min(a, b, k); }
