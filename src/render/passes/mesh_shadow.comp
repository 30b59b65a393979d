#version 460
// SPDX-License-Identifier: MIT
// What meshes hide of each light's disc, multiplied into the fractions that the field leaves. All rays from a point to the disc go through the
// trees of boxes at once: every triangle on their way covers a part of the disc, which is kept as bits. No noise, no bias: rays start on the
// triangle itself.
//   The threads of a workgroup find the triangles together that may lie between them and the light (mesh_beam.glsl); where there is none,
// all of them see the whole disc. What is found does not depend on it: without kFrameAccelerate all triangles of the scene are looked at.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
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
// False: no part has holes.
layout(constant_id = 7) const bool kHoles = true;

#include "render/passes/mesh.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/mesh_shadow_start.glsl"

const float kFarMetres = 1e7;  // meshes are nearer; squares of it are floats

#include "render/passes/mesh_beam.glsl"

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


// The disc is looked at on 32 chords that stand for strips of equal area, each in 32 pieces: what a triangle covers of a chord is a stretch of
// bits. A straight edge along the chords is off by at most half a strip, 1/64 of the disc; any other by less.
const uint kChords = 32u;
// Where (i + 0.5) / 32 of the disc is below.
const float kChordPlaces[32] = float[32](-0.911369, -0.813746, -0.735969, -0.667038, -0.603449, -0.543509, -0.486234, -0.430984, -0.377309, -0.324877, -0.273427, -0.222749, -0.172668, -0.123030, -0.073698, -0.024546, 0.024546, 0.073698, 0.123030, 0.172668, 0.222749, 0.273427, 0.324877, 0.377309, 0.430984, 0.486234, 0.543509, 0.603449, 0.667038, 0.735969, 0.813746, 0.911369);

uint covered[kChords];
uint full_chords;  // a bit each
bool all_covered;

// How many chords, as a real number, lie below x: the disc's share there, see kChordPlaces.
float chords_below(float x) {
    x = clamp(x, -1.0, 1.0);
    return float(kChords) * (0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / kPi) - 0.5;
}

// The bits from `first` to `last`.
uint stretch(float first, float last) {
    int from = int(ceil(clamp(first, 0.0, 32.0)));
    int to = int(floor(clamp(last, -1.0, 31.0)));
    return to < from ? 0u : (0xffffffffu >> uint(31 - (to - from))) << uint(from);
}

// A light's disc seen from a point: a place p has dot(x, p - from) / dot(along, p - from) on it, likewise y.
struct Disc {
    vec3 from;
    vec3 along, x, y;
    float last;  // metres along its middle
    bool hard;   // a point
};

// What a triangle may cover of a disc: where middle + x by_x + y by_y >= 0 in all components. Three are volumes of the ray and two corners each;
// a ray meets the triangle where they have the sign that the triangle's plane has seen from its start. The fourth, of the ray and the whole
// triangle, is too small where it lies behind the light.
struct Shade {
    vec4 middle, by_x, by_y;
    float low, high;  // of x
    uint slot;        // of the chunk's triangles
};

bool is_hole_of(Shade shade, vec3 w) {
    uvec2 leaf = leaves[shade.slot / kInLeaf];
    MeshPart part = mesh_parts[leaf.x];
    uint v[3];
    for (uint i = 0u; i < 3u; ++i) v[i] = mesh_corner(part, (leaf.y >> 3u) + shade.slot % kInLeaf, i);
    return is_hole(mesh_surfaces[part.surface], v, w / (w.x + w.y + w.z));
}

