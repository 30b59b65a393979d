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

/// Of contacts found on triangles, up to a dozen that say where the body rests, each at the deepest point near it: where it rests is said by
/// triangles, how deep and which way by the field. Facets would have a ball roll by steps, and a box on its edges tremble.
void settle_on_triangles(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                         std::vector<FieldContact>& contacts);

/// Whether a contact on a mesh is its own, not one on its apron.
bool is_own(const RegionMesh& mesh, vec3 p);

}  // namespace kiln::physics
