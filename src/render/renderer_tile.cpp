// SPDX-License-Identifier: MIT
// One tile of a picture, from what it needs of the frame to what is read back.
#include "render/renderer_impl.h"

#include "render/frame.h"
#include "render/lib/pack.h"
#include "render/light_rects.h"
#include "render/passes/cascades.h"
#include "render/passes/cluster.gpu.h"
#include "render/passes/instances.h"
#include "render/passes/lamps.h"
#include "render/picture.h"
#include "render/shadow_cascades.h"
#include "render/temporal.h"
#include "render/through_rects.h"

#include <algorithm>
#include <chrono>

namespace kiln {

using namespace render;

namespace {

// Of a part of the picture.
LightRects rects_in(const Frame& frame, const FrameParams& part) {
    LightRects out =
        (part.flags & kFrameAllLights) == 0
            ? light_rects(frame.lights, part.camera, part.tile_x, part.tile_y, part.tile_width, part.tile_height)
            : all_light_rects(frame.lights.size(), part.tile_width, part.tile_height);
    if (out.rects.empty()) out.rects.emplace_back();
    return out;
}

}  // namespace

void Renderer::Impl::find_through(Graph& g, const Frame& frame, const FrameParams& params, TileInputs& in) const {
    if (!in.has_glass && !in.has_blends) return;
    std::vector<Box3> seen = meshes->blends();
    const float h = params.grid.voxel_size;
    for (const InstanceNode& n : instances->glass_nodes())
        if (n.instance != kNoInstance)
            seen.push_back({vec3{n.low_x, n.low_y, n.low_z} * h, vec3{n.high_x, n.high_y, n.high_z} * h});
    const PixelRect tile{params.tile_x, params.tile_y, params.tile_width, params.tile_height};
    const int apart = refines_on_host() ? kPixelsApart : kPixelsApartOfGpu;
    for (const PixelRect& rect : through_rects(seen, params.camera, tile, kBentRays, apart)) {
        FrameParams part = params;
        part.tile_x = rect.x, part.tile_y = rect.y;
        part.tile_width = rect.width, part.tile_height = rect.height;
        part.flags &= ~kFrameRayEnds;
        if (!in.refine) part.flags &= ~kFrameRefine;
        ThroughPart& out = in.through.emplace_back();
        out.x = rect.x - tile.x, out.y = rect.y - tile.y;
        out.size = {uint32_t(rect.width), uint32_t(rect.height)};
        out.frame = g.block(part);
        part.flags |= kFrameRays;
        out.frame_of_rays = g.block(part);
        const LightRects rects = rects_in(frame, part);
        out.lights_of_tile = rects.most;
        out.light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects));
        part.tile_height *= 2;
        out.frame_of_parted = g.block(part);
    }
    if (in.through.empty()) return;
    LightRects all = all_light_rects(frame.lights.size(), params.tile_width, 2 * params.tile_height);
    if (all.rects.empty()) all.rects.emplace_back();
    in.all_light_rects = g.upload("light rects", std::span<const LightRect>(all.rects));
}

void Renderer::Impl::find_bands(Graph& g, const Frame& frame, const FrameParams& params, TileInputs& in) const {
    // Passes that look at neighbours, at pictures before or at surfaces once more want them whole.
    const bool whole = in.has_meshes || in.rt || in.taa || in.ao_every > 0 || !in.through.empty() ||
                       in.outline_count > 0 || in.outlines_meshes || in.outline_hulls || in.volume_count > 0;
    const int rows = ((params.tile_height + 1) / 2 + kClusterSide - 1) / kClusterSide * kClusterSide;
    if (whole || params.view != uint32_t(View::Shaded) || rows >= params.tile_height) return;
    for (int y = 0; y < params.tile_height; y += rows) {
        FrameParams part = params;
        part.tile_y += y;
        part.tile_height = std::min(rows, params.tile_height - y);
        part.first_row = y;
        const LightRects rects = rects_in(frame, part);
        in.bands.push_back({.y = uint32_t(y),
                            .size = {uint32_t(part.tile_width), uint32_t(part.tile_height)},
                            .frame = g.block(part),
                            .light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects)),
                            .lights_of_tile = rects.most});
    }
}

