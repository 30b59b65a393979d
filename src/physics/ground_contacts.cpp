// SPDX-License-Identifier: MIT

#include "physics/ground_contacts.h"

#include <cmath>

namespace kiln::physics {

namespace {
constexpr float kBorder = 1e-3f;  // of a brick: both sides may tell of what lies in a border
constexpr float kMostSides = 3;   // a body larger than so many regions touches the field
}  // namespace

Box3 box_of(const Convex& body, const Pose& pose) {
    const vec3 half = half_extents(body);
    const vec3 x = rotate(pose.rotation, {half.x, 0, 0}), y = rotate(pose.rotation, {0, half.y, 0}),
               z = rotate(pose.rotation, {0, 0, half.z});
    const vec3 reach{std::abs(x.x) + std::abs(y.x) + std::abs(z.x), std::abs(x.y) + std::abs(y.y) + std::abs(z.y),
                     std::abs(x.z) + std::abs(y.z) + std::abs(z.z)};
    return {pose.position - reach, pose.position + reach};
}

bool collide_ground(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                    std::vector<FieldContact>& out) {
    const Regions& regions = *ground.regions();
    bool any = false;
    const bool small = outer_radius(body) < 0.5f * kMostSides * regions.side();
    const bool all =
        small && regions.size() > 0 &&
        regions.each(box_of(body, ground_from_body).inflated(margin), [&](const Regions::Entry&) { any = true; });
    if (any && !(ground.bricks().distance(ground_from_body.position) > 0)) any = false;
    if (any && all) {
        out.clear();
        return true;
    }
    collide(ground, body, ground_from_body, margin, out);
    if (!any) return false;
    std::erase_if(out, [&](const FieldContact& c) {
        const vec3 on_ground = c.point + c.normal * c.depth;
        const Regions::Entry* e = regions.find(regions.region_of(on_ground));
        return e != nullptr && e->mesh->box().inflated(-kBorder * e->mesh->cell).contains(on_ground);
    });
    return true;
}

bool is_own(const RegionMesh& mesh, vec3 p) { return mesh.box().inflated(kBorder * mesh.cell).contains(p); }

}  // namespace kiln::physics
