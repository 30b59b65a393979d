// SPDX-License-Identifier: MIT
// One tile of a frame as passes on a graph, and what comes back from it.
#pragma once

#include "render/passes/passes.h"

#include <kiln/renderer.h>

#include <utility>

namespace kiln::render {

// Rays across and down: fewer than pixels where settings.scale is below 1.
std::pair<int, int> rays_of(const RenderSettings& settings);
// TileInputs::ao_every of a picture.
uint32_t ao_every(const RenderSettings& settings);
// The camera with so many.
shade::CameraParams of_rays(shade::CameraParams camera, int across, int down);

// Parameters of a frame from what its user asked for; the tile's fields are the whole picture.
// Errors (kind Usage) for sizes and cameras that make no picture.
Result<FrameParams> frame_params(const Frame& frame, const RenderSettings& settings, const GpuField& field);
std::vector<MaterialRecord> material_records(const Frame& frame);

struct TileResult {
    Readback radiance;  // 4 halves a pixel; of a view: 4 floats
    Readback shown;     // 4 bytes a pixel; of a shaded tile only where TileInputs::develops
    Readback depth;     // a float a pixel
    Readback exposure;  // ExposureState, with `shown`, of a shaded tile
    std::vector<Readback> evaluations;
    std::vector<Readback> mesh_numbers;  // kMeshDrawnWords of each phase, with TileInputs::cull_meshes
};
TileResult record_tile(Graph& g, const TileInputs& in, View view);

// The same in two graphs, where the host refines between them.
struct TileSeen {
    Readback visibility;  // 4 words a pixel
    Readback mesh_ids;    // likewise, with TileInputs::cull_meshes
    std::vector<Readback> evaluations;
    std::vector<Readback> mesh_numbers;
};
TileSeen record_visibility(Graph& g, const TileInputs& in);
TileResult record_tile(Graph& g, const TileInputs& in, View view, std::span<const uint32_t> visibility,
                       std::span<const uint32_t> refined, std::span<const uint32_t> mesh_ids);

// Kernels of a frame, for warm-up.
std::vector<const Kernel*> frame_kernels(const TileInputs& in, View view);
std::vector<const RasterKernel*> frame_raster_kernels(const TileInputs& in);
std::vector<const TraceKernel*> frame_trace_kernels(const TileInputs& in);

}  // namespace kiln::render
