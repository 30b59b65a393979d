// SPDX-License-Identifier: MIT
// Starts threads.
#include "field/meshing.h"

#include "field/cell_cases.h"
#include "field/mesh_edges.h"

#include "meshes.h"
#include "rounds.h"

#include <numbers>

namespace kiln::field {
namespace {

using meshes::expect_closed;
using meshes::facts;

constexpr double kPi = std::numbers::pi;

Mesh smooth_of(const worlds::World& world, int workers = 0) {
    const auto field = world.field();
    const HostBricks bricks = HostBricks::bake(field, workers);
    Mesh out;
    mesh_smooth(MeshBricks(bricks), out, workers);
    return out;
}

Mesh sharp_of(const HostBricks& host, int workers = 0) {
    const MeshBricks bricks(host);
    Mesh out;
    mesh_sharp(bricks, exact_of(host, bricks), out, workers);
    return out;
}

Mesh sharp_of(const worlds::World& world, int workers = 0) {
    return sharp_of(HostBricks::bake(world.field(), workers), workers);
}

// Worst and root mean square distance of vertices from the exact surface, voxels.
struct Off {
    double most = 0, rms = 0;
};
Off off(const Mesh& mesh, const Field& field) {
    const sdf::TapeView tape = sdf::view(field.program());
    Off out;
    for (const vec3 p : mesh.positions.span()) {
        const double d = std::abs(sdf::evaluate(tape, dvec3{double(p.x), double(p.y), double(p.z)})) /
                         double(field.grid().voxel_size);
        out.most = std::max(out.most, d);
        out.rms += d * d;
    }
    out.rms = std::sqrt(out.rms / double(mesh.vertex_count()));
    return out;
}

std::vector<std::byte> bytes_of(const Mesh& mesh) {
    std::vector<std::byte> out;
    const auto append = [&](auto span) {
        const auto bytes = std::as_bytes(span);
        out.insert(out.end(), bytes.begin(), bytes.end());
    };
    append(mesh.positions.span());
    append(mesh.triangles.span());
    return out;
}

// Solid where the waves' sum is below 0, inside a ball; made of heights so that it fits no closed form.
worlds::World waves() {
    worlds::World w{"repeated tori", {}, {.voxel_size = 0.05f, .bounds = {{-1.6f, -1.6f, -1.6f}, {1.6f, 1.6f, 1.6f}}}};
    Edit e = worlds::edit(Torus{.major_radius = 0.25f, .minor_radius = 0.1f});
    e.node.domain.push_back(Repeat{.spacing = {0.75f, 0.75f, 0.75f}, .count = {3, 3, 3}});
    e.node.domain.push_back(Twist{.rate = 0.6f});
    w.edits.push_back(e);
    w.edits.push_back(worlds::edit(Sphere{.radius = 1.2f}, {0.1f, 0, 0}, Op::Intersect, 0.1f));
    return w;
}

TEST(Meshing, WorldsAreClosedManifolds) {
    for (const worlds::World& world : worlds::all()) expect_closed(smooth_of(world), world.name);
    expect_closed(smooth_of(waves()), "waves");
    for (uint32_t seed = 20; seed < 26; ++seed) expect_closed(smooth_of(worlds::jumble(seed, 80)), "jumble");
}

TEST(Meshing, RandomSignsAreClosedManifoldsThroughEveryCase) {
    const meshes::MadeUp noise = meshes::noise(8, 3);
    const MeshBricks bricks = noise.view();
    std::set<uint32_t> cases;
    size_t ambiguous = 0;
    const MeshEdges edges(bricks, 1, [&](const BrickEdges& brick) {
        for (int z = 0; z < 7; ++z) {
            for (int bit = 0; bit < 56; ++bit) {
                if ((bit & 7) == 7) continue;
                const uint32_t signs = corner_signs(brick.solid, z, bit);
                cases.insert(signs);
                ambiguous += bits_of(ambiguous_faces(signs));
            }
        }
        return 0u;
    });
    EXPECT_EQ(cases.size(), 256u);
    EXPECT_GT(ambiguous, 2u * 4096u);
    Mesh mesh;
    mesh_smooth(bricks, mesh);
    expect_closed(mesh, "noise");
    mesh_smooth(meshes::noise(3, 9, DistanceFormat::Snorm8).view(), mesh);
    expect_closed(mesh, "noise in 8 bits");
}

TEST(Meshing, MissingNeighboursLeaveNoVertexWithoutATriangleAndNoTwoOwners) {
    // A sparse subset of bricks: open at its border, but every vertex used and none doubled.
    const meshes::MadeUp noise = meshes::noise(5, 4);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        worlds::Random random(seed);
        std::vector<MeshBrick> some;
        for (const MeshBrick& b : noise.bricks)
            if (random.below(2) == 0) some.push_back(b);
        const MeshBricks bricks(some, noise.format, noise.voxel_size);
        Mesh mesh;
        mesh_smooth(bricks, mesh);
        const MeshFacts f = facts(mesh);
        EXPECT_EQ(f.vertices, mesh.vertex_count());
        EXPECT_EQ(f.non_manifold_edges, 0u);
        std::set<std::tuple<float, float, float>> places;
        for (const vec3 p : mesh.positions.span()) places.emplace(p.x, p.y, p.z);
        EXPECT_EQ(places.size(), mesh.vertex_count());
    }
}

TEST(Meshing, RegionsHaveEqualVerticesOnTheirCommonFaceAndTogetherAreTheWhole) {
    const auto field = worlds::jumble(7).field();
    const HostBricks bricks = HostBricks::bake(field);
    Mesh whole;
    mesh_smooth(MeshBricks(bricks), whole);
    const GridParams g = field->grid();
    const int middle = g.cell_x + g.size_x / 2;
    const ivec3 low{g.cell_x, g.cell_y, g.cell_z}, high{g.cell_x + g.size_x, g.cell_y + g.size_y, g.cell_z + g.size_z};
    Mesh left, right;
    mesh_smooth(MeshBricks(bricks, {low, {middle, high.y, high.z}}), left);
    mesh_smooth(MeshBricks(bricks, {{middle, low.y, low.z}, high}), right);
    EXPECT_EQ(left.triangle_count() + right.triangle_count(), whole.triangle_count());
    const float plane = float(7 * middle) * g.voxel_size;
    const auto on_face = [&](const Mesh& mesh) {
        std::set<std::tuple<float, float, float>> out;
        for (const vec3 p : mesh.positions.span())
            if (p.x == plane) out.emplace(p.x, p.y, p.z);
        return out;
    };
    const auto shared = on_face(left);
    EXPECT_GT(shared.size(), 50u);
    EXPECT_EQ(shared, on_face(right));
    EXPECT_EQ(left.vertex_count() + right.vertex_count(), whole.vertex_count() + shared.size());
    EXPECT_GT(facts(left).open_edges, 50u);
}

TEST(Meshing, SameBytesForAnyNumberOfWorkers) {
    const auto one = bytes_of(smooth_of(worlds::jumble(11, 60), 1));
    const auto sharp = bytes_of(sharp_of(worlds::jumble(11, 60), 1));
    for (const int workers : {2, 3, 8}) {
        EXPECT_EQ(bytes_of(smooth_of(worlds::jumble(11, 60), workers)), one) << workers;
        EXPECT_EQ(bytes_of(sharp_of(worlds::jumble(11, 60), workers)), sharp) << workers;
    }
}

TEST(Meshing, SharpWorldsAreClosedManifoldsAndTheirVerticesAreOnTheSurface) {
    std::vector<worlds::World> all = worlds::all();
    all.push_back(waves());
    for (uint32_t seed = 0; seed < uint32_t(rounds(6)); ++seed) all.push_back(worlds::jumble(20 + seed, 80));
    for (const worlds::World& world : all) {
        const auto field = world.field();
        const Mesh mesh = sharp_of(HostBricks::bake(field));
        expect_closed(mesh, world.name);
        const Off d = off(mesh, *field);
        EXPECT_LE(d.most, 0.5) << world.name;
        EXPECT_LE(d.rms, 0.025) << world.name;
    }
}

TEST(Meshing, SharpRandomSignsAreClosedManifolds) {
    for (const uint32_t seed : {3u, 4u, 5u}) {
        const meshes::MadeUp noise = meshes::noise(4, seed);
        const MeshBricks bricks = noise.view();
        Mesh mesh;
        // A field that knows nothing of the bricks: vertices land anywhere in their voxels.
        mesh_sharp(
            bricks,
            [](size_t, const sdf::Points& p, float* to) {
                for (int i = 0; i < p.count; ++i) to[i] = std::sin(90 * p.x[i]) * std::cos(70 * p.y[i] + p.z[i]) * 0.1f;
            },
            mesh);
        expect_closed(mesh, "noise");
    }
}

// A corner is found where the voxel that holds it has a crossing with each of its three faces; where one face misses all
// twelve edges the vertex still lies on the other two.
TEST(Meshing, SharpKeepsTheCornersAndVolumeOfTurnedBoxes) {
    constexpr int kBoxes = 40;
    int found = 0;
    worlds::Random random(5);
    for (int i = 0; i < kBoxes; ++i) {
        worlds::World box{"box", {}, {.voxel_size = 0.05f, .bounds = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}}};
        const vec3 half{0.7f, 0.5f, 0.6f};
        box.edits.push_back(worlds::edit(Box{.half_extents = half}, random.point(0.05f)));
        Transform& place = box.edits[0].node.transform;
        place.rotation = axis_angle(random.direction(), random.in(-3, 3));
        const Mesh mesh = sharp_of(box);
        const double volume = 8 * 0.7 * 0.5 * 0.6, area = 8 * (0.7 * 0.5 + 0.5 * 0.6 + 0.6 * 0.7);
        EXPECT_NEAR(facts(mesh).volume, volume, 1e-3 * volume);
        EXPECT_NEAR(facts(mesh).area, area, 4e-3 * area);
        for (int corner = 0; corner < 8; ++corner) {
            const vec3 local{corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y,
                             corner & 4 ? half.z : -half.z};
            const vec3 p = rotate(place.rotation, local) + place.position;
            float nearest = 1;
            for (const vec3 v : mesh.positions.span()) nearest = std::min(nearest, length(v - p));
            EXPECT_LT(nearest / box.options.voxel_size, std::numbers::sqrt3_v<float>) << "not in its own voxel";
            found += nearest / box.options.voxel_size < 0.05f;
        }
    }
    EXPECT_GT(found, kBoxes * 8 / 2);
    RecordProperty("found", found);
}

