#version 460
// SPDX-License-Identifier: MIT
// The first levels of the pyramid: how far a tile can be seen at each pixel. That is the nearer of the triangles drawn so far and of what march
// found, no nearer than refining may put it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/depth_pyramid.gpu.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/refine.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2) uniform utexture2D visibility;
layout(set = 0, binding = 3) uniform texture2D mesh_depth;
layout(set = 0, binding = 4, std430) writeonly buffer Pyramid { float pyramid[]; };
layout(push_constant) uniform Push { DepthPyramidPush push; };

#include "render/passes/rays.glsl"

float pyramid_source(ivec2 at) {
    float depth = texelFetch(mesh_depth, at, 0).x;
    uvec4 seen = texelFetch(visibility, at, 0);
    uint state = seen.y >> 28u;
    if (state == kSeenNothing) return depth;
    float t = uintBitsToFloat(seen.x);
    if ((frame.flags & kFrameRefine) != 0u && (state == kSeenBrick || state == kSeenInstance)) {
        t += state == kSeenBrick ? kRefineMostVoxels * float(1u << (seen.z >> kSeenLevelShift)) : frame.refine_reach;
    }
    float ahead = t * frame.grid.voxel_size * dot(pixel_ray(at).direction, frame.camera.forward.xyz);
    return max(depth, kMeshNear / max(ahead, kMeshNear));
}

#include "render/passes/depth_pyramid.glsl"
