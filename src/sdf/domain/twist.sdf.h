// SPDX-License-Identifier: MIT
// Twist about +Y: the cross-section at height y is turned by rate * y, right-handed.

struct Twist {
    param rate;  // = 1 rad/m, any: turn per metre of height
};

// From the twisted space back to the bare shape's.
KILN_SDF real3 warp_twist(real3 p, Twist s) {
    real angle = p.y * s.rate;
    real c = cos_of(angle);
    real n = sin_of(angle);
    // Turning by +angle about +Y takes (x, z) to (c x + n z, c z - n x); this is the inverse.
    return real3(c * p.x - n * p.z, p.y, n * p.x + c * p.z);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_twist(Twist s, Bounds child) {
    if (s.rate == 0.0f) return child;
    param r = farthest_xz(child);
    return Bounds{param3(-r, child.lo.y, -r), param3(r, child.hi.y, r)};
}
// The distance from the axis stays. The Jacobian is a rotation times the shear [1 a; 0 1], a = rate * r, whose largest singular value is (a + sqrt(a² + 4)) / 2.
KILN_SDF param lipschitz_twist(Twist s, Bounds region) {
    param a = abs(s.rate) * farthest_xz(region);
    return 0.5f * (a + sqrt(a * a + 4.0f));
}
#endif
