// SPDX-License-Identifier: MIT
// Where the code of an exact hit or segment is. The including kernel declares first: BrickRecord records[], and has tape_buffers.glsl.

// Code of a segment or of a hit: first instruction and count.
uvec2 code_of(uint state, int slot) {
    if (state == kSeenPruned) return uvec2(records[slot].code_first, records[slot].code_count);
    if (state == kSeenOutside) return uvec2(kFromProgram + frame.outside_first, frame.outside_count);
    return uvec2(kFromProgram, frame.program_count);
}
