// SPDX-License-Identifier: MIT
#include "render/frame.h"

#include "base/format.h"
#include "render/lib/pack.h"
#include "render/passes/ao.h"
#include "render/passes/cascades.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"
#include "render/passes/lamps.h"
#include "render/passes/light_volumes.h"
#include "render/passes/upscale.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace kiln::render {

namespace {

constexpr int kLargestSide = 16384;

bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

std::pair<int, int> rays_of(const RenderSettings& settings) {
    const auto of = [&](int pixels) {
        return std::clamp(int(std::lround(double(settings.scale) * pixels)), 1, std::max(pixels, 1));
    };
    return {of(settings.width), of(settings.height)};
}

uint32_t ao_every(const RenderSettings& settings) {
    const bool shown =
        settings.view == View::Ao || (settings.view == View::Shaded && settings.ao != AmbientOcclusion::Off);
    if (!shown) return 0;
    return settings.ao == AmbientOcclusion::Half ? 2 : 1;
}

shade::CameraParams of_rays(shade::CameraParams camera, int across, int down) {
    camera.right.w = 1 / float(across);
    camera.up.w = 1 / float(down);
    return camera;
}

Result<FrameParams> frame_params(const Frame& frame, const RenderSettings& settings, const GpuField& field) {
    int width = settings.width, height = settings.height;
    if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide) {
        return Error{formatted("a picture of {} x {} pixels; each side is 1 to {}", width, height, kLargestSide),
                     ErrorKind::Usage};
    }
    const Camera& camera = frame.camera;
    if (!finite(camera.position) || !finite(camera.target) || !finite(camera.up)) {
        return Error{"the camera's position, target and up must be finite numbers", ErrorKind::Usage};
    }
    if (!(camera.fov_y_deg > 0 && camera.fov_y_deg < 180)) {
        return Error{formatted("a camera with fov_y_deg {}; it is above 0 and below 180", camera.fov_y_deg),
                     ErrorKind::Usage};
    }
    if (!(camera.exposure > 0) || !std::isfinite(camera.exposure)) {
        return Error{formatted("a camera with exposure {}; it is above 0", camera.exposure), ErrorKind::Usage};
    }
    if (!(camera.bloom >= 0 && camera.bloom <= 1))
        return Error{formatted("a camera with bloom {}; it is a share, 0 to 1", camera.bloom), ErrorKind::Usage};
    if (!(camera.bloom_size > 0 && camera.bloom_size <= 1)) {
        return Error{formatted("a camera with bloom_size {}; it is a share of the height, above 0 and at most 1",
                               camera.bloom_size),
                     ErrorKind::Usage};
    }
    if (!(camera.bloom_threshold >= 0)) {
        return Error{formatted("a camera with bloom_threshold {}; it is at least 0", camera.bloom_threshold),
                     ErrorKind::Usage};
    }
    if (!(settings.scale >= 0.25f && settings.scale <= 1))
        return Error{formatted("scale {}; it is from 0.25 to 1", settings.scale), ErrorKind::Usage};
    if (settings.scale < 1 && !(settings.taa && settings.view == View::Shaded))
        return Error{"scale: a picture of fewer rays is made whole over time; ask for taa, on a shaded picture",
                     ErrorKind::Usage};
    if (settings.scale < 1 && settings.outline_hulls)
        return Error{"scale: outlines by hulls are drawn at the size of the rays; leave one of them out",
                     ErrorKind::Usage};
    const int texels = settings.shadow_map_side;
    if (texels != 0 && (texels < 64 || texels > 8192 || (texels & (texels - 1)) != 0)) {
        return Error{formatted("shadow_map_side {}; it is 0, or a power of two from 64 to 8192", texels),
                     ErrorKind::Usage};
    }
    if (!(settings.elapsed >= 0))
        return Error{formatted("elapsed {} s; it is at least 0", settings.elapsed), ErrorKind::Usage};
    const vec3 look = camera.target - camera.position;
    if (!(dot(look, look) > 0))
        return Error{"the camera's target is its position; it must be elsewhere", ErrorKind::Usage};

