// SPDX-License-Identifier: MIT
// Taper: the cross-section at height y is scaled by 1 - rate * y, but never below 0.05.

struct Taper {
    param rate;  // = 0.3 1/m, any: how much of the cross-section is lost per metre of height
};

KILN_SDF real3 warp_taper(real3 p, Taper s) {
    real scale = max(1.0f - s.rate * p.y, KILN_C(0.05));
    return real3(p.x / scale, p.y, p.z / scale);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_taper(Taper s, Bounds child) {
    if (s.rate == 0.0f) return child;
    const param a = max(1.0f - s.rate * child.lo.y, KILN_C(0.05));
    const param b = max(1.0f - s.rate * child.hi.y, KILN_C(0.05));
    const param most = max(a, b);
    const param least = min(a, b);
    return Bounds{param3(child.lo.x * (child.lo.x < 0.0f ? most : least), child.lo.y,
                         child.lo.z * (child.lo.z < 0.0f ? most : least)),
                  param3(child.hi.x * (child.hi.x > 0.0f ? most : least), child.hi.y,
                         child.hi.z * (child.hi.z > 0.0f ? most : least))};
}
// With c = 1 / scale the Jacobian, in the plane of the axis and the point, is [c b; 0 1], b = rate * r * c² = rate * c * (r of the bare
// point), and c across that plane; its largest singular value squared is (S + sqrt(S² - 4 c²)) / 2, S = 1 + b² + c², which grows
// with b and c.
KILN_SDF param lipschitz_taper(Taper s, Bounds region) {
    if (s.rate == 0.0f) return 1.0f;
    const param c = 1.0f / max(1.0f - max(s.rate * region.lo.y, s.rate * region.hi.y), KILN_C(0.05));
    const param b = abs(s.rate) * farthest_xz(region) * c;
    const param sum = 1.0f + b * b + c * c;
    return sqrt(0.5f * (sum + sqrt(max((sum - 2.0f * c) * (sum + 2.0f * c), 0.0f))));
}
#endif
