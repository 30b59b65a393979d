// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/view.spv.h"

namespace kiln::render {

const Kernel kView{"view", kViewSpv};

Shown view(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth) {
    Shown out;
    out.values = g.create("view values", {.size = in.size, .format = rhi::Format::Rgba32Float});
    out.bytes = g.create("view bytes", {.size = in.size, .format = rhi::Format::Rgba8Unorm});
    g.dispatch(kView, in.size,
               {g.uniform(in.frame), g.read(surface.seen), g.read(surface.words), g.read(depth), g.write(out.values),
                g.write(out.bytes)});
    return out;
}

}  // namespace kiln::render
