// SPDX-License-Identifier: MIT
// The words in which shader code that C++ also compiles is written: GLSL's built-ins on one side, their C++ twins here.
// Vectors are built with every component, vec3(x, y, z), or with splat3(x); used by component; results leave by return.
// In C++ the functions are in kiln::gpu: a namespace that holds such a text says `using namespace kiln::gpu;`.

#ifndef KILN_MATH_MATH_GPU_H
#define KILN_MATH_MATH_GPU_H

#ifdef __cplusplus

#include <kiln/math.h>

#include <bit>
#include <cmath>
#include <cstdint>

#define KILN_CONST inline constexpr
#define KILN_FN inline

namespace kiln::gpu {

using uint = uint32_t;

// Ties and NaN as GLSL leaves them to us: min(a, b) is a unless b is less, max(a, b) is a unless b is greater.
inline float min(float a, float b) { return b < a ? b : a; }
inline float max(float a, float b) { return a < b ? b : a; }
inline float clamp(float x, float lo, float hi) { return min(max(x, lo), hi); }
inline float mix(float a, float b, float t) { return a * (1.0f - t) + b * t; }
inline float abs(float a) { return std::fabs(a); }
inline float sqrt(float a) { return std::sqrt(a); }
inline float floor(float a) { return std::floor(a); }
inline float fract(float a) { return a - std::floor(a); }
inline float pow(float a, float b) { return std::pow(a, b); }
inline float exp(float a) { return std::exp(a); }
inline float log2(float a) { return std::log2(a); }
inline float sin(float a) { return std::sin(a); }
inline float cos(float a) { return std::cos(a); }
inline float asin(float a) { return std::asin(a); }
inline float acos(float a) { return std::acos(a); }
inline float tan(float a) { return std::tan(a); }
inline float atan(float y, float x) { return std::atan2(y, x); }
inline uint floatBitsToUint(float a) { return std::bit_cast<uint>(a); }
inline float uintBitsToFloat(uint a) { return std::bit_cast<float>(a); }

inline vec3 operator/(vec3 a, vec3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
inline vec3 mix(vec3 a, vec3 b, float t) { return a * (1.0f - t) + b * t; }
inline float dot(vec2 a, vec2 b) { return a.x * b.x + a.y * b.y; }

using kiln::cross;
using kiln::dot;
using kiln::length;
using kiln::max;
using kiln::min;
using kiln::normalize;

}  // namespace kiln::gpu

#else

#define KILN_CONST const
#define KILN_FN

#endif

#ifdef __cplusplus
namespace kiln::gpu {
#endif

KILN_CONST float kPi = 3.14159265358979f;
KILN_CONST float kTwoPi = 6.28318530717959f;

KILN_FN float saturate(float x) { return clamp(x, 0.0f, 1.0f); }
KILN_FN float square(float x) { return x * x; }
KILN_FN vec3 splat3(float x) { return vec3(x, x, x); }
KILN_FN float largest3(vec3 v) { return max(v.x, max(v.y, v.z)); }
KILN_FN float smallest3(vec3 v) { return min(v.x, min(v.y, v.z)); }

// Two unit vectors that make a right-handed basis with the unit vector n: tangent, bitangent, n. No branch, no pole but in
// rounding. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
struct Basis {
    vec3 tangent, bitangent;
};
KILN_FN Basis basis_around(vec3 n) {
    float side = n.z < 0.0f ? -1.0f : 1.0f;
    float a = -1.0f / (side + n.z);
    float b = n.x * n.y * a;
    Basis basis;
    basis.tangent = vec3(1.0f + side * n.x * n.x * a, side * b, -side * n.x);
    basis.bitangent = vec3(b, side + n.y * n.y * a, -n.y);
    return basis;
}

// A well-mixed word of a word, and the next of a sequence: PCG (O'Neill, "PCG", 2014) as a hash (Jarzynski and Olano,
// "Hash Functions for GPU Rendering", JCGT 2020).
KILN_FN uint pcg_hash(uint x) {
    uint state = x * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
// The word's upper 24 bits as a number in [0, 1).
KILN_FN float unit_float(uint word) { return float(word >> 8u) * 5.9604644775390625e-8f; }

#ifdef __cplusplus
}  // namespace kiln::gpu
#endif

#endif
