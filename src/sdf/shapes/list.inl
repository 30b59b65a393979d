// SPDX-License-Identifier: MIT
// Every primitive, one line each: KILN_SHAPE(Type, name, how). `shapes/<name>.sdf.h` holds the rest.
// how: Exact (true distance outside the solid), Bound (1-Lipschitz lower bound), Sampled (also reads the program's samples).
// Files store names, so the order is free.
KILN_SHAPE(Sphere, sphere, Exact)
KILN_SHAPE(Box, box, Exact)
KILN_SHAPE(Torus, torus, Exact)
