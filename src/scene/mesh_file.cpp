// SPDX-License-Identifier: MIT
// OBJ with its material file, binary STL, binary PLY; and Mesh::save.
#include "scene/mesh_file.h"

#include "base/atomic_file.h"
#include "base/format.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

namespace kiln {
namespace scene {
namespace {

void append(std::string& out, float v) {
    char buffer[40];
    out += ' ';
    out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
}
void append(std::string& out, vec3 v) { append(out, v.x), append(out, v.y), append(out, v.z); }

template <typename T>
void append_bytes(std::string& out, const T& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// A material's name in files of words: no spaces, no control characters.
std::string word(const std::string& name) {
    std::string out = name.empty() ? "_" : name;
    for (char& c : out)
        if (static_cast<unsigned char>(c) <= ' ' || c == 127 || c == '#') c = '_';
    return out;
}

uint8_t srgb_of(float linear) {
    const float v = std::clamp(linear, 0.0f, 1.0f);
    const float encoded = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
    return uint8_t(encoded * 255 + 0.5f);
}

}  // namespace

std::vector<std::string> part_names(const Mesh& mesh) {
    std::vector<std::string> out;
    for (const MeshPart& part : mesh.parts) {
        std::string name = part.name + (part.blended ? " (seam)" : "");
        while (std::find(out.begin(), out.end(), name) != out.end()) name += "'";
        out.push_back(std::move(name));
    }
    return out;
}

std::string encode_obj(const Mesh& mesh, const std::string& material_file) {
    std::string out = "# Kiln: metres, +Y up\n";
    if (!material_file.empty()) out += "mtllib " + material_file + "\n";
    out.reserve(mesh.positions.size() * 64 + mesh.triangles.size() * 10);
    for (const vec3 p : mesh.positions) out += "v", append(out, p), out += '\n';
    for (const vec3 n : mesh.normals) out += "vn", append(out, n), out += '\n';
    const std::vector<std::string> names = part_names(mesh);
    for (size_t i = 0; i < mesh.parts.size(); ++i) {
        if (!material_file.empty()) out += "usemtl " + word(names[i]) + "\n";
        const MeshPart& part = mesh.parts[i];
        for (size_t t = part.first; t < size_t(part.first) + part.count; ++t) {
            out += 'f';
            for (size_t k = 0; k < 3; ++k) {
                const std::string number = std::to_string(uint64_t(mesh.triangles[3 * t + k]) + 1);
                out += ' ' + number;
                if (!mesh.normals.empty()) out += "//" + number;
            }
            out += '\n';
        }
    }
    return out;
}

std::string encode_mtl(const Mesh& mesh) {
    std::string out = "# Kiln: linear colours\n";
    const std::vector<std::string> names = part_names(mesh);
    for (size_t i = 0; i < mesh.parts.size(); ++i) {
        const Material& m = mesh.parts[i].material;
        out += "newmtl " + word(names[i]) + "\nKd";
        append(out, m.base_color);
        if (m.emissive != vec3{}) out += "\nKe", append(out, m.emissive);
        out += "\nPr", append(out, m.roughness);
        out += "\nPm", append(out, m.metallic);
        out += "\nd", append(out, m.opacity);
        out += "\nillum 2\n";
    }
    return out;
}

std::string encode_stl(const Mesh& mesh) {
    std::string out = "Kiln: binary STL, metres, +Y up";  // readers take a file that starts with "solid" for text
    out.resize(80);
    append_bytes(out, uint32_t(mesh.triangles.size() / 3));
    out.reserve(84 + mesh.triangles.size() / 3 * 50);
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
        const vec3 a = mesh.positions[mesh.triangles[t]], b = mesh.positions[mesh.triangles[t + 1]],
                   c = mesh.positions[mesh.triangles[t + 2]];
        const vec3 n = cross(b - a, c - a);
        const float size = length(n);
        append_bytes(out, size > 0 ? n / size : vec3{});
        append_bytes(out, a), append_bytes(out, b), append_bytes(out, c);
        append_bytes(out, uint16_t(0));
    }
    return out;
}

std::string encode_ply(const Mesh& mesh) {
    std::string out = "ply\nformat binary_little_endian 1.0\ncomment Kiln: metres, +Y up, sRGB colours\n";
    out += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
    out += "property float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
    out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    out += "element face " + std::to_string(mesh.triangles.size() / 3) +
           "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        append_bytes(out, mesh.positions[v]);
        if (!mesh.normals.empty()) append_bytes(out, mesh.normals[v]);
        for (const float c : {mesh.colors[v].x, mesh.colors[v].y, mesh.colors[v].z}) append_bytes(out, srgb_of(c));
    }
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
        out += char(3);
        for (size_t k = 0; k < 3; ++k) append_bytes(out, mesh.triangles[t + k]);
    }
    return out;
}

}  // namespace scene

std::optional<MeshFormat> mesh_format(std::string_view path) {
    std::string ending(path.substr(std::min(path.rfind('.'), path.size())));
    for (char& c : ending)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    if (ending == ".glb") return MeshFormat::Glb;
    if (ending == ".obj") return MeshFormat::Obj;
    if (ending == ".stl") return MeshFormat::Stl;
    if (ending == ".ply") return MeshFormat::Ply;
    return std::nullopt;
}

Result<std::string> Mesh::encode(MeshFormat format) const {
    switch (format) {
    case MeshFormat::Glb:
        return scene::encode_glb(*this);
    case MeshFormat::Obj:
        return scene::encode_obj(*this, "");
    case MeshFormat::Stl:
        return scene::encode_stl(*this);
    case MeshFormat::Ply:
        return scene::encode_ply(*this);
    }
    return Error{"there is no such mesh format", ErrorKind::Usage};
}

Result<void> Mesh::save(const std::string& path) const {
    const std::optional<MeshFormat> format = mesh_format(path);
    if (!format) return Error{formatted("{}: a mesh's name ends in .glb, .obj, .stl or .ply", path), ErrorKind::Usage};
    const auto write = [](AtomicFile& file, const std::string& bytes) { return file.write(bytes); };
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    if (*format != MeshFormat::Obj) {
        const auto bytes = encode(*format);
        if (!bytes) return bytes.error();
        if (auto ok = write(*file, *bytes); !ok) return ok;
        return file->commit();
    }
    // The material file first: a mesh without its materials is whole, a name of nothing is not.
    const std::string materials = path.substr(0, path.size() - 4) + ".mtl";
    auto other = AtomicFile::create(materials);
    if (!other) return other.error();
    if (auto ok = write(*other, scene::encode_mtl(*this)); !ok) return ok;
    if (auto ok = write(*file, scene::encode_obj(*this, materials.substr(materials.rfind('/') + 1))); !ok) return ok;
    if (auto ok = other->commit(); !ok) return ok;
    return file->commit();
}

}  // namespace kiln
