// SPDX-License-Identifier: MIT
// Shell: keeps a layer of the given thickness around the child's surface, half of it outside.

struct Shell {
    param thickness;  // = 0.05 m, > 0: of the layer
};

// p is not used.
KILN_SDF real value_shell(real d, real3 p, Shell s) { return abs(d) - 0.5f * s.thickness; }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_shell(Shell s, Bounds child) { return inflated(child, 0.5f * s.thickness); }
KILN_SDF param lipschitz_shell(Shell, Bounds) { return 1.0f; }
#endif
