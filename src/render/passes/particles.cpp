// SPDX-License-Identifier: MIT
#include "render/passes/cascades.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"

#include "shaders/particles.spv.h"
#include "shaders/particles_light.spv.h"
#include "shaders/particles_start.spv.h"

namespace kiln::render {

const Kernel kParticles{"particles", kParticlesSpv};
const Kernel kParticlesStart{"particles start", kParticlesStartSpv};
const Kernel kParticlesLight{"particles light", kParticlesLightSpv};
const Kernel kParticlesLightImage{"particles light image", kParticlesLightSpv, kWithImage};

namespace {

// What each particle's middle sees of the sun, as the first light's byte of a pixel.
Image sun_on_particles(Graph& g, const TileInputs& tile, const ParticlePush& push) {
    const ParticleHandles& p = tile.particles;
    if (p.sun == kNoSun) {
        Image none = g.create("no sun on particles", {.size = {1, 1}, .format = rhi::Format::Rgba32Uint});
        g.clear(none);
        return none;
    }
    TileInputs in = tile;
    in.size = p.size;
    in.frame = p.frame;
    in.rays = p.rays;
    Surface s;
    s.seen = g.create("particles seen", {.size = p.size, .format = rhi::Format::Rgba32Uint});
    s.words = g.create("particles surface", {.size = p.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kParticlesStart, p.size, {g.read(in.lights), g.write(s.seen), g.write(s.words)}, push);
    const bool mapped = in.has_cascades && in.mapped_light == p.sun;
    const ShadowPush first{.first_light = 0, .more = 0, .pad_0 = 0, .pad_1 = 0};
    Image fractions = shadow(g, in, s.seen, s, p.masks, first);
    shadow_instances(g, in, s.seen, s, p.masks, 0, fractions);
    if (mapped) fractions = shadow_by_cascades(g, in, s, p.masks, fractions, first);
    if (in.has_meshes && !mapped) fractions = shadow_meshes(g, in, s, p.masks, fractions, first);
    if (in.has_glass) (void)shadow_glass(g, in, s.seen, s, p.masks, 0, fractions);  // dims, and does not colour
    return fractions;
}

}  // namespace

void draw_particles(Graph& g, const TileInputs& in, const Image& solid_depth, Front& front, Image& radiance,
                    Image& motion) {
    const ParticleHandles& p = in.particles;
    if (p.count == 0) return;
    ParticlePush push{};
    push.width = int(in.size.width), push.height = int(in.size.height);
    push.count = p.count;
    static_assert(kParticleLevels == 5);
    const auto& first = p.first_level;
    push.first_0 = first[0], push.first_1 = first[1], push.first_2 = first[2], push.first_3 = first[3];
    push.first_4 = first[4];
    push.across_0 = p.across[0], push.across_1 = p.across[1], push.across_2 = p.across[2];
    push.across_3 = p.across[3], push.across_4 = p.across[4];
    push.behind = in.through.empty() ? 0 : 1;
    push.moves = in.taa ? 1 : 0;
    push.sun = p.sun;
    const Image sun = sun_on_particles(g, in, push);
    Buffer light = g.create_buffer("particles light", uint64_t{p.count} * 4 * sizeof(float));
    g.dispatch(in.image_sky ? kParticlesLightImage : kParticlesLight, rhi::Extent{p.count, 1},
               {g.uniform(in.frame), g.read(p.records), g.read(in.lights), g.read(in.environment), g.write(light),
                g.read(sun)},
               push);
    // Without taa one pixel stands for what is not written.
    const rhi::Extent size = in.taa ? in.size : rhi::Extent{1, 1};
    Image out = g.create("radiance with particles", {.size = in.size, .format = rhi::Format::Rgba16Float});
    Image depth_now = g.create("front depth", {.size = size, .format = rhi::Format::R32Float});
    Image motion_now = g.create("motion", {.size = size, .format = rhi::Format::Rgba16Float});
    g.dispatch(kParticles, in.size,
               {g.uniform(in.frame), g.uniform(in.motion), g.read(p.records), g.read(light), g.read(p.ends),
                g.read(p.numbers), g.read(radiance), g.read(solid_depth), g.read(front.depth), g.read(front.light),
                g.read(front.left), g.read(motion), g.write(out), g.write(depth_now), g.write(motion_now)},
               push);
    radiance = out;
    if (!in.taa) return;
    front.depth = depth_now;
    motion = motion_now;
}

}  // namespace kiln::render
