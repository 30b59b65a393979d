// SPDX-License-Identifier: MIT
#include "render/passes/bloom.gpu.h"
#include "render/lens.h"
#include "render/passes/passes.h"
#include "shaders/bloom_blur.spv.h"
#include "shaders/bloom_down.spv.h"
#include "shaders/bloom_up.spv.h"

namespace kiln::render {

const Kernel kBloomDown{"bloom down", kBloomDownSpv};
const Kernel kBloomUp{"bloom up", kBloomUpSpv};
const Kernel kBloomBlur{"bloom blur", kBloomBlurSpv};

namespace {

BloomPush push_for(const rhi::Extent& size) {
    BloomPush push{};
    push.width = int(size.width);
    push.height = int(size.height);
    return push;
}

Image pyramid(Graph& g, const Image& radiance, float size) {
    const std::vector<BloomLevel> plan = bloom_levels(int(radiance.size.width), int(radiance.size.height), size);
    std::vector<Image> levels;
    for (const BloomLevel& level : plan) {
        const rhi::Extent extent{uint32_t(level.width), uint32_t(level.height)};
        Image out = g.create("bloom level", {.size = extent, .format = rhi::Format::Rgba16Float});
        g.dispatch(kBloomDown, extent, {g.sampled(levels.empty() ? radiance : levels.back()), g.write(out)},
                   push_for(extent));
        levels.push_back(out);
    }
    Image below = levels.back();
    for (size_t i = levels.size() - 1; i-- > 0;) {
        Image out = g.create("bloom", {.size = levels[i].size, .format = rhi::Format::Rgba16Float});
        BloomPush push = push_for(out.size);
        push.coarser = plan[i].coarser;
        g.dispatch(kBloomUp, out.size, {g.sampled(below), g.read(levels[i]), g.write(out)}, push);
        below = out;
    }
    return below;
}

}  // namespace

Image bloom(Graph& g, const Image& radiance, const Buffer& exposure, const Camera& camera) {
    if (camera.bloom_kind == BloomKind::Pyramid) return pyramid(g, radiance, camera.bloom_size);
    Image now = radiance;
    for (int pass = 0; pass < kBlurPasses; ++pass) {
        Image out = g.create("bloom blur", {.size = radiance.size, .format = rhi::Format::Rgba16Float});
        BloomPush push = push_for(out.size);
        push.threshold = pass == 0 ? camera.bloom_threshold : -1.0f;
        push.along_x = pass % 2 == 0 ? 1 : 0;
        g.dispatch(kBloomBlur, out.size, {g.read(exposure), g.read(now), g.write(out)}, push);
        now = out;
    }
    return now;
}

}  // namespace kiln::render
