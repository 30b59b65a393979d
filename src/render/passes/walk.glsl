// SPDX-License-Identifier: MIT
// A ray cut into segments, each with one description of the field:
//   unpruned    the whole ray: the whole program
//   otherwise   outside the grid: the program of what leaves it;  inside, if asked for: one occupied cell after the other
// So that whoever follows the ray has one loop, with one call of whatever evaluates the field.
// The including kernel declares first: FrameParams frame, uint cells[], and has map.glsl.

const int kBeforeGrid = 0;
const int kInGrid = 1;
const int kAfterGrid = 2;
const int kWalkDone = 3;

#include "render/passes/grid_stretch.glsl"

struct Walk {
    float t;            // voxels along the ray; where the segment starts
    float segment_end;
    float t_end;        // of the whole walk
    float grid_in, grid_out;
    float outside_in, outside_out;  // where solids of the program of what leaves the grid may be met
    int stage;          // what advance() looks at next
    uint state;         // kSeen… of a hit in it; kSeenInside: the walk stops in solid at t
    int slot;           // of kSeenPruned
    ivec3 cell;         // the next to look at, counted from the grid's first
    ivec3 segment_cell; // of kSeenPruned
    bool has_cell;
};

Walk walk_begin(TexelRay ray, float t_begin, float t_end) {
    Walk w;
    w.t = t_begin;
    w.segment_end = t_begin;
    w.t_end = t_end;
    grid_stretch(ray, w.grid_in, w.grid_out);
    outside_stretch(ray, w.outside_in, w.outside_out);
    w.stage = (frame.flags & kFrameUnpruned) != 0u ? kAfterGrid : kBeforeGrid;
    w.state = kSeenNothing;
    w.slot = 0;
    w.cell = ivec3(0);
    w.segment_cell = ivec3(0);
    w.has_cell = false;
    return w;
}

// Is w.t outside the grid?
bool walk_outside(Walk w) { return w.t < w.grid_in || w.t >= w.grid_out || w.grid_in > w.grid_out; }

// Makes what of the way from w.t to `end`, outside the grid, may meet something the next segment. False: nothing is there.
bool walk_beyond(inout Walk w, float end) {
    float begin = max(w.t, w.outside_in);
    end = min(end, w.outside_out);
    if (frame.outside_count == 0u || begin >= end) return false;
    w.t = begin;
    w.segment_end = end;
    w.state = kSeenOutside;
    return true;
}

// The next segment, from w.t on. False: there is none, or the walk stands in solid (state kSeenInside).
bool walk_advance(TexelRay ray, inout Walk w, bool look_in_cells, bool jump) {
    bool unpruned = (frame.flags & kFrameUnpruned) != 0u;
    if (w.stage == kBeforeGrid) {
        bool meets = w.grid_in <= w.grid_out;
        w.stage = meets ? kInGrid : kWalkDone;
        if (walk_beyond(w, meets ? min(w.grid_in, w.t_end) : w.t_end)) return true;
    }
    if (w.stage == kInGrid) {
        w.t = max(w.t, w.grid_in);
        ivec3 up = ivec3(greaterThan(ray.direction, vec3(0.0)));
        ivec3 whole = ray.whole - grid_first_cell() * kBrickVoxels;
        ivec3 last = ivec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) - 1;
        if (look_in_cells && !w.has_cell) {
            vec3 at = vec3(whole) + (ray.part + ray.direction * w.t);
            w.cell = clamp(ivec3(floor(at / float(kBrickVoxels))), ivec3(0), last);
            w.has_cell = true;
        }
        while (look_in_cells && w.t < min(w.grid_out, w.t_end) && in_grid(w.cell)) {
            uint word = field_cell(w.cell);
            bool occupied = (word & kCellOccupied) != 0u;
            if (!occupied && (word & kCellInside) != 0u) {
                w.state = kSeenInside;
                return false;
            }
            int reach = occupied || !jump ? 0 : max(int(word & 7u) - 1, 0);
            ivec3 out_plane = (w.cell + up * (2 * reach + 1) - reach) * kBrickVoxels;
            vec3 out_t = (vec3(out_plane - whole) - ray.part) * ray.inverse;
            out_t = mix(out_t, vec3(kFarVoxels), equal(ray.inverse, vec3(0.0)));
            float leave = min(min(out_t.x, out_t.y), out_t.z);
            float t_leave = max(w.t, leave);
            vec3 at = vec3(whole) + (ray.part + ray.direction * t_leave);
            ivec3 guess = clamp(ivec3(floor(at / float(kBrickVoxels))), w.cell - reach, w.cell + reach);
            bvec3 leaves = bvec3(out_t.x == leave, out_t.y == leave && out_t.x != leave, out_t.y != leave && out_t.x != leave);
            w.segment_cell = w.cell;
            w.cell = mix(guess, out_plane / kBrickVoxels - 1 + up, leaves);
            if (occupied) {
                w.slot = int(word & kCellSlotMask);
                w.segment_end = min(t_leave, w.t_end);
                w.state = kSeenPruned;
                return true;
            }
            w.t = t_leave;
        }
        w.t = max(w.t, w.grid_out);
        w.stage = w.t < w.t_end ? kAfterGrid : kWalkDone;
    }
    if (w.stage == kAfterGrid) {
        w.stage = kWalkDone;
        if (!unpruned) {
            if (walk_beyond(w, w.t_end)) return true;
            w.state = kSeenNothing;
            return false;
        }
        w.segment_end = w.t_end;
        w.state = kSeenProgram;
        return frame.program_count != 0u;
    }
    w.state = kSeenNothing;
    return false;
}
