// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/depth.spv.h"
#include "shaders/resolve.spv.h"
#include "shaders/resolve_exact.spv.h"
#include "shaders/resolve_levels.spv.h"
#include "shaders/resolve_levels_exact.spv.h"

namespace kiln::render {

const Kernel kDepthOf{"depth", kDepthSpv};
const Kernel kResolve{"resolve", kResolveSpv};
const Kernel kResolveExact{"resolve exact", kResolveExactSpv};
const Kernel kResolveLevels{"resolve levels", kResolveLevelsSpv};
const Kernel kResolveLevelsExact{"resolve levels exact", kResolveLevelsExactSpv};

const Kernel& resolve_kernel(const TileInputs& in) {
    if (!in.exact) return in.levels ? kResolveLevels : kResolve;
    return specialised(in.levels ? kResolveLevelsExact : kResolveExact, in.use);
}

Surface resolve(Graph& g, const TileInputs& in, const Image& visibility, const Image& refined) {
    Surface out;
    out.words = g.create("surface", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.seen = g.create("visibility resolved", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    const FieldHandles& f = in.field;
    std::vector<Use> uses{g.uniform(in.frame), g.read(f.cells),      g.read(f.records),   g.read(in.rays),
                          g.read(f.tables),    g.read(in.materials), g.read(f.distances), g.read(f.materials),
                          g.read(visibility),  g.read(refined),      g.write(out.words),  g.write(out.seen)};
    if (in.exact) {
        uses.insert(uses.end(), {g.read(f.code), g.read(f.program), g.read(f.numbers)});
    }
    if (in.levels) uses.push_back(g.uniform(in.levels_block));
    g.dispatch(resolve_kernel(in), in.size, uses);
    return out;
}

Image depth_of(Graph& g, const TileInputs& in, const Image& seen) {
    Image out = g.create("depth", {.size = in.size, .format = rhi::Format::R32Float});
    g.dispatch(kDepthOf, in.size, {g.uniform(in.frame), g.read(seen), g.write(out)});
    return out;
}

}  // namespace kiln::render
