// SPDX-License-Identifier: MIT
#include "render/passes/instances.h"

#include "shaders/refine_instances.spv.h"
#include "shaders/resolve_instances.spv.h"
#include "shaders/shadow_instances.spv.h"

namespace kiln::render {

const Kernel kRefineInstances{"refine instances", kRefineInstancesSpv};
const Kernel kResolveInstances{"resolve instances", kResolveInstancesSpv};
const Kernel kShadowInstances{"shadow instances", kShadowInstancesSpv};

void refine_instances(Graph& g, const TileInputs& in, const Image& visibility, Image& refined) {
    const InstanceHandles& i = in.instances;
    if (!i) return;
    g.dispatch(specialised(kRefineInstances, i.use), in.size,
               {g.uniform(in.frame), g.read(i.instances), g.read(i.sets), g.read(i.records), g.read(i.code),
                g.read(i.numbers), g.read(in.rays), g.read(visibility), g.write(refined)});
}

void resolve_instances(Graph& g, const TileInputs& in, const Image& refined, Surface& surface) {
    const InstanceHandles& i = in.instances;
    if (!i) return;
    g.dispatch(kResolveInstances, in.size,
               {g.uniform(in.frame), g.read(i.instances), g.read(i.sets), g.read(i.cells), g.read(i.records),
                g.read(in.rays), g.read(in.field.tables), g.read(in.materials), g.read(in.field.distances),
                g.read(in.field.materials), g.read(surface.seen), g.read(refined), g.write(surface.words)});
}

void shadow_instances(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                      const Buffer& light_masks, uint32_t first_light, Image& fractions) {
    const InstanceHandles& i = in.instances;
    if (!i || in.light_count == 0) return;
    Image both = g.create("visible fractions", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kShadowInstances, in.size,
               {g.uniform(in.frame), g.read(i.ways), g.read(i.nodes), g.read(i.cells), g.read(in.rays),
                g.read(in.field.tables), g.read(in.lights), g.sampled(in.field.distances), g.read(visibility),
                g.read(surface.words), g.read(fractions), g.write(both), g.read(light_masks)},
               InstancePush{.node_count = i.node_count, .first_light = first_light, .by_tree = 0, .pad_0 = 0});
    fractions = both;
}

void instance_kernels(const TileInputs& in, bool shaded, std::vector<const Kernel*>& out) {
    if (!in.has_instances) return;
    if (in.refine) out.push_back(&specialised(kRefineInstances, in.use_of_instances));
    out.push_back(&kResolveInstances);
    if (shaded) out.push_back(&kShadowInstances);
}

}  // namespace kiln::render
