// SPDX-License-Identifier: MIT
#include "render/passes/cluster.gpu.h"
#include "render/passes/passes.h"

#include "shaders/cluster.spv.h"

namespace kiln::render {

const Kernel kCluster{"cluster", kClusterSpv};

Buffer cluster(Graph& g, const TileInputs& in, const Image& visibility) {
    const uint32_t side = uint32_t(kClusterSide);
    const Groups tiles{(in.size.width + side - 1) / side, (in.size.height + side - 1) / side, 1};
    const uint64_t words = std::max((in.light_count + 31u) / 32u, 1u);
    Buffer masks = g.create_buffer("light masks", uint64_t{tiles.x} * tiles.y * words * 4);
    if (!in.local_lights && words == 1) {
        g.clear(masks, in.light_count == 32 ? ~0u : (1u << in.light_count) - 1);
        return masks;
    }
    g.dispatch(kCluster, tiles,
               {g.uniform(in.frame), g.read(in.rays), g.read(in.lights), g.read(in.light_rects), g.read(visibility),
                g.write(masks)});
    return masks;
}

}  // namespace kiln::render
