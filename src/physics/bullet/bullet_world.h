// SPDX-License-Identifier: MIT
// Bodies through Bullet 3.24, as Debian builds it: single precision, one thread.
#pragma once

#include "physics/physics.h"

namespace kiln::physics {

std::unique_ptr<World> make_bullet_world(const WorldSettings& settings);

}  // namespace kiln::physics
