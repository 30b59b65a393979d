#version 460
// SPDX-License-Identifier: MIT
// The share of its hemisphere that each visible point sees open, into the G-buffer: the mean over the rays of the points around it that lie on the
// same surface. Squares of four points' width have all directions once, whatever their middle (what they cover of a point is its weight, and
// points four apart look the same ways), so where the surface goes on the mean has no noise; it does not cross edges.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/ao.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2) uniform utexture2D visibility;
layout(set = 0, binding = 3) uniform utexture2D ao_points;
layout(set = 0, binding = 4) uniform utexture2D words_before;
layout(set = 0, binding = 5, rgba32ui) writeonly uniform uimage2D surface_words;
layout(push_constant) uniform Push { AoPush push; };

#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/ao_rays.glsl"

// Metres from the eye to what a ray sees at t.
vec3 point_at(ivec2 pixel, float t) {
    vec3 from = vec3(0.0);
    vec3 direction;
    if ((frame.flags & kFrameRays) != 0u) {
        FrameRay r = rays[pixel.y * frame.tile_width + pixel.x];
        from = ray_origin(texel_ray(ivec3(r.whole_x, r.whole_y, r.whole_z), vec3(r.part_x, r.part_y, r.part_z), vec3(1.0)));
        direction = vec3(r.direction_x, r.direction_y, r.direction_z);
    } else {
        direction = camera_direction(pixel + ivec2(frame.tile_x, frame.tile_y));
    }
    return from + direction * (t * frame.grid.voxel_size);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uvec4 words = texelFetch(words_before, pixel, 0);
    uint state = seen.y >> 28u;
    if (state == kSeenNothing || state == kSeenInside) {
        imageStore(surface_words, pixel, words);
        return;
    }
    vec3 normal = unpack_unit(words.y);
    float t = uintBitsToFloat(seen.x);
    vec3 p = point_at(pixel, t);
    int every = int(push.every);
    ivec2 size = (ivec2(frame.tile_width, frame.tile_height) + every - 1) / every;
    // The square's middle, in points; within the picture's border.
    vec2 middle = clamp(vec2(pixel) / float(every), vec2(2.0), max(vec2(size) - 3.0, vec2(2.0)));
    float apart = 0.5 * float(every) * frame.pixel_angle * t * frame.grid.voxel_size;
    float sum = 0.0;
    float weight = 0.0;
    vec2 side = vec2(0.0);  // on which the surface goes on
    // Beside an edge a second square brings what is missing: moved by twice as far as the middle of what is left of the first is off, it is whole.
    for (int i = 0; i < 50; ++i) {
        if (i == 25) {
            if (weight > 0.97 * float(kAoPoints * push.rays) || weight <= 0.0) break;
            middle = clamp(middle + 2.0 * float(push.rays) * side / weight, vec2(2.0), max(vec2(size) - 3.0, vec2(2.0)));
        }
        int at = i % 25;
        ivec2 texel = ivec2(ceil(middle - 2.5)) + ivec2(at % 5, at / 5);
        vec2 covered = clamp(2.5 - abs(vec2(texel) - middle), vec2(0.0), vec2(1.0));
        if (texel.x >= size.x || texel.y >= size.y || covered.x * covered.y <= 0.0) continue;
        uvec4 tap = texelFetch(ao_points, texel, 0);
        if ((tap.x & kAoSurface) == 0u) continue;
        vec3 away = point_at(ao_pixel(texel), uintBitsToFloat(tap.z)) - p;
        // Off the plane of this point by less than a curved surface would be, and turned by no more.
        float off = abs(dot(away, normal)) / (apart + 0.2 * length(away));
        float turned = dot(normal, unpack_unit(tap.y));
        // Where nothing is on the same surface, at least something.
        float w = covered.x * covered.y * max(saturate(2.0 - off) * saturate(2.5 * turned - 1.25), 1e-3);
        sum += w * float(bitCount(tap.x & kAoOpen));
        weight += w * float(push.rays);
        side += w * (vec2(texel) - middle);
    }
    uint open = weight > 0.0 ? uint(sum / weight * 255.0 + 0.5) : 255u;
    words.z = (words.z & 0xff00ffffu) | (min(open, (words.z >> 16u) & 255u) << 16u);
    imageStore(surface_words, pixel, words);
}
