// SPDX-License-Identifier: MIT
// What resists rolling and spinning: soft ground and soft bodies close behind what rolls slower than they gave way before it, so the
// ground's push comes from a little ahead of the middle (Tabor, "The mechanism of rolling friction", 1952). Neither engine has it, so it
// is the same code for both: before a step the velocities that a body begins it with are changed by what the moment of that push does.
#pragma once

#include "physics/pose.h"
#include "physics/sdf_shape.h"

namespace kiln::physics {

/// What a body lies on, in the world.
struct Support {
    vec3 point{}, normal{};      ///< mean of where it touches; unit, out of what it lies on
    vec3 velocity{}, spin{};     ///< of what it lies on, there
    float rolling_friction = 0;  ///< the largest of its contacts
    float impulse = 0;           ///< N s that held it up in the last step, along the normal
};

struct Velocities {
    vec3 linear{}, angular{};  ///< of the centre of mass
};

/// The moment is at most rolling_friction · arm · load, the arm from the centre of mass to where it touches: a ball stays where the slope's
/// tangent is no more than that, and elsewhere loses 5/7 of rolling_friction · g · cos(slope). It stops and never drives: what a body would
/// have after gravity has acted for `seconds` is shortened, to nothing at most. `pose` is of the mass.
Velocities resist_rolling(const MassProperties& mass, const Pose& pose, const Velocities& now, const Support& support,
                          vec3 gravity, float seconds);

}  // namespace kiln::physics