TEST(Meshing, SharpVerticesStayInTheirVoxels) {
    const HostBricks host = HostBricks::bake(worlds::jumble(11, 60).field());
    const MeshBricks bricks(host);
    Mesh mesh;
    mesh_sharp(bricks, exact_of(host, bricks), mesh);
    const float h = bricks.voxel_size();
    for (size_t brick = 0; brick < bricks.bricks().size(); ++brick) {
        for (uint32_t v = mesh.brick_vertices[brick]; v < mesh.brick_vertices[brick + 1]; ++v) {
            // Its voxel is active: a corner on each side.
            const vec3 p = mesh.positions[v] / h;
            const ivec3 cell = bricks.bricks()[brick].cell;
            const ivec3 voxel{int(std::floor(p.x)) - 7 * cell.x, int(std::floor(p.y)) - 7 * cell.y,
                              int(std::floor(p.z)) - 7 * cell.z};
            ASSERT_TRUE(voxel.x >= 0 && voxel.y >= 0 && voxel.z >= 0 && voxel.x < 7 && voxel.y < 7 && voxel.z < 7);
            const Corners c = host.corners(bricks.bricks()[brick].slot, voxel);
            const auto [low, high] = std::minmax({c.v000, c.v100, c.v010, c.v110, c.v001, c.v101, c.v011, c.v111});
            ASSERT_TRUE(low <= 0 && high > 0) << "vertex " << v;
        }
    }
}

