// SPDX-License-Identifier: MIT
// A primary ray among instances: along the list of its workgroup or down the tree, into each object's own voxels, and through its bricks by the march
// of the world's. The including kernel declares first what instances.glsl asks for with KILN_INSTANCE_WALK, and InstancePush push.

// The bricks of sets, under names of their own beside the world's.
#define field_cell set_cell
#define field_corners set_corners
#define field_voxel_solid set_voxel_solid
#define field_enter set_enter
#define voxel_exit_plane set_voxel_exit_plane
#define brick_walk set_brick_walk
#define brick_walk_seek set_brick_walk_seek
#define brick_walk_solve set_brick_walk_solve
#define is_brick set_is_brick
#define march_brick set_march_brick
#define texel_plane_crossing set_texel_plane_crossing
#define cell_at set_cell_at
#define march_start set_march_start
#define march_miss set_march_miss
#define march_cell set_march_cell
#define field_march set_march
#define KILN_INSTANCE_WALK
#include "render/passes/instances.glsl"
#undef field_cell
#undef field_corners
#undef field_voxel_solid
#undef field_enter
#undef voxel_exit_plane
#undef brick_walk
#undef brick_walk_seek
#undef brick_walk_solve
#undef is_brick
#undef march_brick
#undef texel_plane_crossing
#undef cell_at
#undef march_start
#undef march_miss
#undef march_cell
#undef field_march

#include "render/passes/instance_list.glsl"

struct SetHit {
    float t;        // finest voxels; kFarVoxels: none
    uint instance;  // kNoInstance: none
    MarchHit hit;   // in the object's voxels
    int cells, voxels;
};

MarchHit no_hit() { return MarchHit(kMarchMiss, kFarVoxels, -1, ivec3(0), ivec3(0), vec3(0.0), 0, 0); }

// Where a ray enters the first box of a leaf, kFarVoxels where it meets none. `looks` counts boxes.
float first_box_of(vec3 from, vec3 inverse, inout int looks) {
    float first = kFarVoxels;
    float enters = kFarVoxels;
    uint at = 0u;
    while (next_leaf(at, from, inverse, first, enters, looks) != kNoInstance) first = enters;
    return first;
}

// The nearest hit of all up to t_last; of equals the lower number.
SetHit march_sets(TexelRay ray, vec3 from, vec3 inverse, float t_last, bool accelerate) {
    SetHit nearest = SetHit(t_last, kNoInstance, no_hit(), 0, 0);
    uint at = 0u;
    float enters = 0.0;
    while (true) {
        // To the next object in whose turned box the ray comes first, so that rays that are in step march together (Aila and Laine, "Understanding the
        // Efficiency of Ray Traversal on GPUs", 2009).
        uint found = kNoInstance;
        InstanceRecord instance;
        TexelRay local;
        float t_begin = 0.0;
        float t_end = 0.0;
        bool meets = false;
        do {
            found = next_leaf(at, from, inverse, nearest.t, enters, nearest.cells);
            if (found != kNoInstance) {
                instance = instance_at(found);
                local = object_ray(instance, from, ray.direction);
                // Beyond the nearest by more than a voxel is long: no voxel with a nearer hit is cut short, so each hit has its bits whatever was
                // found before, and of equals the lower number is found.
                t_begin = 0.0;
                t_end = nearest.t < kFarVoxels ? nearest.t * instance.voxels * 1.000001 + 2.0 : kFarVoxels;
                set_span(local, 0.0, t_begin, t_end);
                meets = t_begin <= t_end;
            }
        } while (found != kNoInstance && !meets);
        if (!meets) break;
        MarchHit hit = set_march(here.grid, local, t_begin, t_end, accelerate);
        nearest.cells += hit.cells;
        nearest.voxels += hit.voxels;
        if (hit.state == kMarchMiss) continue;
        float t = hit.t / instance.voxels;
        if (t < nearest.t || (t == nearest.t && found < nearest.instance)) {
            nearest.t = t;
            nearest.instance = found;
            nearest.hit = hit;
        }
    }
    return nearest;
}
