// SPDX-License-Identifier: MIT
// kiln::render_reference: the CPU path tracer of render/reference.h on the exact edits of a frame.

#include "scene/exact.h"

#include "field/clipmap.h"
#include "field/field.h"
#include "render/lens.h"
#include "render/lib/pack.h"
#include "render/merged.h"
#include "render/mesh_trace.h"
#include "render/reference.h"
#include "scene/movers.h"

#include <kiln/renderer.h>

#include <chrono>
#include <limits>
#include <memory>
#include <vector>

namespace kiln {
namespace {

// What the surface is made of, as resolve blends it: every number by the second's share.
Material blend(const std::vector<Material>& materials, const sdf::MaterialMix& mix) {
    if (mix.id0 >= materials.size()) return materials.front();
    Material out = materials[mix.id0];
    if (mix.weight <= 0 || mix.id1 >= materials.size()) return out;
    const Material& other = materials[mix.id1];
    const auto mixed = [&](auto a, auto b) { return a * (1 - mix.weight) + b * mix.weight; };
    out.base_color = mixed(out.base_color, other.base_color);
    out.emissive = mixed(out.emissive, other.emissive);
    out.roughness = mixed(out.roughness, other.roughness);
    out.metallic = mixed(out.metallic, other.metallic);
    return out;
}

// Where the object has a point of the world.
dvec3 into_object(const Pose& pose, dvec3 p) {
    const dvec3 u{-double(pose.rotation.x), -double(pose.rotation.y), -double(pose.rotation.z)};
    const double w = double(pose.rotation.w);
    const dvec3 v{p.x - double(pose.position.x), p.y - double(pose.position.y), p.z - double(pose.position.z)};
    const auto crossed = [](dvec3 a, dvec3 b) {
        return dvec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    };
    const dvec3 t = crossed(u, v), s = crossed(u, t);
    return {v.x + 2 * (w * t.x + s.x), v.y + 2 * (w * t.y + s.y), v.z + 2 * (w * t.z + s.z)};
}

}  // namespace

Result<Picture> render_reference(const Frame& frame, const RenderSettings& settings, int samples, RenderStats* stats) {
    if (samples < 1) return Error{"render_reference: samples must be 1 or more", ErrorKind::Usage};
    if (settings.width < 1 || settings.height < 1 || settings.width > 16384 || settings.height > 16384)
        return Error{"render_reference: width and height must be from 1 to 16384", ErrorKind::Usage};
    if (settings.view != View::Shaded)
        return Error{"the reference draws the shaded view only; leave --view out", ErrorKind::Usage};
    const auto start = std::chrono::steady_clock::now();
    const auto merged = render::merged_program(frame);
    if (!merged) return Error{"the reference: " + merged.error().message, merged.error().kind};
    const sdf::Program& program = *merged;
    const scene::ExactField exact(program);
    render::ReferenceField field;
    field.distance = [&](dvec3 p) { return exact.distance(p); };
    field.material = [&](dvec3 p) {
        sdf::MaterialMix mix;
        (void)sdf::evaluate(sdf::view(program), p, &mix);
        return blend(frame.materials, mix);
    };
    field.bounds = program.bounds;
    if (program.unbounded) {
        constexpr float inf = std::numeric_limits<float>::infinity();
        field.bounds = {{-inf, -inf, -inf}, {inf, inf, inf}};
    } else if (!field.bounds.empty()) {
        field.bounds =
            field.bounds.inflated(program.index.largest_reach());  // smooth unions bulge beyond their operands
    }
    std::vector<std::unique_ptr<scene::ExactField>> objects;
    for (const Instance& i : frame.instances) {
        if (i.glass == 0 || i.glass >= frame.materials.size()) continue;
        const sdf::Program& object = i.bricks->program();
        if (object.index.size() == 0) continue;
        objects.push_back(std::make_unique<scene::ExactField>(object));
        field.glass.push_back({.distance = [exact = objects.back().get(),
                                            pose = i.pose](dvec3 p) { return exact->distance(into_object(pose, p)); },
                               .bounds = scene::posed_box(object, i.pose).inflated(1e-4f),
                               .material = frame.materials[i.glass]});
    }
    const render::MeshSet meshes = render::make_mesh_set(frame);
    const render::MeshTrace trace(meshes);
    if (!meshes.empty()) field.meshes = &trace;
    const render::ReferencePicture traced =
        render::render_reference(field, frame.lights, render::shade::sky_params(frame), frame.camera,
                                 {.width = settings.width,
                                  .height = settings.height,
                                  .samples = samples,
                                  .environment = frame.environment ? frame.environment_map.get() : nullptr});
    Picture out;
    out.width = traced.width;
    out.height = traced.height;
    out.rgba = traced.rgba;
    out.depth = traced.depth;
    const render::shade::ExposureState exposure = render::measured_exposure(out.rgba, frame.camera, 0, {});
    render::develop(out, frame.camera, exposure);
    if (stats) {
        *stats = {};
        stats->device = "CPU path tracer, exact edits";
        stats->edits = int(program.index.size());
        stats->bricks = frame.levels ? int(frame.levels->bricks()) : int(frame.field->stats().bricks);
        stats->frame_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        stats->passes = {{"reference", stats->frame_ms}};
        for (const render::MeshSet::Part& part : meshes.parts)
            stats->triangles += meshes.primitive(part).index_count / 3;
        stats->triangles_drawn = stats->triangles;
        stats->coarsened = frame.coarsened;
        stats->exposure = exposure.multiplier;
    }
    return out;
}

}  // namespace kiln
