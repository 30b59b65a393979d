// SPDX-License-Identifier: MIT
// What lets light through, drawn by the passes of all else: glass bends the rays of a part of the picture, and the frame's own passes draw
// what the bent rays see, as they drew what the camera sees. One round a surface: who is nearest along the rays as they are (those that rest
// cost little), what it looks like, where light goes on. Order follows from the rays, so whoever comes first in a list changes nothing.
#include "render/passes/forward.h"
#include "render/passes/instances.h"

#include "shaders/march_glass.spv.h"
#include "shaders/mesh_trace.spv.h"
#include "shaders/shadow_glass.spv.h"
#include "shaders/through_begin.spv.h"
#include "shaders/through_bend.spv.h"
#include "shaders/through_end.spv.h"
#include "shaders/through_enter.spv.h"
#include "shaders/through_front.spv.h"
#include "shaders/through_layer.spv.h"
#include "shaders/through_mirror.spv.h"
#include "shaders/through_mirrored.spv.h"
#include "shaders/through_surface.spv.h"

namespace kiln::render {

namespace {
constexpr rhi::SpecConstant kWithImage[] = {{6, 1}};
}  // namespace

const Kernel kMarchGlass{"march glass", kMarchGlassSpv};
const Kernel kThroughBegin{"through begin", kThroughBeginSpv};
const Kernel kThroughLayer{"through layer", kThroughLayerSpv};
const Kernel kThroughSurface{"through surface", kThroughSurfaceSpv};
const Kernel kThroughEnter{"through enter", kThroughEnterSpv};
const Kernel kThroughBend{"through bend", kThroughBendSpv};
const Kernel kThroughBendImage{"through bend image", kThroughBendSpv, kWithImage};
const Kernel kThroughEnd{"through end", kThroughEndSpv};
const Kernel kThroughFront{"through front", kThroughFrontSpv};
const Kernel kThroughMirror{"through mirror", kThroughMirrorSpv};
const Kernel kThroughMirrored{"through mirrored", kThroughMirroredSpv};
const Kernel kThroughMirroredImage{"through mirrored image", kThroughMirroredSpv, kWithImage};
const Kernel kShadowGlass{"shadow glass", kShadowGlassSpv};
const Kernel kMeshTrace{"mesh trace", kMeshTraceSpv};

namespace {

constexpr rhi::SamplerDesc kTrilinear{.mip = rhi::Filter::Linear, .address = rhi::AddressMode::Repeat};

Image trace_meshes(Graph& g, const TileInputs& in, const Image& visibility, bool through) {
    const MeshHandles& m = in.meshes;
    Image out = g.create("visibility with meshes", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    std::vector<Use> uses{g.uniform(in.frame), g.read(in.rays),    g.read(m.parts),
                          g.read(m.corners),   g.read(m.vertices), g.read(m.surfaces),
                          g.read(m.nodes),     g.read(visibility), g.write(out)};
    for (const Image& page : m.pages) uses.push_back(g.read(page));
    uses.push_back(g.sampler(kTrilinear));
    g.dispatch(kMeshTrace, in.size, uses,
               MeshTracePush{.through = through ? 1u : 0u, .pad_0 = 0, .pad_1 = 0, .pad_2 = 0});
    return out;
}

// What is solid along rays that come from a buffer.
Image fields_along(Graph& g, const TileInputs& in) {
    TileInputs by_compute = in;  // boxes are of the camera's rays
    by_compute.rt = false;
    return march(g, by_compute).words;
}

Image solid_seen_along(Graph& g, const TileInputs& in) {
    const Image words = fields_along(g, in);
    return in.has_meshes ? trace_meshes(g, in, words, false) : words;
}

struct Solid {
    Image seen, light;
};
Solid solid_along(Graph& g, const TileInputs& in) {
    const Image seen = fields_along(g, in);
    Image refined = in.refine ? refine(g, in, seen) : seen;
    if (in.refine) refine_instances(g, in, seen, refined);
    Image words = seen;
    if (in.has_meshes) words = trace_meshes(g, in, words, false);
    Surface surface = resolve(g, in, words, refined);
    resolve_instances(g, in, words, refined, surface);
    if (in.has_meshes) resolve_meshes(g, in, surface);
    return {surface.seen, light(g, in, surface.seen, surface)};
}

// Stands for a buffer that a kernel then does not read.
const Buffer& or_any(const Buffer& buffer, const TileInputs& in) { return buffer ? buffer : in.rays; }

// The surfaces that rays meet next, of what lets light through before what is solid.
struct Layer {
    Surface surface;
    Image light;
    Surface lit;  // as it was lit
};
Layer layer_along(Graph& g, const TileInputs& in, const Image& solid, const Image& carried, const ThroughPush& push) {
    TileInputs of_glass = in;
    of_glass.instances = in.instances.of_glass();
    Image nearest = solid;
    if (const InstanceHandles& i = of_glass.instances) {
        nearest = g.create("visibility with glass", {.size = in.size, .format = rhi::Format::Rgba32Uint});
        g.dispatch(
            kMarchGlass, in.size,
            {g.uniform(in.frame), g.read(i.instances), g.read(i.sets), g.read(i.nodes), g.read(i.cells),
             g.read(in.rays), g.read(in.field.tables), g.read(in.field.distances), g.read(solid), g.write(nearest)},
            InstancePush{.node_count = i.node_count, .first_light = 0, .by_tree = 0, .pad_0 = 0});
    }
    if (in.has_blends) nearest = trace_meshes(g, in, nearest, true);
    Layer out;
    Image found = g.create("through found", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.surface.seen = g.create("through seen", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.surface.words = g.create("through surface", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.surface.depth = g.create("through depth", {.size = in.size, .format = rhi::Format::R32Float});
    g.dispatch(
        kThroughLayer, in.size,
        {g.read(or_any(in.instances.glass, in)), g.read(or_any(in.meshes.parts, in)), g.read(nearest), g.read(carried),
         g.write(found), g.write(out.surface.seen), g.write(out.surface.words), g.write(out.surface.depth)},
        push);
    if (of_glass.instances) {
        Image refined = found;
        if (in.refine) {
            refined = g.create("through refined", {.size = in.size, .format = rhi::Format::Rgba32Uint});
            refine_instances(g, of_glass, found, refined);
        }
        resolve_instances(g, of_glass, found, refined, out.surface);
    }
    if (in.has_blends) resolve_meshes(g, in, out.surface);
    Surface lit = out.surface;
    lit.words = g.create("through surface lit", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kThroughSurface, in.size,
               {g.read(or_any(in.instances.glass, in)), g.read(out.surface.seen), g.read(out.surface.words),
                g.write(lit.words)},
               push);
    out.light = light(g, in, lit.seen, lit);
    out.lit = lit;
    return out;
}

// What is solid in the mirror that glass is, into the light of a layer that the camera's rays met.
void mirror_solid(Graph& g, const TileInputs& tile, const ThroughPart& part, const TileInputs& in,
                  const ThroughPush& push, Layer& layer) {
    Buffer rays = g.create_buffer("through rays mirrored", uint64_t{in.size.width} * in.size.height * sizeof(FrameRay));
    g.dispatch(kThroughMirror, in.size,
               {g.uniform(in.frame), g.read(in.rays), g.read(in.instances.instances), g.read(layer.surface.seen),
                g.read(layer.surface.words), g.write(rays)},
               push);
    TileInputs mirrored = in;
    mirrored.rays = rays;
    mirrored.frame = part.frame_of_rays;
    mirrored.light_rects = tile.all_light_rects;
    mirrored.lights_of_tile = tile.light_count;
    const Solid solid = solid_along(g, mirrored);
    Image both = g.create("through light mirrored", {.size = in.size, .format = rhi::Format::Rgba16Float});
    g.dispatch(
        in.image_sky ? kThroughMirroredImage : kThroughMirrored, in.size,
        {g.uniform(in.frame), g.read(in.rays), g.read(in.ggx_table), g.read(in.environment), g.read(layer.lit.seen),
         g.read(layer.lit.words), g.read(layer.light), g.read(solid.light), g.write(both)},
        push);
    layer.light = both;
}

bool wants_front(const TileInputs& in) { return in.taa || in.particles.count > 0; }

void draw_part(Graph& g, const TileInputs& tile, const ThroughPart& part, const Surface& surface, Image& radiance,
               Front& front) {
    TileInputs in = tile;
    in.size = part.size;
    in.frame = part.frame;
    in.light_rects = part.light_rects;
    in.lights_of_tile = part.lights_of_tile;
    in.volume_count = 0;  // bent rays see no solids of lights as the rasteriser draws them
    ThroughPush push{.from_x = part.x,
                     .from_y = part.y,
                     .width = int(part.size.width),
                     .height = int(part.size.height),
                     .passed = 0,
                     .last = 0,
                     .pad_0 = 0,
                     .pad_1 = 0};
    Solid solid;
    solid.seen = g.create("through solid", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    solid.light = g.create("through solid light", {.size = in.size, .format = rhi::Format::Rgba16Float});
    g.dispatch(kThroughBegin, in.size,
               {g.read(surface.seen), g.read(radiance), g.write(solid.seen), g.write(solid.light)}, push);
    Image carried = solid.light, sum = solid.light;  // not read in the first round
    const Image distances = in.field.distances;
    for (int passed = 0; passed <= tile.transparent_layers; ++passed) {
        push.passed = uint32_t(passed);
        push.last = passed == tile.transparent_layers ? 1 : 0;
        if (passed > 0) solid = solid_along(g, in);
        Layer layer{{solid.seen, solid.light, solid.seen}, solid.light, {}};  // not read in the last round
        if (push.last == 0) layer = layer_along(g, in, solid.seen, carried, push);
        if (passed == 0 && push.last == 0 && in.has_glass) mirror_solid(g, tile, part, in, push, layer);
        Buffer rays = g.create_buffer("through rays", uint64_t{part.size.width} * part.size.height * sizeof(FrameRay));
        Image carried_now = g.create("through carried", {.size = in.size, .format = rhi::Format::Rgba16Float});
        Image sum_now = g.create("through sum", {.size = in.size, .format = rhi::Format::Rgba16Float});
        const InstanceHandles& i = in.instances;
        TileInputs inside = in;
        Image seen_inside = solid.seen;
        if (push.last == 0 && i.glass_node_count > 0) {
            Buffer entered = g.create_buffer("through rays inside", rays.size);
            g.dispatch(kThroughEnter, in.size,
                       {g.uniform(in.frame), g.read(in.rays), g.read(i.instances), g.read(i.glass),
                        g.read(layer.surface.seen), g.read(layer.surface.words), g.write(entered)},
                       push);
            inside.rays = entered;
            inside.frame = part.frame_of_rays;
            seen_inside = solid_seen_along(g, inside);
        }
        g.dispatch(in.image_sky ? kThroughBendImage : kThroughBend, in.size,
                   {g.uniform(in.frame), g.read(in.rays), g.read(or_any(i.instances, in)), g.read(or_any(i.sets, in)),
                    g.read(or_any(i.cells, in)), g.read(or_any(i.glass, in)), g.read(distances),
                    g.read(layer.surface.seen), g.read(layer.surface.words), g.read(layer.light), g.read(solid.light),
                    g.read(carried), g.read(sum), g.read(inside.rays), g.read(seen_inside), g.write(rays),
                    g.write(carried_now), g.write(sum_now), g.read(in.environment)},
                   push);
        carried = carried_now;
        sum = sum_now;
        if (passed == 0 && wants_front(tile)) {
            push.passed = 1;  // over what is there
            g.dispatch(
                kThroughFront, in.size,
                {g.read(layer.surface.seen), g.read(layer.surface.depth), g.read(sum), g.read(carried),
                 g.write(front.surface.seen), g.write(front.surface.depth), g.write(front.light), g.write(front.left)},
                push);
        }
        in.rays = rays;
        in.frame = part.frame_of_rays;
        in.light_rects = tile.all_light_rects;
        in.lights_of_tile = tile.light_count;
    }
    g.dispatch(kThroughEnd, in.size, {g.read(sum), g.write(radiance)}, push);
}

}  // namespace

Front draw_through(Graph& g, const TileInputs& in, const Surface& surface, Image& radiance) {
    Front front{surface, radiance, radiance};
    if (in.through.empty()) return front;
    if (wants_front(in)) {
        front.surface.seen = g.create("front seen", {.size = in.size, .format = rhi::Format::Rgba32Uint});
        front.surface.depth = g.create("front depth", {.size = in.size, .format = rhi::Format::R32Float});
        front.light = g.create("front light", {.size = in.size, .format = rhi::Format::Rgba16Float});
        front.left = g.create("front left", {.size = in.size, .format = rhi::Format::Rgba16Float});
        const ThroughPush all{.from_x = 0,
                              .from_y = 0,
                              .width = int(in.size.width),
                              .height = int(in.size.height),
                              .passed = 0,
                              .last = 0,
                              .pad_0 = 0,
                              .pad_1 = 0};
        g.dispatch(
            kThroughFront, in.size,
            {g.read(surface.seen), g.read(surface.depth), g.read(radiance), g.read(radiance),
             g.write(front.surface.seen), g.write(front.surface.depth), g.write(front.light), g.write(front.left)},
            all);
    }
    for (const ThroughPart& part : in.through) draw_part(g, in, part, surface, radiance, front);
    return front;
}

std::vector<Image> shadow_glass(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                                const Buffer& light_masks, uint32_t first_light, Image& fractions) {
    const InstanceHandles& i = in.instances;
    Image left = g.create("visible fractions", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    std::vector<Image> tints;
    for (int k = 0; k < 2; ++k)
        tints.push_back(g.create("glass tints", {.size = in.size, .format = rhi::Format::Rgba32Uint}));
    g.dispatch(kShadowGlass, in.size,
               {g.uniform(in.frame), g.read(in.rays), g.read(in.lights), g.read(light_masks), g.read(i.instances),
                g.read(i.sets), g.read(i.glass_nodes), g.read(i.cells), g.read(in.field.tables),
                g.read(in.field.distances), g.read(visibility), g.read(surface.words), g.read(fractions), g.write(left),
                g.write(tints[0]), g.write(tints[1])},
               InstancePush{.node_count = i.glass_node_count, .first_light = first_light, .by_tree = 0, .pad_0 = 0});
    fractions = left;
    return tints;
}

void through_kernels(const TileInputs& in, std::vector<const Kernel*>& out) {
    if (!in.has_glass && !in.has_blends) return;
    out.insert(out.end(), {&kThroughBegin, &kThroughLayer, &kThroughSurface, &kThroughEnter,
                           in.image_sky ? &kThroughBendImage : &kThroughBend, &kThroughEnd});
    if (in.taa || in.has_particles) out.push_back(&kThroughFront);
    if (in.has_meshes) out.push_back(&kMeshTrace);
    if (!in.has_glass) return;
    out.insert(out.end(), {&kShadowGlass, &kThroughMirror, in.image_sky ? &kThroughMirroredImage : &kThroughMirrored});
    out.insert(out.end(), {&kMarchGlass, &kResolveInstances});
    if (in.refine) out.push_back(&specialised(kRefineInstances, in.use_of_instances));
}

}  // namespace kiln::render