    FrameParams p{};
    p.grid = field.grid();
    const double h = p.grid.voxel_size;
    const double eye[3] = {camera.position.x / h, camera.position.y / h, camera.position.z / h};
    int whole[3];
    float part[3];
    for (int i = 0; i < 3; ++i) {
        if (std::fabs(eye[i]) > 1e9)
            return Error{"the camera is more than 1e9 voxels from the origin", ErrorKind::Usage};
        whole[i] = int(std::floor(eye[i]));
        part[i] = float(eye[i] - std::floor(eye[i]));
    }
    p.eye_x = whole[0], p.eye_y = whole[1], p.eye_z = whole[2];
    p.eye_part_x = part[0], p.eye_part_y = part[1], p.eye_part_z = part[2];
    p.distance_scale = field.distance_scale();

    p.camera = shade::camera_params(camera, width, height);
    if (settings.scale < 1) {
        std::tie(width, height) = rays_of(settings);
        p.camera = of_rays(p.camera, width, height);
    }
    p.pixel_angle = 2.0f * length({p.camera.up.x, p.camera.up.y, p.camera.up.z}) / float(height);

    p.width = p.tile_width = width;
    p.height = p.tile_height = height;
    p.flags = (settings.accelerate ? kFrameAccelerate : 0u) | (settings.analytic ? kFrameAnalytic : 0u) |
              (settings.analytic && settings.unpruned ? kFrameUnpruned : 0u) |
              (settings.refine && !settings.analytic ? kFrameRefine : 0u) |
              (settings.cull_lights ? 0u : kFrameAllLights) | (ao_every(settings) != 0 ? kFrameAmbient : 0u) |
              (field.outside_is_concave() ? kFrameOutsideConcave : 0u);
    p.outside_first = field.outside_first();
    std::ranges::copy(field.planes(), p.planes);
    p.outside_count = field.outside_count();
    const Box3& outside = field.outside_box();
    const auto voxels = [&](float metres) { return std::clamp(metres / p.grid.voxel_size, -1e30f, 1e30f); };
    p.outside_low_x = voxels(outside.min.x), p.outside_high_x = voxels(outside.max.x);
    p.outside_low_y = voxels(outside.min.y), p.outside_high_y = voxels(outside.max.y);
    p.outside_low_z = voxels(outside.min.z), p.outside_high_z = voxels(outside.max.z);
    p.program_count = field.program_count();
    p.params_first = field.params_first();
    p.light_count = uint32_t(frame.lights.size());
    p.view = uint32_t(settings.view);
    p.material_count = uint32_t(std::max<size_t>(frame.materials.size(), 1));
    return p;
}

std::vector<MaterialRecord> material_records(const Frame& frame) {
    std::vector<MaterialRecord> out;
    for (const Material& m : frame.materials) {
        out.push_back({m.base_color.x, m.base_color.y, m.base_color.z, m.roughness, m.emissive.x, m.emissive.y,
                       m.emissive.z, m.metallic});
    }
    if (out.empty()) {
        const Material m;
        out.push_back({m.base_color.x, m.base_color.y, m.base_color.z, m.roughness, 0, 0, 0, m.metallic});
    }
    return out;
}

