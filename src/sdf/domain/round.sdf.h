// SPDX-License-Identifier: MIT
// Round: grows the solid by `radius`, rounding its convex edges.

struct Round {
    param radius;  // = 0.1 m, >= 0: how far the surface moves out
};

// p is the point in the space of the entry, for entries that need it.
KILN_SDF real value_round(real d, real3 p, Round s) { return d - s.radius; }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_round(Round s, Bounds child) { return inflated(child, s.radius); }
KILN_SDF param lipschitz_round(Round s, Bounds region) { return 1.0f; }
#endif
