// SPDX-License-Identifier: MIT
// What a scene gets where it says nothing: a camera that sees all of it, a sun and a sky.
#pragma once

#include <kiln/renderer.h>

namespace kiln::scene {

/// A three-quarter view of the box that fits pictures at least as wide as high. Any box; the default camera for an empty one.
Camera framing_camera(const Box3& box);
Light default_sun();

}  // namespace kiln::scene
