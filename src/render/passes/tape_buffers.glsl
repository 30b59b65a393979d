// SPDX-License-Identifier: MIT
// The tape interpreter on a frame's buffers. Instructions with kFromProgram in their number come from the program buffer, the
// others from the bricks' pruned code. The including kernel declares first:
//   FrameParams frame, uvec2 code[], uvec2 program_code[], float numbers[].

const uint kFromProgram = 0x80000000u;

uvec2 sdf_code(uint at) { return (at & kFromProgram) != 0u ? program_code[at & ~kFromProgram] : code[at]; }
float sdf_param(uint at) { return numbers[frame.params_first + at]; }
float sdf_sample(uint at) { return numbers[at]; }
#include "render/passes/tape_use.glsl"
#include "sdf/tape.glsl"
