// SPDX-License-Identifier: MIT
// Bricks of instances in kernels: their field for field/march.gpu.h and field/surface.gpu.h, and the walk of a ray through the tree. The including
// kernel declares first what atlas.glsl and rays.glsl ask for, and
//   uint instance_cells[];
//   for the walk: readonly uimage2D instance_nodes, instance_ways (KILN_INSTANCE_TEXTURES: utexture2D), InstancePush push; else: InstanceRecord instances[], InstanceSet sets[];
//   for KILN_FIELD_SURFACE also utexture3D materials.

#include "field/brick_walk.gpu.h"
#include "field/codes.gpu.h"
#include "field/cubic.gpu.h"
#include "render/passes/atlas.glsl"

#include "render/passes/instance_rays.glsl"

// Slots count from the set's first in the map, in field_… from the atlas' first.
uint cell_of_set(ivec3 c) {
    return instance_cells[int(here.cells_first) + cell_word_index(c.x, c.y, c.z, (here.grid.size_x + kCellPage - 1) >> 3, (here.grid.size_y + kCellPage - 1) >> 3)];
}
#ifdef KILN_FROM_INSIDE
bool inside_out = true;  // the object is the air, and the air solid
uint field_cell(ivec3 c) {
    uint word = cell_of_set(c);
    return inside_out && (word & kCellOccupied) == 0u ? word ^ kCellInside : word;
}
Corners field_corners(int slot, ivec3 voxel) {
    Corners c = brick_corners(slot + int(here.slot_first), voxel);
    return inside_out ? Corners(-c.v000, -c.v100, -c.v010, -c.v110, -c.v001, -c.v101, -c.v011, -c.v111) : c;
}
bool field_voxel_solid(int slot, ivec3 voxel) { return inside_out || brick_voxel_solid(slot + int(here.slot_first), voxel); }
#else
uint field_cell(ivec3 c) { return cell_of_set(c); }
Corners field_corners(int slot, ivec3 voxel) { return brick_corners(slot + int(here.slot_first), voxel); }
bool field_voxel_solid(int slot, ivec3 voxel) { return brick_voxel_solid(slot + int(here.slot_first), voxel); }
#endif
void field_enter(uint word, ivec3 texel) {}
#include "field/march.gpu.h"

bool in_set(ivec3 c) { return all(greaterThanEqual(c, ivec3(0))) && all(lessThan(c, ivec3(here.grid.size_x, here.grid.size_y, here.grid.size_z))); }
ivec3 set_first_cell() { return ivec3(here.grid.cell_x, here.grid.cell_y, here.grid.cell_z); }

#ifdef KILN_FIELD_SURFACE
int field_slot(ivec3 cell) {
    ivec3 c = cell - set_first_cell();
    if (!in_set(c)) return -1;
    uint word = field_cell(c);
    return (word & kCellOccupied) != 0u ? int(word & kCellSlotMask) : -1;
}
#ifdef KILN_FROM_INSIDE
float field_texel(int slot, ivec3 texel) {
    float d = brick_texel(slot + int(here.slot_first), texel);
    return inside_out ? -d : d;
}
#else
float field_texel(int slot, ivec3 texel) { return brick_texel(slot + int(here.slot_first), texel); }
#endif
uint field_material(int slot, ivec3 texel) { return brick_material(slot + int(here.slot_first), texel); }
#include "field/surface.gpu.h"
#endif

#ifdef KILN_INSTANCE_WALK
// Storage images, where a kernel has room for two more among the four that every device has: software loads their texels at a third of the work.
#ifdef KILN_INSTANCE_TEXTURES
#define KILN_INSTANCE_TEXEL(image, at) texelFetch(image, at, 0)
#else
#define KILN_INSTANCE_TEXEL(image, at) imageLoad(image, at)
#endif
// The instance as far as its InstanceWay tells; its set, likewise, becomes the one at hand.
InstanceRecord instance_at(uint i) {
    ivec2 at = ivec2(8 * int(i % kWaysARow), int(i / kWaysARow));
    uvec4 eye = KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(3, 0));
    uvec4 first = KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(4, 0));
    uvec4 size = KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(5, 0));
    uvec4 low = KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(6, 0));
    uvec4 high = KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(7, 0));
    here.grid = GridParams(int(first.x), int(first.y), int(first.z), uintBitsToFloat(first.w), int(size.x), int(size.y), int(size.z), size.w);
    here.slot_first = low.x;
    here.cells_first = low.y;
    here.low_x = uintBitsToFloat(low.z);
    here.low_y = uintBitsToFloat(low.w);
    here.low_z = uintBitsToFloat(high.x);
    here.high_x = uintBitsToFloat(high.y);
    here.high_y = uintBitsToFloat(high.z);
    here.high_z = uintBitsToFloat(high.w);
    InstanceRecord instance;
    instance.x = uintBitsToFloat(KILN_INSTANCE_TEXEL(instance_ways, at));
    instance.y = uintBitsToFloat(KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(1, 0)));
    instance.z = uintBitsToFloat(KILN_INSTANCE_TEXEL(instance_ways, at + ivec2(2, 0)));
    instance.eye_x = int(eye.x);
    instance.eye_y = int(eye.y);
    instance.eye_z = int(eye.z);
    instance.voxels = uintBitsToFloat(eye.w);
    return instance;
}
float instance_voxels(uint i) { return uintBitsToFloat(KILN_INSTANCE_TEXEL(instance_ways, ivec2(8 * int(i % kWaysARow) + 3, int(i / kWaysARow))).w); }