namespace {

// Four words a pixel as an image. Copies want rows of whole 256 bytes.
Image image_of_words(Graph& g, std::string_view name, rhi::Extent size, std::span<const uint32_t> words) {
    const size_t row = size_t(size.width) * 4, padded = (row + 63) / 64 * 64;
    std::vector<uint32_t> rows(padded * size.height);
    for (size_t y = 0; y < size.height; ++y)
        std::copy_n(words.begin() + ptrdiff_t(y * row), row, rows.begin() + ptrdiff_t(y * padded));
    Image out = g.create(name, {.size = size, .format = rhi::Format::Rgba32Uint});
    const CopyRegion all{.bytes_per_row = uint32_t(padded * 4), .rows_per_layer = size.height, .size = size};
    g.copy(g.upload(name, std::span<const uint32_t>(rows)), out, std::span(&all, 1));
    return out;
}

// `refined`: none where march's words are good enough.
Surface find_surface(Graph& g, const TileInputs& in, const Image& words, const Image* refined, const Image& mesh_ids,
                     TileResult& out) {
    const Image& asked = refined != nullptr ? *refined : words;
    Image seen = words;
    if (in.has_meshes)
        seen = see_meshes(g, in, mesh_ids, words, asked);
    else if (refined != nullptr)
        seen = settle(g, in, words, asked);
    Surface surface = resolve(g, in, seen, asked);
    resolve_instances(g, in, asked, surface);
    if (in.has_meshes) resolve_meshes(g, in, surface);
    if (in.ao_every > 0) out.evaluations.push_back(g.readback(occlude(g, in, surface)));
    return surface;
}

// From the light of what is solid to what comes back.
void finish(Graph& g, const TileInputs& in, const Surface& surface, Image depth, Image radiance, TileResult& out) {
    Front front = draw_through(g, in, surface, depth, radiance);
    Image moved = in.taa ? motion(g, in, front.seen) : radiance;  // not read without
    draw_particles(g, in, depth, front, radiance, moved);
    if (in.taa && !in.upscales) radiance = taa(g, in, radiance, front.depth, moved);
    if (in.upscales) {
        radiance = taa_up(g, in, radiance, front.depth, moved);
        depth = upscale_depth(g, in, depth);
    }
    out.radiance = g.readback(radiance);
    out.depth = g.readback(depth);
    if (!in.develops) return;
    Buffer exposure = in.exposure;
    if (in.camera.auto_exposure) expose(g, radiance, exposure, in.elapsed, in.camera.exposure);
    const Image glow = in.camera.bloom > 0 ? bloom(g, radiance, exposure, in.camera) : radiance;
    Image shown = tonemap(g, radiance, glow, exposure, in.camera);
    if (in.outline_hulls) shown = draw_hulls(g, in, surface.seen, depth, shown);
    if (in.outline_count > 0 || in.outlines_meshes) shown = outline(g, in, surface.seen, shown);
    shown = draw_lines(g, in, depth, shown);
    out.shown = g.readback(shown);
    out.exposure = g.readback(exposure);
}

TileResult record_shading(Graph& g, const TileInputs& in, View wanted, const Image& words, const Image* refined,
                          const Image& mesh_ids) {
    TileResult out;
    const Surface surface = find_surface(g, in, words, refined, mesh_ids, out);
    Image depth = depth_of(g, in, surface.seen);
    if (wanted == View::Shaded) {
        finish(g, in, surface, depth, light(g, in, surface, depth), out);
        return out;
    }
    const Shown shown = view(g, in, surface, depth);
    out.radiance = g.readback(shown.values);
    out.shown = g.readback(shown.bytes);
    out.depth = g.readback(depth);
    return out;
}

// One band after the other, each into its rows of depth and radiance. `find`: the words of march and of refine of a band with these inputs,
// which tells whether there are any of refine.
template <typename Find>
TileResult record_bands(Graph& g, const TileInputs& in, Find&& find) {
    TileResult out;
    Image depth = g.create("depth", {.size = in.size, .format = rhi::Format::R32Float});
    Image radiance = g.create("radiance", {.size = in.size, .format = rhi::Format::Rgba16Float});
    for (const Band& band : in.bands) {
        TileInputs of_band = in;
        of_band.frame = band.frame;
        of_band.size = band.size;
        of_band.light_rects = band.light_rects;
        of_band.lights_of_tile = band.lights_of_tile;
        Image words, refined;
        const bool moved = find(of_band, band, words, refined, out);
        const Surface surface = find_surface(g, of_band, words, moved ? &refined : nullptr, {}, out);
        depth_of(g, of_band, surface.seen, depth);
        light(g, of_band, surface, depth, radiance);
    }
    finish(g, in, {}, depth, radiance, out);
    return out;
}

}  // namespace

