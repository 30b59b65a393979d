// SPDX-License-Identifier: MIT
// Lights as solids that are rasterised over the G-buffer, their light added by blending: what deferred renderers began with, kept beside the lists by
// tile, which it equals to the rounding of half floats.
#pragma once

#include "render/passes/passes.h"

namespace kiln::render {

// As kLight and its kin, laid over what volumes added.
const Kernel& light_over_kernel(const TileInputs& in);
const RasterKernel& light_volume_kernel(const TileInputs& in);

// Adds the lights in.volumes of this batch to `sum`, which the first batch begins.
void add_volumes(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                 const Image& fractions, const Buffer& masks, std::span<const Image> tints, const ShadowPush& push,
                 Image& sum);

}  // namespace kiln::render
