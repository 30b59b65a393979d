// SPDX-License-Identifier: MIT
// What the kernels that choose clusters of triangles share; see mesh_cull.cpp.

#ifdef __cplusplus
#pragma once
#endif
#include "render/passes/mesh.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
#endif

KILN_CONST int kMeshCullGroup = 64;
KILN_CONST uint kMeshPackGroup = 256u;

// Of a cluster's triangles, in their part's own frame.
struct MeshBox {
    float min_x, min_y, min_z;
    float max_x, max_y, max_z;
};

// Clusters of the three kinds lie one kind after the other, as MeshHandles has them.
struct MeshCullPush {
    uint one_sided, double_sided, masked;  // clusters
    uint late;  // 0: those seen in the picture before; 1: the others that this picture's depth does not hide
};

// Words of the buffer that draws take their numbers from: four a kind, then the triangles of all.
KILN_CONST uint kMeshDrawWords = 4u;
KILN_CONST uint kMeshDrawnTriangles = 12u;
KILN_CONST uint kMeshDrawnWords = 16u;

#ifdef __cplusplus
static_assert(sizeof(MeshBox) == 24 && sizeof(MeshCullPush) == 16);
}  // namespace kiln::render
#endif
