#version 460
// SPDX-License-Identifier: MIT
// Primary visibility of the bricks of all levels and of instances.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#define KILN_LEVELS
#define KILN_INSTANCES
#include "render/passes/march.glsl"
