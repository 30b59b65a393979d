// SPDX-License-Identifier: MIT
// Pyramid over a square: base at -half_height, apex at +half_height on the axis.
// Exact everywhere. By symmetry the nearest point lies in the wedge x >= |z| of p; there the solid has the base, one slanted side
// and one edge of it.

struct Pyramid {
    param half_height;  // = 0.5 m, > 0: centre to base and apex
    param half_extent;  // = 0.5 m, > 0: axis to each side of the base
};

KILN_SDF real sd_pyramid(real3 p, Pyramid s) {
    real x = max(abs(p.x), abs(p.z));
    real z = min(abs(p.x), abs(p.z));
    real y = p.y + s.half_height;
    param e = s.half_extent;
    param h = 2.0f * s.half_height;
    // The side: up its middle line from (e, 0) to (0, h) by `up`, across it by z, out of it by `out_of`.
    param slant = length(param2(e, h));
    real up = ((e - x) * e + y * h) / slant;
    real out_of = ((x - e) * h + y * e) / slant;
    real inside = max(out_of, -y);
    // Distance within the side's plane: 0 on the triangle, else to its edge from (up 0, z e) to (slant, 0).
    // Below up = 0 the base is nearer.
    real beyond = up * e + (z - e) * slant;
    param edge2 = slant * slant + e * e;
    real t = clamp((up * slant + (e - z) * e) / edge2, 0.0f, 1.0f);
    real2 to_edge = real2(up - slant * t, z - e + e * t);
    real within = select(both(ge(up, 0.0f), le(beyond, 0.0f)), 0.0f, dot(to_edge, to_edge));
    real3 to_base = real3(max(x - e, 0.0f), y, max(z - e, 0.0f));
    real outside = sqrt(min(out_of * out_of + within, dot(to_base, to_base)));
    return select(gt(inside, 0.0f), outside, inside);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_pyramid(Pyramid s) { return symmetric(s.half_extent, s.half_height, s.half_extent); }
#endif
