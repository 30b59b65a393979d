// SPDX-License-Identifier: MIT
// Meshes done the slow way, to hold the fast ones against.
#pragma once

#include "field/host_bricks.h"
#include "field/meshing.h"

#include <cstdint>
#include <span>

namespace kiln::measure {

/// Of the corners' places of each triangle, in any order of triangles, and of the number of vertices.
uint64_t checksum_of_triangles(const field::Mesh& mesh);
/// The same of marching cubes voxel by voxel, each corner anew from its two texels, edges told apart by sorting them.
uint64_t smooth_mesh_by_voxel(const field::HostBricks& bricks);

/// Which lattice edges the corners of each triangle lie on, wherever on them; triangles in any order. `voxel`: metres.
uint64_t checksum_of_edges(std::span<const vec3> vertices, std::span<const uint32_t> indices, float voxel);
/// The same, voxel by voxel, of bricks whose middle lies in the box.
uint64_t edges_by_voxel(const field::HostBricks& bricks, const Box3& within);

/// Of every byte of a mesh.
uint64_t checksum_of_bytes(const field::Mesh& mesh);
/// What the sharp mesher asks, answered by every edit of the program in every `stride`-th brick; in the others by what the brick keeps.
field::ExactBrick every_edit(const field::HostBricks& host, const field::MeshBricks& bricks, uint64_t stride);

}  // namespace kiln::measure
