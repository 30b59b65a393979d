// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/march.spv.h"
#include "shaders/march_exact.spv.h"
#include "shaders/march_instances.spv.h"
#include "shaders/march_levels.spv.h"
#include "shaders/march_levels_instances.spv.h"

namespace kiln::render {

const Kernel kMarch{"march", kMarchSpv};
const Kernel kMarchLevels{"march levels", kMarchLevelsSpv};
const Kernel kMarchInstances{"march instances", kMarchInstancesSpv};
const Kernel kMarchLevelsInstances{"march levels instances", kMarchLevelsInstancesSpv};
const Kernel kMarchExact{"march exact", kMarchExactSpv};

const Kernel& march_kernel(const TileInputs& in) {
    if (in.levels) return in.has_instances ? kMarchLevelsInstances : kMarchLevels;
    return in.has_instances ? kMarchInstances : kMarch;
}

Visibility march(Graph& g, const TileInputs& in, const Image* mesh_depth) {
    Visibility out;
    const uint32_t groups =
        ((in.size.width + kTileGroup - 1) / kTileGroup) * ((in.size.height + kTileGroup - 1) / kTileGroup);
    const FieldHandles& f = in.field;
    Image words = g.create("visibility", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    Image ends;
    if (mesh_depth != nullptr) {
        ends = *mesh_depth;
    } else {
        ends = g.create("no mesh depth", {.size = {1, 1}, .format = rhi::Format::R32Float});
        g.clear(ends);
    }
    if (in.analytic) {
        g.clear(words);
    } else if (in.rt) {
        out.evaluations.push_back(march_boxes(g, in, ends, words));
    } else {
        Buffer counted = g.create_buffer("march evaluations", uint64_t{groups} * 4);
        std::vector<Use> uses{g.uniform(in.frame), g.read(f.cells),  g.read(in.rays),  g.read(f.distances),
                              g.write(words),      g.read(f.tables), g.write(counted), g.read(ends)};
        if (in.levels) uses.push_back(g.uniform(in.levels_block));
        if (in.has_instances) {
            const InstanceHandles& i = in.instances;
            uses.insert(uses.end(), {g.read(i.ways), g.read(i.nodes), g.read(i.cells)});
            g.dispatch(march_kernel(in), in.size, uses,
                       InstancePush{.node_count = i.node_count, .first_light = 0, .by_tree = i.by_tree, .pad_0 = 0});
        } else {
            g.dispatch(march_kernel(in), in.size, uses);
        }
        out.evaluations.push_back(counted);
    }
    if (in.exact) {
        Image both = g.create("visibility exact", {.size = in.size, .format = rhi::Format::Rgba32Uint});
        Buffer counted = g.create_buffer("march exact evaluations", uint64_t{groups} * 4);
        g.dispatch(specialised(kMarchExact, in.use), in.size,
                   {g.uniform(in.frame), g.read(f.cells), g.read(f.records), g.read(f.code), g.read(f.program),
                    g.read(f.numbers), g.read(in.rays), g.read(words), g.write(both), g.write(counted)});
        out.evaluations.push_back(counted);
        words = both;
    }
    out.words = words;
    return out;
}

}  // namespace kiln::render
