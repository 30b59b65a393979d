// SPDX-License-Identifier: MIT
// The same tetrahedron in every format, made byte by byte.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace kiln::model {

inline void put(std::string& out, uint32_t bits, int bytes, bool big = false) {
    for (int i = 0; i < bytes; ++i) out += char(bits >> (8 * (big ? bytes - 1 - i : i)) & 255u);
}
inline void put(std::string& out, float v, bool big = false) {
    uint32_t bits = 0;
    std::memcpy(&bits, &v, 4);
    put(out, bits, 4, big);
}

constexpr float kCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr uint32_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

inline std::string obj_file() {
    return "# a comment\nmtllib x.mtl\no tet\nv 0 0 0\nv 1 0 0 1.0\nv +0 1 0 0.5 0.5 0.5\r\nv 0 0 1e0\nvn 0 0 1\nvt 0 "
           "0\n"
           "g a\nusemtl m\ns off\nf 1//1 3//1 2//1\nf 1/1/1 2/1/1 \\\n4/1/1\nf -4 -1 -2 # from the last\nf 2 3 4\nl 1 "
           "2\n";
}
inline std::string off_file() {
    return "OFF # head\n# counts\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n\n0 0 1\n3 0 2 1\n3 0 1 3 255 0 0\n3 0 3 2\n3 1 2 3\n";
}
inline std::string stl_text() {
    std::string out = "solid tet\n";
    for (const auto& f : kFaces) {
        out += " facet normal 0 0 0\n  outer loop\n";
        for (const uint32_t c : f) {
            out += "   vertex";
            for (const float v : kCorners[c]) out += v == 1 ? " 1.0e+00" : " 0";
            out += "\n";
        }
        out += "  endloop\n endfacet\n";
    }
    return out + "endsolid tet\n";
}
inline std::string stl_binary() {
    std::string out = "solid and yet binary";
    out.resize(80, ' ');
    put(out, 4, 4);
    for (const auto& f : kFaces) {
        out.append(12, '\0');
        for (const uint32_t c : f)
            for (const float v : kCorners[c]) put(out, v);
        put(out, 0, 2);
    }
    return out;
}
inline std::string ply_head(const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\ncomment made by hand\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty float y\n"
           "property float z\nelement other 1\nproperty list uchar short nothing\nelement face 4\n"
           "property list uchar int vertex_indices\nproperty double quality\nend_header\n";
}
inline std::string ply_text() {
    std::string out = ply_head("ascii");
    for (const auto& c : kCorners) {
        out += "255";
        for (const float v : c) out += v == 1 ? " 1.0" : " 0";
        out += "\n";
    }
    out += "2 -7 8\n";
    for (const auto& f : kFaces)
        out += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + " 0.25\n";
    return out;
}
inline std::string ply_binary(bool big) {
    std::string out = ply_head(big ? "binary_big_endian" : "binary_little_endian");
    for (const auto& c : kCorners) {
        put(out, 200, 1);
        for (const float v : c) put(out, v, big);
    }
    put(out, 2, 1);
    put(out, 65529, 2, big);
    put(out, 8, 2, big);
    for (const auto& f : kFaces) {
        put(out, 3, 1);
        for (const uint32_t i : f) put(out, i, 4, big);
        out.append(8, '\0');
    }
    return out;
}

/// Positions, then indices of 16 bits.
inline std::string gltf_buffer() {
    std::string out;
    for (const auto& c : kCorners)
        for (const float v : c) put(out, v);
    for (const auto& f : kFaces)
        for (const uint32_t i : f) put(out, i, 2);
    return out;  // 48 + 24 bytes
}
inline std::string base64(const std::string& bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63u];
    }
    return out;
}
/// `uri`: of the buffer, empty in a .glb. `nodes`: the scene's, as JSON; node 0 is its root.
inline std::string gltf_json(const std::string& uri, const std::string& nodes = "[{\"mesh\": 0}]") {
    return "{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": " + nodes +
           ", \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}, \"indices\": 1}]}], \"accessors\": ["
           "{\"bufferView\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\", \"min\": [0, 0, 0], "
           "\"max\": [1, 1, 1]},"
           "{\"bufferView\": 1, \"componentType\": 5123, \"count\": 12, \"type\": \"SCALAR\"}], \"bufferViews\": ["
           "{\"buffer\": 0, \"byteOffset\": 0, \"byteLength\": 48}, {\"buffer\": 0, \"byteOffset\": 48, "
           "\"byteLength\": 24}], "
           "\"buffers\": [{" +
           (uri.empty() ? "" : "\"uri\": \"" + uri + "\", ") + "\"byteLength\": 72}]}";
}
inline std::string gltf_text() { return gltf_json("data:application/octet-stream;base64," + base64(gltf_buffer())); }
inline std::string glb_file() {
    std::string json = gltf_json("");
    while (json.size() % 4 != 0) json += ' ';
    const std::string bytes = gltf_buffer();
    std::string out = "glTF";
    put(out, 2, 4);
    put(out, uint32_t(12 + 8 + json.size() + 8 + bytes.size()), 4);
    put(out, uint32_t(json.size()), 4);
    out += "JSON" + json;
    put(out, uint32_t(bytes.size()), 4);
    out += std::string("BIN\0", 4) + bytes;
    return out;
}

struct File {
    const char* ending;
    std::string bytes;
};
inline std::vector<File> files() {
    return {{".obj", obj_file()},       {".off", off_file()},   {".stl", stl_text()},
            {".stl", stl_binary()},     {".ply", ply_text()},   {".ply", ply_binary(false)},
            {".ply", ply_binary(true)}, {".gltf", gltf_text()}, {".glb", glb_file()}};
}

}  // namespace kiln::model
