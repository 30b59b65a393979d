// SPDX-License-Identifier: MIT
// Starts threads.
// Worlds to meshes to files, read back by a reader that shares no code with the writers.
#include "scene/mesh_file.h"

#include "field/self_crossings.h"
#include "scene_text.h"
#include "temp_folder.h"
#include "rounds.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

namespace kiln {
namespace {

namespace fs = std::filesystem;

World world_with(const std::string& json) {
    auto world = World::parse(json, "test.kiln.json");
    EXPECT_TRUE(world) << (world ? "" : world.error().message);
    return world ? std::move(*world) : World();
}

const char* const kSeam = R"({"format": 1, "field": {"voxel_size": 0.05},
  "materials": {"clay": {"base_color": [0.7, 0.3, 0.2], "roughness": 0.9}, "glow": {"base_color": [0.1, 0.2, 0.3], "emissive": [2, 4, 1], "opacity": 0.5}},
  "edits": [{"shape": "sphere", "radius": 0.5, "material": "clay"},
            {"shape": "sphere", "radius": 0.4, "position": [0.6, 0, 0], "blend_radius": 0.2, "material": "glow"}]})";

Mesh mesh_of(const World& world, const MeshSettings& settings = {}) {
    auto mesh = world.mesh(settings);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
    return mesh ? std::move(*mesh) : Mesh{};
}

void expect_closed(const Mesh& mesh, const std::string& name) {
    const MeshReport r = measure(mesh);
    EXPECT_GT(r.triangles, 0u) << name;
    EXPECT_EQ(r.open_edges, 0u) << name;
    EXPECT_EQ(r.non_manifold_edges, 0u) << name;
    EXPECT_EQ(r.vertices, mesh.positions.size()) << name;
    EXPECT_EQ(r.triangles * 3, mesh.triangles.size()) << name;
    uint32_t next = 0;
    for (const MeshPart& part : mesh.parts) {
        EXPECT_EQ(part.first, next) << name;
        EXPECT_GT(part.count, 0u) << name;
        next = part.first + part.count;
    }
    EXPECT_EQ(next, r.triangles) << name;
}

template <typename T>
T at(const std::string& bytes, size_t offset) {
    T out{};
    EXPECT_LE(offset + sizeof(T), bytes.size());
    if (offset + sizeof(T) <= bytes.size()) std::memcpy(&out, bytes.data() + offset, sizeof(T));
    return out;
}

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    return s.str();
}

class MeshFile : public testing::Test {
protected:
    const TempFolder folder_;
};

TEST(WorldMesh, BundledScenesAreClosedSmoothAndSharp) {
    for (const auto& [name, description] : bundled_scenes()) {
        const auto world = World::load(name);
        ASSERT_TRUE(world);
        const Box3 box = world->field_settings.bounds.value_or(world->bounds());
        const vec3 size = box.max - box.min;
        const float cell = std::max({size.x, size.y, size.z}) / float(rounds(100));
        for (const bool sharp : {false, true}) {
            if (sharp || !kSanitized) expect_closed(mesh_of(*world, {.cell = cell, .sharp = sharp}), name);
        }
    }
}

TEST(WorldMeshSlow, BundledScenesNeverCrossThemselves) {
    for (const auto& [name, description] : bundled_scenes()) {
        const auto world = World::load(name);
        ASSERT_TRUE(world);
        const Box3 box = world->field_settings.bounds.value_or(world->bounds());
        const vec3 size = box.max - box.min;
        for (const float cells : {97.0f, 211.0f}) {
            const float cell = std::max({size.x, size.y, size.z}) / cells;
            for (const bool sharp : {false, true}) {
                const Mesh mesh = mesh_of(*world, {.cell = cell, .sharp = sharp});
                expect_closed(mesh, name);
                const auto found = field::meshes::SelfCrossings(mesh.positions, mesh.triangles).count(cell);
                EXPECT_EQ(found.apart + found.at_vertex, 0u)
                    << name << ": at " << found.example.x << ' ' << found.example.y << ' ' << found.example.z;
                std::printf("%s %s at %g m: %zu triangles\n", std::string(name).c_str(), sharp ? "sharp" : "smooth",
                            double(cell), mesh.triangles.size() / 3);
            }
        }
    }
}

