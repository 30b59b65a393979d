#version 460
// SPDX-License-Identifier: MIT
// What meshes hide of each light's disc, multiplied into the fractions that the field leaves. One walk through the trees of boxes a light,
// with the whole cone of rays at once: every triangle on the way covers those of 256 places on the disc that lie behind it, and what is
// covered is a bit each. No noise, no bias: rays start on the triangle itself.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer Parts { MeshPart mesh_parts[]; };
layout(set = 0, binding = 4, std430) readonly buffer MeshCorners { uint mesh_corners[]; };
layout(set = 0, binding = 5, std430) readonly buffer Vertices { MeshVertex mesh_vertices[]; };
layout(set = 0, binding = 6, std430) readonly buffer Surfaces { MeshSurface mesh_surfaces[]; };
layout(set = 0, binding = 7, std430) readonly buffer Nodes { MeshNode nodes[]; };  // of the parts' boxes first, then of each part's triangles
layout(set = 0, binding = 8) uniform utexture2D visibility;
layout(set = 0, binding = 9) uniform utexture2D surface_words;
layout(set = 0, binding = 10) uniform texture2D fractions_of_field;
layout(set = 0, binding = 11, rgba8) writeonly uniform image2D visible_fractions;
// Pages of sRGB alone, where base colours with holes are.
layout(set = 0, binding = 12) uniform texture2DArray page_0;
layout(set = 0, binding = 13) uniform texture2DArray page_1;
layout(set = 0, binding = 14) uniform texture2DArray page_2;
layout(set = 0, binding = 15) uniform texture2DArray page_3;
layout(set = 0, binding = 16) uniform texture2DArray page_4;
layout(set = 0, binding = 17) uniform texture2DArray page_5;
layout(set = 0, binding = 18) uniform sampler page_sampler;
layout(push_constant) uniform Push { ShadowPush push; };

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"

// Places on the disc, on a spiral of golden angles: even in area, and in every direction (Vogel, "A better way to construct the sunflower
// head", 1979). What a straight edge leaves of them is off by at most 0.02 of the disc.
const uint kDiscPlaces = 256u;
const uint kDiscWords = kDiscPlaces / 32u;
const float kGoldenCos = -0.7373688781;
const float kGoldenSin = 0.6754902943;

// All rays from a point to a light's disc: along + x across + y up, x² + y² <= 1; a ray's parameter counts metres along its middle.
struct Cone {
    vec3 from;
    vec3 along, across, up;
    vec3 slowest, fastest;  // components of any ray of it
    float last;
};

Cone make_cone(vec3 from, vec3 along, vec3 across, vec3 up, float last) {
    vec3 spread = sqrt(across * across + up * up);
    return Cone(from, along, across, up, along - spread, along + spread, last);
}

// Whether some ray of the cone may meet the box: low <= from + t v <= high with v between slowest and fastest, as bounds on t.
bool may_meet(Cone c, vec3 low, vec3 high) {
    float first = 0.0;
    float last = c.last;
    for (int i = 0; i < 3; ++i) {
        float above = high[i] - c.from[i];  // slowest t <= above
        float below = low[i] - c.from[i];   // fastest t >= below
        if (c.slowest[i] > 0.0) {
            last = min(last, above / c.slowest[i]);
        } else if (c.slowest[i] < 0.0) {
            first = max(first, above / c.slowest[i]);
        } else if (above < 0.0) {
            return false;
        }
        if (c.fastest[i] > 0.0) {
            first = max(first, below / c.fastest[i]);
        } else if (c.fastest[i] < 0.0) {
            last = min(last, below / c.fastest[i]);
        } else if (below > 0.0) {
            return false;
        }
    }
    // A thousandth of a percent wider than rounding makes it.
    return first <= last * 1.00001;
}

float alpha_texel(uint page, vec3 at) {
    switch (page) {
        case 0u: return textureLod(sampler2DArray(page_0, page_sampler), at, 0.0).a;
        case 1u: return textureLod(sampler2DArray(page_1, page_sampler), at, 0.0).a;
        case 2u: return textureLod(sampler2DArray(page_2, page_sampler), at, 0.0).a;
        case 3u: return textureLod(sampler2DArray(page_3, page_sampler), at, 0.0).a;
        case 4u: return textureLod(sampler2DArray(page_4, page_sampler), at, 0.0).a;
        default: return textureLod(sampler2DArray(page_5, page_sampler), at, 0.0).a;
    }
}

