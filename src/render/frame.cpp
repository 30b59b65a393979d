// SPDX-License-Identifier: MIT
#include "render/frame.h"

#include "base/format.h"
#include "render/lib/pack.h"

#include <cmath>

namespace kiln::render {

namespace {

constexpr int kLargestSide = 16384;

bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Result<FrameParams> frame_params(const Frame& frame, const RenderSettings& settings, const GpuField& field) {
    const auto [width, height] = std::pair{settings.width, settings.height};
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
    p.pixel_angle = 2.0f * length({p.camera.up.x, p.camera.up.y, p.camera.up.z}) / float(height);

    p.width = p.tile_width = width;
    p.height = p.tile_height = height;
    p.flags = (settings.accelerate ? kFrameAccelerate : 0u) | (settings.analytic ? kFrameAnalytic : 0u) |
              (settings.analytic && settings.unpruned ? kFrameUnpruned : 0u) |
              (field.outside_is_concave() ? kFrameOutsideConcave : 0u);
    p.outside_first = field.outside_first();
    p.outside_count = field.outside_count();
    p.program_count = field.program_count();
    p.params_first = field.params_first();
    p.light_count = uint32_t(frame.lights.size());
    p.exposure = camera.exposure;
    p.tone_map = uint32_t(camera.tone_map);
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

TileResult record_tile(Graph& g, const TileInputs& in, View wanted, bool want_visibility) {
    TileResult out;
    const Visibility seen = march(g, in);
    const Surface surface = resolve(g, in, seen.words);
    if (wanted == View::Shaded) {
        const Image radiance = light(g, in, seen.words, surface);
        const Image shown = tonemap(g, in, radiance);
        out.radiance = g.readback(radiance);
        out.shown = g.readback(shown);
    } else {
        const Shown shown = view(g, in, seen.words, surface);
        out.radiance = g.readback(shown.values);
        out.shown = g.readback(shown.bytes);
    }
    out.depth = g.readback(surface.depth);
    if (want_visibility) out.visibility = g.readback(seen.words);
    for (const Buffer& counted : seen.evaluations) out.evaluations.push_back(g.readback(counted));
    return out;
}

std::vector<const Kernel*> frame_kernels(const TileInputs& in, View view) {
    std::vector<const Kernel*> out;
    if (!in.analytic) out.push_back(&kMarch);
    if (in.exact) out.push_back(&specialised(kMarchExact, in.use));
    out.push_back(in.exact ? &specialised(kResolveExact, in.use) : &kResolve);
    if (view != View::Shaded) {
        out.push_back(&kView);
        return out;
    }
    out.push_back(&shadow_kernel(in));
    out.push_back(&light_kernel(in));
    out.push_back(&kTonemap);
    return out;
}

}  // namespace kiln::render
