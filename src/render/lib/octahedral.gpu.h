// SPDX-License-Identifier: MIT
// Unit vectors in 32 bits: the octahedron's faces unfolded to a square, 16 bits a side (Cigolle et al., "A Survey of
// Efficient Representations for Independent Unit Vectors", JCGT 2014). A round trip turns a vector by less than 0.004 degrees.

#ifndef KILN_RENDER_LIB_OCTAHEDRAL_GPU_H
#define KILN_RENDER_LIB_OCTAHEDRAL_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// n: unit. Both coordinates in [-1, 1].
KILN_FN vec2 octahedral_from_unit(vec3 n) {
    float s = 1.0f / (abs(n.x) + abs(n.y) + abs(n.z));
    float x = n.x * s;
    float y = n.y * s;
    if (n.z >= 0.0f) return vec2(x, y);
    return vec2((1.0f - abs(y)) * (x < 0.0f ? -1.0f : 1.0f), (1.0f - abs(x)) * (y < 0.0f ? -1.0f : 1.0f));
}

KILN_FN vec3 unit_from_octahedral(vec2 e) {
    float z = 1.0f - abs(e.x) - abs(e.y);
    float fold = max(-z, 0.0f);
    return normalize(vec3(e.x + (e.x < 0.0f ? fold : -fold), e.y + (e.y < 0.0f ? fold : -fold), z));
}

// One side in 16 bits. 0 is stored exactly, so axis-aligned normals come back exact.
KILN_FN uint octahedral_word(float e) { return uint(floor(clamp(e, -1.0f, 1.0f) * 32767.0f + 32768.5f)); }

KILN_FN uint pack_unit(vec3 n) {
    vec2 e = octahedral_from_unit(n);
    return octahedral_word(e.x) | (octahedral_word(e.y) << 16u);
}

KILN_FN vec3 unpack_unit(uint word) {
    float x = (float(word & 0xffffu) - 32768.0f) / 32767.0f;
    float y = (float(word >> 16u) - 32768.0f) / 32767.0f;
    return unit_from_octahedral(vec2(x, y));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
