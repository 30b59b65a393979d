// SPDX-License-Identifier: MIT
// First hit on exact programs, by proven steps: a field that is 1-Lipschitz lets a ray advance by its value.
// The including kernel declares first what walk.glsl and tape_buffers.glsl ask for, and BrickRecord records[].

#include "render/passes/code_of.glsl"
#include "render/passes/walk.glsl"

const int kOutsideSteps = 1024;             // rays along the horizon end as sky
const float kConcaveEnd = 1e12;             // voxels: where rays out of the grid end
const float kExactStepVoxels = 0.00390625;  // least step: thinner features may be missed

struct ExactHit {
    float t;     // voxels
    uint state;  // kSeen…
    int slot;    // of kSeenPruned
    int steps;   // evaluations of a program
};

// First hit between 0 and t_end. A hit is a bracketed change of sign, never a small distance alone.
ExactHit exact_march(TexelRay ray, float t_end, bool look_in_cells, bool jump) {
    float h = frame.grid.voxel_size;
    vec3 origin = (vec3(ray.whole) + ray.part) * h;
    ExactHit hit = ExactHit(t_end, kSeenNothing, 0, 0);
    Walk w = walk_begin(ray, 0.0, t_end);
    bool in_segment = false;
    bool fresh = true;       // no evaluation in this segment yet
    bool bracketed = false;
    float positive = 0.0;    // last place in air, and its value
    float positive_value = 1.0;
    float solid = 0.0;       // first place known to be solid, and its value
    float solid_value = -1.0;
    int outside_steps = 0;
    for (;;) {
        if (!in_segment) {
            if (!walk_advance(ray, w, look_in_cells, jump)) {
                if (w.state == kSeenInside) {
                    hit.t = w.t;
                    hit.state = kSeenInside;
                }
                return hit;
            }
            in_segment = true;
            fresh = true;
        }
        uvec2 segment_code = code_of(w.state, w.slot);
        float d = code_distance(segment_code, origin + ray.direction * (w.t * h)) / h;
        hit.steps++;
        bool concave = w.state == kSeenOutside && (frame.flags & kFrameOutsideConcave) != 0u;
        if (!bracketed && d <= 0.0) {
            if (fresh) {
                // Solid from the segment's start: the ray's own start, or a rounding of where one segment meets the next.
                hit.t = w.t;
                hit.state = w.t <= 0.0 ? kSeenInside : w.state;
                hit.slot = w.slot;
                return hit;
            }
            bracketed = true;
            positive_value = max(positive_value, 1e-30);
        } else if (bracketed) {
            // False position; the end that stays counts half (Dowell and Jarratt, "The Illinois Method", 1971).
            if (d > 0.0) solid_value *= 0.5; else positive_value *= 0.5;
        }
        if (bracketed) {
            if (d > 0.0) {
                positive = w.t;
                positive_value = d;
            } else {
                solid = w.t;
                solid_value = min(d, -1e-30);
            }
            if (solid - positive <= max(1e-5, solid * 2.4e-7) || (d <= 0.0 && d > -2e-6)) {
                hit.t = solid;
                hit.state = w.state;
                hit.slot = w.slot;
                return hit;
            }
            float share = positive_value / (positive_value - solid_value);
            if (!concave) share = clamp(share, 0.02, 0.98);
            // A little past the estimate, so that both ends close in.
            w.t = min(positive + (solid - positive) * share + 5e-6, mix(positive, solid, 0.999));
            continue;
        }
        fresh = false;
        positive = w.t;
        positive_value = d;
        if (w.t >= w.segment_end || d * h >= kTapeEmptyTest) {
            w.t = max(w.t, w.segment_end);
            in_segment = false;
            continue;
        }
        if (concave) {
            // Concave and positive at both ends is positive between them; else the root is bracketed.
            w.t = min(w.segment_end, kConcaveEnd);
            if (positive >= w.t) {
                w.t = w.segment_end;
                in_segment = false;
            }
            continue;
        }
        // Far from the grid nothing smaller than half a pixel is looked for.
        bool outside = walk_outside(w);
        float least = outside ? max(kExactStepVoxels, 0.5 * frame.pixel_angle * w.t) : max(kExactStepVoxels, 2.4e-7 * w.t);
        if (outside && ++outside_steps > kOutsideSteps) return hit;
        w.t = min(w.t + max(d, least), w.segment_end);
    }
}
