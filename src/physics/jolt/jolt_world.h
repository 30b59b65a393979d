// SPDX-License-Identifier: MIT
// Bodies through Jolt Physics, where cmake finds it: a library of its own, so that the instruction sets Jolt is compiled for stay there.
#pragma once

#include "physics/physics.h"

namespace kiln::physics {

/// Why Jolt cannot run here; empty when it can. Touches none of Jolt's code before it knows that the processor has what it needs.
std::string_view jolt_fault();
std::unique_ptr<World> make_jolt_world(const WorldSettings& settings);

}  // namespace kiln::physics
