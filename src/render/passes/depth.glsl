// SPDX-License-Identifier: MIT
// Metres along a pixel's ray to what a visibility word names, infinity where that is nothing.
float depth_of(uvec4 seen, float voxel_size) {
    return (seen.y >> 28u) == kSeenNothing ? uintBitsToFloat(0x7f800000u) : uintBitsToFloat(seen.x) * voxel_size;
}
