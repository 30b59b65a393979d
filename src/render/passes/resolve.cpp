// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/resolve.spv.h"
#include "shaders/resolve_exact.spv.h"

namespace kiln::render {

const Kernel kResolve{"resolve", kResolveSpv};
const Kernel kResolveExact{"resolve exact", kResolveExactSpv};

Surface resolve(Graph& g, const TileInputs& in, const Image& visibility, const Image& refined) {
    Surface out;
    out.words = g.create("surface", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.depth = g.create("depth", {.size = in.size, .format = rhi::Format::R32Float});
    out.seen = g.create("visibility resolved", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    const FieldHandles& f = in.field;
    std::vector<Use> uses{g.uniform(in.frame), g.read(f.cells),      g.read(f.records),   g.read(in.rays),
                          g.read(f.tables),    g.read(in.materials), g.read(f.distances), g.read(f.materials),
                          g.read(visibility),  g.read(refined),      g.write(out.words),  g.write(out.depth),
                          g.write(out.seen)};
    if (in.exact) {
        uses.insert(uses.end(), {g.read(f.code), g.read(f.program), g.read(f.numbers)});
    }
    g.dispatch(in.exact ? specialised(kResolveExact, in.use) : kResolve, in.size, uses);
    return out;
}

}  // namespace kiln::render