bool is_hole(MeshSurface s, uint v[3], vec3 w) {
    float alpha = s.alpha * (w.x * vertex_color(v[0]).a + w.y * vertex_color(v[1]).a + w.z * vertex_color(v[2]).a);
    if ((s.base.where & kTextureIs) != 0u) {
        bool second = (s.base.where & kTextureSet1) != 0u;
        vec2 uv = w.x * vertex_uv(v[0], second) + w.y * vertex_uv(v[1], second) + w.z * vertex_uv(v[2], second);
        uv = mat2(s.base.m0, s.base.m1, s.base.m2, s.base.m3) * uv + vec2(s.base.m4, s.base.m5);
        uint modes = s.base.where >> kTextureWrapU;
        for (int i = 0; i < 2; ++i) {
            uint mode = (modes >> (2 * i)) & 3u;
            if (mode == 1u) uv[i] = abs(uv[i] - 2.0 * floor(0.5 * uv[i] + 0.5));
            if (mode == 2u) uv[i] = clamp(uv[i], 0.0, 1.0);
        }
        alpha *= alpha_texel((s.base.where >> kTexturePageShift) & 15u, vec3(uv, float(s.base.where & 255u)));
    }
    return alpha < s.alpha_cutoff;
}

uint covered[kDiscWords];
bool all_covered;

// Adds the places of the disc that the triangle covers.
void cover(Cone c, MeshPart part, uint triangle, bool hard) {
    uint corner[3];
    vec3 p[3];
    for (uint i = 0u; i < 3u; ++i) {
        corner[i] = mesh_corner(part, triangle, i);
        p[i] = vertex_position(corner[i]) - c.from;
    }
    // Volumes with the ray and two corners each: of one sign where the ray's line meets the triangle. All are linear on the disc.
    vec3 e0 = cross(p[1], p[2]);
    vec3 e1 = cross(p[2], p[0]);
    vec3 e2 = cross(p[0], p[1]);
    vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    vec4 middle = vec4(dot(e0, c.along), dot(e1, c.along), dot(e2, c.along), dot(n, c.along));
    vec4 by_x = vec4(dot(e0, c.across), dot(e1, c.across), dot(e2, c.across), dot(n, c.across));
    vec4 by_y = vec4(dot(e0, c.up), dot(e1, c.up), dot(e2, c.up), dot(n, c.up));
    float height = dot(n, p[0]);
    vec4 reach = sqrt(by_x * by_x + by_y * by_y);
    vec4 low = middle - reach;
    vec4 high = middle + reach;
    if (any(lessThan(high.xyz, vec3(0.0))) && any(greaterThan(low.xyz, vec3(0.0)))) return;
    bool holes = (part.flags & kMeshMask) != 0u;
    // 0 < height / w < last for the whole disc, behind all of the triangle: nothing is left to see.
    float ahead_low = height < 0.0 ? -high.w : low.w;
    float size = abs(height);
    if (!holes && (all(greaterThan(low.xyz, vec3(0.0))) || all(lessThan(high.xyz, vec3(0.0)))) && ahead_low * c.last > size && size > 0.0) {
        all_covered = true;
        return;
    }
    uint places = hard ? 1u : kDiscPlaces;
    vec2 turn = vec2(1.0, 0.0);
    uint left = 0u;  // bits still to see
    for (uint word = 0u; word * 32u < places; ++word) {
        uint bits = covered[word];
        for (uint i = 0u; i < min(32u, places); ++i) {
            float r = hard ? 0.0 : sqrt((float(32u * word + i) + 0.5) / float(kDiscPlaces));
            vec4 e = middle + (r * turn.x) * by_x + (r * turn.y) * by_y;
            turn = vec2(turn.x * kGoldenCos - turn.y * kGoldenSin, turn.x * kGoldenSin + turn.y * kGoldenCos);
            bool in_line = all(greaterThanEqual(e.xyz, vec3(0.0))) || all(lessThanEqual(e.xyz, vec3(0.0)));
            float ahead = e.w < 0.0 ? -height : height;
            if (!in_line || e.w == 0.0 || ahead <= 0.0 || ahead >= c.last * abs(e.w)) continue;
            if (holes && is_hole(mesh_surfaces[part.surface], corner, e.xyz / (e.x + e.y + e.z))) continue;
            bits |= 1u << i;
        }
        covered[word] = bits;
        left |= hard ? ~bits & 1u : ~bits;
    }
    all_covered = left == 0u;
}

