#version 460
// SPDX-License-Identifier: MIT
// Ambient occlusion by bricks of all levels and exact programs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#define KILN_LEVELS
#include "field/levels.gpu.h"
#define KILN_EXACT
#include "render/passes/ao.glsl"
