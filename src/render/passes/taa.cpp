// SPDX-License-Identifier: MIT
#include "render/passes/taa.gpu.h"
#include "render/passes/passes.h"

#include "shaders/motion.spv.h"
#include "shaders/taa.spv.h"

namespace kiln::render {

const Kernel kMotion{"motion", kMotionSpv};
const Kernel kTaa{"taa", kTaaSpv};

Image motion(Graph& g, const TileInputs& in, const Image& visibility) {
    Image out = g.create("motion", {.size = in.size, .format = rhi::Format::Rgba16Float});
    Image owners;
    if (in.moved.owners.count != 0) {
        owners = edit_owners(g, in, in.moved.owners, visibility).owners;
    } else {
        owners = g.create("no owners", {.size = {1, 1}, .format = rhi::Format::R32Uint});
        g.clear(owners);
    }
    g.dispatch(kMotion, in.size,
               {g.uniform(in.frame), g.uniform(in.motion), g.read(in.rays), g.read(visibility), g.write(out),
                g.read(in.instances.any() ? in.instances.instances : in.rays),
                g.read(in.has_meshes ? in.meshes.parts : in.rays),
                g.read(in.moved.owners.count != 0 ? in.moved.edits : in.rays),
                g.read(in.moved.has_boxes ? in.moved.boxes : in.rays), g.read(owners)});
    return out;
}

Image taa(Graph& g, const TileInputs& in, const Image& radiance, const Image& depth, const Image& motion) {
    ImageHistory colors = g.history("taa radiance", {.size = in.size, .format = rhi::Format::Rgba16Float});
    ImageHistory depths = g.history("taa depth", {.size = in.size, .format = rhi::Format::R32Float});
    Image out = g.create("radiance smoothed", {.size = in.size, .format = rhi::Format::Rgba16Float});
    const TaaPush push{.width = int(in.size.width),
                       .height = int(in.size.height),
                       .valid = in.has_history && colors.valid && depths.valid ? 1u : 0u,
                       .pad_0 = 0};
    g.dispatch(kTaa, in.size,
               {g.read(radiance), g.read(depth), g.read(motion), g.read(colors.previous), g.read(depths.previous),
                g.write(colors.current), g.write(depths.current), g.write(out)},
               push);
    return out;
}

}  // namespace kiln::render