void Renderer::Impl::draw_maps(Graph& g, const Frame& frame, const RenderSettings& settings, const FrameParams& params,
                               TileInputs& in) {
    const int side =
        settings.shadow_map_side > 0 ? settings.shadow_map_side : shadow_map_side(params.width, params.height);
    stats.mesh_shadows = "cascades";
    CasterLists casters;
    if (in.has_cascades) {
        std::vector<Box3> bounds;
        for (const MeshCaster& caster : meshes->casters()) bounds.push_back(caster.bounds);
        const ShadowCascades fitted = fit_cascades(bounds, frame.lights[in.mapped_light].direction, frame.camera,
                                                   double(settings.width) / settings.height, side);
        casters = caster_lists(meshes->casters(), fitted);
        in.cascades = draw_cascades(g, in.meshes, fitted, casters, frame.camera.position, in.mapped_light);
        stats.cascades = int(fitted.squares.size());
    } else {
        casters =
            caster_lists(meshes->casters(), {.half = 1, .range = 1});  // where they are in light space is not asked
    }
    if (!in.has_lamps) return;
    const LampFaces faces = faces_of_lamps(frame);
    // At most 64 MiB, and no finer than the sun's: a face is a fourth of what is around.
    const int most = faces.faces.size() <= 16 ? 1024 : 512;
    in.lamps = draw_lamps(g, in.meshes, faces.faces, casters, std::clamp(side / 2, 64, most));
}

void Renderer::Impl::shade_particles(Graph& g, const Frame& frame, const FrameParams& params, const ParticleBins& bins,
                                     ParticleHandles& out) {
    const auto is_sun = [](const Light& l) { return !is_somewhere(l); };
    const auto sun = std::find_if(frame.lights.begin(), frame.lights.end(), is_sun);
    if (sun == frame.lights.end()) return;
    out.sun = uint32_t(sun - frame.lights.begin());
    ParticleSun picture = particle_sun(bins.records, params, out.sun);
    out.size = {uint32_t(picture.frame.tile_width), uint32_t(picture.frame.tile_height)};
    out.frame = g.block(picture.frame);
    out.rays = g.upload("rays of particles", std::span<const FrameRay>(picture.rays));
    out.masks = g.upload("lights of particles", std::span<const uint32_t>(picture.masks));
}