// The chunk's triangle `slot`, of a part with these flags. False: nothing. Sets all_covered where it hides the whole disc.
bool may_shade(Disc disc, uint slot, uint flags, bool holes, out Shade shade) {
    shade.slot = slot;
    vec3 p[3];  // x, y and 1 on the disc, times metres along its middle
    for (uint i = 0u; i < 3u; ++i) {
        uint at = 9u * slot + 3u * i;
        vec3 q = vec3(leaf_places[at], leaf_places[at + 1u], leaf_places[at + 2u]) - disc.from;
        p[i] = vec3(dot(disc.x, q), dot(disc.y, q), dot(disc.along, q));
    }
    vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    float height = dot(n, p[0]);
    float side = height < 0.0 ? -1.0 : 1.0;
    vec3 e0 = side * cross(p[1], p[2]);
    vec3 e1 = side * cross(p[2], p[0]);
    vec3 e2 = side * cross(p[0], p[1]);
    n *= side * disc.last;
    shade.middle = vec4(e0.z, e1.z, e2.z, n.z - abs(height));
    shade.by_x = vec4(e0.x, e1.x, e2.x, n.x);
    shade.by_y = vec4(e0.y, e1.y, e2.y, n.y);
    vec4 reach = disc.hard ? vec4(0.0) : sqrt(shade.by_x * shade.by_x + shade.by_y * shade.by_y);
    shade.low = -1.0;
    shade.high = 1.0;
    if (p[0].z > 0.0 && p[1].z > 0.0 && p[2].z > 0.0) {
        vec3 x = vec3(p[0].x / p[0].z, p[1].x / p[1].z, p[2].x / p[2].z);
        shade.low = max(min(min(x.x, x.y), x.z), -1.0);
        shade.high = min(max(max(x.x, x.y), x.z), 1.0);
    }
    // Of a closed surface the faces that are turned to the point hide all that it hides.
    bool turned_away = (flags & kMeshClosed) != 0u && (height < 0.0) == ((flags & kMeshMirrored) != 0u);
    if (height == 0.0 || turned_away || any(lessThan(shade.middle + reach, vec4(0.0)))) return false;
    bool some_left = holes || any(lessThan(shade.middle - reach, vec4(0.0)));
    if (holes && disc.hard) some_left = is_hole_of(shade, shade.middle.xyz);
    all_covered = !some_left;
    return !disc.hard;
}

// Where along a chord each volume changes sign: y = at + by * x, from below or from above.
struct Sides {
    vec4 up_at, up_by, down_at, down_by;
};

Sides sides_of(Shade shade) {
    // A volume that does not depend on y changes sign far out.
    vec4 slope = mix(shade.by_y, vec4(1e-20), lessThan(abs(shade.by_y), vec4(1e-20)));
    vec4 at = -shade.middle / slope;
    vec4 by = -shade.by_x / slope;
    bvec4 up = greaterThan(slope, vec4(0.0));
    return Sides(mix(vec4(-2.0), at, up), mix(vec4(0.0), by, up), mix(at, vec4(2.0), up), mix(by, vec4(0.0), up));
}

// The pieces of neighbouring chords lie beside each other's edges, not in rows.
float chord_shift(uint i) { return fract(float(i) * 0.618034); }

// The pieces of chord i, as long as this on each side of its middle at x, that lie within all four.
uint pieces_within(Sides sides, uint i, float x, float half_length) {
    vec4 above = sides.up_at + x * sides.up_by;
    vec4 below = sides.down_at + x * sides.down_by;
    float first = max(max(max(above.x, above.y), max(above.z, above.w)), -half_length);
    float last = min(min(min(below.x, below.y), min(below.z, below.w)), half_length);
    float shift = chord_shift(i);
    float pieces = 16.0 / half_length;
    return stretch(pieces * first + (16.0 - shift), pieces * last + (16.0 - shift));
}

void cover_chord(uint i, uint bits) {
    uint now = covered[i] | bits;
    covered[i] = now;
    full_chords |= uint(now == 0xffffffffu) << i;
}

// All chords in the same order for all threads, so that what is covered stays in registers and none waits for another's.
void cover(Shade shade) {
    Sides sides = sides_of(shade);
    // The chords that reach into the triangle.
    uint begin = uint(max(ceil(chords_below(shade.low) - 0.05), 0.0));
    uint end = uint(clamp(floor(chords_below(shade.high) + 1.05), 0.0, float(kChords)));
    [[unroll]] for (uint i = 0u; i < kChords; ++i) {
        float x = kChordPlaces[i];
        uint bits = pieces_within(sides, i, x, sqrt(1.0 - x * x));
        cover_chord(i, i >= begin && i < end ? bits : 0u);
    }
    all_covered = full_chords == 0xffffffffu;
}

