// SPDX-License-Identifier: MIT
// Every format gives the same triangles, and whatever bytes come, a reader answers with sound triangles or with one clear error.

#include "feed.h"
#include "files.h"

#include "temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include <sys/stat.h>

namespace kiln::model {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// Corner places of every triangle, each turned so that the least comes first.
std::vector<std::array<float, 9>> places(const Triangles& mesh) {
    std::vector<std::array<float, 9>> out;
    for (const Face& f : mesh.faces) {
        std::array<float, 9> best{};
        for (size_t turn = 0; turn < 3; ++turn) {
            std::array<float, 9> now{};
            for (size_t k = 0; k < 3; ++k) {
                const vec3 p = mesh.positions[f[(k + turn) % 3]];
                now[3 * k] = p.x;
                now[3 * k + 1] = p.y;
                now[3 * k + 2] = p.z;
            }
            if (turn == 0 || now < best) best = now;
        }
        out.push_back(best);
    }
    return out;
}

Triangles expected() {
    Triangles out;
    for (const auto& c : kCorners) out.positions.push_back({c[0], c[1], c[2]});
    for (const auto& f : kFaces) out.faces.push_back({f[0], f[1], f[2]});
    return out;
}

double volume(const Triangles& mesh) {
    double sum = 0;
    for (const Face& f : mesh.faces)
        sum += double(dot(mesh.positions[f[0]], cross(mesh.positions[f[1]], mesh.positions[f[2]])));
    return sum / 6;
}

class Folder : public testing::Test {
protected:
    std::string write(const std::string& name, const std::string& bytes) {
        std::ofstream(path_ + name, std::ios::binary) << bytes;
        return path_ + name;
    }
    const TempFolder folder_;
    const std::string path_ = folder_.string() + "/";
};
using ReadFile = Folder;

TEST_F(ReadFile, EveryFormatGivesTheSameTriangles) {
    int n = 0;
    for (const File& file : files()) {
        const auto mesh = read(write("m" + std::to_string(n++) + file.ending, file.bytes));
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(places(*mesh), places(expected())) << file.ending;
    }
    EXPECT_TRUE(read(write("LOUD.OBJ", obj_file()))) << "endings in any case";
}

TEST_F(ReadFile, BuffersBesideAGltfAreFound) {
    write("mesh.bin", gltf_buffer());
    const auto mesh = read(write("m.gltf", gltf_json("mesh.bin")));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(places(*mesh), places(expected()));
    const auto lost = read(write("lost.gltf", gltf_json("gone.bin")));
    ASSERT_FALSE(lost);
    EXPECT_THAT(lost.error().message, StartsWith(path_ + "lost.gltf: "));
    // What is no file has no bytes to wait for.
    ASSERT_EQ(::mkfifo((path_ + "pipe.bin").c_str(), 0600), 0);
    std::filesystem::create_directory(path_ + "folder.bin");
    for (const char* name : {"pipe.bin", "folder.bin"}) {
        const auto other = read(write("other.gltf", gltf_json(name)));
        ASSERT_FALSE(other);
        EXPECT_THAT(other.error().message, HasSubstr(std::string("not found : ") + name));
    }
}

TEST_F(ReadFile, WhatIsNoModelSaysWhatWouldBe) {
    std::filesystem::create_directory(path_ + "folder.obj");
    for (const std::string& path :
         {path_ + "none.obj", path_ + "folder.obj", write("m.fbx", "x"), write("noending", "x"), write("empty.obj", ""),
          write("empty.glb", ""), write("empty.stl", ""), write("empty.ply", ""), write("empty.off", ""),
          write("empty.gltf", "")}) {
        const auto mesh = read(path);
        ASSERT_FALSE(mesh) << path;
        EXPECT_EQ(mesh.error().kind, ErrorKind::Input);
        EXPECT_THAT(mesh.error().message, StartsWith(path + ":"));
        EXPECT_THAT(mesh.error().message, HasSubstr(";")) << "a mend";
        EXPECT_THAT(mesh.error().message, Not(HasSubstr(":0"))) << "lines count from 1";
    }
}

TEST(ReadGltf, NodesPlaceTheirMeshes) {
    // Twice: moved; and inside a scaled parent, mirrored, which must not turn it inside out.
    const std::string nodes =
        "[{\"children\": [1, 2]}, {\"mesh\": 0, \"translation\": [10, 0, 0]},"
        "{\"scale\": [2, 2, 2], \"rotation\": [0, 0.7071068, 0, 0.7071068], \"children\": [3]},"
        "{\"mesh\": 0, \"matrix\": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,5,0,1]}]";
    const auto mesh =
        parse_gltf(gltf_json("data:application/octet-stream;base64," + base64(gltf_buffer()), nodes), "m", "");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->faces.size(), 8u);
    EXPECT_NEAR(volume(*mesh), 1.0 / 6 + 8.0 / 6, 1e-5);
    vec3 lo = mesh->positions[0], hi = lo;
    for (const vec3& p : mesh->positions) {
        lo = min(lo, p);
        hi = max(hi, p);
    }
    // (-x, y + 5, z) doubled and turned a quarter about Y: x <- z, z <- -x.
    EXPECT_NEAR(lo.x, 0, 1e-5);
    EXPECT_NEAR(hi.x, 11, 1e-5);
    EXPECT_NEAR(hi.y, 12, 1e-5);
    EXPECT_NEAR(hi.z, 2, 1e-5);
}