TEST(Meshing, SharpVerticesOfFacesAndFansHaveTheWholeProgramsMaterialAndNormal) {
    const HostBricks host = HostBricks::bake(worlds::jumble(11, 60).field());
    const MeshBricks bricks(host);
    Mesh mesh;
    mesh_sharp(bricks, exact_of(host, bricks), mesh);
    const size_t first = mesh.vertex_count() - mesh.late_bricks.size();
    ASSERT_GT(mesh.late_bricks.size(), 20u);
    const MeshSurface surface = surface_of(host, bricks, mesh, true);
    const sdf::TapeView whole = sdf::view(host.field().program());
    for (size_t v = first; v < mesh.vertex_count(); ++v) {
        const vec3 p = mesh.positions[v];
        float value;
        sdf::MaterialMix mix;
        sdf::evaluate_materials(whole, {&p.x, &p.y, &p.z, 1}, &value, &mix);
        ASSERT_EQ(surface.mixes[v].id0, mix.id0) << "vertex " << v;
        ASSERT_EQ(surface.mixes[v].weight, mix.weight) << "vertex " << v;
        const double step = 1e-3;
        const auto slope = [&](vec3 by) {
            const dvec3 d{double(by.x) * step, double(by.y) * step, double(by.z) * step};
            const dvec3 at{double(p.x), double(p.y), double(p.z)};
            return float(sdf::evaluate(whole, {at.x + d.x, at.y + d.y, at.z + d.z}) -
                         sdf::evaluate(whole, {at.x - d.x, at.y - d.y, at.z - d.z}));
        };
        const vec3 g{slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1})};
        if (length(g) > 0) {
            ASSERT_GT(dot(surface.normals[v], g), 0.9f * length(g)) << "vertex " << v;
        }
    }
}

