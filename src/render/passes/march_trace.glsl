// SPDX-License-Identifier: MIT
// What the shaders of "march by boxes" share: the march of the bricks as rays through a box tree, a box a cell with a brick.
// A ray's parameter in the tree counts from where it meets the grid, so that coordinates there are small.
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3) uniform texture3D distances;
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 7, std430) readonly buffer BoxCells { uint box_cells[]; };
layout(set = 0, binding = 9) uniform texture2D mesh_depth;

#include "render/passes/field.glsl"
#include "field/box_march.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/ray_end.glsl"

const uint kNoBox = 0xffffffffu;

// Cell of a box, counted from the grid's first.
ivec3 cell_of_box(uint box) {
    uint at = box_cells[box];
    uint size_x = uint(frame.grid.size_x);
    uint size_y = uint(frame.grid.size_y);
    return ivec3(at % size_x, (at / size_x) % size_y, at / (size_x * size_y));
}
