#version 460
// SPDX-License-Identifier: MIT
// Ambient occlusion by bricks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/ao.glsl"
