// SPDX-License-Identifier: MIT
// Starts threads.
// A mesh as a shape: where its surface is, which side is inside, that it is 1-Lipschitz, and what is said of it.

#include "meshes.h"

#include "model/triangle_tree.h"
#include "rounds.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <numbers>

namespace kiln::model {
namespace {

std::vector<std::pair<const char*, Triangles>> samples() {
    Random random(7);
    Triangles bumpy = sphere(4);
    for (vec3& p : bumpy.positions) p = p * random.in(0.8f, 1.1f);
    Triangles needles{{{0, 0, 0}, {1, 0, 0}, {1, 1e-7f, 0}, {0, 1, 0}, {0, 0, 1}, {0.5f, 0.5f, 0.5f}},
                      {{0, 1, 2}, {0, 3, 4}, {3, 3, 4}, {1, 4, 5}, {5, 5, 5}}};
    return {{"tetrahedron", tetrahedron()}, {"box", box({1, 0.5f, 0.02f})}, {"sphere", sphere(3)}, {"bumpy", bumpy},
            {"hemisphere", hemisphere(3)},  {"soup", soup(random, 300)},    {"needles", needles}};
}

TEST(TriangleTree, DistanceIsThatOfTheNearestTriangle) {
    for (const auto& [name, mesh] : samples()) {
        const TriangleTree surface(mesh.positions, mesh.faces);
        Random random(1);
        int32_t near = -1;
        for (int i = 0; i < 500; ++i) {
            const vec3 p = random.point(i % 3 == 0 ? 5.0f : 1.2f);
            const double slow = slow_distance(mesh, p);
            const float fast = surface.squared_distance(p, INFINITY);
            EXPECT_NEAR(std::sqrt(double(fast)), slow, 2e-6) << name << " at " << p.x << ' ' << p.y << ' ' << p.z;
            EXPECT_NEAR(surface.squared_distance(p, INFINITY, &near), fast, 1e-6 * fast) << name << ": with a hint";
            EXPECT_EQ(surface.squared_distance(p, 0.25f * fast), 0.25f * fast) << "no nearer than the bound";
        }
    }
}

TEST(TriangleTree, WindingNumberIsTheSumOfSolidAngles) {
    for (const auto& [name, mesh] : samples()) {
        const TriangleTree surface(mesh.positions, mesh.faces);
        Random random(2);
        for (int i = 0; i < 300; ++i) {
            const vec3 p = random.point(1.2f);
            if (slow_distance(mesh, p) < 1e-3) continue;  // on a triangle it jumps
            EXPECT_NEAR(surface.winding(p), slow_winding(mesh, p), 0.02) << name;
        }
    }
}

// ---- Where the surface is.

TEST(Bake, ASphereIsApproachedByTheSquareOfTheCell) {
    const Triangles ball = sphere(6);
    double last = 0;
    for (const int resolution : {16, 32, 64}) {
        const Shape s = shape_of(ball, {.resolution = resolution});
        Random random(3);
        double worst = 0;
        for (int i = 0; i < 4000; ++i) worst = std::max(worst, std::fabs(s.distance(normalize(random.point(1)))));
        // Between samples a sphere of curvature 1 is missed by h²/8 on each axis; the triangles miss it by 3e-4.
        const double h = double(s.cell());
        EXPECT_LT(worst, 0.375 * h * h + 4e-4) << resolution;
        if (last > 0) {
            EXPECT_LT(worst, 0.4 * last) << resolution;
        }
        last = worst;
    }
}

TEST(Bake, FlatFacesOfABoxAreExact) {
    const vec3 half{0.5f, 0.3f, 0.2f};
    const Shape s = shape_of(box(half), {.resolution = 48});
    const float h = s.cell();
    Random random(4);
    for (int i = 0; i < 2000; ++i) {
        // Above a face, away from its edges.
        const float rim = 6 * h;
        const float up = random.in(-1.5f * h, 3 * h);
        const vec3 p{random.in(rim - half.x, half.x - rim), half.y + up, random.in(rim - half.z, half.z - rim)};
        EXPECT_NEAR(s.distance(p), up, 0.02f * h);
    }
}

TEST(Bake, FarAwayItIsNearlyTheDistance) {
    const Shape s = shape_of(sphere(5), {.resolution = 32});
    for (const float far : {1.5f, 3.0f, 10.0f, 1000.0f}) {
        const vec3 p = normalize(vec3{1, 0.4f, -0.7f}) * far;
        EXPECT_LE(s.value(p), double(far) - 1 + 2e-3);
        EXPECT_GE(s.value(p), (far < 100 ? 0.65 : 0.99) * (double(far) - 1)) << far;
    }
    EXPECT_TRUE(std::isfinite(s.value({1e6f, -1e6f, 1e6f})));
}

TEST(Bake, ItsBoundsHoldItsSolidAndLittleMore) {
    const Shape s = shape_of(sphere(4), {.resolution = 24});
    EXPECT_LE(s.program.bounds.max.x, 1 + 1.5f * s.cell());
    Random random(5);
    for (int i = 0; i < 3000; ++i) {
        const vec3 p = random.point(1.3f);
        if (s.value(p) <= 0) {
            EXPECT_TRUE(s.program.bounds.contains(p));
        }
    }
}

// ---- 1-Lipschitz.

TEST(Bake, IsOneLipschitz) {
    for (const auto& [name, mesh] : samples()) {
        if (std::string(name) == "needles") continue;
        for (const int resolution : {12, kSanitized ? 20 : 40}) {
            const auto baked = bake(mesh, name, {.resolution = resolution});
            if (!baked) continue;  // a soup may enclose nothing
            const Shape s = shape_of(mesh, {.resolution = resolution});
            EXPECT_LT(s.baked.report.divisor, 1.8f) << name;
            Random random(6);
            double worst = 0;
            for (int i = 0; i < rounds(20000); ++i) {
                const vec3 p = random.point(i % 8 == 0 ? 4.0f : 1.3f);
                const vec3 q = p + random.point(s.cell() * (i % 4 == 0 ? 5.0f : 0.3f));
                const double far = (Vector(p) - Vector(q)).length();
                if (far > 1e-5) worst = std::max(worst, std::fabs(s.value(p) - s.value(q)) / far);
            }
            EXPECT_LE(worst, 1 + 1e-6) << name << ' ' << resolution;
        }
    }
}

// Not by being divided away: a smooth closed surface keeps most of its distance.
TEST(Bake, IsDividedByLittle) {
    EXPECT_LT(shape_of(sphere(5), {.resolution = 64}).baked.report.divisor, 1.25f);
    EXPECT_LT(shape_of(box({1, 1, 1}), {.resolution = 64}).baked.report.divisor, 1.35f);
}

// ---- Inside and outside.

// Values have the sign of the winding number, but beside the surface.
void expect_sign(const Shape& s, const Triangles& mesh, const std::string& what) {
    Random random(8);
    for (int i = 0; i < 1500; ++i) {
        const vec3 p = random.point(1.4f);
        const double w = slow_winding(mesh, p);
        if (slow_distance(mesh, p) < double(s.cell()) || std::fabs(w - 0.5) < 0.1) continue;
        EXPECT_EQ(s.value(p) < 0, w > 0.5)
            << what << " at " << p.x << ' ' << p.y << ' ' << p.z << ", winding number " << w;
    }
}

TEST(Bake, ClosedMeshesAreSolid) {
    for (const Triangles& mesh : {tetrahedron(), box({1, 0.6f, 0.3f}), sphere(3)}) {
        const Shape s = shape_of(mesh, {.resolution = 32});
        EXPECT_TRUE(s.baked.report.topology.closed_manifold());
        EXPECT_EQ(s.baked.report.ambiguous_share, 0);
        expect_sign(s, mesh, "closed");
    }
}

TEST(Bake, AnOpenHemisphereIsClosedByAFlatSheet) {
    // From every point of its opening the hemisphere fills half of all directions.
    const Triangles mesh = hemisphere(5);
    const Shape s = shape_of(mesh, {.resolution = 48});
    const Topology& t = s.baked.report.topology;
    EXPECT_FALSE(t.balanced);
    EXPECT_EQ(t.open_edges, 128u);
    EXPECT_EQ(t.non_manifold_edges, 0u);
    EXPECT_GT(s.baked.report.cap_triangles, 0u);
    EXPECT_THAT(s.baked.report.sentence(), testing::HasSubstr("128 open"));
    EXPECT_THAT(s.baked.report.sentence(), testing::HasSubstr("winding number"));
    expect_sign(s, mesh, "hemisphere");
    const float h = s.cell();
    for (const float x : {0.0f, 0.3f, -0.5f})
        for (const float y : {-3 * h, -h, 0.4f * h, 2 * h})
            EXPECT_NEAR(s.distance({x, y, 0.1f}), -y, 0.15f * h) << x << ' ' << y / h;
}

TEST(Bake, SmallHolesLeaveTheSolidWhereItWas) {
    Triangles mesh = sphere(4);
    Random random(9);
    std::erase_if(mesh.faces, [&](const Face&) { return random.below(60) == 0; });
    const Shape s = shape_of(mesh, {.resolution = 40});
    EXPECT_GT(s.baked.report.topology.open_edges, 50u);
    expect_sign(s, mesh, "holes");
    for (int i = 0; i < 500; ++i) EXPECT_LT(std::fabs(s.distance(normalize(random.point(1)))), 1.5 * double(s.cell()));
}

TEST(Bake, PartsThatOverlapAreOneSolid) {
    const Triangles mesh = together(box({1, 0.3f, 0.3f}), box({0.3f, 1, 0.3f}));
    const Shape s = shape_of(mesh, {.resolution = 48});
    EXPECT_TRUE(s.baked.report.overlapping);
    EXPECT_THAT(s.baked.report.sentence(), testing::HasSubstr("overlap"));
    expect_sign(s, mesh, "cross");
    // The inner walls are gone: from the middle the nearest surface is the front.
    for (const float x : {0.0f, 0.3f, -0.3f, 0.25f}) EXPECT_LT(s.distance({x, 0, 0}), -0.2) << x;
}

// One closed surface, each edge passed twice, that goes through itself: what lies in both arms is wound twice, and as solid as the rest.
TEST(Bake, ATubeThatPassesThroughItselfIsSolidWhereItDoes) {
    constexpr int kAlong = 160, kAround = 24;
    constexpr double kRadius = 0.15, kTurn = 2 * std::numbers::pi;
    const auto middle = [](double t) {
        return dvec3{std::sin(t), std::sin(t) * std::cos(t), 0};
    };  // Gerono's lemniscate
    Triangles mesh;
    for (uint32_t i = 0; i < kAlong; ++i) {
        const double t = kTurn * (i + 0.5) / kAlong, x = std::cos(t), y = std::cos(2 * t), size = std::hypot(x, y);
        const dvec3 c = middle(t);
        for (uint32_t k = 0; k < kAround; ++k) {
            const double u = kRadius * std::cos(kTurn * k / kAround), z = kRadius * std::sin(kTurn * k / kAround);
            mesh.positions.push_back({float(c.x - u * y / size), float(c.y + u * x / size), float(z)});
            const uint32_t a = i * kAround + k, b = i * kAround + (k + 1) % kAround;
            const uint32_t c_next = (a + kAround) % (kAlong * kAround), d_next = (b + kAround) % (kAlong * kAround);
            mesh.faces.push_back({a, c_next, b});
            mesh.faces.push_back({b, c_next, d_next});
        }
    }
    const Shape s = shape_of(mesh, {.resolution = 64});
    EXPECT_TRUE(s.baked.report.topology.balanced);
    EXPECT_TRUE(s.baked.report.overlapping);
    EXPECT_THAT(s.baked.report.sentence(), testing::HasSubstr("overlap"));
    Random random(12);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const vec3 p{random.in(-1.2f, 1.2f), random.in(-0.7f, 0.7f), random.in(-0.25f, 0.25f)};
        double nearest = 10;
        for (int k = 0; k < 1000; ++k) {
            const dvec3 c = middle(kTurn * k / 1000);
            nearest = std::min(nearest, std::hypot(double(p.x) - c.x, double(p.y) - c.y, double(p.z)));
        }
        const double distance = nearest - kRadius;
        if (std::abs(distance) < 2 * double(s.cell())) continue;
        EXPECT_EQ(s.value(p) <= 0, distance < 0) << p.x << ' ' << p.y << ' ' << p.z;
        inside += distance < 0;
    }
    EXPECT_GT(inside, 100);
    // The wall of one arm within the other is no surface.
    const float wall = float(kRadius / std::numbers::sqrt2);
    EXPECT_LT(s.distance({wall, wall, 0}), -0.1);
    EXPECT_LT(s.distance({-wall, wall, 0}), -0.1);
}

TEST(Bake, AHollowKeepsItsHollow) {
    Triangles inner = sphere(4, 0.5f);
    for (Face& f : inner.faces) std::swap(f[1], f[2]);
    const Triangles mesh = together(sphere(4), inner);
    const Shape s = shape_of(mesh, {.resolution = 40});
    EXPECT_TRUE(s.baked.report.topology.closed_manifold());
    EXPECT_GT(s.value({0, 0, 0}), 0);
    EXPECT_LT(s.value({0.75f, 0, 0}), 0);
}

TEST(Bake, TurnedTrianglesAreTurnedBack) {
    Triangles mesh = sphere(4);
    const Triangles right = mesh;
    Random random(10);
    size_t turned = 0;
    for (Face& f : mesh.faces) {
        if (random.below(5) != 0) continue;
        std::swap(f[1], f[2]);
        ++turned;
    }
    const Shape s = shape_of(mesh, {.resolution = 32});
    EXPECT_EQ(s.baked.report.topology.flipped_faces, turned);
    EXPECT_TRUE(s.baked.report.topology.closed_manifold());
    expect_sign(s, right, "turned");

    Triangles inside_out = sphere(3);
    for (Face& f : inside_out.faces) std::swap(f[1], f[2]);
    const Shape o = shape_of(inside_out, {.resolution = 24});
    EXPECT_TRUE(o.baked.report.topology.turned_inside_out);
    EXPECT_LT(o.value({0, 0, 0}), 0);
}

TEST(Bake, DuplicatesAndCornersOfTheirOwnChangeNothing) {
    const Triangles once = sphere(3);
    Triangles apart;  // as STL has it: every triangle with corners of its own; some twice, some without area
    for (size_t i = 0; i < once.faces.size(); ++i) {
        for (int copy = 0; copy < (i % 4 == 0 ? 2 : 1); ++copy) {
            const auto first = uint32_t(apart.positions.size());
            for (const uint32_t c : once.faces[i]) apart.positions.push_back(once.positions[c]);
            apart.faces.push_back({first, first + 1, first + 2});
            apart.faces.push_back({first, first + 1, first});
        }
    }
    const Shape a = shape_of(once, {.resolution = 24}), b = shape_of(apart, {.resolution = 24});
    EXPECT_EQ(b.baked.report.topology.duplicate_faces, once.faces.size() / 4);
    EXPECT_TRUE(b.baked.report.topology.closed_manifold());
    Random random(11);
    for (int i = 0; i < 500; ++i) {
        const vec3 p = random.point(1.5f);
        EXPECT_NEAR(a.value(p), b.value(p), 1e-6);
    }
}

TEST(Bake, WhatEnclosesNothingIsRefused) {
    const Triangles sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
    const Triangles both_sides{sheet.positions, {{0, 1, 2}, {0, 2, 1}}};
    const Triangles line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 1}}};
    for (const Triangles& mesh : {sheet, both_sides, line}) {
        const auto baked = bake(mesh, "sheet.obj");
        ASSERT_FALSE(baked);
        EXPECT_EQ(baked.error().kind, ErrorKind::Input);
        EXPECT_THAT(baked.error().message, testing::StartsWith("sheet.obj: "));
    }
}

