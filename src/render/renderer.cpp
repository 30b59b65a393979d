// SPDX-License-Identifier: MIT
#include <kiln/renderer.h>

#include "base/assert.h"
#include "base/format.h"
#include "base/log.h"
#include "field/field.h"
#include "render/edit_motion.h"
#include "render/frame.h"
#include "render/gpu_boxes.h"
#include "render/lens.h"
#include "render/live_shaders.h"
#include "render/merged.h"
#include "render/graph_runner.h"
#include "render/light_rects.h"
#include "render/passes/cluster.gpu.h"
#include "render/lib/environment_map.h"
#include "render/lib/ggx_table.h"
#include "render/lib/pack.h"
#include "render/passes/cascades.h"
#include "render/passes/forward.h"
#include "render/particle_bins.h"
#include "render/passes/instances.h"
#include "render/passes/lamps.h"
#include "render/passes/refine.gpu.h"
#include "render/picture.h"
#include "render/presenter.h"
#include "render/through_rects.h"
#include "render/temporal.h"
#include "rhi/create.h"

#include <algorithm>
#include <chrono>

namespace kiln {

namespace render {
namespace {

// Tiles bound the memory of a frame's images (about 100 bytes a pixel), whatever the size of the picture. A GPU takes 3840 x 2160 whole.
constexpr int kTileWidth = 4096;
constexpr int kTilePixels = 1 << 21;
constexpr int kTilePixelsOfGpu = 9 << 20;
// Pixels whose rays may be bent at once: a buffer of twice as many is within a binding.
constexpr int kBentRays = 1 << 20;
static_assert(2 * uint64_t{kBentRays} * sizeof(FrameRay) <= rhi::kMaxStorageBinding);

}  // namespace
}  // namespace render

using namespace render;

struct Renderer::Impl {
    std::unique_ptr<rhi::Device> device;
    std::unique_ptr<Runner> runner;
    std::unique_ptr<GpuField> field;
    std::unique_ptr<GpuInstances> instances;
    std::unique_ptr<GpuMeshes> meshes;
    std::unique_ptr<GpuBoxes> boxes;       // once a frame asked for the tier
    std::unique_ptr<LiveShaders> live;     // where KILN_LIVE_SHADERS asks for it
    std::unique_ptr<Presenter> presenter;  // where there is a window
    std::string fault;                     // first message of the device since the last call
    rhi::BufferHandle ggx_table;
    rhi::BufferHandle environment;
    rhi::BufferHandle exposure;
    shade::ExposureState eye{};                                    // what is in it, and stays from picture to picture
    std::shared_ptr<const shade::EnvironmentMap> environment_map;  // what is in the buffer
    RenderStats stats;
    // The picture before, with taa.
    struct Before {
        Camera camera;
        int width, height;
    };
    std::optional<Before> before;
    uint64_t taa_frame = 0;
    vec2 jitter{};                  // of the frame
    OutlineCode outlined;           // of the frame
    MovedEdits moved;               // likewise, with taa
    std::vector<LineRecord> lines;  // likewise

    ~Impl() {
        presenter.reset();
        instances.reset();
        boxes.reset();
        field.reset();
        meshes.reset();
        for (const rhi::BufferHandle buffer : {ggx_table, environment, exposure}) {
            if (!runner || !buffer) continue;
            runner->forget(buffer);
            device->destroy(buffer);
        }
        runner.reset();
    }

