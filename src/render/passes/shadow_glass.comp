#version 460
// SPDX-License-Identifier: MIT
// What glass leaves of each light, along the straight line to its middle: less what both surfaces reflect and keep out, and what the way absorbs.
// Caustics are not made: light that a lens sends elsewhere is missed here and found nowhere.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer LightMasks { uint light_masks[]; };
layout(set = 0, binding = 4) uniform utexture2D instance_ways;
layout(set = 0, binding = 5) uniform utexture2D instance_nodes;  // of glass; then the GlassRecord of every instance
layout(set = 0, binding = 6, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 7, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 8) uniform texture3D distances;
layout(set = 0, binding = 9) uniform utexture2D visibility;
layout(set = 0, binding = 10) uniform utexture2D surface_words;
layout(set = 0, binding = 11) uniform utexture2D fractions_before;
layout(set = 0, binding = 12, rgba32ui) writeonly uniform uimage2D visible_fractions;
layout(set = 0, binding = 13, rgba32ui) writeonly uniform uimage2D tints_low;
layout(set = 0, binding = 14, rgba32ui) writeonly uniform uimage2D tints_high;
layout(push_constant) uniform Push { InstancePush push; };

#define KILN_FROM_INSIDE
#define KILN_INSTANCE_WALK
#define KILN_INSTANCE_TEXTURES
#include "render/lib/glass.gpu.h"
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/glass_tint.glsl"

// Behind the nodes: a record is as large as one.
GlassRecord glass_of(uint instance) {
    InstanceNode n = node_at(push.node_count + instance);
    return GlassRecord(n.low_x, n.low_y, n.low_z, 0.0, n.high_x, n.high_y, 0.0, 0.0);
}

// Of one object; `ray` in its voxels, up to t_last.
vec3 left_by_object(GlassRecord g, TexelRay ray, float t_last, float metres_a_voxel) {
    vec3 left = vec3(1.0);
    float t = 0.0;
    inside_out = false;
    for (int surfaces = 0; surfaces < 16; ++surfaces) {
        MarchHit hit = field_march(here.grid, ray, t, t_last, true);
        float way = (hit.state == kMarchMiss ? t_last : hit.t) - t;
        if (inside_out) left *= exp(-vec3(g.absorbed_red, g.absorbed_green, g.absorbed_blue) * (way * metres_a_voxel));
        if (hit.state == kMarchMiss) break;
        // Where the way begins inside, no surface is crossed.
        if (hit.state == kMarchHit && (way > 1e-3 || surfaces > 0)) {
            vec3 gradient = trilinear_gradient(field_corners(hit.slot, hit.voxel), hit.p);
            float cosine = abs(dot(gradient, ray.direction)) / max(length(gradient), 1e-20);
            left *= 1.0 - dielectric_reflectance(min(cosine, 1.0), 1.0 / g.ior);
            if (!inside_out) left *= 1.0 - g.opacity;
        }
        inside_out = !inside_out;
        t = hit.t + 0.02;
    }
    return left;
}

// The lights of a pixel's list one after the other, and for each the glass that its way may meet. A search goes over nodes and lights alike, so that
// rays that are in step go through glass together whichever lights they are for, and most pixels, near no glass, never do.
struct GlassSearch {
    LightWalk walk;
    uint channel;  // of the light at hand, in the batch
    uint at;       // node
    bool more;     // a light is at hand
    LightSample light;
    vec3 inverse;
    vec3 left;     // of that light
};

GlassSearch search;
uvec4 fractions;
uvec4 low = uvec4(0xffffffffu);
uvec4 high = uvec4(0xffffffffu);

void light_is_done() {
    float most = max(search.left.r, max(search.left.g, search.left.b));
    if (most >= 1.0) return;
    set_visible_fraction(fractions, search.channel, visible_fraction(fractions, search.channel) * most);
    if (search.channel < 8u) {
        pack_tint(low, search.channel, search.left / max(most, 1e-20));
    } else {
        pack_tint(high, search.channel & 7u, search.left / max(most, 1e-20));
    }
}

// The next glass on a way from p, counted from the eye in finest voxels; kNoInstance: no light has any more.
uint next_glass(vec3 p, vec3 p_world) {
    uint found = kNoInstance;
    do {
        if (search.at >= push.node_count) {
            light_is_done();
            ++search.channel;
            uint index = search.channel < kLightsAtOnce ? next_light(search.walk) : kNoLight;
            search.more = index != kNoLight;
            search.left = vec3(1.0);
            if (search.more && visible_fraction(fractions, search.channel) > 0.0) {
                search.light = sample_light(lights[index], p_world);
                search.inverse = walk_inverse(search.light.l);
                search.at = 0u;
            }
        }
        while (search.at < push.node_count && found == kNoInstance) {
            InstanceNode node = node_at(search.at);
            bool meets = walk_meets(node, p, search.inverse, search.light.distance / frame.grid.voxel_size);
            search.at = meets ? search.at + 1u : node.skip;
            if (meets) found = node.instance;
        }
    } while (search.more && found == kNoInstance);
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    fractions = texelFetch(fractions_before, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside && fractions != uvec4(0u)) {
        TexelRay ray = pixel_ray(pixel);
        vec3 n = unpack_surface(texelFetch(surface_words, pixel, 0)).normal;
        vec3 p = from_eye(ray) + ray.direction * uintBitsToFloat(seen.x);
        vec3 p_world = seen_point(ray, seen);
        search.walk = light_walk(pixel, push.first_light);
        search.channel = 0xffffffffu;  // before the first
        search.at = push.node_count;
        search.left = vec3(1.0);
        uint found = next_glass(p, p_world);
        while (found != kNoInstance) {
            InstanceRecord instance = instance_at(found);
            // Off the surface by as much as its own bricks may be wrong.
            TexelRay way = object_ray(instance, p + n * (1.0 / instance.voxels), search.light.l);
            float t_last = search.light.distance / frame.grid.voxel_size;
            search.left *= left_by_object(glass_of(found), way, min(t_last * instance.voxels, kFarVoxels), frame.grid.voxel_size / instance.voxels);
            found = next_glass(p, p_world);
        }
    }
    imageStore(visible_fractions, pixel, fractions);
    imageStore(tints_low, pixel, low);
    imageStore(tints_high, pixel, high);
}
