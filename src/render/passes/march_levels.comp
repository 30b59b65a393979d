#version 460
// SPDX-License-Identifier: MIT
// Primary visibility of the bricks of all levels.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#define KILN_LEVELS
#include "render/passes/march.glsl"
