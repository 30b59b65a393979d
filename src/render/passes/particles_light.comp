#version 460
// SPDX-License-Identifier: MIT
// Light that a particle sends everywhere: what falls on its middle from the lights and from all around, scattered evenly. What is solid shades it from
// the sun, by what its middle sees of it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/particles.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Particles { ParticleRecord particles[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer Environment { uint environment_words[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 5) uniform utexture2D visible_fractions;  // a pixel each, see particles_start.comp
layout(push_constant) uniform Push { ParticlePush push; };

// True: an image is all around, multiplied by the constant sky.
layout(constant_id = 6) const bool kImageSky = false;

uint environment_word(uint i) { return environment_words[i]; }
#include "render/lib/environment.gpu.h"

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) return;
    ParticleRecord p = particles[index];
    vec3 eye = (vec3(frame.eye_x, frame.eye_y, frame.eye_z) + vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z)) * frame.grid.voxel_size;
    vec3 p_world = eye + vec3(p.x, p.y, p.z);
    // The mean of all directions.
    vec3 around = frame.sky.c0.rgb;
    if (kImageSky) around *= environment_color(0u);
    vec3 fallen = vec3(0.0);
    uint across = uint(textureSize(visible_fractions, 0).x);
    for (uint i = 0u; i < frame.light_count; ++i) {
        float seen = 1.0;
        if (i == push.sun) seen = float(texelFetch(visible_fractions, ivec2(index % across, index / across), 0).r & 255u) / 255.0;
        fallen += sample_light(lights[i], p_world).illuminance * seen;
    }
    vec3 color = vec3(p.red, p.green, p.blue) * (around + fallen / (4.0 * kPi));
    radiance[index] = vec4(color + vec3(p.glow_red, p.glow_green, p.glow_blue), 0.0);
}
