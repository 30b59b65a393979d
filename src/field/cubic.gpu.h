// SPDX-License-Identifier: MIT
// Where a ray meets the trilinear surface inside one voxel: the first root of a cubic (Hansson-Söderlund, Evans and
// Akenine-Möller, "Ray Tracing of Signed Distance Function Grids", JCGT 2022), and the ray's own bookkeeping.
// We keep the cubic in Bernstein form, made by blossoming the trilinear polynomial (Ramshaw, "Blossoming", 1987): every
// coefficient is a convex sum of corner values, so nothing cancels, no leading coefficient can degenerate, four positive
// coefficients prove a miss, and both ends are the face values that the neighbouring voxels see.
// Solid is value <= 0. Lengths are in voxels.

#ifndef KILN_FIELD_CUBIC_GPU_H
#define KILN_FIELD_CUBIC_GPU_H

#include "field/trilinear.gpu.h"

KILN_FIELD_BEGIN

// Nothing: greater than any root.
KILN_CONST float kNoRoot = 2.0f;
KILN_CONST float kFarVoxels = 1e30f;
// How far past its faces a brick is marched: above the rounding of positions in a brick (1e-6), below what counts (1e-4).
KILN_CONST float kFaceOverlap = 1e-5f;

// How much larger than its cell a box is that stands for it in a traversal (box_march.gpu.h), voxels: covers the rounding of coordinates of
// rays that begin within 2^18 voxels of the grid.
KILN_CONST float kBoxMargin = 0.0625f;

// Bernstein coefficients of a cubic on [0, 1].
struct Cubic {
    float b0, b1, b2, b3;
};

// The cubic that the trilinear polynomial makes along the segment from p (at 0) to q (at 1).
KILN_FN Cubic cubic_along(Corners c, vec3 p, vec3 q) {
    Cubic cubic;
    cubic.b0 = trilinear_value(c, p);
    cubic.b1 = (trilinear_value(c, vec3(q.x, p.y, p.z)) + trilinear_value(c, vec3(p.x, q.y, p.z)) +
                trilinear_value(c, vec3(p.x, p.y, q.z))) *
               0.33333334f;
    cubic.b2 = (trilinear_value(c, vec3(p.x, q.y, q.z)) + trilinear_value(c, vec3(q.x, p.y, q.z)) +
                trilinear_value(c, vec3(q.x, q.y, p.z))) *
               0.33333334f;
    cubic.b3 = trilinear_value(c, q);
    return cubic;
}

KILN_FN float cubic_value(Cubic c, float s) {
    float r = 1.0f - s;
    return ((c.b0 * r + 3.0f * c.b1 * s) * r + 3.0f * c.b2 * s * s) * r + c.b3 * s * s * s;
}

KILN_FN float cubic_slope(Cubic c, float s) {
    float r = 1.0f - s;
    return 3.0f * ((c.b1 - c.b0) * r * r + 2.0f * (c.b2 - c.b1) * r * s + (c.b3 - c.b2) * s * s);
}

// Root of a cubic that is monotone on [lo, hi], positive at lo and not at hi: Newton's method kept inside the bracket.
KILN_FN float cubic_bracketed(Cubic c, float lo, float hi, float value_lo, float value_hi) {
    float s = lo + (hi - lo) * (value_lo / (value_lo - value_hi));
    for (int i = 0; i < 24; i++) {
        float value = cubic_value(c, s);
        if (value > 0.0f)
            lo = s;
        else
            hi = s;
        float slope = cubic_slope(c, s);
        float next = slope < 0.0f ? s - value / slope : lo;
        if (!(next >= lo && next <= hi)) next = 0.5f * (lo + hi);
        float moved = abs(next - s);
        s = next;
        if (moved < 1e-6f) break;
    }
    return s;
}

