#version 460
// SPDX-License-Identifier: MIT
// What meshes hide of each light's disc, multiplied into the fractions that the field leaves. One walk through the trees of boxes a light,
// with the whole cone of rays at once: every triangle on the way covers a part of the disc, which is
// kept as bits. No noise, no bias: rays start on the triangle itself.
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
layout(set = 0, binding = 10) uniform utexture2D fractions_of_field;
layout(set = 0, binding = 11, rgba32ui) writeonly uniform uimage2D visible_fractions;
// Pages of sRGB alone, where base colours with holes are.
layout(set = 0, binding = 12) uniform texture2DArray page_0;
layout(set = 0, binding = 13) uniform texture2DArray page_1;
layout(set = 0, binding = 14) uniform texture2DArray page_2;
layout(set = 0, binding = 15) uniform texture2DArray page_3;
layout(set = 0, binding = 16) uniform texture2DArray page_4;
layout(set = 0, binding = 17) uniform texture2DArray page_5;
layout(set = 0, binding = 18) uniform sampler page_sampler;
layout(set = 0, binding = 19, std430) readonly buffer LightMasks { uint light_masks[]; };
layout(push_constant) uniform Push { ShadowPush push; };

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"

// The disc is looked at on 32 chords that stand for strips of equal area, each in 32 pieces: what a triangle covers of a chord is a stretch of
// bits. A straight edge along the chords is off by at most half a strip, 1/64 of the disc; any other by less.
const uint kChords = 32u;
const float kChordPlaces[16] = float[16](0.024546, 0.073698, 0.123030, 0.172668, 0.222749, 0.273427, 0.324877, 0.377309, 0.430984, 0.486234, 0.543509, 0.603449, 0.667038, 0.735969, 0.813746, 0.911369);  // of the upper half: where (i + 0.5) / 32 of the disc is below

const float kFarMetres = 1e7;  // meshes are nearer; squares of it are floats

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

uint covered[kChords];
bool all_covered;

// The bits from `first` to `last`.
uint stretch(float first, float last) {
    int from = max(int(ceil(first)), 0);
    int to = min(int(floor(last)), 31);
    return to < from ? 0u : (0xffffffffu >> uint(31 - (to - from))) << uint(from);
}

// Adds what the triangle covers.
void cover(Cone c, MeshPart part, uint triangle, bool hard) {
    uint corner[3];
    vec3 p[3];
    for (uint i = 0u; i < 3u; ++i) {
        corner[i] = mesh_corner(part, triangle, i);
        p[i] = vertex_position(corner[i]) - c.from;
    }
    // Volumes of the ray and two corners each, linear on the disc. A ray meets the triangle where they have the sign that the triangle's plane
    // has seen from its start; and behind `last`, where the fourth, of the ray and the whole triangle, is too small.
    vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    float height = dot(n, p[0]);
    if (height == 0.0) return;
    float side = height < 0.0 ? -1.0 : 1.0;
    vec3 e0 = side * cross(p[1], p[2]);
    vec3 e1 = side * cross(p[2], p[0]);
    vec3 e2 = side * cross(p[0], p[1]);
    n *= side * c.last;
    vec4 middle = vec4(dot(e0, c.along), dot(e1, c.along), dot(e2, c.along), dot(n, c.along) - abs(height));
    vec4 by_x = vec4(dot(e0, c.across), dot(e1, c.across), dot(e2, c.across), dot(n, c.across));
    vec4 by_y = vec4(dot(e0, c.up), dot(e1, c.up), dot(e2, c.up), dot(n, c.up));
    vec4 reach = sqrt(by_x * by_x + by_y * by_y);
    if (any(lessThan(middle + reach, vec4(0.0)))) return;
    bool holes = (part.flags & kMeshMask) != 0u;
    if (hard) {
        all_covered = !holes || !is_hole(mesh_surfaces[part.surface], corner, middle.xyz / (middle.x + middle.y + middle.z));
        return;
    }
    if (!holes && all(greaterThanEqual(middle - reach, vec4(0.0)))) {
        all_covered = true;
        return;
    }
    uint left = 0u;  // bits that are still seen
    for (uint i = 0u; i < kChords; ++i) {
        uint before = covered[i];
        if (before == 0xffffffffu) continue;
        float x = i < 16u ? -kChordPlaces[15u - i] : kChordPlaces[i - 16u];
        float half_length = sqrt(1.0 - x * x);
        vec4 a = middle + x * by_x;
        vec4 b = half_length * by_y;
        // a + b y >= 0, for y from -1 to 1.
        vec4 root = -a / b;
        vec4 above = mix(vec4(-1.0), root, greaterThan(b, vec4(0.0)));
        vec4 below = mix(vec4(1.0), root, lessThan(b, vec4(0.0)));
        float first = max(max(max(above.x, above.y), max(above.z, above.w)), -1.0);
        float last = min(min(min(below.x, below.y), min(below.z, below.w)), 1.0);
        bool none = any(lessThan(a + abs(b), vec4(0.0)));
        // The pieces of neighbouring chords lie beside each other's edges, not in rows.
        float shift = fract(float(i) * 0.618034);
        uint bits = none ? 0u : stretch(16.0 * (first + 1.0) - shift, 16.0 * (last + 1.0) - shift);
        if (holes) {
            for (uint k = 0u; k < 32u; k += 4u) {
                if (((bits >> k) & 15u) == 0u) continue;
                float y = (float(k) + 1.5 + shift) / 16.0 - 1.0;
                vec3 e = a.xyz + y * b.xyz;
                if (is_hole(mesh_surfaces[part.surface], corner, e / (e.x + e.y + e.z))) bits &= ~(15u << k);
            }
        }
        covered[i] = before | bits;
        left |= ~(before | bits);
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
    for (uint i = 0u; i < kChords; ++i) covered[i] = 0u;
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
    for (uint i = 0u; i < kChords; ++i) hidden += bitCount(covered[i]);
    return 1.0 - float(hidden) / float(32u * kChords);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 fractions = texelFetch(fractions_of_field, pixel, 0);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside && fractions != uvec4(0u)) {
        SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
        TexelRay ray = pixel_ray(pixel);
        float h = frame.grid.voxel_size;
        float t = uintBitsToFloat(seen.x) * h;
        vec3 origin = ray_origin(ray);
        vec3 from = origin + ray.direction * t;
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
            vec3 w = mesh_weights_inside(p[0] - origin, p[1] - origin, p[2] - origin, ray.direction);
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
        LightWalk walk = light_walk(pixel, push.first_light);
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel) {
            uint index = next_light(walk);
            if (index == kNoLight) break;
            float before = visible_fraction(fractions, channel);
            if (before <= 0.0) continue;
            LightSample light = sample_light(lights[index], p_world);
            float left = unhidden(from, light.l, light.tan_radius, min(light.distance, kFarMetres));
            set_visible_fraction(fractions, channel, before * left);
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
