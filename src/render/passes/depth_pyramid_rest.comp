#version 460
// SPDX-License-Identifier: MIT
// Six more levels of the pyramid.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/depth_pyramid.gpu.h"

layout(set = 0, binding = 0, std430) buffer Pyramid { float pyramid[]; };
layout(push_constant) uniform Push { DepthPyramidPush push; };

float pyramid_source(ivec2 at) {
    return pyramid[pyramid_first(push.width, push.height, push.from) + at.y * pyramid_side(push.width, push.from) + at.x];
}

#include "render/passes/depth_pyramid.glsl"
