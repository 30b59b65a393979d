// SPDX-License-Identifier: MIT
// What a Renderer holds between pictures. renderer.cpp decides what a picture takes and cuts it into tiles, renderer_inputs.cpp what their passes
// are told, and renderer_tile.cpp draws one.
#pragma once

#include <kiln/renderer.h>

#include "render/edit_motion.h"
#include "render/gpu_boxes.h"
#include "render/gpu_field.h"
#include "render/gpu_instances.h"
#include "render/gpu_materials.h"
#include "render/gpu_meshes.h"
#include "render/graph_runner.h"
#include "render/lamp_faces.h"
#include "render/lens.h"
#include "render/lib/environment_map.h"
#include "render/live_shaders.h"
#include "render/particle_bins.h"
#include "render/passes/passes.h"
#include "render/presenter.h"
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
// Glass that stands apart has a part of its own where that spares as many bent rays as this: of about a hundred passes more a device that is a CPU
// feels little, and each pixel costs it as much as a pixel with glass does.
inline constexpr int kPixelsApart = 1 << 10;
inline constexpr int kPixelsApartOfGpu = 1 << 18;

}  // namespace render

struct Renderer::Impl {
    std::unique_ptr<rhi::Device> device;
    std::unique_ptr<render::Runner> runner;
    std::unique_ptr<render::GpuField> field;
    std::unique_ptr<render::GpuInstances> instances;
    std::unique_ptr<render::GpuMeshes> meshes;
    std::unique_ptr<render::GpuMaterials> materials;
    std::unique_ptr<render::GpuBoxes> boxes;       // once a frame asked for the tier
    std::unique_ptr<render::LiveShaders> live;     // where KILN_LIVE_SHADERS asks for it
    std::unique_ptr<render::Presenter> presenter;  // where there is a window
    std::string fault;                             // first message of the device since the last call
    rhi::BufferHandle ggx_table;
    rhi::BufferHandle environment;
    rhi::BufferHandle exposure;
    render::shade::ExposureState eye{};  // what is in it, and stays from picture to picture
    std::shared_ptr<const render::shade::EnvironmentMap> environment_map;  // what is in the buffer
    RenderStats stats;
    // The picture before, with taa.
    struct Before {
        Camera camera;
        int width, height;
    };
    std::optional<Before> before;
    uint64_t taa_frame = 0;
    vec2 jitter{};                          // of the frame
    render::OutlineCode outlined;           // of the frame
    render::MovedEdits moved;               // likewise, with taa
    std::vector<render::LineRecord> lines;  // likewise

    ~Impl() {
        presenter.reset();
        instances.reset();
        boxes.reset();
        field.reset();
        meshes.reset();
        materials.reset();
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
    Result<void> render_tile(const Frame& frame, const RenderSettings& settings, const render::FrameParams& params,
                             Picture& picture);
    // Software devices run the tape many times slower than our SIMD.
    bool refines_on_host() const { return device->info().kind == rhi::DeviceKind::Cpu; }
    struct TileSize {
        int width, height;
    };
    // Tiles are smaller where many lights' bits would not fit a binding.
    TileSize tile_size(const RenderSettings& settings, size_t lights) const;
    int tiles_of(const RenderSettings& settings, size_t lights) const;
    // The switches of a frame; its resources are still to come.
    render::TileInputs inputs(const Frame& frame, const RenderSettings& settings) const;
    bool culls_meshes(const RenderSettings& settings) const {
        return settings.cull_meshes && settings.accelerate && meshes->clusters_in_sight() > 0;
    }
    static bool is_somewhere(const Light& light) { return light.kind != Light::Kind::Directional; }
    // Maps are for the first sun, and for the first lamps and spots.
    void choose_maps(const Frame& frame, const RenderSettings& settings, render::TileInputs& in) const;
    // As many as a buffer has room for with a list of all casters each.
    render::LampFaces faces_of_lamps(const Frame& frame) const;
    void draw_maps(render::Graph& g, const Frame& frame, const RenderSettings& settings,
                   const render::FrameParams& params, render::TileInputs& in);
    // Levels and instances are marched by the compute shader whatever the tier: see docs/architecture.md.
    static bool traces(const Frame& frame, const RenderSettings& settings) {
        return settings.tier == Tier::Rt && !settings.analytic && frame.field && frame.instances.empty();
    }
    // Has the device what this tier needs?
    Result<void> check_tier(Tier tier) const;
    // What the passes of shadows want to know of the sun on particles.
    static void shade_particles(render::Graph& g, const Frame& frame, const render::FrameParams& params,
                                const render::ParticleBins& bins, render::ParticleHandles& out);
    // The parts of a tile behind which something lets light through.
    void find_through(render::Graph& g, const Frame& frame, const render::FrameParams& params,
                      render::TileInputs& in) const;
    // Rows that a frame's passes may draw one after the other; they want it whole: none.
    void find_bands(render::Graph& g, const Frame& frame, const render::FrameParams& params,
                    render::TileInputs& in) const;
    void add_times(const render::FrameTimes& times);
    // What the device complained about, as this call's error.
    Result<void> healthy() {
        if (fault.empty()) return {};
        return Error{std::exchange(fault, {}), device->lost() ? ErrorKind::OutOfMemory : ErrorKind::Failed};
    }
};

}  // namespace kiln
