#version 460
// SPDX-License-Identifier: MIT
// Test kernel: samples a volume at given places (0..1), through a separate sampler.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform texture3D volume;
layout(set = 0, binding = 1) uniform sampler smooth_sampler;
layout(set = 0, binding = 2, std430) readonly buffer Places { vec4 at[]; } places;
layout(set = 0, binding = 3, std430) writeonly buffer Values { float value[]; } values;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(places.at.length())) values.value[i] = textureLod(sampler3D(volume, smooth_sampler), places.at[i].xyz, 0.0).x;
}
