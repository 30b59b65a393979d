// SPDX-License-Identifier: MIT
// From fewer rays to the pixels that are shown.
#include "render/passes/upscale.h"

#include "render/passes/taa_up.gpu.h"

#include "shaders/taa_up.spv.h"
#include "shaders/up_depth.spv.h"
#include "shaders/up_owners.spv.h"

namespace kiln::render {

const Kernel kTaaUp{"taa upscaling", kTaaUpSpv};
const Kernel kUpDepth{"upscale depth", kUpDepthSpv};
const Kernel kUpOwners{"upscale outlines", kUpOwnersSpv};

namespace {

UpPush sizes(const TileInputs& in) {
    return {int(in.shown_size.width), int(in.shown_size.height), int(in.size.width), int(in.size.height)};
}

}  // namespace

Image taa_up(Graph& g, const TileInputs& in, const Image& radiance, const Image& depth, const Image& motion) {
    ImageHistory colors = g.history("taa radiance", {.size = in.shown_size, .format = rhi::Format::Rgba16Float});
    ImageHistory depths = g.history("taa depth", {.size = in.size, .format = rhi::Format::R32Float});
    Image out = g.create("radiance upscaled", {.size = in.shown_size, .format = rhi::Format::Rgba16Float});
    const UpPush s = sizes(in);
    const float share = float(s.width_rays) * float(s.height_rays) / (float(s.width) * float(s.height));
    g.dispatch(kTaaUp, in.shown_size,
               {g.read(radiance), g.read(depth), g.read(motion), g.read(colors.previous), g.read(depths.previous),
                g.write(colors.current), g.write(out)},
               TaaUpPush{.width = s.width,
                         .height = s.height,
                         .width_rays = s.width_rays,
                         .height_rays = s.height_rays,
                         .jitter_x = in.jitter.x,
                         .jitter_y = in.jitter.y,
                         .most_frames = std::min(16 / share, 48.0f),
                         .valid = in.has_history && colors.valid && depths.valid ? 1u : 0u});
    const CopyRegion all{.size = in.size};
    g.copy(depth, depths.current, std::span(&all, 1));
    return out;
}

Image upscale_depth(Graph& g, const TileInputs& in, const Image& depth) {
    Image out = g.create("depth upscaled", {.size = in.shown_size, .format = rhi::Format::R32Float});
    g.dispatch(kUpDepth, in.shown_size, {g.read(depth), g.write(out)}, sizes(in));
    return out;
}

OutlineMask upscale_mask(Graph& g, const TileInputs& in, const OutlineMask& mask) {
    OutlineMask out;
    out.owners = g.create("outline owners", {.size = in.shown_size, .format = rhi::Format::R32Uint});
    out.seeds = g.create("outline seeds", {.size = in.shown_size, .format = rhi::Format::R32Uint});
    g.dispatch(kUpOwners, in.shown_size, {g.read(mask.owners), g.write(out.owners), g.write(out.seeds)}, sizes(in));
    return out;
}

}  // namespace kiln::render
