// SPDX-License-Identifier: MIT
// Meshes of the surface that bricks hold. Both are closed manifolds wherever the bricks around the surface exist, and open at the
// border of a region; the bytes do not depend on the number of workers. Solid is value <= 0. Any thread, one Mesh each.
#pragma once

#include "field/mesh.h"

#include "sdf/eval.h"

#include <functional>

namespace kiln::field {

/// Vertices keep this far from the ends of their edge, or the faces of their voxel, in voxels: no two share a position, and no triangle is
/// degenerate, where a texel is exactly 0.
inline constexpr float kLeastFraction = 1.0f / 256;

/// Marching cubes: a vertex on each crossed lattice edge, where the stored values vanish linearly. A pure function of the edge's two
/// texels and its place, so two regions that share a face have the same vertices on it, bit for bit.
void mesh_smooth(const MeshBricks& bricks, Mesh& out, int workers = 0);

/// out[i] = the exact field at point i, metres, for points of a brick. Called from many threads.
using ExactBrick = std::function<void(size_t brick, const sdf::Points& points, float* out)>;
/// Of the bricks' own code. `bricks` must be of `host`, and both outlive it.
ExactBrick exact_of(const HostBricks& host, const MeshBricks& bricks);

/// Dual: a vertex in each voxel for each sheet of the surface there (Nielson, "Dual Marching Cubes", 2004), where the planes of the
/// surface at the voxel's crossed edges meet (Ju, Losasso, Schaefer and Warren, "Dual Contouring of Hermite Data", 2002), so
/// edges and corners of shapes stay sharp. A vertex never leaves its voxel, and lies within kSharpTolerance of the surface or on or near
/// one of the edge crossings. No two triangles cross (dual_quads.h).
void mesh_sharp(const MeshBricks& bricks, const ExactBrick& exact, Mesh& out, int workers = 0);
inline constexpr float kSharpTolerance = 0.05f;  // voxels

/// What the exact field says at the vertices.
struct MeshSurface {
    std::vector<vec3> normals;            ///< unit; 0 where the gradient vanishes; empty where not asked for
    std::vector<sdf::MaterialMix> mixes;  ///< kNoMaterial only where the whole world has none
};
MeshSurface surface_of(const HostBricks& host, const MeshBricks& bricks, const Mesh& mesh, bool normals,
                       int workers = 0);

}  // namespace kiln::field
