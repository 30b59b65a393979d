// SPDX-License-Identifier: MIT
// What lets light through, drawn by the passes of all else: glass bends the rays of a part of the picture, and the frame's own passes draw
// what the bent rays see, as they drew what the camera sees. One step a surface: who is nearest along the rays as they are (those that rest
// cost little), what it looks like, where light goes on. What is solid where they end is lit once, behind the last step. Order follows from
// the rays, so whoever comes first in a list changes nothing.
#include "render/passes/ao.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"

#include "shaders/march_glass.spv.h"
#include "shaders/mesh_trace.spv.h"
#include "shaders/shadow_glass.spv.h"
#include "shaders/through_begin.spv.h"
#include "shaders/through_bend.spv.h"
#include "shaders/through_end.spv.h"
#include "shaders/through_front.spv.h"
#include "shaders/through_layer.spv.h"
#include "shaders/through_surface.spv.h"
#include "shaders/through_total.spv.h"

namespace kiln::render {

const Kernel kMarchGlass{"march glass", kMarchGlassSpv};
const Kernel kThroughBegin{"through begin", kThroughBeginSpv};
const Kernel kThroughLayer{"through layer", kThroughLayerSpv};
const Kernel kThroughSurface{"through surface", kThroughSurfaceSpv};
const Kernel kThroughBend{"through bend", kThroughBendSpv};
const Kernel kThroughBendImage{"through bend image", kThroughBendSpv, kWithImage};
const Kernel kThroughEnd{"through end", kThroughEndSpv};
const Kernel kThroughFront{"through front", kThroughFrontSpv};
const Kernel kThroughTotal{"through total", kThroughTotalSpv};
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
Image solid_along(Graph& g, const TileInputs& in) {
    TileInputs by_compute = in;  // boxes are of the camera's rays
    by_compute.rt = false;
    const Image words = march(g, by_compute).words;
    return in.has_meshes ? trace_meshes(g, in, words, false) : words;
}

// The light of what was found along them.
Image light_along(Graph& g, const TileInputs& in, const Image& seen) {
    Image refined = in.refine ? refine(g, in, seen) : seen;
    if (in.refine) refine_instances(g, in, seen, refined);
    Surface surface = resolve(g, in, in.refine ? settle(g, in, seen, refined) : seen, refined);
    resolve_instances(g, in, refined, surface);
    if (in.has_meshes) resolve_meshes(g, in, surface);
    if (in.ao_every > 0) (void)occlude(g, in, surface);
    return light(g, in, surface, depth_of(g, in, surface.seen));
}

// Stands for a buffer that a kernel then does not read.
const Buffer& or_any(const Buffer& buffer, const TileInputs& in) { return buffer ? buffer : in.rays; }

// The surfaces that rays meet next, of what lets light through before what is solid.
struct Layer {
    Surface surface;
    Image nearest;    // that, or what is solid
    Image lit_words;  // the surface as it was lit
    Image light;
};
Layer layer_along(Graph& g, const TileInputs& in, const Image& solid, const Image& carried, const ThroughPush& push) {
    TileInputs of_glass = in;
    of_glass.instances = in.instances.of_glass();
    Layer out;
    out.nearest = of_glass.instances ? march_glass(g, of_glass, solid) : solid;
    if (in.has_blends) out.nearest = trace_meshes(g, in, out.nearest, true);
    Image found = g.create("through found", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    out.surface.words = g.create("through surface", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kThroughLayer, in.size,
               {g.read(or_any(in.instances.glass, in)), g.read(or_any(in.meshes.parts, in)), g.read(out.nearest),
                g.read(carried), g.write(found), g.write(out.surface.words)},
               push);
    out.surface.seen = found;
    if (of_glass.instances) {
        Image refined = found;
        if (in.refine) {
            refined = g.create("through refined", {.size = in.size, .format = rhi::Format::Rgba32Uint});
            refine_instances(g, of_glass, found, refined);
            out.surface.seen = settle(g, of_glass, found, refined);
        }
        resolve_instances(g, of_glass, refined, out.surface);
    }
    if (in.has_blends) resolve_meshes(g, in, out.surface);
    Surface lit = out.surface;
    lit.words = g.create("through surface lit", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    lit.seen = g.create("through seen lit", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kThroughSurface, in.size,
               {g.read(or_any(in.instances.glass, in)), g.read(out.surface.seen), g.read(out.surface.words),
                g.read(in.rays), g.write(lit.words), g.write(lit.seen)},
               push);
    out.lit_words = lit.words;
    out.light = light(g, in, lit, depth_of(g, in, lit.seen));
    return out;
}

// Rays through what is transparent, a pixel each, and how it goes with them.
struct Ways {
    TileInputs in;  // size, and rays with their frame once they are not the camera's
    Image carried;
    uint32_t step = 0;  // some of kThrough…, in the first step
};
// Pixels whose first surface is transparent: what that brought, what it lets in, and what comes through the thing it is of.
struct First {
    Surface surface;
    Image sum, entered, carried;
};
struct Brought {
    Image total;
    First first;
    Ways parted;  // with kThroughParts
};

TileInputs by_rays(const TileInputs& in, const TileInputs& tile, const Block& frame, const Buffer& rays) {
    TileInputs out = in;
    out.rays = rays;
    out.frame = frame;
    out.light_rects = tile.all_light_rects;
    out.lights_of_tile = tile.light_count;
    return out;
}

// The last of `steps` looks only for what is solid. `solid`: with kThroughCamera what the camera's rays meet, and its light.
struct Solid {
    Image seen, light;
};
Brought bring(Graph& g, const TileInputs& tile, const Block& frame_of_rays, Ways ways, const Solid& solid, int steps) {
    TileInputs& in = ways.in;
    const rhi::Extent size = in.size;
    const uint64_t ray_bytes = uint64_t{size.width} * size.height * sizeof(FrameRay);
    const bool parts = (ways.step & kThroughParts) != 0;
    const uint32_t with_parts = parts ? kThroughParts : 0;
    const rhi::Extent of_parted = parts ? rhi::Extent{size.width, 2 * size.height} : rhi::Extent{1, 1};
    ThroughPush push{.from_x = 0,
                     .from_y = 0,
                     .width = int(size.width),
                     .height = int(size.height),
                     .step = 0,
                     .passed = 0,
                     .picture = tile.picture,
                     .pad_0 = 0};
    Buffer rays_ended = g.create_buffer("through rays ended", ray_bytes);
    Image seen_ended = g.create("through seen ended", {.size = size, .format = rhi::Format::Rgba32Uint});
    Buffer rays_parted = g.create_buffer("through rays parted", parts ? 2 * ray_bytes : sizeof(FrameRay));
    Image carried_parted = g.create("through carried parted", {.size = of_parted, .format = rhi::Format::Rgba16Float});
    Image carried = ways.carried, sum = ways.carried;
    Brought out;
    for (int i = 0; i <= steps; ++i) {
        push.passed = uint32_t(i);
        push.step = (i == 0 ? ways.step | kThroughBegins : with_parts) | (i == steps ? kThroughLast : 0);
        const bool of_camera = (push.step & kThroughCamera) != 0;
        const Image solid_seen = of_camera ? solid.seen : solid_along(g, in);
        Layer layer{{solid_seen, solid_seen}, solid_seen, solid_seen, solid.light};  // not read in the last
        if (i < steps) layer = layer_along(g, in, solid_seen, carried, push);
        Buffer rays = g.create_buffer("through rays", ray_bytes);
        Image carried_now = g.create("through carried", {.size = size, .format = rhi::Format::Rgba16Float});
        Image sum_now = g.create("through sum", {.size = size, .format = rhi::Format::Rgba16Float});
        g.dispatch(in.image_sky ? kThroughBendImage : kThroughBend, size,
                   {g.uniform(in.frame),
                    g.read(in.rays),
                    g.read(or_any(in.instances.instances, in)),
                    g.read(or_any(in.instances.glass, in)),
                    g.read(in.ggx_table),
                    g.read(in.environment),
                    g.read(layer.surface.seen),
                    g.read(layer.surface.words),
                    g.read(layer.lit_words),
                    g.read(layer.light),
                    g.read(layer.nearest),
                    g.read(solid_seen),
                    g.read(solid.light),
                    g.read(carried),
                    g.read(sum),
                    g.write(rays),
                    g.write(carried_now),
                    g.write(sum_now),
                    g.write(rays_ended),
                    g.write(seen_ended),
                    g.write(rays_parted),
                    g.write(carried_parted)},
                   push);
        carried = carried_now;
        sum = sum_now;
        if (i == 0) out.first = {layer.surface, sum, carried, carried};
        if (i == 1 && parts) out.first.carried = carried;  // glass has two surfaces
        in = by_rays(in, tile, frame_of_rays, rays);
    }
    in.rays = rays_ended;
    out.total = g.create("through total", {.size = size, .format = rhi::Format::Rgba16Float});
    g.dispatch(kThroughTotal, size,
               {g.read(sum), g.read(carried), g.read(light_along(g, in, seen_ended)), g.write(out.total)}, push);
    out.parted.in = in;
    out.parted.in.size = of_parted;
    out.parted.in.rays = rays_parted;
    out.parted.carried = carried_parted;
    return out;
}

bool wants_front(const TileInputs& in) { return in.taa || in.particles.count > 0; }

// Of what is parted from a ray where it first meets glass: the mirror, and what is thrown back inside.
constexpr int kStepsOfParted = 6;

void draw_part(Graph& g, const TileInputs& tile, const ThroughPart& part, const Surface& surface, Image& radiance,
               Front& front) {
    Ways ways;
    ways.in = tile;
    TileInputs& in = ways.in;
    in.size = part.size;
    in.frame = part.frame;
    in.light_rects = part.light_rects;
    in.lights_of_tile = part.lights_of_tile;
    in.volume_count = 0;  // bent rays see no solids of lights as the rasteriser draws them
    const bool parts = in.instances.glass_node_count > 0 && tile.transparent_layers > 0;
    ThroughPush push{.from_x = part.x,
                     .from_y = part.y,
                     .width = int(part.size.width),
                     .height = int(part.size.height),
                     .step = parts ? kThroughParts : 0,
                     .passed = 0,
                     .picture = 0,
                     .pad_0 = 0};
    Solid solid;
    solid.seen = g.create("through solid", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    solid.light = g.create("through solid light", {.size = in.size, .format = rhi::Format::Rgba16Float});
    g.dispatch(kThroughBegin, in.size,
               {g.read(surface.seen), g.read(radiance), g.write(solid.seen), g.write(solid.light)}, push);
    ways.carried = solid.light;  // not read
    ways.step = kThroughCamera | push.step;
    // Surfaces of glass come in twos; some more for rays that glass throws back inside.
    const int steps = parts ? 2 * tile.transparent_layers + tile.glass_bounces : tile.transparent_layers;
    const int steps_of_parted = tile.glass_bounces > 0 ? std::min(steps, kStepsOfParted) : 0;
    Brought brought = bring(g, tile, part.frame_of_rays, ways, solid, steps);
    Image parted = brought.total;
    if (parts) {
        brought.parted.in.frame = part.frame_of_parted;
        parted = bring(g, tile, part.frame_of_parted, brought.parted, solid, steps_of_parted).total;
    }
    if (wants_front(tile)) {
        const First& first = brought.first;
        g.dispatch(
            kThroughFront, in.size,
            {g.uniform(in.frame), g.read(first.surface.seen), g.read(first.sum), g.read(first.carried), g.read(parted),
             g.write(front.seen), g.write(front.depth), g.write(front.light), g.write(front.left)},
            push);
    }
    g.dispatch(kThroughEnd, in.size,
               {g.uniform(in.frame), g.read(or_any(in.instances.glass, in)), g.read(brought.total), g.read(parted),
                g.read(brought.first.surface.seen), g.read(brought.first.surface.words), g.read(brought.first.sum),
                g.read(brought.first.entered), g.write(radiance)},
               push);
}

}  // namespace

Image march_glass(Graph& g, const TileInputs& in, const Image& solid) {
    const InstanceHandles& i = in.instances;
    Image out = g.create("visibility with glass", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kMarchGlass, in.size,
               {g.uniform(in.frame), g.read(i.ways), g.read(i.nodes), g.read(i.cells), g.read(in.rays),
                g.read(in.field.tables), g.read(in.field.distances), g.read(solid), g.write(out)},
               InstancePush{.node_count = i.node_count, .first_light = 0, .by_tree = 0, .pad_0 = 0});
    return out;
}

Front draw_through(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth, Image& radiance) {
    Front front{surface.seen, depth, radiance, radiance};
    if (in.through.empty()) return front;
    if (wants_front(in)) {
        front.seen = g.create("front seen", {.size = in.size, .format = rhi::Format::Rgba32Uint});
        front.depth = g.create("front depth", {.size = in.size, .format = rhi::Format::R32Float});
        front.light = g.create("front light", {.size = in.size, .format = rhi::Format::Rgba16Float});
        front.left = g.create("front left", {.size = in.size, .format = rhi::Format::Rgba16Float});
        const ThroughPush all{.from_x = 0,
                              .from_y = 0,
                              .width = int(in.size.width),
                              .height = int(in.size.height),
                              .step = kThroughBegins,
                              .passed = 0,
                              .picture = 0,
                              .pad_0 = 0};
        g.dispatch(kThroughFront, in.size,
                   {g.uniform(in.frame), g.read(surface.seen), g.read(radiance), g.read(radiance), g.read(radiance),
                    g.write(front.seen), g.write(front.depth), g.write(front.light), g.write(front.left)},
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
               {g.uniform(in.frame), g.read(in.rays), g.read(in.lights), g.read(light_masks), g.read(i.ways),
                g.read(i.glass_nodes), g.read(i.cells), g.read(in.field.tables), g.read(in.field.distances),
                g.read(visibility), g.read(surface.words), g.read(fractions), g.write(left), g.write(tints[0]),
                g.write(tints[1])},
               InstancePush{.node_count = i.glass_node_count, .first_light = first_light, .by_tree = 0, .pad_0 = 0});
    fractions = left;
    return tints;
}

void through_kernels(const TileInputs& in, std::vector<const Kernel*>& out) {
    if (!in.has_glass && !in.has_blends) return;
    out.insert(out.end(), {&kThroughBegin, &kThroughLayer, &kThroughSurface,
                           in.image_sky ? &kThroughBendImage : &kThroughBend, &kThroughTotal, &kThroughEnd});
    if (in.taa || in.has_particles) out.push_back(&kThroughFront);
    if (in.has_meshes) out.push_back(&kMeshTrace);
    if (!in.has_glass) return;
    out.insert(out.end(), {&kShadowGlass, &kMarchGlass, &kResolveInstances});
    if (in.refine) out.push_back(&specialised(kRefineInstances, in.use_of_instances));
}

}  // namespace kiln::render
