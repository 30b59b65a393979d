// SPDX-License-Identifier: MIT
// Exponential and natural logarithm of the shape language, as polynomials (Moshier, "Methods and Programs for Mathematical Functions",
// 1989), so that every lane type and device rounds alike. For values that differ from lane to lane only.
// Relative error of exp below 2e-7 for x in [-87, 88], where it is cut off; error of log below 1e-7 times 1 + |log x|,
// x cut off below 1e-37.

KILN_SDF real exp_of(real x_wanted) {
    real x = clamp(x_wanted, real(-87.0f), real(88.0f));
    real n = floor(x * KILN_C(1.4426950408889634) + 0.5f);
    real r = (x - n * 0.693359375f) - n * KILN_C(-0.00021219444005469057);  // n ln 2, the first part exactly
    real poly = real(KILN_C(0.00019875691500));
    poly = poly * r + KILN_C(0.0013981999507);
    poly = poly * r + KILN_C(0.0083334519073);
    poly = poly * r + KILN_C(0.041665795894);
    poly = poly * r + KILN_C(0.16666665459);
    poly = poly * r + KILN_C(0.50000001201);
    real power = real_of_bits(whole_of(n + 127.0f) << 23);  // 2ⁿ
    return (poly * (r * r) + r + 1.0f) * power;
}

KILN_SDF real log_of(real x_wanted) {
    real x = max(x_wanted, real(KILN_C(1e-37)));
    whole bits = bits_of(x);
    real e = real_of(bits >> 23) - 126.0f;
    real m = real_of_bits((bits & whole(0x7fffffu)) + whole(0x3f000000u));  // x = m 2ᵉ, m in [1/2, 1)
    mask small = lt(m, real(KILN_C(0.7071067811865476)));
    e = select(small, e - 1.0f, e);
    real f = select(small, m + m, m) - 1.0f;
    real s = f * f;
    real poly = real(KILN_C(0.070376836292));
    poly = poly * f + KILN_C(-0.11514610310);
    poly = poly * f + KILN_C(0.11676998740);
    poly = poly * f + KILN_C(-0.12420140846);
    poly = poly * f + KILN_C(0.14249322787);
    poly = poly * f + KILN_C(-0.16668057665);
    poly = poly * f + KILN_C(0.20000714765);
    poly = poly * f + KILN_C(-0.24999993993);
    poly = poly * f + KILN_C(0.33333331174);
    real tail = f * s * poly + e * KILN_C(-0.00021219444005469057) - s * 0.5f;
    return (f + tail) + e * 0.693359375f;
}
