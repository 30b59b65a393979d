// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/tonemap.spv.h"

namespace kiln::render {

const Kernel kTonemap{"tonemap", kTonemapSpv};

Image tonemap(Graph& g, const TileInputs& in, const Image& radiance) {
    Image shown = g.create("shown", {.size = in.size, .format = rhi::Format::Rgba8Unorm});
    g.dispatch(kTonemap, in.size, {g.uniform(in.frame), g.read(radiance), g.write(shown)});
    return shown;
}

}  // namespace kiln::render
