// SPDX-License-Identifier: MIT
// The words in which src/field/*.gpu.h are written, so that C++ and GLSL read one text: GLSL's own types and built-ins
// on one side, their C++ twins on the other. Vectors are built as vec3(x, y, z), used by component, `+ -` and `* scalar`.

#ifndef KILN_FIELD_WORDS_GPU_H
#define KILN_FIELD_WORDS_GPU_H

#ifdef __cplusplus

#include <kiln/math.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#define KILN_FIELD_BEGIN namespace kiln::field {
#define KILN_FIELD_END }
#define KILN_CONST inline constexpr
#define KILN_FN inline
#define KILN_OUT(type) type&
#define KILN_INOUT(type) type&
#define KILN_PRECISE

namespace kiln::field {
using uint = uint32_t;
struct ivec3 {
    int x = 0, y = 0, z = 0;
    friend bool operator==(const ivec3&, const ivec3&) = default;
    friend constexpr ivec3 operator+(ivec3 a, ivec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend constexpr ivec3 operator-(ivec3 a, ivec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};
inline uint floatBitsToUint(float a) { return std::bit_cast<uint>(a); }
inline float uintBitsToFloat(uint a) { return std::bit_cast<float>(a); }
using std::abs;
using std::floor;
using std::max;
using std::min;
using std::sqrt;
}  // namespace kiln::field

#else

#define KILN_FIELD_BEGIN
#define KILN_FIELD_END
#define KILN_CONST const
#define KILN_FN
#define KILN_OUT(type) out type
#define KILN_INOUT(type) inout type
#define KILN_PRECISE precise

#endif
#endif