// Least s in [0, 1] with value <= 0, or kNoRoot. The cubic is split where its derivative vanishes.
KILN_FN float cubic_first_root(Cubic c) {
    if (c.b0 <= 0.0f) return 0.0f;
    if (min(min(c.b1, c.b2), c.b3) > 0.0f) return kNoRoot;
    // derivative / 3 = a s² + 2 h s + d0
    float d0 = c.b1 - c.b0;
    float h = (c.b2 - c.b1) - d0;
    float a = (c.b3 - c.b2) - (c.b2 - c.b1) - h;
    float first = 1.0f;
    float second = 1.0f;
    float squared = h * h - a * d0;
    if (squared > 0.0f) {
        float w = h < 0.0f ? sqrt(squared) - h : -sqrt(squared) - h;
        float u = abs(w) > abs(a) ? 1.0f : w / a;  // a quotient past 1 is of no use; a may be 0, w not
        float v = abs(d0) > abs(w) ? 1.0f : d0 / w;
        if (!(u > 0.0f && u < 1.0f)) u = 1.0f;
        if (!(v > 0.0f && v < 1.0f)) v = 1.0f;
        first = min(u, v);
        second = max(u, v);
    }
    float value_first = first < 1.0f ? cubic_value(c, first) : c.b3;
    if (value_first <= 0.0f) return cubic_bracketed(c, 0.0f, first, c.b0, value_first);
    if (first == 1.0f) return kNoRoot;
    float value_second = second < 1.0f ? cubic_value(c, second) : c.b3;
    if (value_second <= 0.0f) return cubic_bracketed(c, first, second, value_first, value_second);
    if (second < 1.0f && c.b3 <= 0.0f) return cubic_bracketed(c, second, 1.0f, value_second, c.b3);
    return kNoRoot;
}

// A ray in voxels: it starts at texel position whole + part. `direction` has unit length.
struct TexelRay {
    ivec3 whole;
    vec3 part;
    vec3 direction;
    vec3 inverse;  // 1 / direction; 0 where the ray is parallel to the axis' planes
};

KILN_FN float ray_component(float d) { return abs(d) < 1e-12f ? 0.0f : d; }
KILN_FN float ray_inverse(float d) { return d == 0.0f ? 0.0f : 1.0f / d; }

// `part` may be any size, but is best small: its own rounding moves the ray.
KILN_FN TexelRay texel_ray(ivec3 whole, vec3 part, vec3 direction) {
    TexelRay ray;
    ray.whole = whole;
    ray.part = part;
    ray.direction = vec3(ray_component(direction.x), ray_component(direction.y), ray_component(direction.z));
    ray.inverse = vec3(ray_inverse(ray.direction.x), ray_inverse(ray.direction.y), ray_inverse(ray.direction.z));
    return ray;
}

// The same ray seen from texel (0, 0, 0) of one brick, with its parameter counted from near the brick, so that floats
// suffice at any distance: point(t) = (high + low) + (lead + rest) * (t - t_base). A pure function of ray and brick.
struct BrickRay {
    vec3 high, low;
    vec3 lead, rest;  // direction: its first 12 bits, and what is left
    vec3 inverse;
    float t_base;
};

// The first 12 bits of a float: the product of two such numbers is exact.
KILN_FN float leading_bits(float a) { return uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u); }

// One axis of brick_ray(): whole + direction * t + part as high + low, without losing what floats would.
KILN_FN void rebased(int whole, float part, float direction, float t, KILN_OUT(float) high, KILN_OUT(float) low) {
    float lead = leading_bits(direction);
    KILN_PRECISE float a = float(whole);
    KILN_PRECISE float b = lead * t;
    KILN_PRECISE float sum = a + b;
    KILN_PRECISE float b_seen = sum - a;
    KILN_PRECISE float lost = (a - (sum - b_seen)) + (b - b_seen);  // Knuth's two-sum
    KILN_PRECISE float rest = (direction - lead) * t + lost;
    high = sum;
    low = rest + part;
}

