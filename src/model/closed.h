// SPDX-License-Identifier: MIT
// Whether triangles bound a solid, as they are listed.
#pragma once

#include <kiln/math.h>

#include <cstdint>
#include <span>

namespace kiln::model {

// True where corners at one place are one corner and every edge then runs once each way: the surface has no rim and one outside. A ray from
// outside meets, before any other of its triangles, one that is turned to where the ray starts. Triangles with two corners at one place
// do not count. None at all: false.
bool is_closed(std::span<const vec3> positions, std::span<const uint32_t> corners);

}  // namespace kiln::model