TEST(WorldMesh, WhatLeavesTheBoundsIsCutThereAndCapped) {
    World world;
    Edit ground;
    ground.node.shape = Plane{};
    ASSERT_TRUE(world.add(ground));
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.5f};
    ball.node.transform.position = {0, 0.3f, 0};
    ball.op = Op::Subtract;
    ASSERT_TRUE(world.add(ball));
    const Box3 bounds{{-1.03f, -0.71f, -0.87f}, {1.01f, 1, 0.93f}};
    for (const bool sharp : {false, true}) {
        const Mesh mesh = mesh_of(world, {.cell = 0.02f, .sharp = sharp, .bounds = bounds});
        expect_closed(mesh, "ground");
        const MeshReport r = measure(mesh);
        const double cap = 0.2 * 0.2 * (3 * 0.5 - 0.2) * std::numbers::pi / 3;  // of the ball, below the ground
        EXPECT_NEAR(r.volume, 2.04 * 0.71 * 1.8 - cap, 2e-3 * 2.6);
        EXPECT_NEAR(r.bounds.min.x, bounds.min.x, 1e-3f);
        EXPECT_NEAR(r.bounds.min.y, bounds.min.y, 1e-3f);
        EXPECT_NEAR(r.bounds.max.z, bounds.max.z, 1e-3f);
        EXPECT_NEAR(r.bounds.max.y, 0, 1e-3f);
    }
}

TEST(WorldMesh, EverythingSolidIsTheBoxOfTheBounds) {
    World world;
    Edit ground;
    ground.node.shape = Plane{};
    ground.node.transform.position = {0, 50, 0};
    ASSERT_TRUE(world.add(ground));
    const Mesh mesh = mesh_of(world, {.cell = 0.05f, .sharp = true, .bounds = Box3{{-1, -1, -1}, {1, 1, 1}}});
    expect_closed(mesh, "all solid");
    EXPECT_NEAR(measure(mesh).volume, 8, 0.01);
}

TEST(WorldMesh, NothingSolidIsAnErrorThatSaysSo) {
    EXPECT_THAT(World().mesh().error().message, testing::HasSubstr("no edits"));
    World world;
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.5f};
    ASSERT_TRUE(world.add(ball));
    const auto away = world.mesh({.cell = 0.1f, .bounds = Box3{{5, 5, 5}, {6, 6, 6}}});
    ASSERT_FALSE(away);
    EXPECT_THAT(away.error().message, testing::HasSubstr("nothing"));
    EXPECT_EQ(world.mesh({.cell = -1}).error().kind, ErrorKind::Usage);
    EXPECT_EQ(world.mesh({.cell = NAN}).error().kind, ErrorKind::Usage);
    EXPECT_EQ(world.mesh({.bounds = Box3{}}).error().kind, ErrorKind::Usage);
    EXPECT_EQ(world.mesh({.simplify_share = 0}).error().kind, ErrorKind::Usage);
    const auto fine = world.mesh({.cell = 1e-5f});
    ASSERT_FALSE(fine);
    EXPECT_EQ(fine.error().kind, ErrorKind::OutOfMemory);
    EXPECT_THAT(fine.error().message, testing::HasSubstr("larger cells"));
}

