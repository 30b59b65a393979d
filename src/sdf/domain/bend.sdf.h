// SPDX-License-Identifier: MIT
// Bend in the xy-plane: the X axis becomes a circle of radius 1 / curvature through the origin, towards +Y.
// Towards -Y for a negative curvature. Lengths along that circle stay; a point at height y is bent around the same centre.
// A shape longer than the circle overlaps itself; the solid is all of it.

struct Bend {
    param curvature;  // = 0.5 1/m, any: one over the radius of the circle
};

// With q = (curvature x, 1 - curvature y) from the circle's centre, in its radii: the angle of q is the way along the circle and
// 1 - |q| the height, written so that a small curvature cancels nothing. The way is known up to whole turns: the point of the bare
// shape nearest to `middle` (second = 0) or the second nearest (second = 1), both within two half turns of it.
KILN_SDF real3 copy_bend(real3 p, Bend s, param3 middle, param3 second) {
    if (abs(s.curvature) < KILN_C(1e-12)) return p;
    real2 q = real2(s.curvature * p.x, 1.0f - s.curvature * p.y);
    real height = (2.0f * p.y - s.curvature * (p.x * p.x + p.y * p.y)) / (1.0f + length(q));
    param from = s.curvature * middle.x;
    real angle = atan_of(q.x, q.y) - from;
    angle = angle - floor(angle * KILN_C(0.15915494309189535) + 0.5f) * KILN_C(6.283185307179586);
    angle = angle + select(lt(angle, 0.0f), KILN_C(6.283185307179586), KILN_C(-6.283185307179586)) * second.x;
    return real3((angle + from) / s.curvature, height, p.z);
}

#ifdef KILN_HOST
// Does [a, b] hold t or t plus whole turns?
KILN_SDF bool turns_past(param a, param b, param t) {
    const param turn = KILN_C(6.283185307179586);
    return t + turn * floor((b - t) / turn) >= a;
}
// A ring sector around (0, 1 / curvature); infinite where the child reaches the centre, which the compiler refuses.
KILN_SDF Bounds bounds_bend(Bend s, Bounds child) {
    const param k = abs(s.curvature);
    if (k < KILN_C(1e-12)) return child;
    const param low = s.curvature > 0.0f ? child.lo.y : -child.hi.y;
    const param high = s.curvature > 0.0f ? child.hi.y : -child.lo.y;
    const param a = k * child.lo.x;
    const param b = k * child.hi.x;
    const bool known = k * high < 1.0f && low > -kInfinite && b - a < kInfinite;
    if (!known) return Bounds{param3(-kInfinite, -kInfinite, child.lo.z), param3(kInfinite, kInfinite, child.hi.z)};
    const param inner = 1.0f / k - high;
    const param outer = 1.0f / k - low;
    // Sine and cosine over the angles [a, b].
    const param quarter = KILN_C(1.5707963267948966);
    const param most = turns_past(a, b, quarter) ? 1.0f : max(sin_of(a), sin_of(b));
    const param least = turns_past(a, b, -quarter) ? -1.0f : min(sin_of(a), sin_of(b));
    const param down = turns_past(a, b, 0.0f) ? 1.0f : max(cos_of(a), cos_of(b));
    const param up = turns_past(a, b, 2.0f * quarter) ? -1.0f : min(cos_of(a), cos_of(b));
    const param lo = 1.0f / k - (down > 0.0f ? outer : inner) * down;
    const param hi = 1.0f / k - (up > 0.0f ? inner : outer) * up;
    const bool flip = s.curvature < 0.0f;
    return Bounds{param3((least < 0.0f ? outer : inner) * least, flip ? -hi : lo, child.lo.z),
                  param3((most > 0.0f ? outer : inner) * most, flip ? -lo : hi, child.hi.z)};
}
KILN_SDF param half_turns_bend(Bend s, Bounds region) {
    return abs(s.curvature) * 0.5f * (region.hi.x - region.lo.x) * KILN_C(0.3183098861837907);
}
// The nearest point jumps half a turn from the middle of the region's X range, the second nearest a whole turn from it.
KILN_SDF param3 second_bend(Bend s, Bounds region) {
    return param3(half_turns_bend(s, region) > 1.0f ? 1.0f : 0.0f, 0.0f, 0.0f);
}
// The map turns, keeps lengths towards the centre and stretches around it by 1 / (curvature * distance from the centre), where that
// distance is 1 / curvature less the height of the bare point.
KILN_SDF param lipschitz_bend(Bend s, Bounds region) {
    if (abs(s.curvature) < KILN_C(1e-12)) return 1.0f;
    const param top = max(s.curvature * region.lo.y, s.curvature * region.hi.y);
    const bool legal = top < 1.0f && half_turns_bend(s, region) < 2.0f;
    return legal ? 1.0f / (1.0f - max(top, 0.0f)) : kInfinite;
}
#endif
