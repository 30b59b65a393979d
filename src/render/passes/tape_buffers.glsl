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

// Of half-spaces that stand for the code: the nearest.
int nearest_plane(vec3 p_world, out float d) {
    int nearest = 0;
    d = kTapeEmpty;
    for (int i = 0; i < kPlanes; ++i) {
        HorizonPlane plane = frame.planes[i];
        vec3 q = p_world - vec3(plane.at_x, plane.at_y, plane.at_z);
        float here = (plane.normal_x * q.x + plane.normal_y * q.y + plane.normal_z * q.z) * plane.scale;
        if (here < d) nearest = i;
        d = min(d, here);
    }
    return nearest;
}

#ifndef KILN_TAPE_MATERIALS
// Metres: what code says, or what stands for it.
float code_distance(uvec2 code_at, vec3 p_world) {
    if (kPlanes == 0) return tape_distance(code_at.x, code_at.y, p_world);
    float d;
    nearest_plane(p_world, d);
    return d;
}
#endif