Result<void> Renderer::Impl::render_tile(const Frame& frame, const RenderSettings& settings, const FrameParams& params,
                                         Picture& picture) {
    const auto inputs_on = [&](Graph& g) {
        TileInputs in = inputs(frame, settings);
        in.field = field->import(g);
        in.instances = instances->import(g);
        in.frame = g.block(params);
        if (in.levels) in.levels_block = g.block(field->levels());
        const FrameRay no_ray{};
        in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
        in.materials = materials->import(g);
        std::vector<shade::LightRecord> lights;
        for (const Light& light : frame.lights) {
            lights.push_back(shade::light_record(light));
            if (!settings.soft_shadows) lights.back().position.w = 0;
        }
        if (in.has_cascades) lights[in.mapped_light].color.w = 1;
        if (in.has_lamps) {
            const LampFaces faces = faces_of_lamps(frame);
            for (size_t i = 0; i < lights.size(); ++i)
                if (faces.of[i] != 0) lights[i].color.w = faces.of[i];
        }
        in.light_count = uint32_t(lights.size());
        const LightRects rects = rects_in(frame, params);
        in.lights_of_tile = rects.most;
        in.local_lights = rects.local;
        if (lights.empty()) lights.emplace_back();
        in.light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects));
        in.lights = g.upload("lights", std::span<const shade::LightRecord>(lights));
        in.ggx_table = g.import("ggx albedo", ggx_table);
        const uint32_t nothing[4] = {};
        in.environment = in.image_sky ? g.import("environment", environment)
                                      : g.upload("no environment", std::span<const uint32_t>(nothing));
        in.size = in.shown_size = {uint32_t(params.tile_width), uint32_t(params.tile_height)};
        if (in.upscales) in.shown_size = {uint32_t(settings.width), uint32_t(settings.height)};
        if (in.volume_count > 0) {
            std::vector<uint32_t> numbers;
            for (uint32_t i = 0; i < frame.lights.size(); ++i)
                if (is_somewhere(frame.lights[i])) numbers.push_back(i);
            in.volumes = g.upload("lights with volumes", std::span<const uint32_t>(numbers));
        }
        in.exposure = g.import("exposure", exposure);
        if (in.outline_count > 0 || in.outlines_meshes) {
            std::vector<OutlineRecord> records = outlined.records;
            for (const MeshOutline& o : meshes->outlined()) {
                records.push_back({.red = o.outline.color.x,
                                   .green = o.outline.color.y,
                                   .blue = o.outline.color.z,
                                   .width_px = o.outline.width_px,
                                   .code_first = 0,
                                   .code_count = 0,
                                   .blend = 0,
                                   .paints = 0,
                                   .instance = kNoInstance,
                                   .pad_0 = 0,
                                   .pad_1 = 0,
                                   .pad_2 = 0});
                in.widest_outline = std::max(in.widest_outline, o.outline.width_px);
            }
            in.outlines = g.upload("outlines", std::span<const OutlineRecord>(records));
        }
        if (in.outline_count > 0) {
            in.outline_code = g.upload("outline code", std::span<const sdf::Instruction>(outlined.code));
        }
        if (in.taa || in.has_particles) {
            MotionParams motion = motion_params(frame.camera, in.has_history ? before->camera : frame.camera,
                                                settings.width, settings.height);
            motion.now = of_rays(motion.now, params.width, params.height);
            motion.before = of_rays(motion.before, params.width, params.height);
            motion.moved_count = in.moved.owners.count;
            motion.changed_count = uint32_t(moved.boxes.size());
            in.motion = g.block(motion);
            if (in.moved.owners.count > 0) {
                in.moved.owners.records = g.upload("moved edits", std::span<const OutlineRecord>(moved.code.records));
                in.moved.owners.code =
                    g.upload("code of moved edits", std::span<const sdf::Instruction>(moved.code.code));
                in.moved.edits = g.upload("motions of edits", std::span<const MovedRecord>(moved.records));
            }
            if (in.moved.has_boxes)
                in.moved.boxes = g.upload("changed boxes", std::span<const ChangedBox>(moved.boxes));
        }
        in.meshes = meshes->import(g);
        if (in.has_cascades || in.has_lamps) draw_maps(g, frame, settings, params, in);
        if (in.rt) in.boxes = boxes->import(g);
        find_through(g, frame, params, in);
        find_bands(g, frame, params, in);
        if (in.has_particles) {
            const ParticleBins bins = particle_bins(frame.particles, params.camera, params.tile_x, params.tile_y,
                                                    params.tile_width, params.tile_height);
            in.particles.count = uint32_t(bins.records.size());
            in.particles.first_level = bins.first_level;
            in.particles.across = bins.across;
            if (!bins.records.empty()) {
                in.particles.records = g.upload("particles", std::span<const ParticleRecord>(bins.records));
                in.particles.ends = g.upload("particle bins", std::span<const uint32_t>(bins.ends));
                in.particles.numbers = g.upload("particle numbers", std::span<const uint32_t>(bins.numbers));
                shade_particles(g, frame, params, bins, in.particles);
            }
        }
        if (in.has_lines) {
            in.lines.count = uint32_t(lines.size());
            in.lines.lines = g.upload("debug lines", std::span<const LineRecord>(lines));
            in.lines.params =
                g.block(LineParams{.camera = shade::camera_params(frame.camera, settings.width, settings.height),
                                   .width = settings.width,
                                   .height = settings.height,
                                   .tile_x = params.tile_x,
                                   .tile_y = params.tile_y,
                                   .tile_width = int(in.shown_size.width),
                                   .tile_height = int(in.shown_size.height),
                                   .pad_0 = 0,
                                   .pad_1 = 0});
        }
        return in;
    };
    const auto run = [&](Graph& g, std::span<const Readback> evaluations,
                         std::span<const Readback> mesh_numbers) -> Result<void> {
        auto submit = runner->execute(g);
        if (!submit) return submit.error();
        for (size_t phase = 0; phase < mesh_numbers.size(); ++phase) {
            auto words = mesh_numbers[phase].get_as<uint32_t>();
            if (!words) return words.error();
            uint64_t& clusters = phase == 0 ? stats.clusters_early : stats.clusters_late;
            for (size_t kind = 0; kind < 3; ++kind) clusters += (*words)[kMeshDrawWords * kind + 1];
            stats.triangles_drawn += (*words)[kMeshDrawnTriangles];
        }
        for (const Readback& counted : evaluations) {
            auto words = counted.get_as<uint32_t>();
            if (!words) return words.error();
            uint64_t sum = 0;
            for (const uint32_t n : *words) {
                sum += n & ~kWalkedTree;
                stats.instance_tiles_by_tree += n >> 31;
            }
            const std::string pass = counted.name().substr(0, counted.name().find(" evaluations"));
            if (pass.starts_with("march")) stats.evaluations += sum;
            const auto same = std::find_if(stats.pass_evaluations.begin(), stats.pass_evaluations.end(),
                                           [&](const auto& p) { return p.first == pass; });
            if (same != stats.pass_evaluations.end())
                same->second += sum;
            else
                stats.pass_evaluations.emplace_back(pass, sum);
        }
        stats.transient_peak_bytes = std::max(stats.transient_peak_bytes, runner->stats().peak_bytes);
        stats.transient_sum_bytes = std::max(stats.transient_sum_bytes, runner->stats().unaliased_bytes);
        stats.transient_pass_bytes = std::max(stats.transient_pass_bytes, runner->plan().most_of_a_pass);
        if (!device->caps().timestamp) return {};
        auto times = runner->times(*submit);
        if (!times) return times.error();
        add_times(*times);
        return {};
    };

    std::vector<uint32_t> visibility, refined, mesh_ids;
    const bool on_host = refines_on_host() && (params.flags & kFrameRefine) != 0;
    if (on_host) {
        Graph first(*runner);
        const TileSeen seen = record_visibility(first, inputs_on(first));
        if (auto done = run(first, seen.evaluations, seen.mesh_numbers); !done) return done;
        if (culls_meshes(settings)) {
            auto ids = seen.mesh_ids.get_as<uint32_t>();
            if (!ids) return ids.error();
            mesh_ids = std::move(*ids);
        }
        auto words = seen.visibility.get_as<uint32_t>();
        if (!words) return words.error();
        visibility = std::move(*words);
        const auto start = std::chrono::steady_clock::now();
        refined = refine_on_host(field->code_of_bricks(), params, visibility);
        refine_instances_on_host(*instances, params, visibility, refined);
        const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        add_times({.passes = {{.name = "refine", .ms = ms}}, .total_ms = ms, .side_by_side_ms = ms});
    }
    Graph g(*runner);
    const TileInputs in = inputs_on(g);
    const TileResult tile =
        on_host ? record_tile(g, in, settings.view, visibility, refined, mesh_ids) : record_tile(g, in, settings.view);
    if (auto done = run(g, tile.evaluations, tile.mesh_numbers); !done) return done;
    std::vector<std::byte> shown;
    if (settings.view != View::Shaded || in.develops) {
        auto bytes = tile.shown.get();
        if (!bytes) return bytes.error();
        shown = std::move(*bytes);
    }
    if (settings.view == View::Shaded && in.develops) {
        auto state = tile.exposure.get_as<shade::ExposureState>();
        if (!state) return state.error();
        eye = state->front();
    }
    if (settings.shown_alone && settings.view == View::Shaded && in.develops) {
        place_shown(picture, params.tile_x, params.tile_y, int(in.shown_size.width), int(in.shown_size.height), shown);
        return {};
    }
    auto radiance = tile.radiance.get();
    if (!radiance) return radiance.error();
    auto depth = tile.depth.get_as<float>();
    if (!depth) return depth.error();
    place_tile(picture, params.tile_x, params.tile_y, int(in.shown_size.width), int(in.shown_size.height), *radiance,
               shown, *depth);
    return {};
}

}  // namespace kiln
