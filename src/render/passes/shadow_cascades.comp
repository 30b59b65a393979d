#version 460
// SPDX-License-Identifier: MIT
// What meshes hide of the sun's disc by their shadow maps, multiplied into the fractions that the field leaves.
//   What a texel says is compared with the height that the receiver's own plane has there, so a flat surface needs no bias to be free of stripes
// and nothing is moved off it (Isidoro, "Shadow Mapping: GPU-based Tips and Techniques", 2006).
//   An edge that is d above a point hides it gradually over a stretch of d times the disc's angle: the mean height of what is above is looked for first,
// then the share of a disc of that size that is hidden is taken (Fernando, "Percentage-Closer Soft Shadows", 2005). Samples are the same in every pixel: no noise.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/cascades.gpu.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std140) uniform Cascades { CascadesBlock cascades; };
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

const float kSearchTexels = 10.0;  // most of a radius on the map that is searched
const float kFilterTexels = 7.0;   // … filtered
const float kLeastTexels = 0.75;   // of a filter's radius: an edge is never harder
const float kSteepest = 40.0;      // tangent: steeper surfaces are taken for this steep
const float kNowhere = 1e20;       // below all receivers
const float kBand = 0.125;         // share of a map's half side over which the next takes over
const uint kSearchTaps = 12u;
const uint kFilterTaps = 24u;
const float kGoldenAngle = 2.39996323;

// A point under the maps: metres along u and v from the eye, above where casters begin, and how its plane climbs.
struct Receiver {
    vec2 at;
    float height;
    vec2 climb;
    float bias;  // texels: triangles that meet at a shallow angle do not shadow each other
};

// -1 to 1 on the map.
vec2 on_map(uint k, vec2 at) { return cascades.squares[k].xy + at * cascades.squares[k].z; }

// How far above the receiver's plane the four texels round a place are, metres; below 0: not in its way. x, y: which part of them the place is.
vec4 above(uint k, Receiver r, vec2 offset, out vec2 part) {
    float side = float(cascades.side);
    float texel = cascades.squares[k].w;
    vec2 place = (on_map(k, r.at + offset) * 0.5 + 0.5) * side - 0.5;
    vec2 first = floor(place);
    part = place - first;
    vec4 heights = textureGather(sampler2DArray(maps, map_sampler), vec3((first + 1.0) / side, float(k)));
    heights = mix(heights * cascades.range, vec4(-kNowhere), equal(heights, vec4(0.0)));
    // (0,1), (1,1), (1,0), (0,0)
    vec2 low = offset - part * texel;
    vec4 plane = r.height + dot(r.climb, low) + texel * vec4(r.climb.y, r.climb.x + r.climb.y, r.climb.x, 0.0);
    return heights - plane - r.bias * texel * (1.0 + abs(r.climb.x) + abs(r.climb.y));
}

vec2 spiral(uint i, uint taps) {
    float angle = kGoldenAngle * float(i);
    return sqrt((float(i) + 0.5) / float(taps)) * vec2(cos(angle), sin(angle));
}

// The mean height above the plane of what is in the way within `radius` metres; 0: nothing is.
float mean_above(uint k, Receiver r, float radius) {
    float sum = 0.0;
    float count = 0.0;
    for (uint i = 0u; i < kSearchTaps; ++i) {
        vec2 part;
        vec4 a = above(k, r, radius * spiral(i, kSearchTaps), part);
        vec4 is = step(vec4(0.0), a);
        sum += dot(a, is);
        count += dot(is, vec4(1.0));
    }
    return count > 0.0 ? max(sum / count, 1e-6) : 0.0;
}

// The share of a disc on the map that nothing hides.
float open_share(uint k, Receiver r, float radius) {
    uint taps = radius < 1.5 * cascades.squares[k].w ? 9u : kFilterTaps;
    float open = 0.0;
    for (uint i = 0u; i < taps; ++i) {
        vec2 part;
        vec4 is = step(above(k, r, radius * spiral(i, taps), part), vec4(0.0));
        open += mix(mix(is.w, is.z, part.x), mix(is.x, is.y, part.x), part.y);
    }
    return open / float(taps);
}

// How far the filter of a map may be from its border, texels.
float weight_of(uint k, Receiver r) {
    vec2 at = abs(on_map(k, r.at));
    float limit = 1.0 - 2.0 * (max(kSearchTexels, kFilterTexels) + 2.0) / float(cascades.side);
    return clamp((limit - max(at.x, at.y)) / kBand, 0.0, 1.0);
}

// By the maps from k on. Where what hides the disc is far above, a coarser map has all the detail that the half shadow shows.
float open_from(uint k, Receiver r, float tan_radius) {
    uint last = cascades.count - 1u;
    float radius = 0.0;
    if (tan_radius > 0.0) {
        float most = max(cascades.range - r.height, 0.0) * tan_radius;
        uint s = k;
        while (s < last && most > kSearchTexels * cascades.squares[s].w) ++s;
        float mean = mean_above(s, r, max(most, kLeastTexels * cascades.squares[s].w));
        if (mean <= 0.0) return 1.0;
        radius = mean * tan_radius;
    }
    while (k < last && radius > kFilterTexels * cascades.squares[k].w) ++k;
    return open_share(k, r, max(radius, kLeastTexels * cascades.squares[k].w));
}

float sun_open(Receiver r, float tan_radius) {
    uint last = cascades.count - 1u;
    vec2 widest = abs(on_map(last, r.at));
    // Neither outside of all that casts nor above it is anything in the way.
    float wider = 1.0 + cascades.range * tan_radius * cascades.squares[last].z;
    if (max(widest.x, widest.y) > wider || r.height > cascades.range) return 1.0;
    uint k = 0u;
    float weight = 1.0;
    for (; k < last; ++k) {
        weight = weight_of(k, r);
        if (weight > 0.0) break;
    }
    float open = open_from(k, r, tan_radius);
    if (k < last && weight < 1.0) open = mix(open_from(k + 1u, r, tan_radius), open, weight);
    return open;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 fractions = texelFetch(fractions_of_field, pixel, 0);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside && fractions != uvec4(0u)) {
        LightWalk walk = light_walk(pixel, push.first_light);
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel) {
            uint index = next_light(walk);
            if (index == kNoLight || index > cascades.light) break;
            float before = visible_fraction(fractions, channel);
            if (index != cascades.light || before <= 0.0) continue;
            TexelRay ray = pixel_ray(pixel);
            ShadowStart start = shadow_start(seen, ray, unpack_surface(texelFetch(surface_words, pixel, 0)).normal);
            vec3 n = vec3(dot(start.outwards, cascades.u.xyz), dot(start.outwards, cascades.v.xyz), dot(start.outwards, cascades.w.xyz));
            Receiver r;
            r.at = vec2(dot(start.from, cascades.u.xyz), dot(start.from, cascades.v.xyz));
            r.height = dot(start.from, cascades.w.xyz) + cascades.w.w;
            r.climb = -n.xy / max(n.z, 1.0 / kSteepest);
            r.bias = start.part != kNoPart ? 0.15 : 0.0;
            LightSample light = sample_light(lights[index], seen_point(ray, seen));
            set_visible_fraction(fractions, channel, before * sun_open(r, light.tan_radius));
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
