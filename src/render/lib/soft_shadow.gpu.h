// SPDX-License-Identifier: MIT
// Visible fraction of a light's disc, by marching a distance field.
// Around a ray to the light lies a cone that just holds the disc: at distance t its radius is t * tan_radius. The least
// d / (t tan_radius) along a ray that gets through is the distance x of the nearest silhouette, in radii of the disc, and
// the field's slope across the ray there says on which side it is. That edge, drawn on the disc, cuts off a circular
// segment; its share of the area is the answer. So, unlike min(k d / t), it is a fraction of solid angle: exact for
// straight edges, 1 only where the cone is clear, and 0 behind a wall of any thickness.
//   A ray that is stopped knows nothing of edges: a wall's depth is not their distance. Then rays to the rim of the disc are
// tried until one gets through. A depth beyond the cone's radius, though, proves that all of the disc is covered.
//   Where the cone is wider than the field tells of (a baked field knows distances up to its band), a silhouette may be missed:
// then rays to the rim look for what is hidden there. Between a ray that gets through and one that is stopped the silhouette is
// closed in on by halves, until the field tells of it.
//   What hides the disc may end on its other side too (a wire, a fence): one more ray looks there.
// Steps: sphere tracing (Hart, 1996), as far as the cone surely stays clear (cf. Crassin et al., 2011, for cones).
//
// A text that includes this first declares
//     vec3 shadow_field(vec3 p, vec3 direction)
// x: distance to the surface, as true as known, negative inside; where only "farther than this" is known, any large value outside,
// and inside the least depth.
// y: how far a step may go from there, > 0, never past the surface, whatever its direction.
// z: how far the ray from there along `direction` surely meets nothing and the field would say no more than "far"; 0 where it may say
// more. Any unit of length, the same in all arguments.
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
// band: distances from there on may be given as large values.
struct ShadowMarch {
    float t_first, t_last, smallest_step, band;
    int most_steps;
};

// What one ray found. state: 0 stopped, 1 got through, -1 stopped and the whole disc is covered.
struct ShadowSight {
    int state;
    float x;     // distance of the nearest silhouette, in radii of the disc, at most 1
    vec2 away;   // unit, on the disc: away from that silhouette; (0, 0) where x is 1
    float open;  // along the ray: up to there all of the cone is clear
    float wide;  // the cone's radius, in bands, where it was widest and not all of it known; 0: it always was
};

// Unit direction from the lit point to (x, y) of the unit disc around l.
KILN_FN vec3 shadow_direction(vec3 l, float tan_radius, vec2 on_disc) {
    Basis basis = basis_around(l);
    return normalize(l + basis.tangent * (on_disc.x * tan_radius) + basis.bitangent * (on_disc.y * tan_radius));
}

// Looks from p towards `on_disc`. Only the middle ray needs to know how deep it is stopped. One call of the field serves the
// march and the four samples around the closest approach after it: shaders copy every call.
// `from`: where its march begins.
KILN_FN ShadowSight shadow_look(vec3 p, vec3 l, float tan_radius, vec2 on_disc, bool measure_depth, float from,
                                ShadowMarch march) {
    vec3 direction = shadow_direction(l, tan_radius, on_disc);
    Basis basis = basis_around(l);
    ShadowSight sight;
    sight.state = 1;
    sight.x = 1.0f;
    sight.away = vec2(0.0f, 0.0f);
    sight.open = from;
    sight.wide = 0.0f;
    bool open = true;
    float t = from;
    float nearest_t = -1.0f;
    float nearest = 0.0f;
    float across = 0.0f;
    float along = 0.0f;
    int probe = -1;  // 0 … 3 once the march is over
    for (int i = 0; i < march.most_steps + 4; i++) {
        if (probe < 0 && (t >= march.t_last || i >= march.most_steps)) {
            // Near the end of what is known, what lies around the nearest place is not: better another look.
            if (sight.wide > 0.0f && nearest > 0.7f * march.band) {
                sight.x = 1.0f;
                nearest_t = -1.0f;
            }
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
        vec3 f = shadow_field(at, direction);
        if (probe >= 0) {
            // A distance cannot have grown by more than the way; larger values say no more than "far".
            float d = min(f.x, nearest + max(0.25f * nearest, march.smallest_step));
            float turned = (probe & 1) == 0 ? d : -d;
            if (probe < 2)
                across = across + turned;
            else
                along = along + turned;
            probe++;
            if (probe > 3) break;
            continue;
        }
        float cone = t * tan_radius;
        open = open && f.x > 0.0f && f.y >= cone;
        if (open) sight.open = t;
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
            // A band of nine tenths of the cone leaves out less than 2 % of the disc.
            if (0.9f * cone > march.band && f.x > 64.0f * cone && f.y < cone) sight.wide = cone / march.band;
            // While the cone is clear, as far as it stays so; else in steps that find the closest approach to within 3 %.
            float clear = (f.y - cone) / (1.0f + tan_radius);
            float close = tan_radius > 0.0f ? max(0.4f * f.y, min(f.y, 0.05f * cone)) : f.y;
            float step = max(max(clear, close), march.smallest_step);
            open = open && f.z <= step;
            t = t + max(step, f.z);
        }
    }
    float size = sqrt(across * across + along * along);
    if (size > 0.0f) sight.away = vec2(across / size, along / size);
    return sight;
}

