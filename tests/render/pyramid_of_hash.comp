#version 460
// SPDX-License-Identifier: MIT
// The first levels of a pyramid over numbers that a test can make as well.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/depth_pyramid.gpu.h"

layout(set = 0, binding = 0, std430) writeonly buffer Pyramid { float pyramid[]; };
layout(push_constant) uniform Push { DepthPyramidPush push; };

float pyramid_source(ivec2 at) {
    uint word = (uint(at.x) * 0x9e3779b1u) ^ (uint(at.y) * 0x85ebca77u);
    word = (word ^ (word >> 15u)) * 0x2c1b3c6du;
    return float(word >> 8u);
}

#include "render/passes/depth_pyramid.glsl"
