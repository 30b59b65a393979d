// SPDX-License-Identifier: MIT
// From fewer rays (TileInputs::size) to the pixels that are shown (shown_size).
#pragma once

#include "render/passes/passes.h"

namespace kiln::render {

extern const Kernel kTaaUp, kUpDepth, kUpOwners;

// As taa(), made larger; see taa_up.comp.
Image taa_up(Graph& g, const TileInputs& in, const Image& radiance, const Image& depth, const Image& motion);
Image upscale_depth(Graph& g, const TileInputs& in, const Image& depth);
OutlineMask upscale_mask(Graph& g, const TileInputs& in, const OutlineMask& mask);

}  // namespace kiln::render
