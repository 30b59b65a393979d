// SPDX-License-Identifier: MIT
// Starts threads.
// The nearest surface on the published scenes, against a reference of its own: every ball and box is cut into patches down to a micrometre, and
// the nearest whose middle the closed-form fold has on the surface is the answer. It shares nothing with the search: it halves surfaces
// where that halves space, and no program, pruning or region is in it.
#include "measure/recipes.h"

#include "scene/exact.h"
#include "sdf/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

namespace kiln::measure {
namespace {

constexpr double kVoxel = 2.0 / 256;
constexpr double kLeaf = 1e-6;   // metres: a patch no wider is a sample
constexpr double kSpeck = 1e-8;  // a patch no wider, whose middle something else hides, is left out

struct Patch {
    double least;  // metres: no point of it is nearer to the point asked
    uint32_t solid;
    int face;
    double u, v, half_u, half_v;  // of a face of the box, or of the cube that a ball is the picture of, in [-1, 1]
    bool operator<(const Patch& other) const { return least > other.least; }
};

class Reference {
public:
    explicit Reference(const std::vector<Edit>& edits) {
        for (const Edit& e : edits) {
            const vec3 c = e.node.transform.position;
            Solid s{{double(c.x), double(c.y), double(c.z)}, {}, 0, e.op == Op::Subtract};
            const auto& size = e.node.shape.params;
            if (e.node.shape.kind == uint16_t(ShapeKind::Sphere)) {
                s.radius = double(size[0]);
            } else {
                for (size_t a = 0; a < 3; ++a) s.half[a] = double(size[a]);
            }
            solids_.push_back(s);
        }
    }

    double fold(dvec3 p) const {
        double d = std::numeric_limits<double>::infinity();
        for (const Solid& s : solids_) d = s.cut ? std::max(d, -s.at(p)) : std::min(d, s.at(p));
        return d;
    }

    struct Answer {
        double least, distance;  // the true one lies between
    };
    Answer nearest(dvec3 p) const {
        std::priority_queue<Patch> queue;
        for (uint32_t i = 0; i < solids_.size(); ++i)
            for (int face = 0; face < 6; ++face) push(queue, p, {0, i, face, 0, 0, 1, 1});
        double hidden = std::numeric_limits<double>::infinity();
        while (!queue.empty()) {
            const Patch patch = queue.top();
            queue.pop();
            const Solid& s = solids_[patch.solid];
            const dvec3 middle = s.point(patch.face, patch.u, patch.v);
            const double size = s.reach(patch), value = std::abs(fold(middle));
            if (value > size * 1.001 + 1e-12) continue;
            if (size <= kLeaf && value <= 1e-12) return {std::min(hidden, patch.least), distance(middle, p)};
            if (size <= kSpeck) {
                hidden = std::min(hidden, patch.least);
                continue;
            }
            const double u = patch.half_u / 2, v = patch.half_v / 2;
            for (int k = 0; k < 4; ++k)
                push(queue, p,
                     {0, patch.solid, patch.face, patch.u + (k & 1 ? u : -u), patch.v + (k & 2 ? v : -v), u, v});
        }
        return {hidden, std::numeric_limits<double>::infinity()};
    }

private:
    struct Solid {
        dvec3 center;
        double half[3] = {};
        double radius;  // 0: a box
        bool cut;

