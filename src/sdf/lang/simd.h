// SPDX-License-Identifier: MIT
// The shape language for KILN_LANES values at a time (4, 8 or 16), on GCC/Clang vector extensions.
// Included inside a namespace; <immintrin.h>, <cmath> and <cstdint> must have been included outside. No include guard, as scalar.h.
// Every operation rounds once and in the same order as the scalar text, so all widths give the same bytes.

// All one function, but where each of its variables on the stack is watched: each instruction of a tape would mark those of all shapes.
#if defined(__SANITIZE_ADDRESS__)
#define KILN_SDF [[maybe_unused]] static inline
#else
#define KILN_SDF [[maybe_unused]] static inline __attribute__((always_inline))
#endif
#define KILN_C(x) param(x)

using param = float;
typedef float lane_f __attribute__((vector_size(4 * KILN_LANES)));
typedef int32_t lane_i __attribute__((vector_size(4 * KILN_LANES)));
typedef uint32_t lane_u __attribute__((vector_size(4 * KILN_LANES)));

struct mask {
    lane_i v;
};
struct whole {
    lane_u v;
    whole() = default;
    whole(lane_u v_) : v(v_) {}
    explicit whole(uint32_t s) : v(lane_u{} + s) {}
};
struct real {
    lane_f v;
    real() = default;
    real(lane_f v_) : v(v_) {}
    real(float s) : v(s - lane_f{}) {}  // not {} + s: that would lose the sign of -0
};

KILN_SDF real operator+(real a, real b) { return a.v + b.v; }
KILN_SDF real operator-(real a, real b) { return a.v - b.v; }
KILN_SDF real operator*(real a, real b) { return a.v * b.v; }
KILN_SDF real operator/(real a, real b) { return a.v / b.v; }
KILN_SDF real operator-(real a) { return -a.v; }
KILN_SDF whole operator+(whole a, whole b) { return a.v + b.v; }
KILN_SDF whole operator*(whole a, whole b) { return a.v * b.v; }
KILN_SDF whole operator^(whole a, whole b) { return a.v ^ b.v; }
KILN_SDF whole operator&(whole a, whole b) { return a.v & b.v; }
KILN_SDF whole operator>>(whole a, int s) { return a.v >> s; }
KILN_SDF whole operator<<(whole a, int s) { return a.v << s; }

KILN_SDF mask lt(real a, real b) { return {lane_i(a.v < b.v)}; }
KILN_SDF mask le(real a, real b) { return {lane_i(a.v <= b.v)}; }
KILN_SDF mask gt(real a, real b) { return {lane_i(a.v > b.v)}; }
KILN_SDF mask ge(real a, real b) { return {lane_i(a.v >= b.v)}; }
KILN_SDF mask both(mask a, mask b) { return {a.v & b.v}; }
KILN_SDF mask either(mask a, mask b) { return {a.v | b.v}; }
KILN_SDF mask no(mask a) { return {~a.v}; }
KILN_SDF real select(mask m, real a, real b) { return m.v ? a.v : b.v; }
KILN_SDF whole select(mask m, whole a, whole b) { return m.v ? a.v : b.v; }

