// SPDX-License-Identifier: MIT
// Expression: the solid where a formula of the local point is below 0, cut to the box of `half_extents`.
// The formula itself is compiled to the tape (expression.h); its value is divided by its largest slope over the box. So there is no
// distance function here, only numbers and bounds.

struct Expression {
    param lipschitz;      // = 0 1, >= 0: largest slope of the formula over the box, checked, 0 to have it found
    param3 half_extents;  // = (1, 1, 1) m, > 0: of the box the solid is cut to
};

#ifdef KILN_HOST
KILN_SDF Bounds bounds_expression(Expression s) {
    return symmetric(s.half_extents.x, s.half_extents.y, s.half_extents.z);
}
#endif
