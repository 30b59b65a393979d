// SPDX-License-Identifier: MIT
// Cone along y, cut or pointed: bottom at -half_height. Exact everywhere.
// Inside a convex polygon the nearest boundary point lies on the nearest side's line; outside, on the nearest side.

struct Cone {
    param half_height;    // = 0.5 m, > 0: centre to bottom and top
    param radius_bottom;  // = 0.5 m, >= 0: radius at -half_height
    param radius_top;     // = 0 m, >= 0: radius at +half_height
};

KILN_SDF real sd_cone(real3 p, Cone s) {
    real2 q = real2(from_axis(p), p.y);
    // The side runs from (radius_bottom, -half_height) along `side`; its outward normal is (side.y, -side.x) / length.
    param2 side = param2(s.radius_top - s.radius_bottom, 2.0f * s.half_height);
    param2 unit = side / length(side);
    real2 from = real2(q.x - s.radius_bottom, q.y + s.half_height);
    real slant = from.x * unit.y - from.y * unit.x;
    real inside = max(slant, abs(q.y) - s.half_height);
    // Nearest points of the side and of the discs.
    real t = clamp(dot(from, real2(unit)) / length(side), 0.0f, 1.0f);
    real2 to_side = real2(from.x - side.x * t, from.y - side.y * t);
    real rim = select(lt(q.y, 0.0f), s.radius_bottom, s.radius_top);
    real2 to_disc = real2(max(q.x - rim, 0.0f), abs(q.y) - s.half_height);
    real outside = sqrt(min(dot(to_side, to_side), dot(to_disc, to_disc)));
    return select(gt(inside, 0.0f), outside, inside);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_cone(Cone s) {
    param r = max(s.radius_bottom, s.radius_top);
    return symmetric(r, s.half_height, r);
}
#endif
