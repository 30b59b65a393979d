// SPDX-License-Identifier: MIT
// Sine, cosine and arc tangent of the shape language, as polynomials, so that every lane type and device
// rounds alike. KILN_T is the type this inclusion is for (real or param); no include guard.
// Coefficients: minimax fits in the Cephes tradition (Moshier, "Methods and Programs for Mathematical Functions", 1989).
// Absolute error below 2e-7 for |x| up to 1e4 (sine, cosine), 4e-7 (arc tangent).

// x less whole turns, in [-pi, pi]. The turn is taken off in three parts whose products with small integers are exact
// (Cody and Waite, "Software Manual for the Elementary Functions", 1980).
KILN_SDF KILN_T within_turn(KILN_T x) {
    KILN_T turns = floor(x * KILN_C(0.15915494309189535) + 0.5f);
    return ((x - turns * 6.28125f) - turns * KILN_C(0.0019350051879882812)) - turns * KILN_C(3.019916050561733e-07);
}

// Sine for |r| <= pi/2.
KILN_SDF KILN_T sin_quarter(KILN_T r) {
    KILN_T s = r * r;
    KILN_T poly = KILN_C(-2.5052108385441718e-08);
    poly = poly * s + KILN_C(2.7557319223985893e-06);
    poly = poly * s + KILN_C(-0.0001984126984126984);
    poly = poly * s + KILN_C(0.008333333333333333);
    poly = poly * s + KILN_C(-0.16666666666666666);
    return r + r * s * poly;
}

KILN_SDF KILN_T sin_of(KILN_T x) {
    KILN_T r = within_turn(x);
    KILN_T folded = select(gt(r, KILN_C(1.5707963267948966)), KILN_C(3.141592653589793) - r, r);
    return sin_quarter(select(lt(r, KILN_C(-1.5707963267948966)), KILN_C(-3.141592653589793) - r, folded));
}

KILN_SDF KILN_T cos_of(KILN_T x) { return sin_quarter(KILN_C(1.5707963267948966) - abs(within_turn(x))); }

// Angle of the point (x, y) in (-pi, pi]; 0 at the origin.
KILN_SDF KILN_T atan_of(KILN_T y, KILN_T x) {
    KILN_T ax = abs(x);
    KILN_T ay = abs(y);
    KILN_T big = max(ax, ay);
    KILN_T small = min(ax, ay);
    KILN_T q = small / max(big, KILN_C(1e-37));
    // q in [0, 1]: above tan(pi/8), atan(q) = pi/4 + atan((q - 1) / (q + 1)).
    KILN_T far = (q - 1.0f) / (q + 1.0f);
    KILN_T t = select(gt(q, KILN_C(0.41421356237309503)), far, q);
    KILN_T base = select(gt(q, KILN_C(0.41421356237309503)), KILN_C(0.7853981633974483), KILN_C(0.0));
    KILN_T s = t * t;
    KILN_T poly = KILN_C(0.0805374449538);
    poly = poly * s + KILN_C(-0.138776856032);
    poly = poly * s + KILN_C(0.199777106478);
    poly = poly * s + KILN_C(-0.333329491539);
    KILN_T angle = base + (t + t * s * poly);
    angle = select(gt(ay, ax), KILN_C(1.5707963267948966) - angle, angle);
    angle = select(lt(x, 0.0f), KILN_C(3.141592653589793) - angle, angle);
    return select(lt(y, 0.0f), -angle, angle);
}
