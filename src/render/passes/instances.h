// SPDX-License-Identifier: MIT
// Passes of a frame that draw its instances beside the field, once march() has found them. Each does nothing where there are none.
#pragma once

#include "render/passes/passes.h"

namespace kiln::render {

extern const Kernel kRefineInstances, kResolveInstances, kShadowInstances;

// Fills refine()'s words in where they are seen.
void refine_instances(Graph& g, const TileInputs& in, const Image& visibility, Image& refined);
// And resolve()'s surface.
void resolve_instances(Graph& g, const TileInputs& in, const Image& refined, Surface& surface);
// Multiplies what they hide into shadow()'s fractions.
void shadow_instances(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                      const Buffer& light_masks, uint32_t first_light, Image& fractions);
// For warm-up.
void instance_kernels(const TileInputs& in, bool shaded, std::vector<const Kernel*>& out);

// refine_instances(), on the host: words of points on instances into `refined`, what refine_on_host() answered.
void refine_instances_on_host(const GpuInstances& instances, const FrameParams& frame,
                              std::span<const uint32_t> visibility, std::span<uint32_t> refined);

}  // namespace kiln::render