        double at(dvec3 p) const {
            const dvec3 d{p.x - center.x, p.y - center.y, p.z - center.z};
            if (radius > 0) return std::hypot(d.x, d.y, d.z) - radius;
            const double x = std::abs(d.x) - half[0], y = std::abs(d.y) - half[1], z = std::abs(d.z) - half[2];
            return std::hypot(std::max(x, 0.0), std::max(y, 0.0), std::max(z, 0.0)) +
                   std::min(std::max({x, y, z}), 0.0);
        }
        dvec3 point(int face, double u, double v) const {
            double at[3];
            const int axis = face / 2;
            at[axis] = face % 2 == 0 ? 1 : -1;
            at[(axis + 1) % 3] = u;
            at[(axis + 2) % 3] = v;
            const double size = std::hypot(at[0], at[1], at[2]);
            for (int a = 0; a < 3; ++a) at[a] *= radius > 0 ? radius / size : half[a];
            return {center.x + at[0], center.y + at[1], center.z + at[2]};
        }
        // No point of the patch is farther from its middle. To look at a cube from the middle of the ball in it shortens what lies on it.
        double reach(const Patch& p) const {
            const int axis = p.face / 2;
            if (radius > 0) return radius * std::hypot(p.half_u, p.half_v);
            return std::hypot(p.half_u * half[(axis + 1) % 3], p.half_v * half[(axis + 2) % 3]);
        }
        // From q to the flat patch, or to the cap of the ball that holds it.
        double least(const Patch& p, dvec3 q) const {
            const dvec3 middle = point(p.face, p.u, p.v);
            if (radius > 0) {
                const double far = distance(q, center);
                const double chord = std::min(reach(p) / radius, 2.0), turn = 2 * std::asin(chord / 2);
                const double cosine =
                    ((q.x - center.x) * (middle.x - center.x) + (q.y - center.y) * (middle.y - center.y) +
                     (q.z - center.z) * (middle.z - center.z)) /
                    std::max(far * radius, 1e-300);
                const double angle = std::max(std::acos(std::clamp(cosine, -1.0, 1.0)) - turn, 0.0);
                return std::hypot(far - radius * std::cos(angle), radius * std::sin(angle));
            }
            const int axis = p.face / 2;
            double extent[3] = {};
            extent[(axis + 1) % 3] = p.half_u * half[(axis + 1) % 3];
            extent[(axis + 2) % 3] = p.half_v * half[(axis + 2) % 3];
            const auto off = [](double d, double e) { return std::max(std::abs(d) - e, 0.0); };
            return std::hypot(off(q.x - middle.x, extent[0]), off(q.y - middle.y, extent[1]),
                              off(q.z - middle.z, extent[2]));
        }
    };

    static double distance(dvec3 a, dvec3 b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); }
    void push(std::priority_queue<Patch>& queue, dvec3 p, Patch patch) const {
        patch.least = solids_[patch.solid].least(patch, p) * (1 - 1e-12);
        queue.push(patch);
    }

    std::vector<Solid> solids_;
};

// `count` points inside and as many outside, anywhere in the scene.
void expect_true_distances(int kind, uint32_t seed, size_t count) {
    const std::vector<Edit> edits = recipe(kind, seed, 1000);
    const Reference reference(edits);
    const auto program = sdf::compile({edits, {}, {}});
    ASSERT_TRUE(program);
    const scene::ExactField exact(*program);
    std::vector<vec3> points;
    size_t inside = 0, outside = 0;
    for (const vec3 p : random_points(200000)) {
        size_t& side = reference.fold({double(p.x), double(p.y), double(p.z)}) < 0 ? inside : outside;
        if (side == count) continue;
        ++side;
        points.push_back(p);
        if (inside == count && outside == count) break;
    }
    ASSERT_EQ(points.size(), 2 * count);
    std::vector<NearestPoint> answers(points.size());
    exact.nearest(points, std::numeric_limits<float>::infinity(), answers.data());
    double most = 0, room = 0;
    size_t bounds = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        const dvec3 p{double(points[i].x), double(points[i].y), double(points[i].z)};
        const Reference::Answer truth = reference.nearest(p);
        ASSERT_TRUE(answers[i].found);
        const double found = std::abs(double(answers[i].distance)), value = std::abs(reference.fold(p));
        EXPECT_EQ(answers[i].distance < 0, reference.fold(p) < 0);
        room = std::max(room, truth.distance - truth.least);
        most = std::max({most, truth.least - found, found - truth.distance});
        EXPECT_GE(found, truth.least - 1e-4) << p.x << ' ' << p.y << ' ' << p.z;
        EXPECT_LE(found, truth.distance + 1e-4) << p.x << ' ' << p.y << ' ' << p.z;
        bounds += truth.least - value > 0.5 * kVoxel;
    }
    EXPECT_LE(room, 1e-5);  // the reference knows what it says
    EXPECT_GE(bounds, 1u);  // and the program's own value is no answer
    std::printf(
        "kind %d seed %u: nearest off by %.2e m at most of %zu points, reference known to %.1e m; the fold's "
        "own value is short by half a voxel at %zu\n",
        kind, seed, most, points.size(), room, bounds);
}

class NearestOfKind : public testing::TestWithParam<int> {};
TEST_P(NearestOfKind, IsTheNearestOfADenseSampleOfTheSurface) { expect_true_distances(GetParam(), 5, 60); }

class NearestOfKindSlow : public testing::TestWithParam<int> {};
TEST_P(NearestOfKindSlow, IsTheNearestOfADenseSampleOfTheSurface) {
    for (const uint32_t seed : {5u, 6u, 7u}) expect_true_distances(GetParam(), seed, 1000);
}

INSTANTIATE_TEST_SUITE_P(Kinds, NearestOfKind, testing::Values(0, 1, 2));
INSTANTIATE_TEST_SUITE_P(Kinds, NearestOfKindSlow, testing::Values(0, 1, 2));

}  // namespace
}  // namespace kiln::measure
