// SPDX-License-Identifier: MIT
// Repeat: a grid of copies centred on the origin.
// A point sees its two nearest copies an axis; that is exact because the child must fit one spacing (copies cannot overlap) and cells are centred on the child's bounds, so a third copy is never nearer.

struct Repeat {
    param3 spacing;  // = (1, 1, 1) m, >= 0: distance between copies along each axis, 0 for none
    param3 count;    // = (0, 0, 0) 1, integer [0, 65536]: copies along each axis, 0 for endless
};

// One axis: the child's coordinate of x in its nearest copy (second = 0) or its second nearest (second = 1).
// `middle` is the centre of the child's bounds on that axis. Where only one copy exists both answers are that copy.
KILN_SDF real repeat_axis(real x, param spacing, param count, param middle, param second) {
    if (spacing <= 0.0f) return x;
    // Endless: copies at whole multiples of the spacing. Counted: at (i - (count - 1) / 2) * spacing, i = 0 … count - 1.
    param shift = select(gt(count, 0.0f), 0.5f * (count - 1.0f), 0.0f);
    param last = select(gt(count, 0.0f), count - 1.0f, KILN_C(1e9));
    param first = select(gt(count, 0.0f), 0.0f, KILN_C(-1e9));
    real u = (x - middle) / spacing + shift;
    real near = clamp(floor(u + 0.5f), first, last);
    real next = clamp(near + select(lt(u, near), -1.0f, 1.0f), first, last);
    real index = near + (next - near) * second;
    return x - (index - shift) * spacing;
}

KILN_SDF real3 copy_repeat(real3 p, Repeat s, param3 middle, param3 second) {
    return real3(repeat_axis(p.x, s.spacing.x, s.count.x, middle.x, second.x),
                 repeat_axis(p.y, s.spacing.y, s.count.y, middle.y, second.y),
                 repeat_axis(p.z, s.spacing.z, s.count.z, middle.z, second.z));
}

#ifdef KILN_HOST
KILN_SDF param repeat_reach(param spacing, param count) {
    if (spacing <= 0.0f) return 0.0f;
    return count > 0.0f ? 0.5f * (count - 1.0f) * spacing : kInfinite;
}
KILN_SDF Bounds bounds_repeat(Repeat s, Bounds child) {
    param3 r = param3(repeat_reach(s.spacing.x, s.count.x), repeat_reach(s.spacing.y, s.count.y),
                      repeat_reach(s.spacing.z, s.count.z));
    return Bounds{child.lo - r, child.hi + r};
}
// Axes along which a point can see two copies.
KILN_SDF param3 second_repeat(Repeat s, Bounds region) {
    return param3(s.spacing.x > 0.0f && s.count.x != 1.0f ? 1.0f : 0.0f,
                  s.spacing.y > 0.0f && s.count.y != 1.0f ? 1.0f : 0.0f,
                  s.spacing.z > 0.0f && s.count.z != 1.0f ? 1.0f : 0.0f);
}
KILN_SDF param lipschitz_repeat(Repeat s, Bounds region) { return 1.0f; }
#endif
