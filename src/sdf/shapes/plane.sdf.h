// SPDX-License-Identifier: MIT
// Plane: everything below y = 0 is solid. Exact everywhere.

// GLSL has no empty structs, so the texts of a shape without parameters take none.
#ifdef KILN_HOST
struct Plane {};
#endif

KILN_SDF real sd_plane(real3 p) { return p.y; }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_plane() {
    return Bounds{param3(-kInfinite, -kInfinite, -kInfinite), param3(kInfinite, 0.0f, kInfinite)};
}
#endif