// The same of a triangle with holes, which are looked for once every four pieces.
void cover_with_holes(Shade shade) {
    Sides sides = sides_of(shade);
    uint begin = uint(max(ceil(chords_below(shade.low) - 0.05), 0.0));
    uint end = uint(clamp(floor(chords_below(shade.high) + 1.05), 0.0, float(kChords)));
    for (uint i = begin; i < end; ++i) {
        float x = kChordPlaces[i];
        float half_length = sqrt(1.0 - x * x);
        uint bits = pieces_within(sides, i, x, half_length);
        for (uint k = 0u; k < 32u; k += 4u) {
            if (((bits >> k) & 15u) == 0u) continue;
            float y = ((float(k) + 1.5 + chord_shift(i)) / 16.0 - 1.0) * half_length;
            if (is_hole_of(shade, shade.middle.xyz + x * shade.by_x.xyz + y * shade.by_y.xyz)) bits &= ~(15u << k);
        }
        cover_chord(i, bits);
    }
    all_covered = full_chords == 0xffffffffu;
}

// The triangle that the rays start on; none: kNoPart.
uint own_part = kNoPart;
uint own_triangle = 0u;

// Covers what the triangles of these leaves of the chunk hide of a disc; those of `later` come after the others. Loops are nested so that what
// costs most is done by all threads at once: each looks for a triangle that shades, then all draw one.
void cover_leaves(Disc disc, uvec2 todo, uvec2 later, bool holes) {
    uint first_slot = 0u;
    uint triangles = 0u;  // of the leaf at hand, a bit each
    uint flags = 0u;
    uint own = 0xffffffffu;  // the triangle that the rays start on
    bool done = all_covered || (todo.x | todo.y | later.x | later.y) == 0u;
    while (!done) {
        bool shades = false;
        Shade shade;
        do {
            if (triangles == 0u) {
                bool none = (todo.x | todo.y) == 0u;
                todo = none ? later : todo;
                later = none ? uvec2(0u) : later;
                done = (todo.x | todo.y) == 0u;
                if (!done) {
                    bool first_word = todo.x != 0u;
                    uint leaf = first_word ? uint(findLSB(todo.x)) : 32u + uint(findLSB(todo.y));
                    todo = first_word ? uvec2(todo.x & (todo.x - 1u), todo.y) : uvec2(0u, todo.y & (todo.y - 1u));
                    uvec2 what = leaves[leaf];
                    first_slot = kInLeaf * leaf;
                    triangles = leaf_triangles[leaf];
                    flags = mesh_parts[what.x].flags;
                    own = what.x == own_part ? first_slot + own_triangle - (what.y >> 3u) : 0xffffffffu;
                }
            }
            if (!done && triangles != 0u) {
                uint slot = first_slot + uint(findLSB(triangles));
                triangles &= triangles - 1u;
                shades = slot != own && may_shade(disc, slot, flags, holes, shade);
                done = all_covered;
            }
        } while (!shades && !done);
        if (shades && !done) {
            if (holes)
                cover_with_holes(shade);
            else
                cover(shade);
            done = all_covered;
        }
    }
}

// All that the chunk hides of a disc, first by those leaves that its middle is behind: a triangle that hides all of it is among them. Triangles
// with holes come last, in a loop of their own: looking for holes costs more than all else.
void cover_chunk(Disc disc, Reach cone, Reach middle) {
    uvec2 todo = uvec2(0u);
    uvec2 later = uvec2(0u);
    uvec2 left = uvec2(leaves_that_hide[0], leaves_that_hide[1]);
    while ((left.x | left.y) != 0u) {
        bool first_word = left.x != 0u;
        uint i = first_word ? uint(findLSB(left.x)) : 32u + uint(findLSB(left.y));
        left = first_word ? uvec2(left.x & (left.x - 1u), left.y) : uvec2(0u, left.y & (left.y - 1u));
        vec3 low = vec3(leaf_boxes[6u * i], leaf_boxes[6u * i + 1u], leaf_boxes[6u * i + 2u]);
        vec3 high = vec3(leaf_boxes[6u * i + 3u], leaf_boxes[6u * i + 4u], leaf_boxes[6u * i + 5u]);
        uint bit = may_meet(cone, low, high) ? 1u << (i & 31u) : 0u;
        bool behind = may_meet(middle, low, high);
        uvec2 bits = i < 32u ? uvec2(bit, 0u) : uvec2(0u, bit);
        todo |= behind ? bits : uvec2(0u);
        later |= behind ? uvec2(0u) : bits;
    }
    uvec2 with_holes = kHoles ? uvec2(leaves_with_holes[0], leaves_with_holes[1]) : uvec2(0u);
    cover_leaves(disc, todo & ~with_holes, later & ~with_holes, false);
    if (kHoles) cover_leaves(disc, todo & with_holes, later & with_holes, true);
}

