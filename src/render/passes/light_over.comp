#version 460
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#define KILN_VOLUMES
#include "render/passes/frame.gpu.h"
#include "render/passes/light.glsl"
