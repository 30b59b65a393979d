// SPDX-License-Identifier: MIT

#include "physics/ground_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// Of many triangles only those that touch as much as the nearest does say where a body rests.
static void drop_far(std::vector<FieldContact>& contacts) {
    constexpr float kNear = 0.5f * kMargin;
    float deepest = -1e30f;
    for (const FieldContact& c : contacts) deepest = std::max(deepest, c.depth);
    std::erase_if(contacts, [&](const FieldContact& c) { return c.depth < std::min(deepest, 0.0f) - kNear; });
}

// Each to the deepest point of the body near it: which triangles it was found on would have an edge of a box tremble. On a face that lies
// flat it stays, however little the face leans: steps are half a voxel.
static void sink(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                 std::vector<FieldContact>& contacts) {
    constexpr int kSteps = 4;
    const Pose body_from_ground = inverse(ground_from_body);
    const float half_voxel = 0.5f * ground.regions()->side() / float(kRegionCells * field::kBrickVoxels);
    static thread_local std::vector<FieldContact> next;
    for (FieldContact& c : contacts) {
        float step = half_voxel;
        for (int i = 0; i < kSteps; ++i) {
            const vec3 down = direction_into(ground_from_body, -c.normal);
            next.assign(1, c);
            next.front().point = ground_from_body * project(body, body_from_ground * c.point + down * step);
            measure(ground, margin, next);
            if (!next.empty() && next.front().depth > c.depth) {
                c = next.front();
            } else {
                step *= 0.25f;
            }
        }
    }
}

static void one_of_each_place(std::vector<FieldContact>& contacts, float radius) {
    size_t kept = 0;
    for (const FieldContact& c : contacts) {
        size_t i = 0;
        while (i < kept && (length(contacts[i].point - c.point) > kSamePlace * radius ||
                            dot(contacts[i].normal, c.normal) < kSameNormal))
            ++i;
        if (i == kept) {
            contacts[kept++] = c;
        } else if (c.depth > contacts[i].depth) {
            contacts[i] = c;
        }
    }
    contacts.resize(kept);
}

// Some of them, as far from each other as can be, the deepest first.
static void spread(std::vector<FieldContact>& contacts) {
    constexpr size_t kMost = 12;
    if (contacts.size() <= kMost) return;
    static thread_local std::vector<float> nearest;
    nearest.assign(contacts.size(), std::numeric_limits<float>::infinity());
    const auto deepest =
        std::max_element(contacts.begin(), contacts.end(),
                         [](const FieldContact& a, const FieldContact& b) { return a.depth < b.depth; });
    std::iter_swap(contacts.begin(), deepest);
    for (size_t kept = 1; kept < kMost; ++kept) {
        size_t best = kept;
        for (size_t i = kept; i < contacts.size(); ++i) {
            nearest[i] = std::min(nearest[i], length(contacts[i].point - contacts[kept - 1].point));
            if (nearest[i] > nearest[best]) best = i;
        }
        std::swap(contacts[kept], contacts[best]);
        std::swap(nearest[kept], nearest[best]);
    }
    contacts.resize(kMost);
}

void settle_on_triangles(const SdfShape& ground, const Convex& body, const Pose& ground_from_body, float margin,
                         std::vector<FieldContact>& contacts) {
    drop_far(contacts);
    spread(contacts);
    measure(ground, margin, contacts);
    if (body.kind == Convex::Kind::Sphere) {
        settle_ball(ground, ground_from_body.position, body.size.x, margin, contacts);
    } else {
        sink(ground, body, ground_from_body, margin, contacts);
        one_of_each_place(contacts, outer_radius(body));
    }
}

bool is_own(const RegionMesh& mesh, vec3 p) { return mesh.box().inflated(kBorder * mesh.cell).contains(p); }

}  // namespace kiln::physics