// The triangle that the rays start on; none: kNoPart.
const uint kNoPart = 0xffffffffu;
uint own_part = kNoPart;
uint own_triangle = 0u;

// How much of a light's disc no mesh hides.
float unhidden(vec3 from, vec3 l, float tan_radius, float distance) {
    Basis basis = basis_around(l);
    bool hard = tan_radius <= 0.0;
    for (uint i = 0u; i < kDiscWords; ++i) covered[i] = 0u;
    all_covered = false;
    Cone cone = make_cone(from, l, basis.tangent * tan_radius, basis.bitangent * tan_radius, distance);
    uint top = nodes[0].skip;
    for (uint i = 0u; i < top && !all_covered;) {
        MeshNode box = nodes[i];
        if (!may_meet(cone, vec3(box.min_x, box.min_y, box.min_z), vec3(box.max_x, box.max_y, box.max_z))) {
            i = box.skip;
            continue;
        }
        ++i;
        for (uint k = 0u; k < (box.leaf & 7u); ++k) {
            uint which = (box.leaf >> 3u) + k;
            MeshPart part = mesh_parts[which];
            Cone local = make_cone(local_point(part, cone.from), local_vector(part, cone.along), local_vector(part, cone.across),
                                   local_vector(part, cone.up), cone.last);
            for (uint j = 0u; j < part.node_count && !all_covered;) {
                MeshNode node = nodes[part.first_node + j];
                if (!may_meet(local, vec3(node.min_x, node.min_y, node.min_z), vec3(node.max_x, node.max_y, node.max_z))) {
                    j = node.skip;
                    continue;
                }
                ++j;
                for (uint t = 0u; t < (node.leaf & 7u) && !all_covered; ++t) {
                    uint triangle = (node.leaf >> 3u) + t;
                    if (which != own_part || triangle != own_triangle) cover(local, part, triangle, hard);
                }
            }
        }
    }
    if (all_covered) return 0.0;
    if (hard) return 1.0;
    int hidden = 0;
    for (uint i = 0u; i < kDiscWords; ++i) hidden += bitCount(covered[i]);
    return 1.0 - float(hidden) / float(kDiscPlaces);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    vec4 fractions = texelFetch(fractions_of_field, pixel, 0);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside && fractions != vec4(0.0)) {
        SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
        TexelRay ray = pixel_ray(pixel);
        float h = frame.grid.voxel_size;
        float t = uintBitsToFloat(seen.x) * h;
        vec3 from = ray.direction * t;
        // As far off the surface as floats of its place, and of bricks, may be wrong.
        float off = 4e-6 * max(t, 0.1);
        vec3 outwards = surface.normal;
        if (state == kSeenMesh) {
            MeshPart part = mesh_parts[seen.z];
            own_part = seen.z;
            own_triangle = seen.y & 0x0fffffffu;
            vec3 p[3];
            vec3 n[3];
            for (uint i = 0u; i < 3u; ++i) {
                uint v = mesh_corner(part, own_triangle, i);
                p[i] = mesh_point(part, vertex_position(v));
                n[i] = normalize(mesh_normal(part, unpack_unit(mesh_vertices[v].normal)));
            }
            vec3 w = mesh_weights_inside(p[0], p[1], p[2], ray.direction);
            from = w.x * p[0] + w.y * p[1] + w.z * p[2];
            outwards = cross(p[1] - p[0], p[2] - p[0]);
            float size = length(outwards);
            outwards = size > 0.0 ? outwards / size : surface.normal;
            float side = dot(outwards, ray.direction) > 0.0 ? -1.0 : 1.0;
            outwards *= side;
            // Onto the round surface that the normals tell of, so that facets do not shadow it (Hanika, "Hacking the Shadow Terminator", 2021).
            vec3 moved = vec3(0.0);
            for (int i = 0; i < 3; ++i) moved -= w[i] * min(dot(from - p[i], side * n[i]), 0.0) * (side * n[i]);
            from += moved;
        } else {
            off = max(off, 2e-3 * h);
        }
        from += outwards * off;
        vec3 p_world = (vec3(ray.whole) + (ray.part + ray.direction * uintBitsToFloat(seen.x))) * h;
        for (int channel = 0; channel < int(kLightsAtOnce); ++channel) {
            uint index = push.first_light + uint(channel);
            if (index >= frame.light_count) break;
            if (fractions[channel] <= 0.0) continue;
            LightSample light = sample_light(lights[index], p_world);
            fractions[channel] *= unhidden(from, light.l, light.tan_radius, light.distance);
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
