// SPDX-License-Identifier: MIT
// Regular tetrahedron with a vertex on +Y and one of the others in the half plane of +X. Exact everywhere.
// The mirror planes of a regular solid fold space into one chamber, in which the solid has one piece of face, half an edge and
// one vertex; folding never lengthens, and the nearest point lies in the chamber of p.

struct Tetrahedron {
    param radius;  // = 0.5 m, > 0: centre to each vertex
};

KILN_SDF real sd_tetrahedron(real3 p, Tetrahedron s) {
    // In axes where the vertices are (1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1) times k.
    real y = p.y * KILN_C(0.5773502691896258);
    real z = p.z * KILN_C(0.7071067811865476);
    real w = p.x * KILN_C(0.4082482904638631);
    real3 c = real3(y + 2.0f * w, y - w - z, y - w + z);
    param k = s.radius * KILN_C(0.5773502691896258);
    // Chamber c.x >= c.y >= |c.z|: largest in size first, then the sign of the product goes to the last.
    real a = max(c.x, max(c.y, c.z));
    real b = min(c.x, min(c.y, c.z));
    real m = max(min(c.x, c.y), min(max(c.x, c.y), c.z));
    // a >= m >= b. Mirror m + b = 0, then order again: the last two now sum to at least 0, for a >= m, and -b >= m where it mirrored.
    real fold = min(m + b, 0.0f);
    m = m - fold;
    b = b - fold;
    real top = max(a, m);
    real next = min(a, m);
    real mid = max(next, b);
    real low = min(next, b);
    // Face (1, 1, -1): distance k / sqrt(3) from the centre.
    real d = (top + mid - low - k) * KILN_C(0.5773502691896258);
    // Its half edge runs from (k, 0, 0) to (k, k, k), where the face's points have mid = low.
    real t = min((mid + low) * 0.5f, k);
    real edge = length(real3(top - k, mid - t, low - t));
    return select(gt(low - mid + d * KILN_C(1.1547005383792515), 0.0f), edge, d);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_tetrahedron(Tetrahedron s) {
    param r = s.radius;
    return Bounds{param3(r * KILN_C(-0.4714045207910317), -r / 3.0f, r * KILN_C(-0.816496580927726)),
                  param3(r * KILN_C(0.9428090415820634), r, r * KILN_C(0.816496580927726))};
}
#endif
