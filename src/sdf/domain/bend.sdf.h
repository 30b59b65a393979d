// SPDX-License-Identifier: MIT
// Bend in the xy-plane: the X axis becomes a circle of radius 1 / curvature through the origin, towards +Y.
// Towards -Y for a negative curvature. Lengths along that circle stay; a point at height y is bent around the same centre.

struct Bend {
    param curvature;  // = 0.5 1/m, any: one over the radius of the circle
};

// With q = (curvature x, 1 - curvature y) from the circle's centre, in its radii: the angle of q is the way along the circle and
// 1 - |q| the height, written so that a small curvature cancels nothing.
KILN_SDF real3 warp_bend(real3 p, Bend s) {
    if (abs(s.curvature) < KILN_C(1e-12)) return p;
    real2 q = real2(s.curvature * p.x, 1.0f - s.curvature * p.y);
    real along = atan_of(q.x, q.y) / s.curvature;
    real height = (2.0f * p.y - s.curvature * (p.x * p.x + p.y * p.y)) / (1.0f + length(q));
    return real3(along, height, p.z);
}

#ifdef KILN_HOST
// A ring sector around (0, 1 / curvature). Infinite, which the compiler refuses, where the child reaches the centre or goes
// more than all the way round.
KILN_SDF Bounds bounds_bend(Bend s, Bounds child) {
    const param k = abs(s.curvature);
    if (k < KILN_C(1e-12)) return child;
    const param low = s.curvature > 0.0f ? child.lo.y : -child.hi.y;
    const param high = s.curvature > 0.0f ? child.hi.y : -child.lo.y;
    const param a = k * child.lo.x;
    const param b = k * child.hi.x;
    const bool legal = k * high < 1.0f && a > KILN_C(-3.1415926) && b < KILN_C(3.1415926) && low > -kInfinite;
    if (!legal) return Bounds{param3(-kInfinite, -kInfinite, child.lo.z), param3(kInfinite, kInfinite, child.hi.z)};
    const param inner = 1.0f / k - high;
    const param outer = 1.0f / k - low;
    // Sine and cosine over the angles [a, b].
    const param quarter = KILN_C(1.5707963267948966);
    const param most = a <= quarter && quarter <= b ? 1.0f : max(sin_of(a), sin_of(b));
    const param least = a <= -quarter && -quarter <= b ? -1.0f : min(sin_of(a), sin_of(b));
    const param down = a <= 0.0f && 0.0f <= b ? 1.0f : max(cos_of(a), cos_of(b));
    const param up = min(cos_of(a), cos_of(b));
    const param lo = 1.0f / k - (down > 0.0f ? outer : inner) * down;
    const param hi = 1.0f / k - (up > 0.0f ? inner : outer) * up;
    const bool flip = s.curvature < 0.0f;
    return Bounds{param3((least < 0.0f ? outer : inner) * least, flip ? -hi : lo, child.lo.z),
                  param3((most > 0.0f ? outer : inner) * most, flip ? -lo : hi, child.hi.z)};
}
// The map turns, keeps lengths towards the centre and stretches around it by 1 / (curvature * distance from the centre).
// It jumps on the far side of the centre; no bound on a region that reaches there.
KILN_SDF param lipschitz_bend(Bend s, Bounds region) {
    const param k = abs(s.curvature);
    if (k < KILN_C(1e-12)) return 1.0f;
    const param r = 1.0f / k;
    const param low = s.curvature > 0.0f ? region.lo.y : -region.hi.y;
    const param high = s.curvature > 0.0f ? region.hi.y : -region.lo.y;
    const param x = max(max(region.lo.x, -region.hi.x), 0.0f);
    const param y = max(max(low - r, r - high), 0.0f);
    const bool reaches_far_side = x == 0.0f && high >= r;
    const param nearest = length(param2(x, y));
    if (reaches_far_side || !(nearest > 0.0f)) return kInfinite;
    return max(r / nearest, 1.0f);
}
#endif
