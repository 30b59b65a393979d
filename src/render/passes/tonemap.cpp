// SPDX-License-Identifier: MIT
#include "render/passes/tonemap.gpu.h"
#include "render/passes/passes.h"
#include "shaders/tonemap.spv.h"

namespace kiln::render {

const Kernel kTonemap{"tonemap", kTonemapSpv};

Image tonemap(Graph& g, const Image& radiance, const Image& glow, const Buffer& exposure, const Camera& camera) {
    Image shown = g.create("shown", {.size = radiance.size, .format = rhi::Format::Rgba8Unorm});
    const bool added = camera.bloom_kind == BloomKind::Gaussian;
    TonePush push{};
    push.width = int(radiance.size.width);
    push.height = int(radiance.size.height);
    push.scattered = added ? 0.0f : camera.bloom;
    push.added = added ? camera.bloom : 0.0f;
    push.tone_map = uint32_t(camera.tone_map);
    g.dispatch(kTonemap, radiance.size, {g.read(exposure), g.read(radiance), g.sampled(glow), g.write(shown)}, push);
    return shown;
}

}  // namespace kiln::render
