// SPDX-License-Identifier: MIT
// The camera of a scene without one: it sees all of it.
#pragma once

#include <kiln/renderer.h>

namespace kiln::scene {

/// A three-quarter view of the box that fits pictures at least as wide as high. Any box; the default camera for an empty one.
Camera framing_camera(const Box3& box);

}  // namespace kiln::scene
