// SPDX-License-Identifier: MIT
// What bodies collide with where the ground has settled: marching cubes of regions. Closed whatever the field, and as near to it as its
// voxels allow.
#include "field/mesh_facts.h"
#include "physics/region_mesh.h"
#include "physics/worlds.h"
#include "rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

constexpr float kFine = 0.1f;

// The regions' own triangles, welded by the bits of their corners: the eight about the corner where they meet, so that every border is
// crossed.
struct Welded {
    std::vector<vec3> vertices;
    std::vector<uint32_t> indices;
    field::MeshFacts facts() const { return field::mesh_facts(vertices, indices); }
};
Welded welded(const field::SdfField& exact, ivec3 low = {-1, -1, -1}, ivec3 high = {0, 0, 0}) {
    std::map<std::array<uint32_t, 3>, uint32_t> numbers;
    Welded out;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const auto mesh = mesh_region(exact, kFine, {x, y, z});
                for (uint32_t i = 0; i < 3 * mesh->own(); ++i) {
                    const vec3 v = mesh->vertices[mesh->indices[i]];
                    std::array<uint32_t, 3> bits;
                    std::memcpy(bits.data(), &v, sizeof bits);
                    const auto [at, fresh] = numbers.try_emplace(bits, uint32_t(out.vertices.size()));
                    if (fresh) out.vertices.push_back(v);
                    out.indices.push_back(at->second);
                }
            }
    return out;
}

TEST(RegionMesh, RegionsFitTogetherBitForBit) {
    const auto ball = field_of({edit(kiln::Sphere{.radius = 2}, {0.03f, 0.02f, -0.01f})});
    const field::MeshFacts one = welded(*ball).facts();
    EXPECT_EQ(one.open_edges, 0u);
    EXPECT_EQ(one.non_manifold_edges, 0u);
    EXPECT_EQ(one.euler(), 2);
    EXPECT_NEAR(one.volume, 4 * double(kPi) / 3 * 8, 0.1);
    std::vector<Edit> edits;
    std::mt19937 rng(7);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    for (int i = 0; i < 40; ++i)
        edits.push_back(edit(kiln::Sphere{.radius = uniform(0.3f, 1.2f)},
                             {uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)}, i % 4 == 3 ? Op::Subtract : Op::Union,
                             i % 2 == 0 ? 0.2f : 0));
    const field::MeshFacts many = welded(*field_of(edits)).facts();
    EXPECT_EQ(many.open_edges, 0u);
    EXPECT_EQ(many.non_manifold_edges, 0u);
    EXPECT_GT(many.triangles, 5000u);
}

TEST(RegionMesh, ABoxIsAnsweredWithTheTrianglesThatMeetItAndNoneTwice) {
    const auto mesh = mesh_region(*field_of({edit(kiln::Sphere{.radius = 3}, {5, 5, 5})}), kFine, {0, 0, 0});
    ASSERT_GT(mesh->own(), 1000u);
    std::mt19937 rng(2);
    for (int k = 0; k < 50; ++k) {
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        const vec3 at{uniform(-1, 12), uniform(-1, 12), uniform(-1, 12)};
        const Box3 box = Box3{at, at}.inflated(uniform(0, 1));
        std::vector<int> told(mesh->own());
        mesh->each(box, [&](uint32_t t) { ++told[t]; });
        for (uint32_t t = 0; t < mesh->own(); ++t) {
            Box3 own;
            for (uint32_t i = 0; i < 3; ++i) {
                const vec3 v = mesh->vertices[mesh->indices[3 * t + i]];
                own = box_union(own, {v, v});
            }
            EXPECT_LE(told[t], 1);
            if (own.overlaps(box)) {
                EXPECT_EQ(told[t], 1) << k;
            }
        }
    }
}

// Any values at all, -1 … 1 voxel, the same at a point whoever asks; nothing solid beyond `reach` voxels from the middle.
class Noise final : public field::SdfField {
public:
    explicit Noise(int reach) : reach_(reach) {}
    float distance(vec3) const override { return 0; }  // the surface may be anywhere
    float distance(vec3, vec3& gradient) const override {
        gradient = {};
        return 0;
    }
    void distances(const sdf::Points& points, float* out) const override {
        for (int i = 0; i < points.count; ++i) out[i] = value(points.x[i], points.y[i], points.z[i]);
    }
    Box3 bounds() const override {
        const float side = float(reach_) * kFine;
        return {{-side, -side, -side}, {side, side, side}};
    }

private:
    float value(float x, float y, float z) const {
        uint32_t hash = 0;
        for (const float v : {x, y, z}) {
            const int at = int(std::lround(v / kFine));
            if (std::abs(at) >= reach_) return kFine;
            hash = (hash ^ uint32_t(at + 1000)) * 2654435761u;
            hash ^= hash >> 15;
        }
        return (float(hash & 0xffff) / 32768 - 1) * kFine;
    }
    int reach_;
};

