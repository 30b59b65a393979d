// SPDX-License-Identifier: MIT
// The shape language in GLSL. The including kernel declares, before this file, the buffers behind
// `float sdf_param(uint at)` and `float sdf_sample(uint index)`.

#define KILN_SDF
#define KILN_C(x) float(x)
#define real float
#define real2 vec2
#define real3 vec3
#define param float
#define param2 vec2
#define param3 vec3
#define mask bool
#define whole uint
#define lt(a, b) ((a) < (b))
#define le(a, b) ((a) <= (b))
#define gt(a, b) ((a) > (b))
#define ge(a, b) ((a) >= (b))
#define both(a, b) ((a) && (b))
#define either(a, b) ((a) || (b))
#define no(a) (!(a))
#define all_of(a) (a)
#define select(m, a, b) ((m) ? (a) : (b))
#define part_of(n, k) ((n) / (k))
#define whole_of(a) uint(int(a))
#define real_of(a) float(a)
#define bits_of(a) floatBitsToUint(a)
#define real_of_bits(a) uintBitsToFloat(a)
#define Samples uint
#define sample_at(s, index) sdf_sample((s) + (index))