// The next light that some point of the workgroup sees something of and that has no map, of the channel before `next_channel`; kNoLight: none.
uint next_wanted_light(inout LightWalk walk, inout uint next_channel) {
    uint index = kNoLight;
    bool found = false;
    do {
        index = next_channel < kLightsAtOnce ? next_light(walk) : kNoLight;
        found = index == kNoLight || ((tile_wants >> next_channel) & 1u) != 0u && lights[index].color.w == 0.0;
        ++next_channel;
    } while (!found);
    return index;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool in_tile = pixel.x < frame.tile_width && pixel.y < frame.tile_height;
    uvec4 fractions = in_tile ? texelFetch(fractions_of_field, pixel, 0) : uvec4(0u);
    uvec4 seen = in_tile ? texelFetch(visibility, pixel, 0) : uvec4(0u);
    uint state = seen.y >> 28u;
    bool lit = in_tile && state != kSeenNothing && state != kSeenInside && fractions != uvec4(0u);
    vec3 from = vec3(0.0);
    vec3 p_world = vec3(0.0);
    if (lit) {
        SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
        TexelRay ray = pixel_ray(pixel);
        ShadowStart start = shadow_start(seen, ray, surface.normal);
        from = start.from;
        own_part = start.part;
        own_triangle = start.triangle;
        p_world = seen_point(ray, seen);
    }
    bound_tile(lit, from, fractions);
    LightWalk walk = light_walk(ivec2(gl_WorkGroupID.xy) * kTileGroup, push.first_light);
    uint next_channel = 0u;
    uint index = next_wanted_light(walk, next_channel);
    if (index != kNoLight) do {
        uint channel = next_channel - 1u;
        begin_light(lights[index]);
        float before = visible_fraction(fractions, channel);
        bool open = lit && before > 0.0;
        LightSample light = sample_light(lights[index], p_world);
        float last = min(light.distance, kFarMetres);
        Basis basis = basis_around(light.l);
        bool hard = light.tan_radius <= 0.0;
        float by_size = hard ? 1.0 : 1.0 / light.tan_radius;
        Disc disc = Disc(from, light.l, basis.tangent * by_size, basis.bitangent * by_size, last, hard);
        Reach cone = cone_reach(from, light.l, basis.tangent * light.tan_radius, basis.bitangent * light.tan_radius, last);
        Reach middle = cone_reach(from, light.l, vec3(0.0), vec3(0.0), last);
        for (uint i = 0u; i < kChords; ++i) covered[i] = 0u;
        full_chords = 0u;
        all_covered = false;
        bool more = false;
        do {
            next_leaves();
            if (open && (leaves_that_hide[0] | leaves_that_hide[1]) != 0u) {
                cover_chunk(disc, cone, middle);
                open = !all_covered;
            }
            more = branch_count != 0u;  // the same in all threads
            if (more) {
                if (open) atomicOr(tile_open, 1u);
                barrier();
                more = tile_open != 0u;
                barrier();
            }
        } while (more);
        if (lit && before > 0.0) {
            int hidden = 0;
            for (uint i = 0u; i < kChords; ++i) hidden += bitCount(covered[i]);
            float left = all_covered ? 0.0 : (hard ? 1.0 : 1.0 - float(hidden) / float(32u * kChords));
            set_visible_fraction(fractions, channel, before * left);
        }
        index = next_wanted_light(walk, next_channel);
    } while (index != kNoLight);
    if (in_tile) imageStore(visible_fractions, pixel, fractions);
}
