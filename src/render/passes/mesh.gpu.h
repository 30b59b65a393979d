// SPDX-License-Identifier: MIT
// Triangle meshes as kernels read them. Places count from the eye: matrices are made in double precision with the eye as their origin, so
// that meshes are as exact far out as they are near the world's origin.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

// 44 bytes, in words.
struct MeshVertex {
    float x, y, z;            // metres, in the part's own frame
    uint normal;              // octahedral
    uint tangent;             // octahedral; lowest bit: the bitangent is -cross(normal, tangent)
    uint color_rg, color_ba;  // linear, 16 bits each
    float u0, v0, u1, v1;
};

// A primitive of a node of a mesh of the scene. Affine maps are three rows: component = dot(row.xyz, p) + row.w.
struct MeshPart {
    vec4 eye_x, eye_y, eye_z;           // eye from local
    vec4 before_x, before_y, before_z;  // the same in the frame before, but still from where the eye is now
    vec4 local_x, local_y, local_z;     // local from eye
    uint surface;
    uint first_triangle;  // of the triangles buffer
    uint first_vertex;    // what its corners count from
    uint first_node;      // of its tree of boxes
    uint node_count;
    uint flags;  // kMesh…
    uint triangle_count;
    uint outline;        // number of its mesh among the outlined ones, plus one; 0: it is not outlined
    uint first_cluster;  // number of its first cluster among all of the frame, the same while the same meshes are drawn
    uint first_box;      // of its clusters
    uint pad_0, pad_1;
};
KILN_CONST uint kMeshDoubleSided = 1u;
KILN_CONST uint kMeshMask = 2u;    // holes where alpha is less than the cutoff
KILN_CONST uint kMeshBlend = 16u;  // alpha is the share that it covers

KILN_CONST uint kMeshClosed = 4u;    // every edge is shared by two triangles that run along it opposite ways
KILN_CONST uint kMeshMirrored = 8u;  // its place in the world turns it inside out

// What is drawn at once: up to kMeshCluster triangles of a part, neighbours in space.
KILN_CONST uint kMeshCluster = 64u;
struct MeshClusterRef {
    uint part;
    uint first;  // triangle of the part
};

// A node of a tree of boxes, as model::BvhNode.
struct MeshNode {
    float min_x, min_y, min_z;
    uint skip;
    float max_x, max_y, max_z;
    uint leaf;
};

// How a surface looks at a texture: `where` is layer | page << 8 | kTexture….
struct MeshTexture {
    uint where;  // 0: no texture
    float m0, m1, m2, m3, m4, m5;
};
KILN_CONST uint kTexturePageShift = 8u;  // pages: kMeshPages of sRGB, then as many linear ones
KILN_CONST uint kMeshPages = 6u;
KILN_CONST uint kTextureSet1 = 1u << 12u;
KILN_CONST uint kTextureWrapU = 13u;  // two bits each, as model::Wrap
KILN_CONST uint kTextureWrapV = 15u;
KILN_CONST uint kTextureNearest = 1u << 17u;
KILN_CONST uint kTextureIs = 1u << 18u;

struct MeshSurface {
    float base_red, base_green, base_blue, alpha;
    float emissive_red, emissive_green, emissive_blue;
    float metallic, roughness;
    float normal_scale, occlusion_strength, alpha_cutoff;
    MeshTexture base, rough_metal, bumps, occlusion, glow;
    uint pad_0;
};

// Reversed depth of what is rasterised: near / distance. As near as this a mesh is not drawn.
KILN_CONST float kMeshNear = 1e-4f;

struct MeshDrawPush {
    uint first;  // of the cluster list
    uint count;
    uint
        drawn;  // 0: all of them; else a mesh shader finds how many in this word, less one, of the numbers that mesh_pack.comp wrote
    uint pad_0;
};

#ifdef __cplusplus
static_assert(sizeof(MeshVertex) == 44 && sizeof(MeshPart) == 192 && sizeof(MeshNode) == 32 &&
              sizeof(MeshSurface) == 192);
}  // namespace kiln::render
#endif
