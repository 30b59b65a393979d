// SPDX-License-Identifier: MIT
// Frames of bodies.
#pragma once

#include <kiln/math.h>

namespace kiln::physics {

using kiln::Pose;

}  // namespace kiln::physics