TEST(Meshing, EulerCharacteristicOfSphereAndTorus) {
    EXPECT_EQ(facts(smooth_of(worlds::sphere_of(10))).euler(), 2);
    worlds::World torus{"torus", {}, {.voxel_size = 0.05f, .bounds = {{-1.5f, -1, -1.5f}, {1.5f, 1, 1.5f}}}};
    torus.edits.push_back(worlds::edit(Torus{.major_radius = 0.8f, .minor_radius = 0.3f}, {0.01f, 0.02f, 0.03f}));
    EXPECT_EQ(facts(smooth_of(torus)).euler(), 0);
}

TEST(Meshing, VolumeAndAreaConvergeToTheClosedForms) {
    // A triangle lies in a voxel, so its circumradius is at most sqrt(3)/2 voxels and it sags by at most 3/8 h²/R below the
    // sphere: both errors are below 9/8 (h/R)² of the whole, and fall with the square of the voxel.
    double volume_error[2], area_error[2];
    for (int i = 0; i < 2; ++i) {
        const float voxels = i == 0 ? 10 : 20;
        const MeshFacts f = facts(smooth_of(worlds::sphere_of(voxels, {0.3f, -0.2f, 0.4f}, 1 / voxels)));
        volume_error[i] = 4 * kPi / 3 - f.volume;
        area_error[i] = 4 * kPi - f.area;
        EXPECT_GT(volume_error[i], 0) << "a polyhedron with its corners on a sphere is smaller";
        EXPECT_LT(volume_error[i], 4 * kPi / 3 * 1.125 / double(voxels * voxels));
        EXPECT_LT(area_error[i], 4 * kPi * 1.125 / double(voxels * voxels));
    }
    EXPECT_NEAR(volume_error[0] / volume_error[1], 4, 0.4);
    EXPECT_NEAR(area_error[0] / area_error[1], 4, 0.4);
}

TEST(Meshing, NothingAndEverythingSolidMakeNoTriangles) {
    Mesh mesh;
    mesh_smooth(MeshBricks({}, DistanceFormat::Half, 0.1f), mesh);
    EXPECT_EQ(mesh.vertex_count() + mesh.triangle_count(), 0u);
    const meshes::MadeUp solid({0, 0, 0}, {2, 2, 2}, [](ivec3) { return -0.5f; });
    mesh_smooth(solid.view(), mesh);
    EXPECT_EQ(mesh.vertex_count() + mesh.triangle_count(), 0u);
}

}  // namespace
}  // namespace kiln::field
