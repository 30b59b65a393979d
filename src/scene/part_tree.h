// SPDX-License-Identifier: MIT
// Lists of edits as object trees: what a part that was cut loose is made of, and a body that was cut or built on.
#pragma once

#include "field/loose.h"

#include <kiln/edit.h>

#include <span>
#include <string>

namespace kiln::scene {

/// A region as a shape, and its box, in the frame that its lattice is of.
Node region_node(const field::RegionMask& mask);
Box3 box_of(const field::RegionMask& mask);

/// The edits one after another; hidden ones are left out. At least one of the rest must be a union.
Object object_of(std::string name, std::span<const Edit* const> edits);
/// intersect(the edits, the region) in a frame at `origin`.
Object object_of_part(std::string name, std::span<const Edit* const> edits, const field::RegionMask& region,
                      vec3 origin);

}  // namespace kiln::scene