KILN_FN BrickRay brick_ray(TexelRay ray, ivec3 texel) {
    ivec3 away = ray.whole - texel;
    vec3 d = ray.direction;
    float middle = (3.5f - ray.part.x - float(away.x)) * d.x + (3.5f - ray.part.y - float(away.y)) * d.y +
                   (3.5f - ray.part.z - float(away.z)) * d.z;
    BrickRay local;
    local.t_base = leading_bits(middle);
    local.lead = vec3(leading_bits(d.x), leading_bits(d.y), leading_bits(d.z));
    local.rest = d - local.lead;
    local.inverse = ray.inverse;
    rebased(away.x, ray.part.x, d.x, local.t_base, local.high.x, local.low.x);
    rebased(away.y, ray.part.y, d.y, local.t_base, local.high.y, local.low.y);
    rebased(away.z, ray.part.z, d.z, local.t_base, local.high.z, local.low.z);
    return local;
}

// Parameter (from t_base) at which the ray crosses plane number `plane` of an axis; `parallel` where it never does.
KILN_FN float plane_crossing(float plane, float high, float low, float inverse, float parallel) {
    return inverse == 0.0f ? parallel : ((plane - high) - low) * inverse;
}

// One coordinate of the point at s (from t_base), counted from `from`. The large terms are exact products and differences, so
// the error is that of a number near 1 (1e-7), however far s is: a grazing ray multiplies it by hundreds.
KILN_FN float ray_coordinate(float from, float high, float low, float lead, float rest, float s) {
    float c = leading_bits(s);
    KILN_PRECISE float large = (high - from) + lead * c;
    KILN_PRECISE float small = low + (rest * c + (lead + rest) * (s - c));
    return large + small;
}

// Position in `voxel` at s: in [0, 1]³, or kFaceOverlap outside. Not clamped to the faces: that would bend the ray.
KILN_FN vec3 voxel_point(BrickRay ray, ivec3 voxel, float s) {
    float x = ray_coordinate(float(voxel.x), ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, s);
    float y = ray_coordinate(float(voxel.y), ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, s);
    float z = ray_coordinate(float(voxel.z), ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, s);
    float low = -kFaceOverlap;
    float high = 1.0f + kFaceOverlap;
    return vec3(min(max(x, low), high), min(max(y, low), high), min(max(z, low), high));
}

// Voxel of the brick, 0 … 6, that holds the point at s or is next to it.
KILN_FN ivec3 voxel_at(BrickRay ray, float s) {
    float x = ray_coordinate(0.0f, ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, s);
    float y = ray_coordinate(0.0f, ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, s);
    float z = ray_coordinate(0.0f, ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, s);
    return ivec3(int(min(max(x, 0.0f), 6.5f)), int(min(max(y, 0.0f), 6.5f)), int(min(max(z, 0.0f), 6.5f)));
}

// Where a walk through a grid begins (march_start() of march.gpu.h). Texels and cells count from the grid's first.
struct MarchStart {
    bool meets;   // the ray meets the grid at all
    ivec3 whole;  // of the ray
    float t;      // voxels along the ray
    ivec3 cell;
};

// What field_march() of march.gpu.h answers.
KILN_CONST int kMarchMiss = 0;
KILN_CONST int kMarchHit = 1;
KILN_CONST int kMarchInside = 2;   // the ray starts in solid, or meets it, where there is no brick: t and cell are set
KILN_CONST int kMarchMissing = 3;  // the ray meets a cell that is kCellMissing: t and cell are set
struct MarchHit {
    int state;
    float t;      // voxels along the ray
    int slot;     // brick of the hit; -1 unless kMarchHit
    ivec3 cell;   // world cell of the hit
    ivec3 voxel;  // voxel of the brick, 0 … 6
    vec3 p;       // position in that voxel, [0, 1]³
    int cells;    // cells visited
    int voxels;   // cubics looked at
};

KILN_FIELD_END

#endif
