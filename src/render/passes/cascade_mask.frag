#version 460
// SPDX-License-Identifier: MIT
// Casters with holes: what is open casts nothing.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 1, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 5, std430) readonly buffer Surfaces { MeshSurface mesh_surfaces[]; };
#define KILN_PAGES 6
#include "render/passes/mesh_textures.glsl"

layout(location = 0) flat in uint part_of;
layout(location = 1) in vec4 uv;
layout(location = 2) in float alpha;

void main() {
    MeshSurface surface = mesh_surfaces[mesh_parts[part_of].surface];
    vec2 at = (surface.base.where & kTextureSet1) != 0u ? uv.zw : uv.xy;
    vec2 dx = dFdx(at);
    vec2 dy = dFdy(at);
    float opacity = surface.alpha * alpha;
    if ((surface.base.where & kTextureIs) != 0u) opacity *= mesh_texture(surface.base, at, dx, dy).a;
    if (opacity < surface.alpha_cutoff) discard;
}
