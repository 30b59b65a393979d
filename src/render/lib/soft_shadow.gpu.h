// SPDX-License-Identifier: MIT
// Visible fraction of a light's disc, by marching a distance field.
// Around a ray to the light lies a cone that just holds the disc: at distance t its radius is t * tan_radius. The least
// d / (t tan_radius) along a ray that gets through is the distance x of the nearest silhouette, in radii of the disc, and
// the field's slope across the ray there says on which side it is. That edge, drawn on the disc, cuts off a circular
// segment; its share of the area is the answer. So, unlike min(k d / t), it is a fraction of solid angle: exact for
// straight edges, 1 only where the cone is clear, and 0 behind a wall of any thickness.
//   A ray that is stopped knows nothing of edges: a wall's depth is not their distance. Then rays to the rim of the disc are
// tried until one gets through. A depth beyond the cone's radius, though, proves that all of the disc is covered.
//   What hides the disc may end on its other side too (a wire, a fence): one more ray looks there.
// Steps: sphere tracing (Hart, 1996), as far as the cone surely stays clear (cf. Crassin et al., 2011, for cones).
//
// A text that includes this first declares
//     vec2 shadow_field(vec3 p)
// x: distance to the surface, as true as known, negative inside; where only "farther than this" is known, any large value.
// y: how far a step may go from there, > 0, never past the surface. Any unit of length, the same in all arguments.
// C++ includes it through shadow_march.h. The text has no guard: there each field is a class of its own.

#ifndef __cplusplus
#include "math/math.gpu.h"
#endif

// Share of a disc that lies past a straight edge at signed distance x from its centre, in radii: 1 where x >= 1.
KILN_FN float disc_visible(float x) {
    float c = clamp(x, -1.0f, 1.0f);
    return 0.5f + (c * sqrt(max(1.0f - c * c, 0.0f)) + asin(c)) / kPi;
}

// t_first: from the lit point to the first sample, > 0 (a voxel or so: the point's own surface casts nothing before it).
// t_last: to the light, or to where the field ends. smallest_step: progress at the surface itself. most_steps: of one ray.
struct ShadowMarch {
    float t_first, t_last, smallest_step;
    int most_steps;
};

// What one ray found. state: 0 stopped, 1 got through, -1 stopped and the whole disc is covered.
struct ShadowSight {
    int state;
    float x;    // distance of the nearest silhouette, in radii of the disc, at most 1
    vec2 away;  // unit, on the disc: away from that silhouette; (0, 0) where x is 1
};

// Unit direction from the lit point to (x, y) of the unit disc around l.
KILN_FN vec3 shadow_direction(vec3 l, float tan_radius, vec2 on_disc) {
    Basis basis = basis_around(l);
    return normalize(l + basis.tangent * (on_disc.x * tan_radius) + basis.bitangent * (on_disc.y * tan_radius));
}

// Looks from p towards `on_disc`. Only the middle ray needs to know how deep it is stopped. One call of the field serves the
// march and the four samples around the closest approach after it: shaders copy every call.
KILN_FN ShadowSight shadow_look(vec3 p, vec3 l, float tan_radius, vec2 on_disc, bool measure_depth, ShadowMarch march) {
    vec3 direction = shadow_direction(l, tan_radius, on_disc);
    Basis basis = basis_around(l);
    ShadowSight sight;
    sight.state = 1;
    sight.x = 1.0f;
    sight.away = vec2(0.0f, 0.0f);
    float t = march.t_first;
    float nearest_t = -1.0f;
    float nearest = 0.0f;
    float across = 0.0f;
    float along = 0.0f;
    int probe = -1;  // 0 … 3 once the march is over
    for (int i = 0; i < march.most_steps + 4; i++) {
        if (probe < 0 && (t >= march.t_last || i >= march.most_steps)) {
            if (sight.state != 1 || nearest_t < 0.0f) return sight;
            probe = 0;
        }
        vec3 at = p + direction * t;
        if (probe >= 0) {
            float reach = max(0.25f * nearest, march.smallest_step);
            float side = (probe & 1) == 0 ? reach : -reach;
            vec3 q = p + direction * nearest_t;
            at = probe < 2 ? q + basis.tangent * side : q + basis.bitangent * side;
        }
        vec2 f = shadow_field(at);
        if (probe >= 0) {
            float turned = (probe & 1) == 0 ? f.x : -f.x;
            if (probe < 2)
                across = across + turned;
            else
                along = along + turned;
            probe++;
            if (probe > 3) break;
            continue;
        }
        float cone = t * tan_radius;
        if (f.x <= 0.0f) {
            sight.state = 0;
            if (-f.x >= cone) sight.state = -1;
            if (sight.state < 0 || !measure_depth) return sight;
            t = t + max(0.5f * f.y, max(0.1f * cone, march.smallest_step));
        } else {
            if (sight.state == 0) return sight;
            if (f.x < sight.x * cone) {
                sight.x = f.x / cone;
                nearest_t = t;
                nearest = f.x;
            }
            // While the cone is clear, as far as it stays so; else in steps that find the closest approach to within 3 %.
            float clear = (f.y - cone) / (1.0f + tan_radius);
            float close = tan_radius > 0.0f ? max(0.4f * f.y, min(f.y, 0.05f * cone)) : f.y;
            t = t + max(max(clear, close), march.smallest_step);
        }
    }
    float size = sqrt(across * across + along * along);
    if (size > 0.0f) sight.away = vec2(across / size, along / size);
    return sight;
}

