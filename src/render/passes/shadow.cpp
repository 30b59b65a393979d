// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/shadow.spv.h"
#include "shaders/shadow_exact.spv.h"
#include "shaders/shadow_levels.spv.h"
#include "shaders/shadow_levels_exact.spv.h"

namespace kiln::render {

const Kernel kShadow{"shadow", kShadowSpv};
const Kernel kShadowExact{"shadow exact", kShadowExactSpv};
const Kernel kShadowLevels{"shadow levels", kShadowLevelsSpv};
const Kernel kShadowLevelsExact{"shadow levels exact", kShadowLevelsExactSpv};

namespace {
constexpr rhi::SpecConstant kBricksAlone[] = {{5, 0}};
}  // namespace

const Kernel kShadowHorizons{"shadow horizons", kShadowExactSpv, kBricksAlone};
const Kernel kShadowLevelsHorizons{"shadow levels horizons", kShadowLevelsExactSpv, kBricksAlone};

const Kernel& shadow_kernel(const TileInputs& in) {
    if (!in.exact) return in.levels ? kShadowLevels : kShadow;
    if (in.levels) return specialised(in.horizons ? kShadowLevelsHorizons : kShadowLevelsExact, in.use);
    return specialised(in.horizons ? kShadowHorizons : kShadowExact, in.use);
}

Image shadow(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface, const Buffer& masks,
             const ShadowPush& push) {
    Image fractions = g.create("visible fractions", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    const FieldHandles& f = in.field;
    std::vector<Use> uses{g.uniform(in.frame),   g.read(f.cells),        g.read(in.rays),
                          g.read(in.lights),     g.sampled(f.distances), g.read(visibility),
                          g.read(surface.words), g.write(fractions),     g.read(masks)};
    if (in.exact) uses.insert(uses.end(), {g.read(f.records), g.read(f.code), g.read(f.program), g.read(f.numbers)});
    if (in.levels) uses.push_back(g.uniform(in.levels_block));
    g.dispatch(shadow_kernel(in), in.size, uses, push);
    return fractions;
}

}  // namespace kiln::render
