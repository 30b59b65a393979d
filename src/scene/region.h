// SPDX-License-Identifier: MIT
// Regions: masks of lattice points, in which a part of the world was cut loose, as shapes of scenes. The mask is in the scene itself, in the
// place of a mesh's file, so that a journal needs no file beside it that a kill could take away:
//   {"shape": "mesh", "file": "region:VOXEL_SIZE:X,Y,Z:COLUMNS,ROWS,LAYERS:MASK"}
// X, Y, Z is its first lattice point (times the voxel size: metres); MASK the lengths of runs of points, x fastest, outside and inside by
// turns, outside first: seven bits a byte, lowest first, the top bit where more follow (LEB128), in base64 without padding.
#pragma once

#include "field/loose.h"
#include "sdf/program.h"

#include <string>
#include <string_view>

namespace kiln::scene {

inline constexpr std::string_view kRegion = "region:";
inline bool is_region(std::string_view file) { return file.starts_with(kRegion); }

/// Whether a mask of that size makes a shape.
bool region_fits(field::ivec3 size);
std::string region_text(const field::RegionMask& mask);
Result<field::RegionMask> read_region(std::string_view text);
/// Its distance as the shape `mesh` reads it, in world metres.
sdf::MeshGrid region_grid(const field::RegionMask& mask);

}  // namespace kiln::scene