TEST(WorldMesh, SeamsAreTheirOwnPartsAndColoursFollowTheBlend) {
    const Mesh mesh = mesh_of(world_with(kSeam));
    expect_closed(mesh, "seam");
    std::map<std::pair<std::string, bool>, int> parts;
    for (const MeshPart& part : mesh.parts) ++parts[{part.name, part.blended}];
    EXPECT_EQ(parts, (std::map<std::pair<std::string, bool>, int>{
                         {{"clay", false}, 1}, {{"clay", true}, 1}, {{"glow", false}, 1}, {{"glow", true}, 1}}));
    int between = 0;
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const vec3 p = mesh.positions[v], c = mesh.colors[v];
        if (p.x < 0.1f) {
            EXPECT_EQ(c, (vec3{0.7f, 0.3f, 0.2f}));
        }
        if (p.x > 0.8f) {
            EXPECT_EQ(c, (vec3{0.1f, 0.2f, 0.3f}));
        }
        // On the line between the two colours.
        const float t = (c.x - 0.7f) / (0.1f - 0.7f);
        EXPECT_NEAR(c.y, 0.3f + t * (0.2f - 0.3f), 1e-5f);
        between += t > 0.01f && t < 0.99f;
    }
    EXPECT_GT(between, 10);
}

TEST(WorldMesh, SimplifiedWorldsStayClosed) {
    const World world = world_with(kSeam);
    const Mesh whole = mesh_of(world), tenth = mesh_of(world, {.simplify_share = 0.1f}),
               near = mesh_of(world, {.simplify_error = 0.002f});
    expect_closed(tenth, "a tenth");
    expect_closed(near, "within 2 mm");
    EXPECT_NEAR(double(tenth.triangles.size()), 0.1 * double(whole.triangles.size()), 6);
    EXPECT_LT(double(near.triangles.size()), 0.55 * double(whole.triangles.size()));
    EXPECT_NEAR(measure(near).volume, measure(whole).volume, 0.001 * measure(whole).area);
}

TEST(WorldMesh, NormalsPointOutwards) {
    World world;
    Edit ball;
    ball.node.shape = Sphere{.radius = 0.5f};
    ASSERT_TRUE(world.add(ball));
    const Mesh mesh = mesh_of(world, {.cell = 0.05f});
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        EXPECT_GT(dot(mesh.normals[v], normalize(mesh.positions[v])), 0.999f);
    EXPECT_TRUE(mesh_of(world, {.cell = 0.05f, .sharp = true}).normals.empty());
}

