// SPDX-License-Identifier: MIT
// What several shapes are made of. Included before every shape.

// Distance from the y axis.
KILN_SDF real from_axis(real3 p) { return length(real2(p.x, p.z)); }

// Distance to the intersection of two solids whose distances a and b change in perpendicular directions (a cylinder is the
// intersection of a pillar and a slab): exact when a and b are.
KILN_SDF real corner(real a, real b) { return min(max(a, b), 0.0f) + length(real2(max(a, 0.0f), max(b, 0.0f))); }
