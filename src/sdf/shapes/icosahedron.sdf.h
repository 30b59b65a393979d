// SPDX-License-Identifier: MIT
// Regular icosahedron with a vertex on +Y and one of its neighbours in the half plane of +X.
// Exact everywhere; folded into one chamber as the tetrahedron is.

struct Icosahedron {
    param radius;  // = 0.5 m, > 0: centre to each vertex
};

KILN_SDF real sd_icosahedron(real3 p, Icosahedron s) {
    // In axes where the vertices are the cyclic permutations of (0, ±1, ±g) times k, g the golden ratio.
    real3 q = real3(p.z, p.x * KILN_C(-0.8506508083520399) + p.y * KILN_C(0.5257311121191336),
                    p.x * KILN_C(0.5257311121191336) + p.y * KILN_C(0.8506508083520399));
    // Chamber: between x = 0, y = 0 and the plane through a vertex and a face's centre, of normal (g, 1, -1/g) / 2.
    for (int i = 0; i < 5; ++i) {
        real beyond =
            max(abs(q.x) * KILN_C(0.8090169943749475) + abs(q.y) * 0.5f - abs(q.z) * KILN_C(0.3090169943749474), 0.0f);
        q = real3(abs(q.x) - beyond * KILN_C(1.618033988749895), abs(q.y) - beyond,
                  abs(q.z) + beyond * KILN_C(0.6180339887498949));
    }
    q = abs(q);
    param k = s.radius * KILN_C(0.5257311121191336);
    // Face of normal (1/g, 0, g) / sqrt(3); its half edge runs from (0, 0, g k) to the vertex (0, k, g k).
    real d = q.x * KILN_C(0.35682208977308993) + q.z * KILN_C(0.9341723589627157) - k * KILN_C(1.5115226281523415);
    real edge = length(real3(q.x, max(q.y - k, 0.0f), q.z - k * KILN_C(1.618033988749895)));
    return select(lt(q.x - d * KILN_C(0.35682208977308993), 0.0f), edge, d);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_icosahedron(Icosahedron s) {
    return symmetric(s.radius * KILN_C(0.8944271909999159), s.radius, s.radius * KILN_C(0.8506508083520399));
}
#endif