// A small reader of binary glTF: chunks, accessors within their views within the buffer, bounds, indices.
void check_glb(const std::string& bytes, const Mesh& mesh) {
    ASSERT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(at<uint32_t>(bytes, 4), 2u);
    ASSERT_EQ(at<uint32_t>(bytes, 8), bytes.size());
    const size_t json_size = at<uint32_t>(bytes, 12);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    ASSERT_EQ(json_size % 4, 0u);
    const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
    const size_t body = 20 + json_size + 8;
    EXPECT_EQ(bytes.substr(body - 4, 4), std::string("BIN\0", 4));
    const size_t body_size = at<uint32_t>(bytes, body - 8);
    ASSERT_EQ(body + body_size, bytes.size());
    ASSERT_EQ(body_size % 4, 0u);
    EXPECT_EQ(json["buffers"].at(0)["byteLength"], body_size);
    EXPECT_EQ(json["asset"]["version"], "2.0");

    const std::map<std::string, size_t> components{{"SCALAR", 1}, {"VEC3", 3}};
    const auto floats = [&](const nlohmann::json& accessor) {
        std::vector<float> out;
        const auto& view = json["bufferViews"].at(accessor["bufferView"].get<size_t>());
        const size_t count = accessor["count"].get<size_t>() * components.at(accessor["type"]);
        EXPECT_LE(accessor["byteOffset"].get<size_t>() + 4 * count, view["byteLength"].get<size_t>());
        EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(), body_size);
        const size_t first = body + view["byteOffset"].get<size_t>() + accessor["byteOffset"].get<size_t>();
        EXPECT_EQ((first - body) % 4, 0u);
        for (size_t i = 0; i < count; ++i) out.push_back(at<float>(bytes, first + 4 * i));
        return out;
    };
    size_t triangles = 0;
    std::set<size_t> materials;
    for (const auto& primitive : json["meshes"].at(0)["primitives"]) {
        const auto& position = json["accessors"].at(primitive["attributes"]["POSITION"].get<size_t>());
        const std::vector<float> p = floats(position);
        ASSERT_EQ(p.size(), 3 * mesh.positions.size());
        for (size_t axis = 0; axis < 3; ++axis) {
            float low = INFINITY, high = -INFINITY;
            for (size_t i = axis; i < p.size(); i += 3) low = std::min(low, p[i]), high = std::max(high, p[i]);
            EXPECT_EQ(position["min"].at(axis).get<float>(), low);
            EXPECT_EQ(position["max"].at(axis).get<float>(), high);
        }
        const auto& indices = json["accessors"].at(primitive["indices"].get<size_t>());
        EXPECT_EQ(indices["componentType"], 5125);
        const size_t first = body +
                             json["bufferViews"].at(indices["bufferView"].get<size_t>())["byteOffset"].get<size_t>() +
                             indices["byteOffset"].get<size_t>();
        for (size_t i = 0; i < indices["count"].get<size_t>(); ++i) {
            const uint32_t v = at<uint32_t>(bytes, first + 4 * i);
            ASSERT_LT(v, mesh.positions.size());
            EXPECT_EQ(v, mesh.triangles[3 * triangles + i]);
        }
        triangles += indices["count"].get<size_t>() / 3;
        const auto& material = json["materials"].at(primitive["material"].get<size_t>());
        materials.insert(primitive["material"].get<size_t>());
        const bool seam = primitive["attributes"].contains("COLOR_0");
        if (seam) {  // COLOR_0 multiplies the base colour, so that must be white
            EXPECT_EQ(material["pbrMetallicRoughness"]["baseColorFactor"].at(0), 1);
            const auto colors = floats(json["accessors"].at(primitive["attributes"]["COLOR_0"].get<size_t>()));
            for (const float c : colors) EXPECT_TRUE(c >= 0 && c <= 1);
        }
        if (primitive["attributes"].contains("NORMAL")) {
            const auto n = floats(json["accessors"].at(primitive["attributes"]["NORMAL"].get<size_t>()));
            for (size_t i = 0; i < n.size(); i += 3) EXPECT_NEAR(std::hypot(n[i], n[i + 1], n[i + 2]), 1, 1e-4);
        }
        for (const auto& e : material.value("emissiveFactor", std::vector<float>{})) EXPECT_LE(e, 1);
    }
    EXPECT_EQ(triangles, mesh.triangles.size() / 3);
    EXPECT_EQ(materials.size(), json["materials"].size());
}

TEST_F(MeshFile, GlbHoldsTheMeshWithValidAccessors) {
    for (const bool sharp : {false, true}) {
        const Mesh mesh = mesh_of(world_with(kSeam), {.sharp = sharp});
        ASSERT_TRUE(mesh.save(folder_ / "a.glb"));
        check_glb(read(folder_ / "a.glb"), mesh);
    }
}

TEST_F(MeshFile, ObjHasPositiveIndicesOneVertexAPositionAndItsMaterials) {
    const Mesh mesh = mesh_of(world_with(kSeam));
    ASSERT_TRUE(mesh.save(folder_ / "a.obj"));
    std::istringstream in(read(folder_ / "a.obj"));
    std::string line;
    std::set<std::string> places;
    std::set<std::string> used;
    size_t vertices = 0, faces = 0;
    std::string library;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        std::string head;
        words >> head;
        if (head == "v") {
            places.insert(line);
            float p[3];
            words >> p[0] >> p[1] >> p[2];
            EXPECT_EQ((vec3{p[0], p[1], p[2]}), mesh.positions[vertices]) << "shortest digits come back";
            ++vertices;
        } else if (head == "f") {
            for (size_t k = 0; k < 3; ++k) {
                std::string corner;
                words >> corner;
                const long index = std::stol(corner);
                EXPECT_EQ(index, long(mesh.triangles[3 * faces + k]) + 1);
            }
            ++faces;
        } else if (head == "mtllib") {
            words >> library;
        } else if (head == "usemtl") {
            std::string name;
            words >> name;
            used.insert(name);
        }
    }
    EXPECT_EQ(vertices, mesh.positions.size());
    EXPECT_EQ(places.size(), vertices);
    EXPECT_EQ(faces, mesh.triangles.size() / 3);
    EXPECT_EQ(library, "a.mtl");
    const std::string materials = read(folder_ / "a.mtl");
    EXPECT_EQ(used.size(), mesh.parts.size());
    for (const std::string& name : used) EXPECT_THAT(materials, testing::HasSubstr("newmtl " + name + "\n"));
}

