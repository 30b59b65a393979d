#version 460
// SPDX-License-Identifier: MIT
// The box with the least parameter.
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uint found;

void main() { found = uint(gl_PrimitiveID); }
