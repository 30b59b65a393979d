// SPDX-License-Identifier: MIT
// Texel codes: how a brick stores a distance (16-bit float or 8-bit fraction of the band) and a pair of materials.
// One text for both bakers (no division: compilers make reciprocals of those). Rounding is to nearest, ties to even, in integer code, so every device makes the same bits.
// The sign never changes and the zero set never grows: 0 is stored for exact 0 only (0 is solid), everything else keeps
// at least one step of distance from it. NaN becomes the far end of the band.

#ifndef KILN_FIELD_CODES_GPU_H
#define KILN_FIELD_CODES_GPU_H

#include "field/brick.gpu.h"

KILN_FIELD_BEGIN

// Smallest stored step: the least normal half, since hardware may flush smaller ones to zero; and 1/127 of the band.
KILN_CONST float kHalfStepVoxels = 6.103515625e-5f;
KILN_CONST float kSnorm8StepVoxels = 0.0314960629921f;

// Half-float bits of a distance in voxels.
KILN_FN uint half_code(float d_voxels) {
    uint side = d_voxels < 0.0f ? 0x8000u : 0u;
    float size = abs(d_voxels);
    if (size == 0.0f) return 0u;
    if (!(size < kBandVoxels)) return side | 0x4400u;
    if (size < kHalfStepVoxels) return side | 0x0400u;
    uint bits = floatBitsToUint(size) - 0x38000000u;  // exponent bias 127 -> 15
    return side | ((bits + 0x0fffu + ((bits >> 13) & 1u)) >> 13);
}

// Voxels of half_code()'s bits: normal halves and zero only.
KILN_FN float half_value(uint code) {
    uint size = code & 0x7fffu;
    return size == 0u ? 0.0f : uintBitsToFloat(((code & 0x8000u) << 16) | ((size << 13) + 0x38000000u));
}

// Two's complement in the low 8 bits: -127 … 127.
KILN_FN uint snorm8_code(float d_voxels) {
    float size = abs(d_voxels) * 31.75f;  // 127 / band, exact
    if (size == 0.0f) return 0u;
    uint steps = 127u;
    if (size < 127.0f) {
        steps = uint(size);
        float rest = size - float(steps);  // exact
        if (rest > 0.5f || (rest == 0.5f && (steps & 1u) == 1u)) steps += 1u;
        if (steps == 0u) steps = 1u;
    }
    return (d_voxels < 0.0f ? 256u - steps : steps) & 255u;
}

KILN_FN float snorm8_value(uint code) {
    int steps = int(code & 255u);
    if (steps > 127) steps = max(steps - 256, -127);
    return float(steps) * kSnorm8StepVoxels;
}

// What a texel of either format reads as.
KILN_FN float stored_half(float d_voxels) { return half_value(half_code(d_voxels)); }
KILN_FN float stored_snorm8(float d_voxels) { return snorm8_value(snorm8_code(d_voxels)); }

// Material word: see brick.gpu.h. `share` is the second's, clamped to [0, 1/2].
KILN_FN uint material_word(uint slot0, uint slot1, float share) {
    uint weight = uint(min(max(share, 0.0f), 0.5f) * 510.0f + 0.5f);
    return (slot0 & 15u) | ((slot1 & 15u) << 4) | (weight << 8);
}
KILN_FN uint material_slot0(uint word) { return word & 15u; }
KILN_FN uint material_slot1(uint word) { return (word >> 4) & 15u; }
KILN_FN float material_share(uint word) { return float((word >> 8) & 255u) * 0.00196078431372549f; }

KILN_FIELD_END

#endif
