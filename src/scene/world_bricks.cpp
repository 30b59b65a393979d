// SPDX-License-Identifier: MIT
// World: answers from baked bricks, for `query --field` and for programs that ask the same region often: points, and rays in step.

#include "scene/exact.h"
#include "scene/world_impl.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kiln {

namespace {

constexpr size_t kChunk = 1024;  // points or rays answered by one worker at a time
constexpr float kFar = std::numeric_limits<float>::infinity();

// Whether all that can be solid of the field's program lies in the grid.
bool holds_all(const field::Field& field) {
    const sdf::Program& program = field.program();
    const Box3 &grid = field.options().bounds, solid = program.bounds.inflated(program.index.largest_reach());
    return !program.unbounded && (program.bounds.empty() || (grid.contains(solid.min) && grid.contains(solid.max)));
}

// Where a ray is within a box, metres; from > to: nowhere.
struct Stretch {
    float from = 0, to = kFar;

    Stretch(const Ray& ray, const Box3& box) {
        const float o[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
        const float d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
        const float low[3] = {box.min.x, box.min.y, box.min.z}, high[3] = {box.max.x, box.max.y, box.max.z};
        for (int axis = 0; axis < 3; ++axis) {
            if (d[axis] == 0) {
                if (o[axis] < low[axis] || o[axis] > high[axis]) to = -kFar;
                continue;
            }
            const float a = (low[axis] - o[axis]) / d[axis], b = (high[axis] - o[axis]) / d[axis];
            from = std::max(from, std::min(a, b));
            to = std::min(to, std::max(a, b));
        }
    }
};

// t[i] becomes where ray i meets something solid of the bricks, where that is before it.
void march(const field::HostBricks& bricks, std::span<const Ray> rays, std::span<const uint32_t> numbers, float* t) {
    std::vector<field::MarchHit> found(rays.size());
    bricks.march_refined(rays, found.data());
    for (size_t i = 0; i < rays.size(); ++i) {
        if (found[i].state == field::kMarchMiss) continue;
        t[numbers[i]] = std::min(t[numbers[i]], std::max(found[i].t, 0.0f) * bricks.field().grid().voxel_size);
    }
}

}  // namespace

std::optional<World::Impl::Baked> World::Impl::baked(const FieldSettings& settings) {
    const auto ready = field(settings);
    if (!ready) return std::nullopt;
    Baked out;
    {
        const std::lock_guard lock(mutex);
        if (!bricks || bricks->field().revision() != ready->field->revision()) {
            field::HostBricks next = bricks ? *bricks : field::HostBricks();
            next.update(ready->field);
            bricks = std::make_shared<const field::HostBricks>(std::move(next));
        }
        out.bricks = bricks;
    }
    const field::FieldOptions& options = ready->field->options();
    if (!instances_of(options.voxel_size, options.format, out.apart, false)) return std::nullopt;
    return out;
}

bool World::Impl::sample_bricks(std::span<const vec3> points, const FieldSettings& settings, FieldSample* answers) {
    const std::optional<Baked> made = baked(settings);
    if (!made) return false;
    parallel_for((points.size() + kChunk - 1) / kChunk, [&](int chunk) {
        const size_t first = size_t(chunk) * kChunk;
        for (size_t i = first; i < std::min(first + kChunk, points.size()); ++i) {
            const vec3 p = points[i];
            field::HostBricks::Sample s = made->bricks->sample({double(p.x), double(p.y), double(p.z)});
            for (const Instance& instance : made->apart) {
                const vec3 local = inverse(instance.pose) * p;
                const vec3 gap =
                    max(max(instance.bricks->box().min - local, local - instance.bricks->box().max), vec3{});
                if (double(length(gap)) >= s.distance) continue;
                field::HostBricks::Sample own =
                    instance.bricks->bricks().sample({double(local.x), double(local.y), double(local.z)});
                if (own.distance >= s.distance) continue;
                own.normal = rotate(instance.pose.rotation, own.normal);
                if (own.material0 == sdf::kDefaultMaterial) own.material0 = uint16_t(instance.material);
                s = own;
            }
            answers[i].distance =
                s.distance < double(sdf::kEmptyTest) ? float(s.distance) : std::numeric_limits<float>::infinity();
            answers[i].normal = s.normal;
            answers[i].material = s.distance < double(sdf::kEmptyTest) ? scene::material_of(s.material0) : MaterialId{};
        }
    });
    return true;
}

bool World::Impl::cast_bricks(std::span<const Ray> rays, const FieldSettings& settings, RayHit* hits) {
    const std::optional<Baked> made = baked(settings);
    if (!made) return false;
    std::vector<Ray> sought;
    std::vector<uint32_t> numbers;  // of `rays`
    for (size_t i = 0; i < rays.size(); ++i) {
        Ray ray = rays[i];
        const float size = length(ray.direction);
        hits[i] = {};
        if (!(size > 0) || !std::isfinite(size) || !std::isfinite(dot(ray.origin, ray.origin)) || !(ray.t_max >= 0))
            continue;
        ray.direction = ray.direction / size;
        sought.push_back(ray);
        numbers.push_back(uint32_t(i));
    }
    std::vector<float> t(rays.size(), kFar);
    parallel_for((sought.size() + kChunk - 1) / kChunk, [&](int chunk) {
        const size_t first = size_t(chunk) * kChunk, count = std::min(kChunk, sought.size() - first);
        march(*made->bricks, std::span(sought).subspan(first, count), std::span(numbers).subspan(first, count),
              t.data());
        std::vector<Ray> local;
        std::vector<uint32_t> of;
        for (const Instance& instance : made->apart) {
            local.clear(), of.clear();
            const Pose local_from_world = inverse(instance.pose);
            for (size_t i = first; i < first + count; ++i) {
                Ray ray = sought[i];
                ray.origin = local_from_world * ray.origin;
                ray.direction = direction_into(instance.pose, ray.direction);
                ray.t_max = std::min(ray.t_max, t[numbers[i]]);
                const Stretch within(ray, instance.bricks->box());
                if (within.from > std::min(within.to, ray.t_max)) continue;
                local.push_back(ray);
                of.push_back(numbers[i]);
            }
            march(instance.bricks->bricks(), local, of, t.data());
        }
    });

    // What leaves the grid is met before or behind it, by the edits alone.
    const std::shared_ptr<const WorldView::Impl> whole = view();
    if (!holds_all(made->bricks->field())) {
        std::vector<Ray> outside;
        std::vector<std::pair<uint32_t, float>> of;  // and how far along the ray they begin
        for (size_t i = 0; i < sought.size(); ++i) {
            const Stretch within(sought[i], made->bricks->field().options().bounds);
            const float end = std::min(sought[i].t_max, t[numbers[i]]),
                        gone = std::min(within.from > within.to ? 0 : within.to, end);
            const auto ask = [&](float from, float to) {
                if (!(from < to)) return;
                outside.push_back({sought[i].origin + sought[i].direction * from, sought[i].direction, to - from});
                of.emplace_back(numbers[i], from);
            };
            if (within.from <= within.to) ask(0, std::min(within.from, end));
            ask(gone, end);
        }
        std::vector<RayHit> met(outside.size());
        whole->exact.cast(outside, met.data());
        for (size_t k = 0; k < met.size(); ++k)
            if (met[k].hit) t[of[k].first] = std::min(t[of[k].first], of[k].second + met[k].t);
    }

    std::vector<RayHit*> found;
    for (size_t i = 0; i < sought.size(); ++i) {
        const float at = t[numbers[i]];
        if (!(at <= sought[i].t_max)) continue;
        RayHit& hit = hits[numbers[i]];
        hit.hit = true;
        hit.t = at;
        hit.position = sought[i].origin + sought[i].direction * at;
        found.push_back(&hit);
    }
    whole->exact.describe(found);
    for (RayHit* hit : found) hit->edit = whole->id_of(hit->edit);
    return true;
}

}  // namespace kiln