TEST(ReadGltf, StripsAndFansAreTriangles) {
    for (const auto& [mode, faces] : {std::pair(5, 2u), std::pair(6, 2u)}) {
        std::string text = gltf_text();
        text.replace(text.find("\"indices\": 1"), 12, "\"mode\": " + std::to_string(mode));
        const auto mesh = parse_gltf(text, "m", "");
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->faces.size(), faces);
    }
}

TEST(ReadModel, PolygonsBecomeFans) {
    const auto obj = parse_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0.5 0\nf 1 2 3 4 5\n", "m");
    ASSERT_TRUE(obj);
    EXPECT_EQ(obj->faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
    const auto off = parse_off("OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "m");
    ASSERT_TRUE(off) << off.error().message;
    EXPECT_EQ(off->faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}}));
}

// {"a":{"a": … 1}} with braces, [[ … ]] with brackets.
std::string nested(char open, char close, size_t deep) {
    std::string out;
    for (size_t i = 0; i < deep; ++i) out += open == '{' ? "{\"a\":" : "[";
    return out + (open == '{' ? "1" : "") + std::string(deep, close);
}

// A binary file of this text alone.
std::string glb_of(const std::string& json) {
    const auto word = [](size_t value) {
        std::string out;
        for (int i = 0; i < 4; ++i) out += char(uint8_t(value >> (8 * i)));
        return out;
    };
    return "glTF" + word(2) + word(json.size() + 20) + word(json.size()) + "JSON" + json;
}

TEST(ReadModel, FaultsSayWhereAndWhatToDo) {
    const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
        text.replace(text.find(from), from.size(), to);
        return text;
    };
    std::string many = stl_binary();
    many[83] = '\x7f';
    const struct {
        std::string ending, bytes, says;
    } cases[] = {
        {".obj", "v 0 0 0\nv 1 0\n", "m.obj:2: "},
        {".obj", "v 0 0 0\nf 1 2 3\n", "names corner 2"},
        {".obj", "v 0 0 0\nf 0 0 0\n", "names corner 0"},
        {".obj", "v 0 0 0\nf 1 1\n", "fewer than three"},
        {".obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "finite"},
        {".obj", "v 0 0 0\nv 1 0 0\nv 0 1e30 0\nf 1 2 3\n", "at most 1000000"},
        {".obj", "v 0 0 0\n", "has no triangles"},
        {".off", "OFF\n99999999999 1 0\n", "m.off:2: "},
        {".off", "PLY\n", "begins with the word OFF"},
        {".off", "OFF\n1 1 0\n0 0 0\n3 0 0 7\n", "names corner 7 of 1"},
        {".stl", many, "promises 2130706436 triangles"},
        {".stl", "solid x\nvertex 0 0 zero\n", "m.stl:2: "},
        {".stl", "solid x\nvertex 0 0 0\n", "inside a triangle"},
        {".ply", replaced(ply_text(), "vertex 4", "vertex 4000000000"), "more than the file can hold"},
        {".ply", replaced(ply_binary(true), "face 4", "face 5"), "face 4 of 5"},
        {".ply", replaced(ply_text(), "float x", "float q"), "finite"},
        {".ply", ply_text().substr(0, ply_text().find("end_header")), "end_header"},
        {".ply", replaced(ply_text(), "ascii", "fancy"), "fancy"},
        {".gltf", "{}", "m.gltf: "},
        {".gltf", replaced(gltf_text(), "\"count\": 12", "\"count\": 99"), "outside its buffer"},
        {".gltf", replaced(gltf_text(), "\"count\": 4", "\"count\": 3"), "corner 3 of 3"},
        {".gltf", replaced(gltf_text(), "\"POSITION\": 0", "\"POSITION\": 7"), "does not exist"},
        {".gltf", replaced(gltf_text(), "{\"mesh\": 0}", "{\"mesh\": 0, \"children\": [0]}"), "contains itself"},
        {".gltf",
         replaced(gltf_text(), "\"scene\": 0",
                  "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"scene\": 0"),
         "without compression"},
        {".gltf", replaced(gltf_text(), "\"scene\": 0", "\"extensionsRequired\": [\"KHR_warp\"], \"scene\": 0"),
         "needs KHR_warp, which is not read; export it without"},
        {".gltf", replaced(gltf_text(), "\"scene\": 0", "\"extras\": " + nested('[', ']', 600) + ", \"scene\": 0"),
         "nested more than 512 deep"},
        {".gltf", replaced(gltf_text(), "\"scene\": 0", "\"extras\": " + nested('{', '}', 200000) + ", \"scene\": 0"),
         "nested more than 512 deep"},
        {".glb",
         glb_of(replaced(gltf_text(), "\"scene\": 0", "\"extras\": " + nested('[', ']', 200000) + ", \"scene\": 0")),
         "nested more than 512 deep"},
        {".gltf",
         replaced(gltf_text(), "\"uri\": \"",
                  "\"uri\": \"data:application/octet-stream;base64,!" + std::string(9999, 'A')),
         " ...; export it again"},
    };
    for (const auto& [ending, bytes, says] : cases) {
        const auto mesh = parse(ending, bytes);
        ASSERT_FALSE(mesh) << ending << bytes;
        EXPECT_EQ(mesh.error().kind, ErrorKind::Input);
        EXPECT_THAT(mesh.error().message, StartsWith("m" + ending + ":"));
        EXPECT_THAT(mesh.error().message, HasSubstr(says));
        EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos) << mesh.error().message;
        EXPECT_LT(mesh.error().message.size(), 300u);
    }
    // Brackets in a text are none, and what only changes looks is no reason to refuse a solid.
    const std::string text = std::string(1000, '[') + "\\\"" + std::string(1000, '{');
    const auto fine = parse(".gltf", replaced(gltf_text(), "\"scene\": 0",
                                              "\"extensionsRequired\": [\"KHR_materials_unlit\"], "
                                              "\"extras\": \"" +
                                                  text + "\", \"scene\": 0"));
    EXPECT_TRUE(fine) << fine.error().message;
    EXPECT_TRUE(parse(
        ".gltf", replaced(gltf_text(), "\"scene\": 0", "\"extras\": " + nested('[', ']', 500) + ", \"scene\": 0")));
}

