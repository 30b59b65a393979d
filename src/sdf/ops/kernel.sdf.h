// SPDX-License-Identifier: MIT
// The smooth minimum every operation is made of: the quadratic polynomial kernel (Quilez, "Smooth minimum", 2013).
// k is the |a - b| where blending begins; where |a - b| >= k the result has the bits of min(a, b).
// Its gradient is a convex combination of the operands' gradients, so it is 1-Lipschitz when they are.

KILN_SDF real smooth_min(real a, real b, param k) {
    real h = part_of(max(k - abs(a - b), 0.0f), max(k, KILN_C(1e-30)));
    return min(a, b) - h * h * (k * 0.25f);
}

// Share of b in smooth_min(a, b): its derivative by b. 1/2 at the seam, h/2 for the farther operand.
// A tie with k = 0 goes to a.
KILN_SDF real share_min(real a, real b, param k) {
    real h = part_of(max(k - abs(a - b), 0.0f), max(k, KILN_C(1e-30)));
    return select(lt(b, a), 1.0f - 0.5f * h, 0.5f * h);
}
