// SPDX-License-Identifier: MIT
// The shape language for one value at a time. Included inside a namespace that has set KILN_SCALAR to float or double.
// double serves the judge, so its sine and friends are the standard library's; float uses the shared polynomials.
// No include guard: one namespace, one inclusion. <cmath> and <cstdint> must have been included outside.

#define KILN_SDF [[maybe_unused]] static inline
#define KILN_C(x) param(x)

using real = KILN_SCALAR;
using param = KILN_SCALAR;
using mask = bool;
using whole = uint32_t;

struct real2 {
    real x, y;
    constexpr real2(real x_, real y_) : x(x_), y(y_) {}
};
struct real3 {
    real x, y, z;
    constexpr real3(real x_, real y_, real z_) : x(x_), y(y_), z(z_) {}
};
using param2 = real2;
using param3 = real3;

KILN_SDF real2 operator+(real2 a, real2 b) { return {a.x + b.x, a.y + b.y}; }
KILN_SDF real2 operator-(real2 a, real2 b) { return {a.x - b.x, a.y - b.y}; }
KILN_SDF real2 operator*(real2 a, real2 b) { return {a.x * b.x, a.y * b.y}; }
KILN_SDF real2 operator*(real2 a, real s) { return {a.x * s, a.y * s}; }
KILN_SDF real2 operator*(real s, real2 a) { return a * s; }
KILN_SDF real2 operator/(real2 a, real s) { return {a.x / s, a.y / s}; }
KILN_SDF real2 operator-(real2 a) { return {-a.x, -a.y}; }
KILN_SDF real3 operator+(real3 a, real3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
KILN_SDF real3 operator-(real3 a, real3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
KILN_SDF real3 operator*(real3 a, real3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
KILN_SDF real3 operator*(real3 a, real s) { return {a.x * s, a.y * s, a.z * s}; }
KILN_SDF real3 operator*(real s, real3 a) { return a * s; }
KILN_SDF real3 operator/(real3 a, real s) { return {a.x / s, a.y / s, a.z / s}; }
KILN_SDF real3 operator/(real3 a, real3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
KILN_SDF real3 operator-(real3 a) { return {-a.x, -a.y, -a.z}; }

KILN_SDF mask lt(real a, real b) { return a < b; }
KILN_SDF mask le(real a, real b) { return a <= b; }
KILN_SDF mask gt(real a, real b) { return a > b; }
KILN_SDF mask ge(real a, real b) { return a >= b; }
KILN_SDF mask both(mask a, mask b) { return a && b; }
KILN_SDF mask either(mask a, mask b) { return a || b; }
KILN_SDF mask no(mask a) { return !a; }
KILN_SDF bool all_of(mask a) { return a; }
KILN_SDF uint32_t lane_bits(mask a) { return a ? 1u : 0u; }
KILN_SDF real select(mask m, real a, real b) { return m ? a : b; }
KILN_SDF whole select(mask m, whole a, whole b) { return m ? a : b; }
KILN_SDF real2 select(mask m, real2 a, real2 b) { return m ? a : b; }
KILN_SDF real3 select(mask m, real3 a, real3 b) { return m ? a : b; }

KILN_SDF real min(real a, real b) { return b < a ? b : a; }
KILN_SDF real max(real a, real b) { return a < b ? b : a; }
KILN_SDF real clamp(real x, real lo, real hi) { return min(max(x, lo), hi); }
KILN_SDF real abs(real a) { return std::fabs(a); }
KILN_SDF real part_of(real n, param k) { return n / k; }
KILN_SDF real sqrt(real a) { return std::sqrt(a); }
KILN_SDF real floor(real a) { return std::floor(a); }
KILN_SDF real3 min(real3 a, real3 b) { return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)}; }
KILN_SDF real3 max(real3 a, real3 b) { return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)}; }
KILN_SDF real3 clamp(real3 x, real3 lo, real3 hi) { return min(max(x, lo), hi); }
KILN_SDF real2 abs(real2 a) { return {abs(a.x), abs(a.y)}; }
KILN_SDF real3 abs(real3 a) { return {abs(a.x), abs(a.y), abs(a.z)}; }
KILN_SDF real3 floor(real3 a) { return {floor(a.x), floor(a.y), floor(a.z)}; }
KILN_SDF real dot(real2 a, real2 b) { return a.x * b.x + a.y * b.y; }
KILN_SDF real dot(real3 a, real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
KILN_SDF real length(real2 a) { return sqrt(dot(a, a)); }
KILN_SDF real length(real3 a) { return sqrt(dot(a, a)); }

KILN_SDF whole whole_of(real floored) { return uint32_t(int32_t(floored)); }
KILN_SDF real real_of(whole a) { return real(a); }
KILN_SDF whole bits_of(float a) { return __builtin_bit_cast(whole, a); }
KILN_SDF float real_of_bits(whole a) { return __builtin_bit_cast(float, a); }

/// Numbers of sampled shapes (heightfields): one flat array for the whole program.
struct Samples {
    const float* values;
};
KILN_SDF real sample_at(Samples s, whole index) { return real(s.values[index]); }
