// SPDX-License-Identifier: MIT
// World: answers from baked bricks, for `query --field` and for programs that ask the same region often.

#include "scene/exact.h"
#include "scene/world_impl.h"

#include "base/parallel_for.h"

namespace kiln {

bool World::Impl::sample_bricks(std::span<const vec3> points, const FieldSettings& settings, FieldSample* answers) {
    const auto ready = field(settings);
    if (!ready) return false;
    std::shared_ptr<const field::HostBricks> baked;
    {
        const std::lock_guard lock(mutex);
        if (!bricks || bricks->field().revision() != ready->field->revision()) {
            field::HostBricks next = bricks ? *bricks : field::HostBricks();
            next.update(ready->field);
            bricks = std::make_shared<const field::HostBricks>(std::move(next));
        }
        baked = bricks;
    }
    std::vector<Instance> apart;
    const field::FieldOptions& options = ready->field->options();
    if (!instances_of(options.voxel_size, options.format, apart, false)) return false;
    constexpr size_t kChunk = 256;
    parallel_for((points.size() + kChunk - 1) / kChunk, [&](int chunk) {
        const size_t first = size_t(chunk) * kChunk;
        for (size_t i = first; i < std::min(first + kChunk, points.size()); ++i) {
            const vec3 p = points[i];
            field::HostBricks::Sample s = baked->sample({double(p.x), double(p.y), double(p.z)});
            for (const Instance& instance : apart) {
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

}  // namespace kiln
