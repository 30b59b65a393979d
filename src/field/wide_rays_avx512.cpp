// SPDX-License-Identifier: MIT
// Rays through host bricks for AVX-512: 32 lanes, two registers in step. A ray's next step needs the last one's result, so a register alone
// would mostly wait; two cost hardly more time.

#include "field/wide_isa.h"

#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wuninitialized"  // GCC 12: false alarms inside its own AVX-512 header (GCC bug 105593)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

namespace kiln::field::wide_avx512_rays {

namespace one {
#include "field/wide_avx512.inl"
}  // namespace one

constexpr int kLanes = 2 * one::kLanes;
struct F {
    one::F a, b;
};
struct I {
    one::I a, b;
};
struct M {
    one::M a, b;
};

static inline F operator+(F x, F y) { return {x.a + y.a, x.b + y.b}; }
static inline F operator+(F x, float y) { return {x.a + y, x.b + y}; }
static inline F operator-(F x, F y) { return {x.a - y.a, x.b - y.b}; }
static inline F operator-(F x, float y) { return {x.a - y, x.b - y}; }
static inline F operator*(F x, F y) { return {x.a * y.a, x.b * y.b}; }
static inline F operator*(F x, float y) { return {x.a * y, x.b * y}; }
static inline F operator/(F x, F y) { return {x.a / y.a, x.b / y.b}; }
static inline F operator/(F x, float y) { return {x.a / y, x.b / y}; }
static inline F operator-(float x, F y) { return {x - y.a, x - y.b}; }
static inline F operator*(float x, F y) { return {x * y.a, x * y.b}; }
static inline F operator/(float x, F y) { return {x / y.a, x / y.b}; }
static inline F operator-(F x) { return {-x.a, -x.b}; }
static inline I operator+(I x, I y) { return {x.a + y.a, x.b + y.b}; }
static inline I operator-(I x, I y) { return {x.a - y.a, x.b - y.b}; }
static inline I operator*(I x, I y) { return {x.a * y.a, x.b * y.b}; }
static inline I operator&(I x, I y) { return {x.a & y.a, x.b & y.b}; }
static inline I operator>>(I x, I y) { return {x.a >> y.a, x.b >> y.b}; }
static inline I operator+(I x, int y) { return {x.a + y, x.b + y}; }
static inline I operator-(I x, int y) { return {x.a - y, x.b - y}; }
static inline I operator*(I x, int y) { return {x.a * y, x.b * y}; }
static inline I operator&(I x, int y) { return {x.a & y, x.b & y}; }
static inline I operator<<(I x, int y) { return {x.a << y, x.b << y}; }
static inline I operator>>(I x, int y) { return {x.a >> y, x.b >> y}; }

static inline F number(float v) { return {one::number(v), one::number(v)}; }
static inline I splat(int v) { return {one::splat(v), one::splat(v)}; }
static inline F to_float(I v) { return {one::to_float(v.a), one::to_float(v.b)}; }
static inline I to_int(F v) { return {one::to_int(v.a), one::to_int(v.b)}; }
static inline F floats_of(I v) { return {one::floats_of(v.a), one::floats_of(v.b)}; }
static inline I bits_of(F v) { return {one::bits_of(v.a), one::bits_of(v.b)}; }
static inline M lt(F x, F y) { return {one::lt(x.a, y.a), one::lt(x.b, y.b)}; }
static inline M le(F x, F y) { return {one::le(x.a, y.a), one::le(x.b, y.b)}; }
static inline M eq(F x, F y) { return {one::eq(x.a, y.a), one::eq(x.b, y.b)}; }
static inline M lt(I x, I y) { return {one::lt(x.a, y.a), one::lt(x.b, y.b)}; }
static inline M eq(I x, I y) { return {one::eq(x.a, y.a), one::eq(x.b, y.b)}; }
static inline F select(M m, F x, F y) { return {one::select(m.a, x.a, y.a), one::select(m.b, x.b, y.b)}; }
static inline I select(M m, I x, I y) { return {one::select(m.a, x.a, y.a), one::select(m.b, x.b, y.b)}; }
static inline M all() { return {one::all(), one::all()}; }
static inline M none() { return {one::none(), one::none()}; }
static inline M both(M x, M y) { return {one::both(x.a, y.a), one::both(x.b, y.b)}; }
static inline M either(M x, M y) { return {one::either(x.a, y.a), one::either(x.b, y.b)}; }
static inline M without(M x, M y) { return {one::without(x.a, y.a), one::without(x.b, y.b)}; }
static inline bool any(M m) { return (m.a | m.b) != 0; }
static inline uint32_t bits(M m) { return uint32_t(m.a) | uint32_t(m.b) << one::kLanes; }
static inline M mask_of(uint32_t bits) { return {one::mask_of(bits & 0xffff), one::mask_of(bits >> one::kLanes)}; }
static inline F expand(M m, F others, const float* from) {
    return {one::expand(m.a, others.a, from), one::expand(m.b, others.b, from + one::count(m.a))};
}
static inline I expand(M m, I others, const int32_t* from) {
    return {one::expand(m.a, others.a, from), one::expand(m.b, others.b, from + one::count(m.a))};
}
static inline int count(M m) { return __builtin_popcount(bits(m)); }
static inline F min(F x, F y) { return {one::min(x.a, y.a), one::min(x.b, y.b)}; }
static inline F max(F x, F y) { return {one::max(x.a, y.a), one::max(x.b, y.b)}; }
static inline F floor(F v) { return {one::floor(v.a), one::floor(v.b)}; }
static inline F sqrt(F v) { return {one::sqrt(v.a), one::sqrt(v.b)}; }
static inline I gather_bytes(const void* base, I index) {
    return {one::gather_bytes(base, index.a), one::gather_bytes(base, index.b)};
}

#include "field/wide_math.inl"

#include "field/wide_rays.inl"

}  // namespace kiln::field::wide_avx512_rays
