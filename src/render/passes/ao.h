// SPDX-License-Identifier: MIT
// Ambient occlusion: the share of the hemisphere over each visible point that is open to light from all around.
#pragma once

#include "render/passes/passes.h"

namespace kiln::render {

// Puts it into surface.words, where it is less than what is there. Answers what marching counted.
Buffer occlude(Graph& g, const TileInputs& in, Surface& surface);
// For warm-up.
void ao_kernels(const TileInputs& in, std::vector<const Kernel*>& out);

}  // namespace kiln::render