// Visible fraction of the disc around l (unit, from p), whose radius is tan_radius of its distance; 0: a hard shadow.
KILN_FN float shadow_visible(vec3 p, vec3 l, float tan_radius, ShadowMarch march) {
    vec2 at = vec2(0.0f, 0.0f);       // the clear ray nearest to the silhouette
    vec2 stopped = vec2(0.0f, 0.0f);  // a ray that is stopped
    ShadowSight sight;
    sight.state = 0;
    sight.x = 1.0f;
    sight.away = vec2(0.0f, 0.0f);
    sight.open = 0.0f;
    sight.wide = 0.0f;
    bool closing_in = false;
    float from = march.t_first;
    // Look 0 is at the middle. 1 to 6 are at the rim: opposite ones in turn, so that a way out is found soonest; they miss at most
    // the last 3 % of the disc. From a clear middle they look a little inside, and every second one does while bands overlap.
    // 7 to 10 halve the way between a clear ray and a stopped one. 11 looks for another silhouette on the far side of the first.
    for (int look = 0; look < 12; look++) {
        vec2 to = vec2(0.0f, 0.0f);
        bool found = sight.state == 1 && sight.x < 1.0f;
        if (look > 0 && look < 7) {
            if (found || closing_in) continue;
            float side = (look & 1) == 1 ? 1.0f : -1.0f;
            if (sight.state == 1) {
                if (sight.wide < 2.0f && side < 0.0f) continue;
                side = sight.wide < 2.0f ? 0.65f : side * 0.8f;
            }
            // Three of every second: 120 degrees apart.
            float turn =
                float((look - 1) / 2) * (sight.state == 1 && sight.wide < 2.0f ? 2.0f * kPi / 3.0f : kPi / 3.0f);
            to = vec2(side * cos(turn), side * sin(turn));
        }
        if (look >= 7 && look < 11) {
            if (found || !closing_in) continue;
            to = vec2(0.5f * (at.x + stopped.x), 0.5f * (at.y + stopped.y));
        }
        if (look == 11) {
            if (!found && !closing_in) return sight.state == 1 ? 1.0f : 0.0f;
            if (!found) {
                // Nothing tells more than that the silhouette is between the two.
                vec2 across = vec2(at.x - stopped.x, at.y - stopped.y);
                float size = 1.0f / max(sqrt(across.x * across.x + across.y * across.y), 1e-6f);
                sight.away = vec2(across.x * size, across.y * size);
                sight.x = 0.0f;
                at = vec2(0.5f * (at.x + stopped.x), 0.5f * (at.y + stopped.y));
            }
            to = vec2(-sight.away.x, -sight.away.y);
        }
        ShadowSight seen = shadow_look(p, l, tan_radius, to, look == 0 && tan_radius > 0.0f, from, march);
        if (look == 11) {
            // The edge is at x - towards along `away`.
            float towards = at.x * sight.away.x + at.y * sight.away.y;
            float visible = disc_visible(sight.x - towards);
            if (seen.state == 1 && sight.away.x * seen.away.x + sight.away.y * seen.away.y < 0.0f) {
                visible = visible + disc_visible(seen.x - (to.x * seen.away.x + to.y * seen.away.y));
            }
            return min(visible, 1.0f);
        }
        if (look == 0) {
            sight = seen;
            from = sight.open;
            if (sight.state < 0) return 0.0f;
            if (tan_radius <= 0.0f || (sight.state == 1 && sight.x >= 1.0f && sight.wide <= 0.0f)) {
                return sight.state == 1 ? 1.0f : 0.0f;
            }
        } else if (seen.state == 1) {
            bool was_stopped = sight.state == 0;
            if (was_stopped || closing_in || seen.x < 1.0f) {
                sight = seen;
                at = to;
            }
            if (was_stopped && seen.x >= 1.0f) {
                // A rim ray that is all clear says no more than that, unless it saw too little.
                if (seen.wide <= 0.0f) return disc_visible(0.0f);
                closing_in = true;
            }
        } else if (sight.state == 1) {
            stopped = to;
            closing_in = true;
        }
    }
    return 0.0f;
}
