// SPDX-License-Identifier: MIT
// Instances as kernels see them: where each is, which bricks it shows, and the tree that finds them. Lengths are in the frame's finest
// voxels and count from the eye, so that floats suffice wherever the camera is.

#ifdef __cplusplus
#pragma once
#endif
#include "field/brick.gpu.h"
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using field::GridParams;
using uint = uint32_t;
#endif

// Bricks of one object (88 bytes). Cell words and records count slots from the set's own first.
struct InstanceSet {
    GridParams grid;  // in voxels of the object; atlas_bricks_x_y is not used
    uint slot_first;  // in the atlas
    uint cells_first, records_first, code_first, params_first, samples_first;  // in the buffers of all sets
    float low_x, low_y, low_z, high_x, high_y, high_z;  // voxels from the object's origin: rays meet it nowhere else
    uint pad_0, pad_1;
};

// One instance (128 bytes). A point p from the eye is at eye + part + voxels * (rotation p) in its object's voxels.
struct InstanceRecord {
    vec4 x, y, z;  // rows of the rotation into the object; w: part of the voxel that the eye is in, [0, 1)
    vec4 before_x, before_y,
        before_z;             // rows of what takes a point from the eye to where it was one frame before, from this eye
    int eye_x, eye_y, eye_z;  // voxel of the object that the eye is in
    uint set;
    float voxels;   // of the object a finest voxel
    uint material;  // where the set says 0
    uint pad_0, pad_1;
};

// What a ray that comes to an instance asks of it and of its set (128 bytes).
struct InstanceWay {
    vec4 x, y, z;  // as of the record
    int eye_x, eye_y, eye_z;
    float voxels;
    GridParams grid;  // as of the set
    uint slot_first, cells_first;
    float low_x, low_y, low_z, high_x, high_y, high_z;
};

// A node of the tree (32 bytes), in the order of a walk that looks at the nearer child first: the next is the node that follows, or,
// where the box is missed, the one at `skip`.
struct InstanceNode {
    float low_x, low_y, low_z;
    uint skip;  // the first node behind this one and all below it
    float high_x, high_y, high_z;
    uint instance;  // of a leaf; kNoInstance: it has children
};
KILN_CONST uint kNoInstance = 0xffffffffu;
// Rays load nodes and ways from storage images, two texels a node and eight a way, so many a row: a software device loads a texel at once, a buffer word by
// word, and a texel of a texture only after working out the mip of each ray.
KILN_CONST uint kNodesARow = 1024u;
KILN_CONST uint kWaysARow = 256u;

struct InstancePush {
    uint node_count;
    uint first_light;  // of the shadow pass
    uint by_tree;      // of the march: 1: no lists, each ray walks the tree
    uint pad_0;
};
// Of what a workgroup of the march counted: its rays walked the tree.
KILN_CONST uint kWalkedTree = 0x80000000u;

// Of z of the visibility word.
KILN_CONST uint kInstanceSlotShift = 9u;

#ifdef __cplusplus
static_assert(sizeof(InstanceSet) == 88 && sizeof(InstanceRecord) == 128 && sizeof(InstanceNode) == 32 &&
              sizeof(InstanceWay) == 128 && sizeof(InstancePush) == 16);
}  // namespace kiln::render
#endif