TEST(RegionMesh, NoiseIsClosedToo) {
    const field::MeshFacts facts = welded(Noise(kSanitized ? 20 : 40)).facts();
    EXPECT_GT(facts.triangles,
              kSanitized ? 60000u : 500000u);  // all 256 cases, thousands of times, also where eight regions meet
    EXPECT_EQ(facts.open_edges, 0u);
    EXPECT_EQ(facts.non_manifold_edges, 0u);
}

TEST(RegionMesh, AGyroidInABallIsClosedAndHasManyHoles) {
    // Two of its periods in each direction, cut to a ball; its holes are where the ball cuts it.
    const Edit gyroid = edit(
        Expression{.expression = "sin(4*x)*cos(4*y)+sin(4*y)*cos(4*z)+sin(4*z)*cos(4*x)", .half_extents = {4, 4, 4}});
    const Edit ball = edit(kiln::Sphere{.radius = 3.5f}, {0.031f, -0.023f, 0.017f}, Op::Intersect);
    const field::MeshFacts facts = welded(*field_of({gyroid, ball})).facts();
    EXPECT_EQ(facts.open_edges, 0u);
    EXPECT_EQ(facts.non_manifold_edges, 0u);
    EXPECT_LT(facts.euler(), -20);
}

// Farthest from the surface, in voxels, by an exact distance.
struct Farthest {
    float vertex = 0, middle = 0;
};
template <typename Distance>
Farthest farthest(const Welded& mesh, Distance&& distance) {
    Farthest out;
    for (const vec3 v : mesh.vertices) out.vertex = std::max(out.vertex, std::abs(distance(v)) / kFine);
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const vec3 middle =
            (mesh.vertices[mesh.indices[i]] + mesh.vertices[mesh.indices[i + 1]] + mesh.vertices[mesh.indices[i + 2]]) /
            3;
        out.middle = std::max(out.middle, std::abs(distance(middle)) / kFine);
    }
    return out;
}

TEST(RegionMesh, ABallsVerticesAndMiddlesOfTrianglesLieOnItsSurface) {
    for (const float radius_voxels : {8.0f, 20.0f, 100.0f}) {
        const float r = radius_voxels * kFine;
        const vec3 center{0.031f, -0.023f, 0.017f};
        const Welded mesh = welded(*field_of({edit(kiln::Sphere{.radius = r}, center)}));
        const auto [vertex, middle] = farthest(mesh, [&](vec3 p) { return length(p - center) - r; });
        EXPECT_LE(vertex, 0.01f) << radius_voxels;
        EXPECT_LE(middle, 0.05f) << radius_voxels;
        EXPECT_EQ(mesh.facts().euler(), 2);
    }
}

TEST(RegionMesh, ATorusHasAHoleAndLiesOnItsSurface) {
    const float minor = 8 * kFine, major = 40 * kFine;
    Edit e = edit(kiln::Torus{.major_radius = major, .minor_radius = minor}, {0.031f, -0.023f, 0.017f});
    e.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 3}), 0.7f);
    const Welded mesh = welded(*field_of({e}));
    const auto [vertex, middle] = farthest(mesh, [&](vec3 p) {
        const vec3 local = rotate(conjugate(e.node.transform.rotation), p - e.node.transform.position);
        return std::hypot(std::hypot(local.x, local.z) - major, local.y) - minor;
    });
    EXPECT_LE(vertex, 0.01f);
    EXPECT_LE(middle, 0.05f);
    const field::MeshFacts facts = mesh.facts();
    EXPECT_EQ(facts.euler(), 0);
    EXPECT_EQ(facts.open_edges, 0u);
    EXPECT_EQ(facts.non_manifold_edges, 0u);
}

TEST(RegionMesh, ABoxsEdgesAreCutByNoMoreThanHalfAVoxel) {
    // Turned, so that its edges lie anyhow between the texels; also hollowed out, so that edges point inwards.
    for (const Op op : {Op::Union, Op::Subtract}) {
        const vec3 half{1.53f, 1.12f, 0.87f};
        Edit e = edit(kiln::Box{.half_extents = half}, {0.031f, -0.023f, 0.017f}, op);
        e.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 3}), 0.7f);
        const Welded mesh = welded(
            *field_of(op == Op::Union ? std::vector<Edit>{e} : std::vector<Edit>{edit(kiln::Sphere{.radius = 4}), e}));
        // Of the box alone, as Euclid has it, both sides.
        const auto box = [&](vec3 p) {
            const vec3 local = rotate(conjugate(e.node.transform.rotation), p - e.node.transform.position);
            const vec3 q{std::abs(local.x) - half.x, std::abs(local.y) - half.y, std::abs(local.z) - half.z};
            return length(vec3{std::max(q.x, 0.0f), std::max(q.y, 0.0f), std::max(q.z, 0.0f)}) +
                   std::min(std::max({q.x, q.y, q.z}), 0.0f);
        };
        const auto solid = [&](vec3 p) {
            return op == Op::Union ? box(p) : std::min(std::abs(length(p) - 4), std::abs(box(p)));
        };
        const auto [vertex, middle] = farthest(mesh, solid);
        EXPECT_LE(vertex, 0.5f);
        EXPECT_LE(middle, 0.5f);
    }
}

}  // namespace
