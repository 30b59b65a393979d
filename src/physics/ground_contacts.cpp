// SPDX-License-Identifier: MIT

#include "physics/ground_contacts.h"

#include <algorithm>
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

// The ends of a long triangle, the point farthest across it, the one on its other side, and the deepest where it is deeper than those by
// more than noise.
void keep_four(std::vector<FieldContact>& contacts) {
    constexpr float kNoise = 1e-3f;
    if (contacts.size() <= 4) return;
    const auto best = [&](auto&& score) {
        return *std::max_element(contacts.begin(), contacts.end(),
                                 [&](const FieldContact& a, const FieldContact& b) { return score(a) < score(b); });
    };
    FieldContact kept[4];
    kept[0] = best([](const FieldContact& c) { return c.point.x + 0.37f * c.point.y + 0.61f * c.point.z; });
    kept[1] = best([&](const FieldContact& c) { return length(c.point - kept[0].point); });
    const vec3 along = kept[1].point - kept[0].point;
    kept[2] = best([&](const FieldContact& c) { return length(cross(along, c.point - kept[0].point)); });
    const vec3 across = cross(along, kept[2].point - kept[0].point);
    // On the other side of the line.
    kept[3] = best([&](const FieldContact& c) { return -dot(across, cross(along, c.point - kept[0].point)); });
    const FieldContact deepest = best([](const FieldContact& c) { return c.depth; });
    FieldContact* shallow = std::min_element(
        kept, kept + 4, [](const FieldContact& a, const FieldContact& b) { return a.depth < b.depth; });
    if (deepest.depth > std::max({kept[0].depth, kept[1].depth, kept[2].depth, kept[3].depth}) + kNoise)
        *shallow = deepest;
    contacts.assign(kept, kept + 4);
}

// Of many triangles only those that touch as much as the nearest does say where a body rests.
static void drop_far(std::vector<FieldContact>& contacts) {
    constexpr float kNear = 5e-3f;  // metres
    float deepest = -1e30f;
    for (const FieldContact& c : contacts) deepest = std::max(deepest, c.depth);
    std::erase_if(contacts, [&](const FieldContact& c) { return c.depth < std::min(deepest, 0.0f) - kNear; });
}

void settle_on_triangles(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                         std::vector<FieldContact>& contacts) {
    drop_far(contacts);
    keep_four(contacts);
    measure(ground, margin, contacts);
    if (body.kind == Convex::Kind::Sphere)
        settle_ball(ground, ground_from_body.position, body.size.x, margin, contacts);
}

bool is_own(const RegionMesh& mesh, vec3 p) { return mesh.box().inflated(kBorder * mesh.cell).contains(p); }

}  // namespace kiln::physics
