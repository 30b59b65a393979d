// SPDX-License-Identifier: MIT
// Regular octahedron with its vertices on the axes.
// Exact everywhere; folded into one chamber as the tetrahedron is.

struct Octahedron {
    param radius;  // = 0.5 m, > 0: centre to each vertex
};

KILN_SDF real sd_octahedron(real3 p, Octahedron s) {
    real3 q = abs(p);
    real top = max(q.x, max(q.y, q.z));
    real low = min(q.x, min(q.y, q.z));
    real mid = max(min(q.x, q.y), min(max(q.x, q.y), q.z));
    real d = (top + mid + low - s.radius) * KILN_C(0.5773502691896258);
    // The half edge runs from the vertex (radius, 0, 0) to (radius / 2, radius / 2, 0), where the face's points have low = 0.
    real t = max((s.radius - top + mid) * 0.5f, 0.0f);
    real edge = length(real3(top - s.radius + t, mid - t, low));
    return select(lt(low - d * KILN_C(0.5773502691896258), 0.0f), edge, d);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_octahedron(Octahedron s) { return symmetric(s.radius, s.radius, s.radius); }
#endif
