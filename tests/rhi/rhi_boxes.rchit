#version 460
// SPDX-License-Identifier: MIT
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec2 found;

void main() { found = uvec2(uint(gl_PrimitiveID), uint(gl_HitTEXT)); }
