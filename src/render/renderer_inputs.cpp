// SPDX-License-Identifier: MIT
// The switches of a frame: what its passes are told of settings and of what is there; who has shadow maps; how large tiles are.
#include "render/renderer_impl.h"

#include "render/frame.h"
#include "render/merged.h"
#include "render/passes/cluster.gpu.h"
#include "render/temporal.h"

#include <algorithm>

namespace kiln {

using namespace render;

Renderer::Impl::TileSize Renderer::Impl::tile_size(const RenderSettings& settings, size_t lights) const {
    const size_t masks = rhi::kMaxStorageBinding / ((lights / 32 + 1) * 4) / 2 * size_t(kClusterSide * kClusterSide);
    const int most = int(std::min(size_t(refines_on_host() ? kTilePixels : kTilePixelsOfGpu), masks));
    const int width = std::min(settings.width, kTileWidth);
    return {width, std::clamp(most / width, 1, settings.height)};
}

int Renderer::Impl::tiles_of(const RenderSettings& settings, size_t lights) const {
    const auto [width, height] = tile_size(settings, lights);
    return ((settings.width + width - 1) / width) * ((settings.height + height - 1) / height);
}

TileInputs Renderer::Impl::inputs(const Frame& frame, const RenderSettings& settings) const {
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
    in.has_history = before && !settings.cut && before->width == settings.width && before->height == settings.height &&
                     follows(frame.camera, before->camera);
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
                   std::any_of(frame.instances.begin(), frame.instances.end(),
                               [](const Instance& i) { return i.glass != 0 && i.bricks->field().stats().bricks > 0; });
    in.has_particles = settings.view == View::Shaded && !frame.particles.empty();
    in.has_blends = in.transparent_layers > 0 && !meshes->blends().empty();
    const bool outlines =
        settings.view == View::Shaded && !meshes->outlined().empty() && tiles_of(settings, frame.lights.size()) == 1;
    in.outlines_meshes = outlines && !settings.outline_hulls;
    in.outline_hidden = settings.outline_hidden;
    in.outline_hulls = outlines && settings.outline_hulls;
    in.has_lines = !lines.empty() && settings.view == View::Shaded && in.develops;
    return in;
}

void Renderer::Impl::choose_maps(const Frame& frame, const RenderSettings& settings, TileInputs& in) const {
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

LampFaces Renderer::Impl::faces_of_lamps(const Frame& frame) const {
    uint64_t clusters = 1;
    for (const MeshCaster& caster : meshes->casters()) clusters += (caster.triangles + kMeshCluster - 1) / kMeshCluster;
    const uint64_t most = rhi::kMaxStorageBinding / (clusters * sizeof(MeshClusterRef));
    return lamp_faces(frame.lights, frame.camera.position, uint32_t(std::min<uint64_t>(most, kMostFaces)));
}

}  // namespace kiln
