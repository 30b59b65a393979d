// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/depth.spv.h"
#include "shaders/resolve.spv.h"
#include "shaders/resolve_exact.spv.h"
#include "shaders/resolve_levels.spv.h"
#include "shaders/resolve_levels_exact.spv.h"
#include "shaders/settle.spv.h"

namespace kiln::render {

const Kernel kDepthOf{"depth", kDepthSpv};
const Kernel kSettle{"settle", kSettleSpv};
const Kernel kResolve{"resolve", kResolveSpv};
const Kernel kResolveExact{"resolve exact", kResolveExactSpv};
const Kernel kResolveLevels{"resolve levels", kResolveLevelsSpv};
const Kernel kResolveLevelsExact{"resolve levels exact", kResolveLevelsExactSpv};

const Kernel& resolve_kernel(const TileInputs& in) {
    if (!in.exact) return in.levels ? kResolveLevels : kResolve;
    return specialised(in.levels ? kResolveLevelsExact : kResolveExact, in.use);
}

Image settle(Graph& g, const TileInputs& in, const Image& visibility, const Image& refined) {
    Image out = g.create("visibility settled", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kSettle, in.size, {g.uniform(in.frame), g.read(visibility), g.read(refined), g.write(out)});
    return out;
}

Surface resolve(Graph& g, const TileInputs& in, const Image& seen, const Image& refined) {
    Surface out{g.create("surface", {.size = in.size, .format = rhi::Format::Rgba32Uint}), seen};
    const FieldHandles& f = in.field;
    std::vector<Use> uses{g.uniform(in.frame), g.read(f.cells),      g.read(f.records),   g.read(in.rays),
                          g.read(f.tables),    g.read(in.materials), g.read(f.distances), g.read(f.materials),
                          g.read(seen),        g.read(refined),      g.write(out.words)};
    if (in.exact) {
        uses.insert(uses.end(), {g.read(f.code), g.read(f.program), g.read(f.numbers)});
    }
    if (in.levels) uses.push_back(g.uniform(in.levels_block));
    g.dispatch(resolve_kernel(in), in.size, uses);
    return out;
}

Image depth_of(Graph& g, const TileInputs& in, const Image& seen) {
    Image out = g.create("depth", {.size = in.size, .format = rhi::Format::R32Float});
    depth_of(g, in, seen, out);
    return out;
}

void depth_of(Graph& g, const TileInputs& in, const Image& seen, Image& depth) {
    g.dispatch(kDepthOf, in.size, {g.uniform(in.frame), g.read(seen), g.write(depth)});
}

}  // namespace kiln::render
