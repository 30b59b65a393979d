// SPDX-License-Identifier: MIT
// C++-only companions of the shape texts: boxes and what their bounds functions are written with.
// Included inside the scalar float namespace that defines KILN_HOST, after scalar.h.

struct Bounds {
    param3 lo, hi;
};
constexpr param kInfinite = std::numeric_limits<param>::infinity();
KILN_SDF Bounds symmetric(param x, param y, param z) { return {param3(-x, -y, -z), param3(x, y, z)}; }
KILN_SDF Bounds inflated(Bounds b, param by) { return {b.lo - param3(by, by, by), b.hi + param3(by, by, by)}; }
/// Largest distance of a point of the box from the y axis.
KILN_SDF param farthest_xz(Bounds b) {
    return length(param2(max(abs(b.lo.x), abs(b.hi.x)), max(abs(b.lo.z), abs(b.hi.z))));
}
