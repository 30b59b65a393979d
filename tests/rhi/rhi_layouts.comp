#version 460
// SPDX-License-Identifier: MIT
// Test module for the reflection reader: one of everything.
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
struct Inner { vec4 a; uint b; float c; vec2 d; };
layout(set = 0, binding = 0, std140) uniform Frame { mat4 clip_from_world; vec4 sun; uint flags[3]; } frame;
layout(set = 1, binding = 2, std430) readonly buffer Items { uint count; float pad_0; vec2 pad_1; Inner items[]; } items;
layout(set = 1, binding = 0, std430) buffer Counters { uint total; int low[5]; } counters;
layout(set = 2, binding = 1) uniform texture2DArray pictures;
layout(set = 2, binding = 3) uniform utexture3D bricks;
layout(set = 2, binding = 4) uniform sampler nearest;
layout(set = 3, binding = 0, rgba16f) uniform writeonly image2D color;
layout(set = 3, binding = 1, r32ui) uniform readonly uimage3D map;
layout(push_constant) uniform Push { vec4 origin; uint level; float step_m; } push;
shared vec4 tile[64];
shared uint found;
void main() {
    tile[gl_LocalInvocationIndex] = push.origin;
    found = 0u;
    barrier();
    Inner one = items.items[push.level];
    uint n = imageLoad(map, ivec3(0)).x + texelFetch(usampler3D(bricks, nearest), ivec3(0), 0).x + frame.flags[1] + items.count;
    counters.total += n + one.b;
    counters.low[2] = int(found);
    vec4 texel = texture(sampler2DArray(pictures, nearest), vec3(0.0)) + frame.clip_from_world * frame.sun;
    imageStore(color, ivec2(0), tile[3] + texel * push.step_m + one.a);
}
