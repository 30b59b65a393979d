// SPDX-License-Identifier: MIT
// Unsigned integers in the order of floats, and back: shared boxes grow by atomicMin and atomicMax of these.

uint ordered_bits(float x) {
    uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
float float_of_ordered(uint key) { return uintBitsToFloat((key & 0x80000000u) != 0u ? key & 0x7fffffffu : ~key); }
