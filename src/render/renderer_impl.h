// SPDX-License-Identifier: MIT
// What a Renderer holds between pictures. renderer.cpp decides what a picture takes and cuts it into tiles; renderer_tile.cpp draws one.
#pragma once

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

namespace kiln {

namespace render {

// Tiles bound the memory of a frame's images (about 100 bytes a pixel), whatever the size of the picture. A GPU takes 3840 x 2160 whole.
inline constexpr int kTileWidth = 4096;
inline constexpr int kTilePixels = 1 << 21;
inline constexpr int kTilePixelsOfGpu = 9 << 20;
// Pixels whose rays may be bent at once: a buffer of twice as many is within a binding.
inline constexpr int kBentRays = 1 << 20;
static_assert(2 * uint64_t{kBentRays} * sizeof(FrameRay) <= rhi::kMaxStorageBinding);

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
        in.ao_every = ao_every(settings);
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

}  // namespace kiln
