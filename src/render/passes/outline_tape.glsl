// SPDX-License-Identifier: MIT
// The code of outlined edits. The including kernel declares first: FrameParams frame, code[], numbers[], instance_numbers[], and includes
// instance_rays.glsl.

// Does the code at hand belong to the object of `here`?
bool of_object = false;
uvec2 sdf_code(uint at) { return code[at]; }
float sdf_param(uint at) { return of_object ? instance_numbers[here.params_first + at] : numbers[frame.params_first + at]; }
float sdf_sample(uint at) { return of_object ? instance_numbers[here.samples_first + at] : numbers[at]; }
#include "render/passes/tape_use.glsl"
#include "sdf/tape.glsl"
