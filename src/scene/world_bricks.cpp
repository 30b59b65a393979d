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
    constexpr size_t kChunk = 256;
    parallel_for((points.size() + kChunk - 1) / kChunk, [&](int chunk) {
        const size_t first = size_t(chunk) * kChunk;
        for (size_t i = first; i < std::min(first + kChunk, points.size()); ++i) {
            const vec3 p = points[i];
            const field::HostBricks::Sample s = baked->sample({double(p.x), double(p.y), double(p.z)});
            answers[i].distance =
                s.distance < double(sdf::kEmptyTest) ? float(s.distance) : std::numeric_limits<float>::infinity();
            answers[i].normal = s.normal;
            answers[i].material = s.distance < double(sdf::kEmptyTest) ? scene::material_of(s.material0) : MaterialId{};
        }
    });
    return true;
}

}  // namespace kiln