// x86 min/max return the second operand unless the first is strictly less/greater: with the operands swapped that is
// the language's rule, ties and signed zeros included.
// lane_bits(), not a word of the language: lanes where m holds, one bit each.
// The maskz forms with every lane on are the plain ones without GCC 12's false warning about an undefined operand.
#if KILN_LANES == 16
KILN_SDF real min(real a, real b) { return lane_f(_mm512_maskz_min_ps(0xffff, __m512(b.v), __m512(a.v))); }
KILN_SDF real max(real a, real b) { return lane_f(_mm512_maskz_max_ps(0xffff, __m512(b.v), __m512(a.v))); }
KILN_SDF real floor(real a) {
    return lane_f(_mm512_maskz_roundscale_ps(0xffff, __m512(a.v), _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC));
}
KILN_SDF whole whole_of(real a) { return lane_u(_mm512_maskz_cvttps_epi32(0xffff, __m512(a.v))); }
KILN_SDF uint32_t lane_bits(mask m) { return uint32_t(_mm512_movepi32_mask(__m512i(m.v))); }
#elif KILN_LANES == 8
KILN_SDF real min(real a, real b) { return lane_f(_mm256_min_ps(__m256(b.v), __m256(a.v))); }
KILN_SDF real max(real a, real b) { return lane_f(_mm256_max_ps(__m256(b.v), __m256(a.v))); }
KILN_SDF real floor(real a) { return lane_f(_mm256_floor_ps(__m256(a.v))); }
KILN_SDF whole whole_of(real a) { return lane_u(_mm256_cvttps_epi32(__m256(a.v))); }
KILN_SDF uint32_t lane_bits(mask m) { return uint32_t(_mm256_movemask_ps(__m256(m.v))); }
#else
KILN_SDF real min(real a, real b) { return lane_f(_mm_min_ps(__m128(b.v), __m128(a.v))); }
KILN_SDF real max(real a, real b) { return lane_f(_mm_max_ps(__m128(b.v), __m128(a.v))); }
KILN_SDF real floor(real a) { return lane_f(_mm_floor_ps(__m128(a.v))); }
KILN_SDF whole whole_of(real a) { return lane_u(_mm_cvttps_epi32(__m128(a.v))); }
KILN_SDF uint32_t lane_bits(mask m) { return uint32_t(_mm_movemask_ps(__m128(m.v))); }
#endif
KILN_SDF bool all_of(mask m) { return lane_bits(m) == (1u << KILN_LANES) - 1; }
KILN_SDF real abs(real a) { return lane_f(lane_i(a.v) & 0x7fffffff); }
KILN_SDF real clamp(real x, real lo, real hi) { return min(max(x, lo), hi); }
#ifdef KILN_PRODUCTS
// Rounded once: a b + c, and c - a b. And of a >= 2^-90: 1 / sqrt(a), to so many bits that root and inverse are bettered kRootSteps times.
#if KILN_LANES == 16
KILN_SDF real fused(real a, real b, real c) { return lane_f(_mm512_fmadd_ps(__m512(a.v), __m512(b.v), __m512(c.v))); }
KILN_SDF real fused_from(real c, real a, real b) {
    return lane_f(_mm512_fnmadd_ps(__m512(a.v), __m512(b.v), __m512(c.v)));
}
KILN_SDF real rough_inverse_root(real a) { return lane_f(_mm512_maskz_rsqrt14_ps(0xffff, __m512(a.v))); }
constexpr int kRootSteps = 1;  // from 14 bits
#else
KILN_SDF real fused(real a, real b, real c) { return lane_f(_mm256_fmadd_ps(__m256(a.v), __m256(b.v), __m256(c.v))); }
KILN_SDF real fused_from(real c, real a, real b) {
    return lane_f(_mm256_fnmadd_ps(__m256(a.v), __m256(b.v), __m256(c.v)));
}
KILN_SDF real rough_inverse_root(real a) { return lane_f(_mm256_rsqrt_ps(__m256(a.v))); }
constexpr int kRootSteps = 2;  // from 11
#endif
// Of 0, or of 2^-90 to 2^100: a square root to the last bit without the divider, which many processors have one of, and half as wide.
// From an estimate of its inverse, root and half its inverse are bettered together; then the root's remainder, which is exact, corrects it
// (Markstein, "Computation of elementary functions on the IBM RISC System/6000 processor", 1990). A test tries all numbers.
KILN_SDF real sqrt_from(real x, real inverse) {
    const real half(0.5f);
    real root = x * inverse, half_inverse = half * inverse;
    for (int step = 0; step < kRootSteps; ++step) {
        const real off = fused_from(half, root, half_inverse);
        root = fused(root, off, root);
        half_inverse = fused(half_inverse, off, half_inverse);
    }
    return fused(fused_from(x, root, root), half_inverse, root);
}
KILN_SDF real sqrt(real a) { return sqrt_from(a, rough_inverse_root(max(a, real(0x1p-90f)))); }
// Likewise, of 2^-60 < k < 2^60: k's inverse as two numbers makes a quotient to a bit, which its exact remainder corrects.
KILN_SDF real part_of(real n, param k) {
    const real divisor(k), inverse(1.0f / k);
    const real rest = fused_from(real(1.0f), inverse, divisor) * inverse;
    const real quotient = fused(n, inverse, n * rest);
    return fused(fused_from(n, quotient, divisor), inverse, quotient);
}
#else
#if KILN_LANES == 16
KILN_SDF real sqrt(real a) { return lane_f(_mm512_maskz_sqrt_ps(0xffff, __m512(a.v))); }
#elif KILN_LANES == 8
KILN_SDF real sqrt(real a) { return lane_f(_mm256_sqrt_ps(__m256(a.v))); }
#else
KILN_SDF real sqrt(real a) { return lane_f(_mm_sqrt_ps(__m128(a.v))); }
#endif
KILN_SDF real part_of(real n, param k) { return n.v / k; }
#endif
KILN_SDF whole bits_of(real a) { return lane_u(a.v); }
KILN_SDF real real_of_bits(whole a) { return lane_f(a.v); }
KILN_SDF real real_of(whole a) { return __builtin_convertvector(lane_i(a.v), lane_f); }