TEST(Bake, SaysWhenAClaimIsWrong) {
    EXPECT_THAT(shape_of(hemisphere(3), {.resolution = 16, .closed = true}).baked.report.sentence(),
                testing::HasSubstr("declared closed, which it is not"));
    EXPECT_EQ(shape_of(sphere(2), {.resolution = 16, .closed = true}).baked.report.sentence(),
              "closed manifold of 128 triangles");
}

// ---- The same bytes.

TEST(Bake, SameBytesForAnyNumberOfWorkers) {
    const int resolution = rounds(64) / 2;
    for (const auto& [name, mesh] : samples()) {
        const auto one = bake(mesh, name, {.resolution = resolution, .workers = 1});
        for (const int workers : {2, 5}) {
            const auto many = bake(mesh, name, {.resolution = resolution, .workers = workers});
            ASSERT_EQ(bool(one), bool(many)) << name;
            if (!one) continue;
            ASSERT_EQ(one->grid.values.size(), many->grid.values.size()) << name;
            EXPECT_EQ(std::memcmp(one->grid.values.data(), many->grid.values.data(), one->report.bytes), 0) << name;
        }
    }
}

TEST(Bake, EveryInstructionSetReadsTheSame) {
    const Shape s = shape_of(sphere(4), {.resolution = 40});
    Random random(12);
    std::vector<float> x, y, z;
    for (int i = 0; i < 1000; ++i) {
        const vec3 p = random.point(i % 5 == 0 ? 20.0f : 1.2f);
        x.push_back(p.x);
        y.push_back(p.y);
        z.push_back(p.z);
    }
    const sdf::Points points{x.data(), y.data(), z.data(), int(x.size())};
    std::vector<float> scalar(x.size()), wide(x.size());
    sdf::evaluate(view(s.program), points, scalar.data(), sdf::Isa::Scalar);
    for (const sdf::Isa isa : {sdf::Isa::Sse4, sdf::Isa::Avx2, sdf::Isa::Avx512}) {
        if (!sdf::has_isa(isa)) continue;
        sdf::evaluate(view(s.program), points, wide.data(), isa);
        EXPECT_EQ(std::memcmp(scalar.data(), wide.data(), 4 * x.size()), 0) << int(isa);
    }
    for (size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(double(scalar[i]), s.value({x[i], y[i], z[i]}), 1e-5);
}

}  // namespace
}  // namespace kiln::model
