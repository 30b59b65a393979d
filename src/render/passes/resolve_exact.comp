#version 460
// SPDX-License-Identifier: MIT
// Normals and materials of points seen in bricks and on exact programs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#define KILN_EXACT
#include "render/passes/resolve.glsl"
