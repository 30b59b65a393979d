// SPDX-License-Identifier: MIT
#include "render/renderer_impl.h"

#include "base/assert.h"
#include "base/format.h"
#include "base/log.h"
#include "field/field.h"
#include "render/frame.h"
#include "render/lib/ggx_table.h"
#include "render/lib/pack.h"
#include "render/merged.h"
#include "render/passes/forward.h"
#include "render/passes/refine.gpu.h"
#include "render/picture.h"
#include "render/temporal.h"

#include <algorithm>
#include <chrono>

namespace kiln {

using namespace render;

Result<void> Renderer::Impl::prepare() {
    device->set_error_sink([this](std::string_view sentence) {
        log::error("{}", sentence);
        if (fault.empty()) fault = sentence;
    });
    runner = std::make_unique<Runner>(*device);
    field = std::make_unique<GpuField>(*runner);
    instances = std::make_unique<GpuInstances>(*runner, *field);
    meshes = std::make_unique<GpuMeshes>(*runner);
    materials = std::make_unique<GpuMaterials>(*runner);
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
    stats.side_by_side_ms += times.side_by_side_ms;
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
    if (auto brought = materials->update(material_records(frame)); !brought) return brought.error();
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
    settings.ao = quality >= Quality::High ? AmbientOcclusion::Full : AmbientOcclusion::Off;
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
