// SPDX-License-Identifier: MIT
// Where a convex body meets ground of which some regions are meshed: who tells what. Both backends ask here.
#pragma once

#include "physics/convex.h"
#include "physics/pose.h"
#include "physics/region_mesh.h"
#include "physics/sdf_collision.h"

#include <vector>

namespace kiln::physics {

/// Of a convex body, in the frame of `pose`.
Box3 box_of(const Convex& body, const Pose& pose);

/// What the field tells: contacts in regions that are not meshed, and all of a body whose middle is in the solid, since triangles do not
/// know how deep it is. Whether triangles are to be asked too.
bool collide_ground(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                    std::vector<FieldContact>& out);

/// The four that hold a body as all of them do: the same ones while nothing moves, since what rests on others in each step trembles.
void keep_four(std::vector<FieldContact>& contacts);

/// Of contacts found on triangles, those that say where the body rests. Where it rests is said by triangles, how deep and which way by the
/// field: facets would have a ball roll by steps.
void settle_on_triangles(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                         std::vector<FieldContact>& contacts);

/// Whether a contact on a mesh is its own, not one on its apron.
bool is_own(const RegionMesh& mesh, vec3 p);

}  // namespace kiln::physics