// Visible fraction of the disc around l (unit, from p), whose radius is tan_radius of its distance; 0: a hard shadow.
KILN_FN float shadow_visible(vec3 p, vec3 l, float tan_radius, ShadowMarch march) {
    vec2 at = vec2(0.0f, 0.0f);
    ShadowSight sight;
    sight.state = 0;
    sight.x = 1.0f;
    sight.away = vec2(0.0f, 0.0f);
    // Look 0 is at the middle. 1 to 6, until one gets through, are at the rim: they miss at most the last 3 % of the disc, and
    // opposite ones in turn find a way out soonest. 7 looks for another silhouette on the far side of the first.
    for (int look = 0; look < 8; look++) {
        vec2 to = vec2(0.0f, 0.0f);
        if (look > 0 && look < 7) {
            if (sight.state == 1) continue;
            float side = (look & 1) == 1 ? 1.0f : -1.0f;
            float turn = float((look - 1) / 2) * (kPi / 3.0f);
            to = vec2(side * cos(turn), side * sin(turn));
        }
        if (look == 7) {
            if (sight.state != 1) return 0.0f;
            // A rim ray that is all clear says no more than that.
            if (sight.x >= 1.0f) return disc_visible(0.0f);
            to = vec2(-sight.away.x, -sight.away.y);
        }
        ShadowSight seen = shadow_look(p, l, tan_radius, to, look == 0 && tan_radius > 0.0f, march);
        if (look == 7) {
            // The edge is at x - towards along `away`.
            float towards = at.x * sight.away.x + at.y * sight.away.y;
            float visible = disc_visible(sight.x - towards);
            if (seen.state == 1 && sight.away.x * seen.away.x + sight.away.y * seen.away.y < 0.0f) {
                visible = visible + disc_visible(seen.x - (to.x * seen.away.x + to.y * seen.away.y));
            }
            return min(visible, 1.0f);
        }
        sight = seen;
        at = to;
        if (look == 0) {
            if (sight.state < 0) return 0.0f;
            if (tan_radius <= 0.0f || (sight.state == 1 && sight.x >= 1.0f)) return sight.state == 1 ? 1.0f : 0.0f;
        }
    }
    return 0.0f;
}

// Part i of n equal parts of the unit disc, as a disc: its centre; every part has radius 1 / sqrt(n). Parts lie on a
// sunflower spiral (Vogel, "A Better Way to Construct the Sunflower Head", 1979), turned by `turn` radians. For lights so
// wide that one edge is not all: march shadow_direction(l, tan_radius, part) with tan_radius / sqrt(n), take the mean.
KILN_FN vec2 shadow_sub_disc(int i, int n, float turn) {
    if (n <= 1) return vec2(0.0f, 0.0f);
    float r = sqrt((float(i) + 0.5f) / float(n));
    float angle = float(i) * 2.39996323f + turn;
    return vec2(r * cos(angle), r * sin(angle));
}
