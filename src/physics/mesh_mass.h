// SPDX-License-Identifier: MIT
// Mass, centre and moments of the solid that a closed mesh bounds.
#pragma once

#include "physics/physics.h"

namespace kiln::physics {

/// For a density of 1 kg/m³. Refused, with what to mend: a mesh that is open or folds, whose triangles have no area or face inwards.
Result<MassProperties> mass_of_mesh(const Triangles& mesh);

}  // namespace kiln::physics