// The same functions of parameters, which are equal in every lane.
KILN_SDF float min(float a, float b) { return b < a ? b : a; }
KILN_SDF float max(float a, float b) { return a < b ? b : a; }
KILN_SDF float clamp(float x, float lo, float hi) { return min(max(x, lo), hi); }
KILN_SDF float sqrt(float a) { return __builtin_sqrtf(a); }
KILN_SDF float floor(float a) { return __builtin_floorf(a); }
KILN_SDF float abs(float a) { return __builtin_fabsf(a); }
KILN_SDF bool lt(float a, float b) { return a < b; }
KILN_SDF bool le(float a, float b) { return a <= b; }
KILN_SDF bool gt(float a, float b) { return a > b; }
KILN_SDF bool ge(float a, float b) { return a >= b; }
KILN_SDF bool both(bool a, bool b) { return a && b; }
KILN_SDF bool either(bool a, bool b) { return a || b; }
KILN_SDF bool no(bool a) { return !a; }
KILN_SDF float select(bool m, float a, float b) { return m ? a : b; }

struct param2 {
    param x, y;
    constexpr param2(param x_, param y_) : x(x_), y(y_) {}
};
struct param3 {
    param x, y, z;
    constexpr param3(param x_, param y_, param z_) : x(x_), y(y_), z(z_) {}
};
struct real2 {
    real x, y;
    real2(real x_, real y_) : x(x_), y(y_) {}
    real2(param2 p) : x(p.x), y(p.y) {}
};
struct real3 {
    real x, y, z;
    real3(real x_, real y_, real z_) : x(x_), y(y_), z(z_) {}
    real3(param3 p) : x(p.x), y(p.y), z(p.z) {}
};

#define KILN_VECTOR_TEXT(V2, V3, S)                                                         \
    KILN_SDF V2 operator+(V2 a, V2 b) { return V2(a.x + b.x, a.y + b.y); }                  \
    KILN_SDF V2 operator-(V2 a, V2 b) { return V2(a.x - b.x, a.y - b.y); }                  \
    KILN_SDF V2 operator*(V2 a, V2 b) { return V2(a.x * b.x, a.y * b.y); }                  \
    KILN_SDF V2 operator*(V2 a, S s) { return V2(a.x * s, a.y * s); }                       \
    KILN_SDF V2 operator*(S s, V2 a) { return a * s; }                                      \
    KILN_SDF V2 operator/(V2 a, S s) { return V2(a.x / s, a.y / s); }                       \
    KILN_SDF V2 operator-(V2 a) { return V2(-a.x, -a.y); }                                  \
    KILN_SDF V3 operator+(V3 a, V3 b) { return V3(a.x + b.x, a.y + b.y, a.z + b.z); }       \
    KILN_SDF V3 operator-(V3 a, V3 b) { return V3(a.x - b.x, a.y - b.y, a.z - b.z); }       \
    KILN_SDF V3 operator*(V3 a, V3 b) { return V3(a.x * b.x, a.y * b.y, a.z * b.z); }       \
    KILN_SDF V3 operator*(V3 a, S s) { return V3(a.x * s, a.y * s, a.z * s); }              \
    KILN_SDF V3 operator*(S s, V3 a) { return a * s; }                                      \
    KILN_SDF V3 operator/(V3 a, S s) { return V3(a.x / s, a.y / s, a.z / s); }              \
    KILN_SDF V3 operator/(V3 a, V3 b) { return V3(a.x / b.x, a.y / b.y, a.z / b.z); }       \
    KILN_SDF V3 operator-(V3 a) { return V3(-a.x, -a.y, -a.z); }                            \
    KILN_SDF V3 min(V3 a, V3 b) { return V3(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)); } \
    KILN_SDF V3 max(V3 a, V3 b) { return V3(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)); } \
    KILN_SDF V3 clamp(V3 x, V3 lo, V3 hi) { return min(max(x, lo), hi); }                   \
    KILN_SDF V2 abs(V2 a) { return V2(abs(a.x), abs(a.y)); }                                \
    KILN_SDF V3 abs(V3 a) { return V3(abs(a.x), abs(a.y), abs(a.z)); }                      \
    KILN_SDF V3 floor(V3 a) { return V3(floor(a.x), floor(a.y), floor(a.z)); }              \
    KILN_SDF S dot(V2 a, V2 b) { return a.x * b.x + a.y * b.y; }                            \
    KILN_SDF S dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }                \
    KILN_SDF S length(V2 a) { return sqrt(dot(a, a)); }                                     \
    KILN_SDF S length(V3 a) { return sqrt(dot(a, a)); }
KILN_VECTOR_TEXT(param2, param3, param)
KILN_VECTOR_TEXT(real2, real3, real)
#undef KILN_VECTOR_TEXT
KILN_SDF real2 select(mask m, real2 a, real2 b) { return real2(select(m, a.x, b.x), select(m, a.y, b.y)); }
KILN_SDF real3 select(mask m, real3 a, real3 b) {
    return real3(select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z));
}

/// Numbers of sampled shapes (heightfields): one flat array for the whole program.
struct Samples {
    const float* values;
};
KILN_SDF real sample_at(Samples s, whole index) {
    lane_f out;
    for (int i = 0; i < KILN_LANES; ++i) out[i] = s.values[index.v[i]];
    return out;
}