namespace {

struct Seen {
    Image words, mesh_ids;
    std::vector<Readback> evaluations, mesh_numbers;
};

Seen record_seen(Graph& g, const TileInputs& in) {
    MeshesEarly early;
    if (in.cull_meshes) early = draw_early(g, in);
    const Visibility seen = march(g, in, in.cull_meshes ? &early.drawn.depth : nullptr);
    Seen out{seen.words, {}, {}, {}};
    for (const Buffer& counted : seen.evaluations) out.evaluations.push_back(g.readback(counted));
    if (in.cull_meshes) {
        const MeshesSeen meshes = draw_late(g, in, early, seen.words);
        out.mesh_ids = meshes.ids;
        for (const Buffer& numbers : meshes.numbers) out.mesh_numbers.push_back(g.readback(numbers));
    }
    return out;
}

}  // namespace

TileResult record_tile(Graph& g, const TileInputs& in, View wanted) {
    if (!in.bands.empty()) {
        return record_bands(
            g, in, [&](const TileInputs& of_band, const Band&, Image& words, Image& refined, TileResult& out) {
                const Seen seen = record_seen(g, of_band);
                words = seen.words;
                out.evaluations.insert(out.evaluations.end(), seen.evaluations.begin(), seen.evaluations.end());
                if (!in.refine) return false;
                refined = refine(g, of_band, words);
                refine_instances(g, of_band, words, refined);
                return true;
            });
    }
    Seen seen = record_seen(g, in);
    Image refined;
    if (in.refine) {
        refined = refine(g, in, seen.words);
        refine_instances(g, in, seen.words, refined);
    }
    if (in.has_meshes && !in.cull_meshes) seen.mesh_ids = draw_clusters(g, in).ids;
    TileResult out = record_shading(g, in, wanted, seen.words, in.refine ? &refined : nullptr, seen.mesh_ids);
    out.evaluations.insert(out.evaluations.begin(), seen.evaluations.begin(), seen.evaluations.end());
    out.mesh_numbers = std::move(seen.mesh_numbers);
    return out;
}

TileSeen record_visibility(Graph& g, const TileInputs& in) {
    Seen seen = record_seen(g, in);
    TileSeen out{g.readback(seen.words), {}, std::move(seen.evaluations), std::move(seen.mesh_numbers)};
    if (in.cull_meshes) out.mesh_ids = g.readback(seen.mesh_ids);
    return out;
}

TileResult record_tile(Graph& g, const TileInputs& in, View wanted, std::span<const uint32_t> visibility,
                       std::span<const uint32_t> refined, std::span<const uint32_t> mesh_ids) {
    if (!in.bands.empty()) {
        return record_bands(g, in, [&](const TileInputs&, const Band& band, Image& words, Image& moved, TileResult&) {
            const auto rows = [&](std::span<const uint32_t> all) {
                const size_t row = size_t{4} * in.size.width;
                return all.subspan(band.y * row, band.size.height * row);
            };
            words = image_of_words(g, "visibility", band.size, rows(visibility));
            moved = image_of_words(g, "refined", band.size, rows(refined));
            return true;
        });
    }
    const Image words = image_of_words(g, "visibility", in.size, visibility);
    Image ids;
    if (in.has_meshes)
        ids = mesh_ids.empty() ? draw_clusters(g, in).ids : image_of_words(g, "mesh ids", in.size, mesh_ids);
    const Image asked = image_of_words(g, "refined", in.size, refined);
    return record_shading(g, in, wanted, words, &asked, ids);
}

