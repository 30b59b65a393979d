#version 460
// SPDX-License-Identifier: MIT
// A solid round all that one light reaches, an instance a light: an icosahedron round the ball of its range, a pyramid of eight sides round a narrow
// spot's cone, or all of the picture where no range ends it. Convex, so every pixel that sees into it has one back face of it: backs are drawn, and the
// eye may be inside.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/frame.gpu.h"
#include "render/passes/light_volume.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 11, std430) readonly buffer Drawn { uint drawn[]; };  // numbers of lights

#include "render/passes/mesh_clip.glsl"

layout(location = 0) flat out uint light_index;

const float kGolden = 1.6180339887;
const vec3 kCorners[12] = vec3[12](vec3(0, 1, kGolden), vec3(0, 1, -kGolden), vec3(0, -1, kGolden), vec3(0, -1, -kGolden),
                                   vec3(1, kGolden, 0), vec3(1, -kGolden, 0), vec3(-1, kGolden, 0), vec3(-1, -kGolden, 0),
                                   vec3(kGolden, 0, 1), vec3(-kGolden, 0, 1), vec3(kGolden, 0, -1), vec3(-kGolden, 0, -1));
// Counter-clockwise from outside.
const uint kFaces[60] = uint[60](0, 2, 8, 0, 9, 2, 0, 4, 6, 0, 8, 4, 0, 6, 9, 1, 10, 3, 1, 3, 11, 1, 6, 4, 1, 4, 10, 1, 11, 6,
                                 2, 7, 5, 2, 5, 8, 2, 9, 7, 3, 5, 7, 3, 10, 5, 3, 7, 11, 4, 8, 10, 5, 10, 8, 6, 11, 9, 7, 9, 11);
const float kRound = 1.4 / 1.9021130326;  // corners are 1.90 from the middle; more than what makes the faces touch the ball of radius 1
const float kWidest = 0.5;                // cosine: wider spots take the ball
const uint kSides = 8u;

// Corner of a pyramid of length 1 whose sides are outside of a cone with this tangent.
vec3 pyramid(uint corner, float tangent) {
    uint face = corner / 3u;
    uint i = corner % 3u;
    float wide = tangent / cos(kPi / float(kSides)) * 1.001;
    uint at;  // of the ring
    if (face < kSides) {
        if (i == 0u) return vec3(0.0);
        at = i == 1u ? face + 1u : face;
    } else {
        uint fan = face - kSides + 1u;
        at = i == 0u ? 0u : (i == 1u ? fan : fan + 1u);
    }
    float turn = 2.0 * kPi * float(at % kSides) / float(kSides);
    return vec3(wide * cos(turn), wide * sin(turn), 1.0);
}

void main() {
    light_index = drawn[gl_InstanceIndex];
    LightRecord light = lights[light_index];
    uint corner = uint(gl_VertexIndex);
    if (light.direction.w <= 0.0) {
        // A triangle over all of the picture, turned away.
        vec2 at = vec2(corner == 2u ? 3.0 : -1.0, corner == 1u ? 3.0 : -1.0);
        gl_Position = corner < 3u ? vec4(at, 0.5, 1.0) : vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }
    vec3 eye = (vec3(frame.eye_x, frame.eye_y, frame.eye_z) + vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z)) * frame.grid.voxel_size;
    vec3 middle = light.position.xyz - eye;
    float range = 1.002 * inversesqrt(light.direction.w) + 1e-5 * length(middle);
    float cosine = light.kind == kLightSpot ? clamp(-light.spot_offset / light.spot_scale, -1.0, 1.0) : -1.0;
    if (cosine < kWidest) {
        gl_Position = mesh_clip(middle + kCorners[kFaces[corner]] * (kRound * range));
        return;
    }
    if (corner >= 3u * (2u * kSides - 2u)) {
        gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }
    vec3 along = light.direction.xyz;
    Basis basis = basis_around(along);
    // A hair behind the light, so that its tip is in front of nothing that is lit.
    float tangent = 1.01 * sqrt(1.0 - cosine * cosine) / cosine + 0.01;
    vec3 p = pyramid(corner, tangent) * (1.02 * range);
    gl_Position = mesh_clip(middle - along * (0.01 * range) + basis.tangent * p.x + basis.bitangent * p.y + along * p.z);
}
