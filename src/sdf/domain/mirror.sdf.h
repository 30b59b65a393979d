// SPDX-License-Identifier: MIT
// Mirror: keeps the half of the child where the axis is positive, and its reflection. Folding never lengthens.

struct Mirror {
    param axis;  // = 0 1, axis: normal of the mirror
};

KILN_SDF real3 warp_mirror(real3 p, Mirror s) {
    if (s.axis < 0.5f) return real3(abs(p.x), p.y, p.z);
    if (s.axis < 1.5f) return real3(p.x, abs(p.y), p.z);
    return real3(p.x, p.y, abs(p.z));
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_mirror(Mirror s, Bounds child) {
    Bounds out = child;
    if (s.axis < 0.5f) {
        out.hi.x = max(child.hi.x, 0.0f);
        out.lo.x = -out.hi.x;
    } else if (s.axis < 1.5f) {
        out.hi.y = max(child.hi.y, 0.0f);
        out.lo.y = -out.hi.y;
    } else {
        out.hi.z = max(child.hi.z, 0.0f);
        out.lo.z = -out.hi.z;
    }
    return out;
}
KILN_SDF param lipschitz_mirror(Mirror, Bounds) { return 1.0f; }
#endif