    Result<void> prepare();
    // Brings a frame's environment image to the device.
    Result<void> bring(const Frame& frame);
    Result<Picture> render(const Frame& frame, const RenderSettings& settings);
    // The exact path has solid instances in its program.
    Result<Picture> render_merged(const Frame& frame, const RenderSettings& settings);
    Result<void> render_tile(const Frame& frame, const RenderSettings& settings, const FrameParams& params,
                             Picture& picture);
    // Software devices run the tape many times slower than our SIMD.
    bool refines_on_host() const { return device->info().kind == rhi::DeviceKind::Cpu; }
    struct TileSize {
        int width, height;
    };
    // Tiles are smaller where many lights' bits would not fit a binding.
    TileSize tile_size(const RenderSettings& settings, size_t lights) const {
        const size_t masks =
            rhi::kMaxStorageBinding / ((lights / 32 + 1) * 4) / 2 * size_t(kClusterSide * kClusterSide);
        const int most = int(std::min(size_t(refines_on_host() ? kTilePixels : kTilePixelsOfGpu), masks));
        const int width = std::min(settings.width, kTileWidth);
        return {width, std::clamp(most / width, 1, settings.height)};
    }
    int tiles_of(const RenderSettings& settings, size_t lights) const {
        const auto [width, height] = tile_size(settings, lights);
        return ((settings.width + width - 1) / width) * ((settings.height + height - 1) / height);
    }
    // The switches of a frame; its resources are still to come.
    TileInputs inputs(const Frame& frame, const RenderSettings& settings) const {
        TileInputs in;
        in.image_sky = frame.environment && frame.environment_map;
        in.analytic = settings.analytic;
        in.levels = field->has_levels();
        in.exact = settings.analytic || field->leaves_grid();
        in.horizons = !settings.analytic && field->outside_is_concave();
        in.refine = settings.refine && !settings.analytic && !refines_on_host();
        in.camera = frame.camera;
        in.elapsed = settings.elapsed;
        in.taa = settings.taa && settings.view == View::Shaded;
        in.has_history = before && !settings.cut && before->width == settings.width &&
                         before->height == settings.height && follows(frame.camera, before->camera);
        in.upscales = in.taa && settings.scale < 1;
        in.jitter = jitter;
        in.picture = in.taa && settings.taa_jitter ? uint32_t(taa_frame & 0xffffu) : 0;
        if (settings.lighting == LightTechnique::Volumes && settings.view == View::Shaded)
            in.volume_count = uint32_t(std::count_if(frame.lights.begin(), frame.lights.end(), is_somewhere));
        in.outline_count = uint32_t(outlined.records.size());
        in.widest_outline = outlined.widest;
        in.use_of_outlines = refines_on_host() ? tape_use(outlined.code) : any_kind(tape_use(outlined.code));
        in.develops = !needs_whole_picture(frame.camera) || tiles_of(settings, frame.lights.size()) == 1;
        in.use = field->use(!settings.analytic);
        in.use_of_bricks = field->use(false);
        in.has_instances = !instances->nodes().empty();
        in.use_of_instances = instances->use();
        in.has_meshes = !meshes->empty();
        in.rt = traces(frame, settings) && boxes->boxes() > 0;
        in.mesh_shader = settings.tier == Tier::Mesh;
        in.cull_meshes = culls_meshes(settings);
        in.moved.owners.count = uint32_t(moved.records.size());
        in.moved.owners.use = refines_on_host() ? tape_use(moved.code.code) : any_kind(tape_use(moved.code.code));
        in.moved.has_boxes = !moved.boxes.empty();
        in.mesh_holes = meshes->holes();
        choose_maps(frame, settings, in);
        in.transparent_layers = settings.view == View::Shaded ? std::clamp(settings.transparent_layers, 0, 16) : 0;
        in.glass_bounces = std::clamp(settings.glass_bounces, 0, 16);
        in.has_glass = in.transparent_layers > 0 &&
                       std::any_of(frame.instances.begin(), frame.instances.end(), [](const Instance& i) {
                           return i.glass != 0 && i.bricks->field().stats().bricks > 0;
                       });
        in.has_particles = settings.view == View::Shaded && !frame.particles.empty();
        in.has_blends = in.transparent_layers > 0 && !meshes->blends().empty();
        const bool outlines = settings.view == View::Shaded && !meshes->outlined().empty() &&
                              tiles_of(settings, frame.lights.size()) == 1;
        in.outlines_meshes = outlines && !settings.outline_hulls;
        in.outline_hulls = outlines && settings.outline_hulls;
        in.has_lines = !lines.empty() && settings.view == View::Shaded && in.develops;
        return in;
    }
    bool culls_meshes(const RenderSettings& settings) const {
        return settings.cull_meshes && settings.accelerate && meshes->clusters_in_sight() > 0;
    }
    static bool is_somewhere(const Light& light) { return light.kind != Light::Kind::Directional; }
    // Maps are for the first sun, and for the first lamps and spots.
    void choose_maps(const Frame& frame, const RenderSettings& settings, TileInputs& in) const {
        if (!in.has_meshes || settings.mesh_shadows != MeshShadows::Cascades || settings.view != View::Shaded) return;
        const auto is_sun = [](const Light& l) { return !is_somewhere(l); };
        const auto sun = std::find_if(frame.lights.begin(), frame.lights.end(), is_sun);
        in.has_cascades = sun != frame.lights.end();
        in.mapped_light = uint32_t(sun - frame.lights.begin());
        const LampFaces faces = faces_of_lamps(frame);
        in.has_lamps = !faces.faces.empty();
        size_t mapped = in.has_cascades ? 1 : 0;
        for (const float of : faces.of) mapped += of != 0;
        in.maps_alone = mapped == frame.lights.size();
    }
    // As many as a buffer has room for with a list of all casters each.
    LampFaces faces_of_lamps(const Frame& frame) const {
        uint64_t clusters = 1;
        for (const MeshCaster& caster : meshes->casters())
            clusters += (caster.triangles + kMeshCluster - 1) / kMeshCluster;
        const uint64_t most = rhi::kMaxStorageBinding / (clusters * sizeof(MeshClusterRef));
        return lamp_faces(frame.lights, frame.camera.position, uint32_t(std::min<uint64_t>(most, kMostFaces)));
    }
    void draw_maps(Graph& g, const Frame& frame, const RenderSettings& settings, const FrameParams& params,
                   TileInputs& in);
    // Levels and instances are marched by the compute shader whatever the tier: see docs/architecture.md.
    static bool traces(const Frame& frame, const RenderSettings& settings) {
        return settings.tier == Tier::Rt && !settings.analytic && frame.field && frame.instances.empty();
    }
    // Has the device what this tier needs?
    Result<void> check_tier(Tier tier) const;
    // What the passes of shadows want to know of the sun on particles.
    static void shade_particles(Graph& g, const Frame& frame, const FrameParams& params, const ParticleBins& bins,
                                ParticleHandles& out);
    // The parts of a tile behind which something lets light through.
    void find_through(Graph& g, const Frame& frame, const FrameParams& params, TileInputs& in) const;
    void add_times(const FrameTimes& times);
    // What the device complained about, as this call's error.
    Result<void> healthy() {
        if (fault.empty()) return {};
        return Error{std::exchange(fault, {}), device->lost() ? ErrorKind::OutOfMemory : ErrorKind::Failed};
    }
};

Result<void> Renderer::Impl::prepare() {
    device->set_error_sink([this](std::string_view sentence) {
        log::error("{}", sentence);
        if (fault.empty()) fault = sentence;
    });
    runner = std::make_unique<Runner>(*device);
    field = std::make_unique<GpuField>(*runner);
    instances = std::make_unique<GpuInstances>(*runner, *field);
    meshes = std::make_unique<GpuMeshes>(*runner);
    const std::span<const uint32_t> table = shade::ggx_albedo_table();
    auto buffer = device->create_buffer({.size = table.size_bytes(), .label = "ggx albedo"});
    if (!buffer) return buffer.error();
    ggx_table = *buffer;
    if (auto written = device->write_buffer(ggx_table, 0, std::as_bytes(table)); !written) return written;
    stats.device = device->info().name;
    auto state = device->create_buffer({.size = sizeof(shade::ExposureState), .label = "exposure"});
    if (!state) return state.error();
    exposure = *state;
    return healthy();
}

Result<void> Renderer::Impl::bring(const Frame& frame) {
    if (!frame.environment || !frame.environment_map || frame.environment_map == environment_map) return {};
    environment_map = nullptr;
    if (environment) {
        runner->forget(environment);
        device->destroy(environment);
        environment = {};
    }
    const std::span<const uint32_t> words = frame.environment_map->words;
    auto buffer = device->create_buffer({.size = words.size_bytes(), .label = "environment"});
    if (!buffer) return buffer.error();
    environment = *buffer;
    if (auto written = device->write_buffer(environment, 0, std::as_bytes(words)); !written) return written;
    environment_map = frame.environment_map;
    return {};
}

void Renderer::Impl::add_times(const FrameTimes& times) {
    stats.frame_ms += times.total_ms;
    for (const PassTime& pass : times.passes) {
        const std::string name = pass.name.substr(0, pass.name.find(" ["));  // without what a kernel is specialised for
        const auto same =
            std::find_if(stats.passes.begin(), stats.passes.end(), [&](const auto& p) { return p.first == name; });
        if (same != stats.passes.end()) {
            same->second += pass.ms;
            stats.pass_bytes[size_t(same - stats.passes.begin())].second += pass.bytes;
        } else {
            stats.passes.emplace_back(name, pass.ms);
            stats.pass_bytes.emplace_back(name, pass.bytes);
        }
    }
}

void Renderer::Impl::find_through(Graph& g, const Frame& frame, const FrameParams& params, TileInputs& in) const {
    if (!in.has_glass && !in.has_blends) return;
    std::vector<Box3> seen = meshes->blends();
    const float h = params.grid.voxel_size;
    for (const InstanceNode& n : instances->glass_nodes())
        if (n.instance != kNoInstance)
            seen.push_back({vec3{n.low_x, n.low_y, n.low_z} * h, vec3{n.high_x, n.high_y, n.high_z} * h});
    const PixelRect tile{params.tile_x, params.tile_y, params.tile_width, params.tile_height};
    for (const PixelRect& rect : through_rects(seen, params.camera, tile, kBentRays)) {
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
        part.tile_height *= 2;
        out.frame_of_parted = g.block(part);
        LightRects rects = (part.flags & kFrameAllLights) == 0
                               ? light_rects(frame.lights, params.camera, rect.x, rect.y, rect.width, rect.height)
                               : all_light_rects(frame.lights.size(), rect.width, rect.height);
        out.lights_of_tile = rects.most;
        if (rects.rects.empty()) rects.rects.emplace_back();
        out.light_rects = g.upload("light rects", std::span<const LightRect>(rects.rects));
    }
    if (in.through.empty()) return;
    LightRects all = all_light_rects(frame.lights.size(), params.tile_width, 2 * params.tile_height);
    if (all.rects.empty()) all.rects.emplace_back();
    in.all_light_rects = g.upload("light rects", std::span<const LightRect>(all.rects));
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
        const std::vector<MaterialRecord> materials = material_records(frame);
        in.materials = g.upload("materials", std::span<const MaterialRecord>(materials));
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
        LightRects rects = settings.cull_lights ? light_rects(frame.lights, params.camera, params.tile_x, params.tile_y,
                                                              params.tile_width, params.tile_height)
                                                : all_light_rects(lights.size(), params.tile_width, params.tile_height);
        in.lights_of_tile = rects.most;
        in.local_lights = rects.local;
        if (lights.empty()) lights.emplace_back(), rects.rects.emplace_back();
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
            stats.evaluations += sum;
            const std::string pass = counted.name().substr(0, counted.name().find(" evaluations"));
            const auto same = std::find_if(stats.pass_evaluations.begin(), stats.pass_evaluations.end(),
                                           [&](const auto& p) { return p.first == pass; });
            if (same != stats.pass_evaluations.end())
                same->second += sum;
            else
                stats.pass_evaluations.emplace_back(pass, sum);
        }
        stats.transient_peak_bytes = std::max(stats.transient_peak_bytes, runner->stats().peak_bytes);
        stats.transient_sum_bytes = std::max(stats.transient_sum_bytes, runner->stats().unaliased_bytes);
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
        add_times({.passes = {{.name = "refine", .ms = ms}}, .total_ms = ms});
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

Result<void> Renderer::Impl::check_tier(Tier tier) const {
    std::string_view lacks;
    if (tier == Tier::Rt && !device->caps().rt_pipeline) lacks = "tier rt: '{}' has no ray-tracing pipelines";
    if (tier == Tier::Mesh && !device->caps().mesh_shader) lacks = "tier mesh: '{}' has no mesh shaders";
    if (lacks.empty()) return {};
    return Error{formatted(lacks, device->info().name) + "; the compute tier draws the same picture",
                 ErrorKind::NoDevice};
}

Result<Picture> Renderer::Impl::render_merged(const Frame& frame, const RenderSettings& settings) {
    auto field_of_all = merged_field(frame);
    if (!field_of_all) return Error{"analytic: " + field_of_all.error().message, field_of_all.error().kind};
    Frame merged = frame;
    merged.field = std::move(*field_of_all);
    std::erase_if(merged.instances, [](const Instance& i) { return i.glass == 0; });
    // An object is one edit of the merged program: there is no code of its parts alone.
    const size_t dropped =
        std::erase_if(merged.outlines, [](const EditOutline& o) { return o.instance != UINT32_MAX; });
    if (dropped > 0) log::warn("analytic: outlines of {} edits of things that move are not drawn", dropped);
    auto picture = render(merged, settings);
    stats.instances = int(frame.instances.size());
    // Each is one edit of the merged program, whatever it is made of.
    for (const Instance& i : frame.instances)
        if (i.glass == 0) stats.edits += int(i.bricks->program().index.size()) - 1;
    return picture;
}

Result<Picture> Renderer::Impl::render(const Frame& frame, const RenderSettings& settings) {
    KILN_ASSERT(frame.field != nullptr || frame.levels != nullptr, "a Frame without a field; World::frame() makes one");
    const bool levels = frame.levels != nullptr;
    const sdf::Program& program = levels ? *frame.levels->program() : frame.field->program();
    fault.clear();
    if (live) live->apply(runner->pipelines());
    const uint64_t late = runner->pipelines().made_late();
    stats = {};
    stats.device = device->info().name;
    if (settings.analytic && levels)
        return Error{
            "analytic: a world of several levels is drawn from bricks; set field.levels to 1 to march its edits",
            ErrorKind::Usage};
    const auto solid = [](const Instance& i) { return i.glass == 0; };
    if (settings.analytic && std::any_of(frame.instances.begin(), frame.instances.end(), solid))
        return render_merged(frame, settings);
    if (settings.analytic) {
        const std::span<const sdf::Instruction> code = program.tape();
        if (std::any_of(code.begin(), code.end(), [](const sdf::Instruction& in) { return in.cpu_only(); }))
            return Error{
                "analytic: the GPU cannot run this world's program (a shape of the program's own, or a formula with "
                "more values than "
                "it has registers); draw it from bricks",
                ErrorKind::Usage};
    }
    if (auto can = check_tier(settings.tier); !can) return can.error();
    instances->reserve(frame.instances);
    if (auto updated = levels ? field->update(*frame.levels)
                              : field->update(frame.field, settings.atlas_by_copy ? Baker::Copy : Baker::Auto);
        !updated)
        return updated.error();
    if (auto updated = instances->update(frame.instances); !updated) return updated.error();
    if (traces(frame, settings)) {
        if (!boxes) boxes = std::make_unique<GpuBoxes>(*runner);
        if (auto updated = boxes->update(frame.field); !updated) return updated.error();
    }
    outlined = {};
    if (settings.view == View::Shaded && !frame.outlines.empty()) {
        if (tiles_of(settings, frame.lights.size()) == 1)
            outlined = outline_code(frame.outlines, program, frame.instances);
        else
            log::warn("outlines are not drawn: the picture is several tiles");
        if (outlined.left_out > 0)
            log::warn("outlines of {} edits are not drawn: the GPU cannot run their code", outlined.left_out);
    }
    auto params = frame_params(frame, settings, *field);
    if (!params) return params.error();
    lines = line_records(frame.lines, frame.camera.position);
    constexpr size_t kMostParticles = rhi::kMaxStorageBinding / sizeof(ParticleRecord);
    if (frame.particles.size() > kMostParticles)
        return Error{formatted("{} particles; a frame has at most {}", frame.particles.size(), kMostParticles),
                     ErrorKind::Usage};
    if (auto brought = meshes->update(frame, params->camera); !brought) return brought.error();
    instances->place(frame.instances, *params, frame.materials);
    moved = {};
    if (settings.taa && settings.view == View::Shaded) moved = moved_edits(frame, program, *params);
    const TileInputs switches = inputs(frame, settings);
    if (!lines.empty() && settings.view == View::Shaded && !switches.has_lines)
        log::warn("debug lines are not drawn: the picture is several tiles");
    if (auto warm = runner->pipelines().warm_up(frame_kernels(switches, settings.view), frame_raster_kernels(switches),
                                                frame_trace_kernels(switches));
        !warm)
        return warm.error();
    params->sky = shade::sky_params(frame);
    if (switches.cull_meshes) params->flags |= kFrameRayEnds;
    if ((params->flags & kFrameRefine) != 0) {
        float voxels = levels ? float(1u << (frame.levels->level_count() - 1)) : 1.0f;
        for (const InstanceRecord& i : instances->records()) voxels = std::max(voxels, 1 / i.voxels);
        params->refine_reach = kRefineMostVoxels * voxels;
    }
    const bool taa = settings.taa && settings.view == View::Shaded;
    if (taa && tiles_of(settings, frame.lights.size()) > 1)
        return Error{
            formatted("taa: a picture of {} x {} pixels is drawn in several tiles on this device; ask for fewer "
                      "pixels, or leave taa out",
                      settings.width, settings.height),
            ErrorKind::Usage};
    if (settings.cut) taa_frame = 0;
    jitter = taa && settings.taa_jitter ? jitter_of(taa_frame, jitter_round(settings.scale)) : vec2{};
    if (taa && settings.taa_jitter) params->camera = jittered(params->camera, jitter);
    if (auto brought = bring(frame); !brought) return brought.error();
    if (field->bake_ms() > 0) {
        stats.frame_ms = field->bake_ms();
        stats.passes.emplace_back("bake", field->bake_ms());
        stats.pass_bytes.emplace_back("bake", 0);
    }
    if (traces(frame, settings) && boxes->build_ms() > 0) {
        stats.frame_ms += boxes->build_ms();
        stats.passes.emplace_back("build boxes", boxes->build_ms());
        stats.pass_bytes.emplace_back("build boxes", 0);
    }
    Picture picture;
    picture.width = settings.width;
    picture.height = settings.height;
    picture.view = settings.view;
    const size_t pixels = size_t(settings.width) * size_t(settings.height);
    const bool shown_alone = settings.shown_alone && settings.view == View::Shaded && switches.develops;
    picture.srgb.resize(pixels * 4);
    if (!shown_alone) {
        picture.rgba.resize(pixels * 4);
        picture.depth.resize(pixels);
    }
    const auto [tile_width, tile_height] = tile_size(settings, frame.lights.size());  // with taa one, of all rays
    const auto [across, down] = rays_of(settings);
    if (!frame.camera.auto_exposure) eye = measured_exposure({}, frame.camera, 0, {});
    if (auto written = device->write_buffer(exposure, 0, std::as_bytes(std::span(&eye, 1))); !written)
        return written.error();
    for (int y = 0; y < down; y += tile_height) {
        for (int x = 0; x < across; x += tile_width) {
            FrameParams tile = *params;
            tile.tile_x = x;
            tile.tile_y = y;
            tile.tile_width = std::min(tile_width, across - x);
            tile.tile_height = std::min(tile_height, down - y);
            if (auto done = render_tile(frame, settings, tile, picture); !done) return done.error();
        }
    }
    if (settings.view == View::Shaded && !inputs(frame, settings).develops) {
        const auto start = std::chrono::steady_clock::now();
        eye = measured_exposure(picture.rgba, frame.camera, settings.elapsed, eye);
        develop(picture, frame.camera, eye);
        const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        add_times({.passes = {{.name = "develop", .ms = ms}}, .total_ms = ms});
    }
    taa_frame = taa ? taa_frame + 1 : 0;
    before = taa ? std::optional(Before{frame.camera, settings.width, settings.height}) : std::nullopt;
    stats.exposure = eye.multiplier;
    stats.bricks = levels ? int(frame.levels->bricks()) : int(frame.field->stats().bricks);
    stats.edits = int(program.index.size());
    for (const Instance& i : frame.instances) stats.edits += int(i.bricks->program().index.size());
    for (int level = 0; levels && level < frame.levels->level_count(); ++level) {
        const field::LevelCounts& c = frame.levels->counts(level);
        stats.levels.push_back({double(frame.levels->voxel_size(level)), c.bricks, c.missing_cells, c.refused_cells,
                                c.baked, c.evicted, c.entered_cells, c.skipped});
    }
    for (int level = int(stats.levels.size()); levels && level < frame.levels->all_levels(); ++level) {
        stats.net_bricks += frame.levels->counts(level).bricks;
        stats.net_baked += frame.levels->counts(level).baked;
    }
    stats.instances = int(frame.instances.size());
    stats.instance_bricks = instances->bricks();
    stats.instance_bricks_new = instances->bricks_new();
    stats.instances_ms = instances->place_ms();
    stats.atlas_bytes = field->atlas_bytes();
    stats.pipelines_created = runner->pipelines().made();
    stats.coarsened = frame.coarsened;
    stats.rays_across = across;
    stats.rays_down = down;
    if (switches.volume_count > 0) stats.lighting = "volumes";
    stats.march_tier = switches.rt ? "rt" : "compute";
    stats.mesh_tier = switches.mesh_shader ? "mesh" : "vertex";
    if (boxes) {
        stats.boxes = boxes->boxes();
        stats.box_tree_builds = boxes->builds();
        stats.box_tree_bytes = boxes->bytes();
    }
    stats.triangles = meshes->triangles();
    stats.clusters = uint64_t{meshes->clusters_in_sight()} * uint64_t(tiles_of(settings, frame.lights.size()));
    if (!switches.cull_meshes) {
        stats.triangles_drawn = meshes->triangles_in_sight();
        stats.clusters_late = stats.clusters;
    }
    if (runner->pipelines().made_late() != late)
        log::warn("{} pipelines were made during a frame", runner->pipelines().made_late() - late);
    if (auto ok = healthy(); !ok) return ok.error();
    return picture;
}

Renderer::Renderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::create(const RendererOptions& options) {
    rhi::WindowSystem window;
    if (options.window) window = {options.window->extensions, options.window->make};
    auto device = rhi::create_device(
        {.device = options.device, .validation = options.validation, .window = options.window ? &window : nullptr});
    if (!device) return device.error();
    auto impl = std::make_unique<Impl>();
    impl->device = std::move(*device);
    if (auto ready = impl->prepare(); !ready) return ready.error();
    if (options.window) impl->presenter = std::make_unique<Presenter>(*impl->device, *options.window);
    auto live = LiveShaders::from_environment();
    if (!live) return live.error();
    impl->live = std::move(*live);
    return Renderer(std::move(impl));
}

Result<Picture> Renderer::render(const Frame& frame, const RenderSettings& settings) {
    return impl_->render(frame, settings);
}

Result<kiln::Shown> Renderer::show(const Picture& picture, int window_width, int window_height, bool wait) {
    if (!impl_->presenter)
        return Error{"show: the renderer was made without a window (RendererOptions::window)", ErrorKind::Usage};
    impl_->fault.clear();
    auto shown = impl_->presenter->show(picture, window_width, window_height, wait);
    if (!shown) return shown;
    if (auto ok = impl_->healthy(); !ok) return ok.error();
    return shown;
}

const RenderStats& Renderer::stats() const { return impl_->stats; }

Quality Renderer::best_quality() const {
    switch (impl_->device->info().kind) {
    case rhi::DeviceKind::Cpu:
        return Quality::Medium;
    case rhi::DeviceKind::Discrete:
        return Quality::Ultra;
    default:
        return Quality::High;
    }
}

void set_quality(RenderSettings& settings, Quality quality) {
    settings.refine = quality >= Quality::Medium;
    settings.soft_shadows = quality >= Quality::High;
    settings.mesh_shadows = quality >= Quality::High ? MeshShadows::Rays : MeshShadows::Cascades;
    settings.transparent_layers = quality >= Quality::High ? RenderSettings().transparent_layers : 2;
    settings.glass_bounces = quality >= Quality::High ? RenderSettings().glass_bounces : 0;
    settings.taa = quality >= Quality::Ultra && settings.view == View::Shaded;
}

std::vector<DeviceInfo> devices() {
    std::vector<DeviceInfo> out;
    auto found = rhi::list_devices();
    if (!found) return out;
    for (const rhi::DeviceInfo& d : *found) {
        out.push_back({.name = d.name,
                       .backend = d.backend,
                       .driver = d.driver,
                       .kind = std::string(rhi::name(d.kind)),
                       .api_version = d.api,
                       .usable = d.usable,
                       .why_not = d.unusable_because,
                       .mesh_shader = d.mesh_shader,
                       .rt_pipeline = d.rt_pipeline});
    }
    return out;
}

}  // namespace kiln
