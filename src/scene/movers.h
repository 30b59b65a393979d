// SPDX-License-Identifier: MIT
// Movers: what of a world moves as a whole, a body or a dynamic edit, and what light goes through. While one is solid by itself (its edits blend with nothing and nothing
// later changes it) it stands apart: its edits leave the world's list, pictures show it as an instance, and questions see it as a hard union.
// Else, and that no body can be, its row stays in the list, at its pose.
#pragma once

#include "field/brick_set.h"
#include "sdf/program.h"

#include <kiln/edit.h>

#include <memory>
#include <vector>

namespace kiln::scene {

struct Mover {
    static constexpr uint32_t kNoBody = UINT32_MAX;
    uint32_t body = kNoBody;      ///< of SceneData::bodies; else it is an edit
    std::vector<uint32_t> slots;  ///< of its edits, in order; its frame is the first's
    Pose pose, before;            ///< now, and as the last frame saw it
    Pose row_pose;                ///< that a dynamic edit's row is compiled for
    bool apart = false;
    uint32_t material = 0;                          ///< number of what its parts without one are made of
    uint32_t glass = 0;                             ///< number of what light goes through it by; 0: solid
    std::shared_ptr<const sdf::Program> object;     ///< its edits in its frame
    std::shared_ptr<const field::BrickSet> bricks;  ///< made when it is first drawn …
    float bricks_for = 0;                           ///< … beside a field of this voxel size
    uint32_t drawn_as = 0;                          ///< number of its instance in the last frame
};

/// Rigid part of an edit's transform.
inline Pose frame_of(const Edit& edit) { return {edit.node.transform.position, edit.node.transform.rotation}; }
/// Edits in the frame of the first, which counts as a union.
std::vector<Edit> in_frame_of_first(std::vector<Edit> edits);
/// An edit that neither blends nor paints nor cuts.
bool is_hard_union(const sdf::EditSpan& span);
/// Holds the solid of a bounded object that a pose puts into the world.
Box3 posed_box(const sdf::Program& object, const Pose& pose);

}  // namespace kiln::scene