InstanceNode node_at(uint i) {
    ivec2 at = ivec2(2 * int(i % kNodesARow), int(i / kNodesARow));
    uvec4 a = KILN_INSTANCE_TEXEL(instance_nodes, at);
    uvec4 b = KILN_INSTANCE_TEXEL(instance_nodes, at + ivec2(1, 0));
    return InstanceNode(uintBitsToFloat(a.x), uintBitsToFloat(a.y), uintBitsToFloat(a.z), a.w, uintBitsToFloat(b.x), uintBitsToFloat(b.y), uintBitsToFloat(b.z), b.w);
}

// 1 / direction for boxes: large where it is parallel.
vec3 walk_inverse(vec3 direction) {
    vec3 far = mix(vec3(-kFarVoxels), vec3(kFarVoxels), greaterThanEqual(direction, vec3(0.0)));
    return mix(1.0 / direction, far, lessThan(abs(direction), vec3(1e-20)));
}

// Where the ray enters the box, if that is before t_end; kFarVoxels where it is not.
float walk_enters(InstanceNode n, vec3 from, vec3 inverse, float t_end) {
    vec3 a = (vec3(n.low_x, n.low_y, n.low_z) - from) * inverse;
    vec3 b = (vec3(n.high_x, n.high_y, n.high_z) - from) * inverse;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    float t_in = max(max(low.x, low.y), max(low.z, 0.0));
    float t_out = min(min(high.x, high.y), min(high.z, t_end));
    return t_in <= t_out ? t_in : kFarVoxels;
}

// Cuts the range of t to where the ray, in the object's voxels, comes as near as `by` to what is solid of the set at hand; t_in > t_out where it
// never does.
void set_span(TexelRay ray, float by, inout float t_in, inout float t_out) {
    vec3 from = vec3(ray.whole) + ray.part;
    vec3 a = (vec3(here.low_x, here.low_y, here.low_z) - by - from) * ray.inverse;
    vec3 b = (vec3(here.high_x, here.high_y, here.high_z) + by - from) * ray.inverse;
    bvec3 parallel = equal(ray.inverse, vec3(0.0));
    vec3 low = mix(min(a, b), vec3(-kFarVoxels), parallel);
    vec3 high = mix(max(a, b), vec3(kFarVoxels), parallel);
    t_in = max(t_in, max(max(low.x, low.y), low.z) * (1.0 - 1e-5));
    t_out = min(t_out, min(min(high.x, high.y), high.z) * (1.0 + 1e-5));
}

bool walk_meets(InstanceNode n, vec3 from, vec3 inverse, float t_end) { return walk_enters(n, from, inverse, t_end) < kFarVoxels; }

// Where the ray, or the cone around it, enters the node's box, if that is up to t_end; kFarVoxels where it does not.
float node_enters(InstanceNode node, vec3 from, vec3 direction, vec3 inverse, float tan_radius, float t_end) {
    if (tan_radius > 0.0) {
        vec3 low = vec3(node.low_x, node.low_y, node.low_z);
        vec3 high = vec3(node.high_x, node.high_y, node.high_z);
        float farthest = dot(0.5 * (low + high) - from, direction) + 0.5 * length(high - low);
        float by = max(farthest, 0.0) * tan_radius;
        node.low_x -= by;
        node.low_y -= by;
        node.low_z -= by;
        node.high_x += by;
        node.high_y += by;
        node.high_z += by;
    }
    return walk_enters(node, from, inverse, t_end);
}

// The next leaf of the tree whose box the ray (the cone) enters up to t_end, and where; kNoInstance: none is left. `at` counts nodes.
uint next_in_tree(inout uint at, vec3 from, vec3 direction, vec3 inverse, float tan_radius, float t_end, inout InstanceNode leaf, inout float enters,
                  inout int looks) {
    while (at < push.node_count) {
        leaf = node_at(at);
        looks++;
        enters = node_enters(leaf, from, direction, inverse, tan_radius, t_end);
        at = enters < kFarVoxels ? at + 1u : leaf.skip;
        if (enters < kFarVoxels && leaf.instance != kNoInstance) return leaf.instance;
    }
    return kNoInstance;
}
#endif
