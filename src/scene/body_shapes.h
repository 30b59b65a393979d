// SPDX-License-Identifier: MIT
// What the bodies of a scene are made of: the world's list without their edits is the ground; a body's edits, brought to the frame of its
// first, are its own.
#pragma once

#include "field/sdf_field.h"
#include "physics/physics.h"
#include "scene/movers.h"
#include "scene/world_impl.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

namespace kiln::scene {

/// The exact convex shape of a body of one edit, where it has one.
std::optional<physics::Convex> convex_of(std::span<const Edit> edits);
/// By material number, the scene's own where a material says nothing; empty where there are no materials.
std::vector<physics::Surface> surfaces_of(const SceneData& data);
/// The world's list without the edits of bodies.
std::vector<Edit> ground_of(const World::Impl& world, const std::unordered_set<std::string>& owned);
Result<std::shared_ptr<const field::ProgramField>> field_of(World::Impl& world, std::span<const Edit> edits);
/// Where the solids of two lists may differ: around the edits between what the lists begin and end with.
Result<Box3> changed_box(World::Impl& world, std::span<const Edit> before, std::span<const Edit> after);

}  // namespace kiln::scene
