// SPDX-License-Identifier: MIT
// Passes of lamp_faces.h's maps.
#pragma once

#include "render/lamp_faces.h"
#include "render/passes/cascades.h"

namespace kiln::render {

extern const Kernel kLampCull, kShadowLamps;
extern const RasterKernel kLampMap, kLampMapMask;

// `casters.clusters` has at least one, `faces` too.
LampHandles draw_lamps(Graph& g, const MeshHandles& meshes, std::span<const LampFace> faces, const CasterLists& casters,
                       int side);

// The fractions, less what meshes hide of the lights of in.lamps.
Image shadow_by_lamps(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                      const Image& fractions, const ShadowPush& push);

}  // namespace kiln::render
