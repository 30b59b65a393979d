#version 460
// SPDX-License-Identifier: MIT
// What meshes hide of the discs of lamps and spots by their shadow maps, multiplied into the fractions that the field leaves: shadow_cascades.comp in
// perspective. A texel holds one over the distance along its face's axis, in which planes are linear, so the receiver's own plane is compared as exactly.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/lamps.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Faces { LampFace faces[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 4, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 5, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 6, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 7) uniform utexture2D visibility;
layout(set = 0, binding = 8) uniform utexture2D surface_words;
layout(set = 0, binding = 9) uniform utexture2D fractions_of_field;
layout(set = 0, binding = 10, rgba32ui) writeonly uniform uimage2D visible_fractions;
layout(set = 0, binding = 11) uniform texture2DArray maps;
layout(set = 0, binding = 12) uniform sampler map_sampler;  // of nearest texels
layout(set = 0, binding = 13, std430) readonly buffer LightMasks { uint light_masks[]; };
layout(push_constant) uniform Push { ShadowPush push; };

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/mesh_shadow_start.glsl"

const float kSearchTexels = 16.0;  // most of a radius on the map that is searched
const float kFilterTexels = 12.0;  // … filtered
const float kLeastTexels = 0.75;
const uint kSearchTaps = 16u;
const uint kFilterTaps = 32u;
const float kGoldenAngle = 2.39996323;

// On the plane a unit before the light; nearness 1 / metres, and how it changes there.
struct Receiver {
    vec2 at;
    float nearness;
    vec2 climb;
    float bias;   // texels
    float texel;  // on the plane
    uint face;
};

// How much nearer to the light than the receiver's plane the four texels round a place are; at most 0: not in its way.
vec4 nearer(Receiver r, vec2 offset, out vec2 part) {
    float side = float(textureSize(maps, 0).x);
    vec2 place = ((r.at + offset) / faces[r.face].u.w * 0.5 + 0.5) * side - 0.5;
    vec2 first = floor(place);
    part = place - first;
    vec4 found = textureGather(sampler2DArray(maps, map_sampler), vec3((first + 1.0) / side, float(r.face))) / kLampNear;
    found = mix(found, vec4(-1e20), equal(found, vec4(0.0)));
    vec2 low = offset - part * r.texel;
    vec4 plane = r.nearness + dot(r.climb, low) + r.texel * vec4(r.climb.y, r.climb.x + r.climb.y, r.climb.x, 0.0);
    return found - plane - r.bias * r.texel * (r.nearness + abs(r.climb.x) + abs(r.climb.y)) - 1e-6 * r.nearness;
}

vec2 spiral(uint i, uint taps) {
    float angle = kGoldenAngle * float(i);
    return sqrt((float(i) + 0.5) / float(taps)) * vec2(cos(angle), sin(angle));
}

float mean_nearer(Receiver r, float radius) {
    float sum = 0.0;
    float count = 0.0;
    for (uint i = 0u; i < kSearchTaps; ++i) {
        vec2 part;
        vec4 a = nearer(r, radius * spiral(i, kSearchTaps), part);
        vec4 is = step(vec4(1e-12), a);
        sum += dot(a, is);
        count += dot(is, vec4(1.0));
    }
    return count > 0.0 ? sum / count : 0.0;
}

float open_share(Receiver r, float radius) {
    uint taps = radius < 1.5 * r.texel ? 9u : kFilterTaps;
    float open = 0.0;
    for (uint i = 0u; i < taps; ++i) {
        vec2 part;
        vec4 is = step(nearer(r, radius * spiral(i, taps), part), vec4(0.0));
        open += mix(mix(is.w, is.z, part.x), mix(is.x, is.y, part.x), part.y);
    }
    return open / float(taps);
}

// Of a light whose faces begin at `first`, or that has one; its disc has this radius, metres.
float lamp_open(uint first, bool one, float disc, ShadowStart start) {
    vec3 d = start.from - faces[first].at.xyz;
    Receiver r;
    r.face = first;
    if (!one) {
        vec3 size = abs(d);
        uint axis = size.x >= max(size.y, size.z) ? 0u : (size.y >= size.z ? 1u : 2u);
        r.face += 2u * axis + (d[axis] < 0.0 ? 1u : 0u);
    }
    LampFace face = faces[r.face];
    vec3 p = vec3(dot(d, face.u.xyz), dot(d, face.v.xyz), dot(d, face.w.xyz));
    vec3 n = vec3(dot(start.outwards, face.u.xyz), dot(start.outwards, face.v.xyz), dot(start.outwards, face.w.xyz));
    if (p.z <= kLampNear || (one && max(abs(p.x), abs(p.y)) > face.u.w * p.z)) return 1.0;
    r.texel = 2.0 * face.u.w / float(textureSize(maps, 0).x);
    r.at = p.xy / p.z;
    r.nearness = 1.0 / p.z;
    // dot(n, x) = dot(n, p) for x = (place, 1) / nearness: nearness = dot(n, (place, 1)) / dot(n, p). At grazing incidence no steeper than 40 times.
    float facing = min(dot(n, p), -0.025 * length(p));
    r.climb = n.xy / facing;
    r.bias = start.part != kNoPart ? 0.2 : 0.0;
    float radius = 0.0;
    if (disc > 0.0) {
        // From what is right before the light the cone to the disc is as wide as the search goes.
        float most = min(disc * max(1.0 / kLampNear - r.nearness, 0.0), kSearchTexels * r.texel);
        float mean = mean_nearer(r, max(most, kLeastTexels * r.texel));
        if (mean <= 0.0) return 1.0;
        // What is b metres from the light, c from the receiver: the disc's image on the plane is disc (c - b) / (c b).
        radius = min(disc * mean, kFilterTexels * r.texel);
    }
    return open_share(r, max(radius, kLeastTexels * r.texel));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 fractions = texelFetch(fractions_of_field, pixel, 0);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside && fractions != uvec4(0u)) {
        TexelRay ray = pixel_ray(pixel);
        ShadowStart start = shadow_start(seen, ray, unpack_surface(texelFetch(surface_words, pixel, 0)).normal);
        LightWalk walk = light_walk(pixel, push.first_light);
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel) {
            uint index = next_light(walk);
            if (index == kNoLight) break;
            float before = visible_fraction(fractions, channel);
            LightRecord light = lights[index];
            if (light.color.w == 0.0 || light.kind == kLightDirectional || before <= 0.0) continue;
            set_visible_fraction(fractions, channel, before * lamp_open(uint(abs(light.color.w)) - 1u, light.color.w < 0.0, light.position.w, start));
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