std::vector<const Kernel*> frame_kernels(const TileInputs& in, View view) {
    std::vector<const Kernel*> out;
    if (!in.analytic && (!in.rt || in.has_blends)) out.push_back(&march_kernel(in));
    if (in.exact) out.push_back(&specialised(kMarchExact, in.use));
    if (in.refine) out.push_back(&specialised(kRefine, in.use_of_bricks));
    out.insert(out.end(), {&kSettle, &resolve_kernel(in), &kDepthOf});
    instance_kernels(in, view == View::Shaded, out);
    if (in.has_meshes) out.insert(out.end(), {&kMeshSee, &kMeshResolve});
    if (in.cull_meshes) out.insert(out.end(), {&kDepthPyramid, &kDepthPyramidRest, &kMeshCull, &kMeshPack, &kMeshPick});
    ao_kernels(in, out);
    if (view != View::Shaded) {
        out.push_back(&kView);
        return out;
    }
    out.push_back(&kCluster);
    out.push_back(&shadow_kernel(in));
    if (in.has_cascades) out.insert(out.end(), {&kCascadeCull, &kShadowCascades});
    if (in.has_lamps) out.insert(out.end(), {&kLampCull, &kShadowLamps});
    if (in.has_meshes && !in.maps_alone) out.push_back(&mesh_shadow_kernel(in));
    if (in.volume_count > 0) out.push_back(&light_over_kernel(in));
    if (in.volume_count == 0 || in.has_glass || in.has_blends) out.push_back(&light_kernel(in));
    through_kernels(in, out);
    if (in.has_particles)
        out.insert(out.end(), {&kParticles, &kParticlesStart, in.image_sky ? &kParticlesLightImage : &kParticlesLight});
    if (in.taa) out.insert(out.end(), {&kMotion, in.upscales ? &kTaaUp : &kTaa});
    if (in.upscales) out.push_back(&kUpDepth);
    if (in.taa && in.moved.owners.count > 0) out.push_back(&specialised(kOutlineMask, in.moved.owners.use));
    if (!in.develops) return out;
    if (in.camera.auto_exposure) out.insert(out.end(), {&kExposureCount, &kExposureAdapt});
    if (in.camera.bloom > 0 && in.camera.bloom_kind == BloomKind::Pyramid)
        out.insert(out.end(), {&kBloomDown, &kBloomUp});
    if (in.camera.bloom > 0 && in.camera.bloom_kind == BloomKind::Gaussian) out.push_back(&kBloomBlur);
    out.push_back(&kTonemap);
    if (in.outline_count > 0) out.push_back(&specialised(kOutlineMask, in.use_of_outlines));
    if (in.outline_count > 0 || in.outlines_meshes) out.insert(out.end(), {&kOutlineFlood, &kOutlineDraw});
    if (in.outlines_meshes || in.outline_hulls) out.push_back(&kOutlineMeshes);
    if (in.outline_hidden && in.outline_count > 0) out.push_back(&specialised(kOutlineHidden, in.use_of_outlines));
    if (in.outline_hidden && in.outlines_meshes) out.push_back(&kOutlineHiddenMeshes);
    if (in.upscales && (in.outline_count > 0 || in.outlines_meshes)) out.push_back(&kUpOwners);
    if (in.has_lines || in.outline_hulls) out.push_back(&kLinesOver);
    return out;
}

std::vector<const RasterKernel*> frame_raster_kernels(const TileInputs& in) {
    std::vector<const RasterKernel*> out;
    if (in.has_meshes && in.mesh_shader) out = {&kMeshOneSidedGroups, &kMeshDoubleSidedGroups, &kMeshMaskedGroups};
    if (in.has_meshes && !in.mesh_shader) out = {&kMeshOneSided, &kMeshDoubleSidedDraw, &kMeshMasked};
    if (in.has_lines) out.push_back(&kLines);
    if (in.outline_hulls) out.push_back(&kOutlineHull);
    if (in.outline_hidden && in.outlines_meshes && in.mesh_shader) out.push_back(&kMeshDoubleSidedDraw);
    if (in.volume_count > 0) out.push_back(&light_volume_kernel(in));
    if (in.has_cascades) out.push_back(&kCascade);
    if (in.has_cascades && in.mesh_holes) out.push_back(&kCascadeMask);
    if (in.has_lamps) out.push_back(&kLampMap);
    if (in.has_lamps && in.mesh_holes) out.push_back(&kLampMapMask);
    return out;
}

std::vector<const TraceKernel*> frame_trace_kernels(const TileInputs& in) {
    if (!in.rt) return {};
    return {&kMarchTrace};
}

}  // namespace kiln::render