TEST_F(MeshFile, StlHoldsEveryTriangleAndItsNormal) {
    const Mesh mesh = mesh_of(world_with(kSeam), {.sharp = true});
    ASSERT_TRUE(mesh.save(folder_ / "a.stl"));
    const std::string bytes = read(folder_ / "a.stl");
    const size_t count = at<uint32_t>(bytes, 80);
    EXPECT_EQ(count, mesh.triangles.size() / 3);
    ASSERT_EQ(bytes.size(), 84 + 50 * count);
    EXPECT_FALSE(bytes.starts_with("solid"));
    double volume = 0;
    for (size_t t = 0; t < count; ++t) {
        vec3 v[4];
        for (size_t k = 0; k < 4; ++k) v[k] = at<vec3>(bytes, 84 + 50 * t + 12 * k);
        const vec3 n = cross(v[2] - v[1], v[3] - v[1]);
        EXPECT_GE(dot(n, v[0]), 0.999f * length(n));
        volume += double(dot(v[1], cross(v[2], v[3]))) / 6;
    }
    EXPECT_NEAR(volume, measure(mesh).volume, 1e-4);
}

TEST_F(MeshFile, PlyHoldsVerticesColoursAndFaces) {
    const Mesh mesh = mesh_of(world_with(kSeam));
    ASSERT_TRUE(mesh.save(folder_ / "a.ply"));
    const std::string bytes = read(folder_ / "a.ply");
    const size_t end = bytes.find("end_header\n");
    ASSERT_NE(end, std::string::npos);
    const std::string header = bytes.substr(0, end);
    EXPECT_THAT(header, testing::StartsWith("ply\nformat binary_little_endian 1.0\n"));
    EXPECT_THAT(header, testing::HasSubstr("element vertex " + std::to_string(mesh.positions.size()) + "\n"));
    size_t offset = end + 11;
    for (size_t v = 0; v < mesh.positions.size(); ++v, offset += 27) {
        EXPECT_EQ(at<vec3>(bytes, offset), mesh.positions[v]);
        if (mesh.positions[v].x < 0.1f) {  // clay, 0.7 linear
            EXPECT_EQ(at<uint8_t>(bytes, offset + 24), 218);
        }
    }
    for (size_t t = 0; t < mesh.triangles.size(); t += 3, offset += 13) {
        EXPECT_EQ(at<uint8_t>(bytes, offset), 3);
        EXPECT_EQ(at<uint32_t>(bytes, offset + 1), mesh.triangles[t]);
    }
    EXPECT_EQ(offset, bytes.size());
}

TEST_F(MeshFile, UnwritableAndUnknownNamesLeaveNothingBehind) {
    const Mesh mesh = mesh_of(world_with(kSeam), {.cell = 0.2f});
    EXPECT_EQ(mesh.save(folder_ / "none/a.glb").error().kind, ErrorKind::Failed);
    EXPECT_EQ(mesh.save(folder_ / "a.fbx").error().kind, ErrorKind::Usage);
    EXPECT_EQ(mesh.save(folder_ / "glb").error().kind, ErrorKind::Usage);
    fs::create_directory(folder_ / "b.mtl");
    EXPECT_FALSE(mesh.save(folder_ / "b.obj")) << "its material file cannot be written";
    fs::remove(folder_ / "b.mtl");
    EXPECT_TRUE(fs::is_empty(folder_.path()));
    EXPECT_EQ(mesh_format("A.GLB"), MeshFormat::Glb);
}

}  // namespace
}  // namespace kiln
