// SPDX-License-Identifier: MIT
// Questions: a world asks the view of what it is now; a view asks the exact field it keeps.

#include "scene/world_impl.h"

#include "base/assert.h"

namespace kiln {

WorldView World::view() const { return WorldView(impl_->view()); }

float World::distance(vec3 p) const { return view().distance(p); }

FieldSample World::sample(vec3 p, FieldSource source) const { return sample(std::span(&p, 1), source).front(); }

std::vector<FieldSample> World::sample(std::span<const vec3> points, FieldSource source) const {
    if (source == FieldSource::Bricks) {
        std::vector<FieldSample> out(points.size());
        if (impl_->sample_bricks(points, field_settings, out.data())) return out;
    }
    return view().sample(points);
}

RayHit World::cast(const Ray& ray) const { return view().cast(ray); }

std::vector<RayHit> World::cast(std::span<const Ray> rays, FieldSource source) const {
    if (source == FieldSource::Bricks) {
        std::vector<RayHit> out(rays.size());
        if (impl_->cast_bricks(rays, field_settings, out.data())) return out;
    }
    return view().cast(rays);
}

float WorldView::distance(vec3 p) const {
    float out;
    distance(std::span(&p, 1), std::span(&out, 1));
    return out;
}

void WorldView::distance(std::span<const vec3> points, std::span<float> out) const {
    KILN_ASSERT(points.size() == out.size(), "{} points, room for {}", points.size(), out.size());
    impl_->exact.distance(points, out.data());
}

FieldSample WorldView::sample(vec3 p) const { return impl_->exact.sample(p); }

std::vector<FieldSample> WorldView::sample(std::span<const vec3> points) const {
    std::vector<FieldSample> out(points.size());
    impl_->exact.sample(points, out.data());
    return out;
}

RayHit WorldView::cast(const Ray& ray) const { return cast(std::span(&ray, 1)).front(); }

std::vector<RayHit> WorldView::cast(std::span<const Ray> rays) const {
    std::vector<RayHit> out(rays.size());
    impl_->exact.cast(rays, out.data());
    for (RayHit& hit : out) hit.edit = impl_->id_of(hit.edit);
    return out;
}

RayHit WorldView::cast_sphere(const Ray& ray, float radius) const {
    RayHit hit = impl_->exact.cast_sphere(ray, radius);
    hit.edit = impl_->id_of(hit.edit);
    return hit;
}

NearestPoint WorldView::nearest(vec3 p, float within) const { return nearest(std::span(&p, 1), within).front(); }

std::vector<NearestPoint> WorldView::nearest(std::span<const vec3> points, float within) const {
    std::vector<NearestPoint> out(points.size());
    impl_->exact.nearest(points, within, out.data());
    for (NearestPoint& near : out) near.edit = impl_->id_of(near.edit);
    return out;
}

bool WorldView::overlaps_sphere(vec3 center, float radius) const {
    return impl_->exact.overlaps_sphere(center, radius);
}

bool WorldView::overlaps_box(vec3 center, vec3 half_extents, quat rotation) const {
    return impl_->exact.overlaps_box(center, half_extents, rotation);
}

}  // namespace kiln
