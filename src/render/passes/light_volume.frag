#version 460
// SPDX-License-Identifier: MIT
// Light of one light, to be added to the others'.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/light_volume.glsl"