// ---- Any bytes.

void feed(const std::string& ending, const std::string& bytes) {
    ASSERT_EQ(triangles_complaint(parse(ending, bytes), "m" + ending), "");
}

TEST(ModelFuzz, EveryTruncation) {
    for (const File& file : files())
        for (size_t n = 0; n < file.bytes.size(); ++n) feed(file.ending, file.bytes.substr(0, n));
}

TEST(ModelFuzz, EveryBitFlip) {
    for (const File& file : files()) {
        for (size_t at = 0; at < file.bytes.size(); ++at) {
            for (int bit = 0; bit < 8; ++bit) {
                std::string bytes = file.bytes;
                bytes[at] = char(uint8_t(bytes[at]) ^ (1u << bit));
                feed(file.ending, bytes);
            }
        }
    }
}

TEST(ModelFuzz, ExtremeNumbersEverywhere) {
    // Binary: four bytes of all ones, of the largest positive, of NaN. Text: each number in turn becomes a wild one.
    for (const File& file : files()) {
        for (size_t at = 0; at + 4 <= file.bytes.size(); ++at) {
            for (const char* four : {"\xff\xff\xff\xff", "\xff\xff\xff\x7f", "\x00\x00\xc0\x7f", "\x7f\xff\xff\xff"}) {
                std::string bytes = file.bytes;
                std::copy(four, four + 4, bytes.begin() + long(at));
                feed(file.ending, bytes);
            }
            const auto digit = [&](size_t i) { return file.bytes[i] >= '0' && file.bytes[i] <= '9'; };
            if (!digit(at) || (at > 0 && digit(at - 1))) continue;
            for (const char* wild : {"-1", "4294967295", "99999999999999999999", "1e39", "nan", "-2147483648", "0.5"})
                feed(file.ending, file.bytes.substr(0, at) + wild + file.bytes.substr(at + 1));
        }
    }
}

TEST(ModelFuzz, PiecesInWrongOrder) {
    std::mt19937 random(5);
    for (const File& file : files()) {
        for (int round = 0; round < 2000; ++round) {
            std::string bytes = file.bytes;
            const size_t from = random() % bytes.size(), count = random() % 40, to = random() % bytes.size();
            const std::string piece = bytes.substr(from, count);
            round % 2 == 0 ? bytes.insert(to, piece) : bytes.erase(from, count);
            feed(file.ending, bytes);
        }
    }
}

}  // namespace
}  // namespace kiln::model
