// SPDX-License-Identifier: MIT
// Passes of shadow_cascades.h's maps.
#pragma once

#include "render/passes/passes.h"
#include "render/shadow_cascades.h"

namespace kiln::render {

extern const Kernel kCascadeCull, kShadowCascades;
extern const RasterKernel kCascade, kCascadeMask;

// Casters as the device takes them.
struct CasterLists {
    std::vector<CascadePart> parts;
    std::vector<MeshClusterRef> clusters;  // those without holes first
    uint32_t solid = 0;                    // … so many
};
CasterLists caster_lists(std::span<const MeshCaster> casters, const ShadowCascades& cascades);

// `casters.clusters` has at least one.
CascadeHandles draw_cascades(Graph& g, const MeshHandles& meshes, const ShadowCascades& cascades,
                             const CasterLists& casters, vec3 eye, uint32_t light);

// The fractions, less what meshes hide of the light of in.cascades.
Image shadow_by_cascades(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                         const Image& fractions, const ShadowPush& push);

}  // namespace kiln::render
