// SPDX-License-Identifier: MIT
// Place: a whole program joins another as one edit of it, where a pose puts it: a hard union with all that comes before. So what moves by
// itself (a body, an instance) is asked, traced and meshed by whatever asks a world.
#pragma once

#include "sdf/program.h"

#include <span>

namespace kiln::sdf {

/// Holds the solid of a program without unbounded edits: where its edits blend, it bulges beyond them.
Box3 solid_box(const Program& object);

/// A copy with arrays of its own, but for samples: what is appended to it costs the original nothing, and any thread may append.
Program detached(const Program& program);

/// Appends `object` to `world`, put there by `pose`, with this place in the order; answers its row. The first edit of the object counts as
/// a union. What has material 0 takes `material`. Its edits keep their owners: rows that
/// are never visible carry them, behind the row itself, and its code names those.
/// Costs what the object's code and numbers cost. Fails when the object's sampled shapes are not among the world's samples.
Result<uint32_t> place(Program& world, const Program& object, const Pose& pose, uint32_t material, uint64_t order);

}  // namespace kiln::sdf
