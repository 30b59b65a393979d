// SPDX-License-Identifier: MIT
// Which reader a file gets, and what all of them promise.

#include "model/drawable.h"
#include "model/triangles.h"

#include "base/format.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sys/stat.h>

namespace kiln::model {
namespace {

/// Farther out a float is coarser than half a metre.
constexpr float kFarthest = 1e6f;

std::string ending(std::string_view path) {
    const size_t dot = path.find_last_of("./");
    if (dot == std::string_view::npos || path[dot] == '/') return {};
    std::string out(path.substr(dot));
    for (char& c : out) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    return out;
}

Result<std::string> bytes_of(const std::string& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0)
        return Error{formatted("{}: cannot be read: {}; check the name", path, std::strerror(errno)), ErrorKind::Input};
    if (!S_ISREG(info.st_mode))
        return Error{path + ": is not a file; name a model, ending in " + std::string(kModelEndings), ErrorKind::Input};
    std::ifstream in(path, std::ios::binary);
    std::string bytes(size_t(info.st_size), '\0');
    if (!in || !in.read(bytes.data(), std::streamsize(bytes.size())))
        return Error{path + ": cannot be read; check its permissions", ErrorKind::Input};
    return bytes;
}

}  // namespace

bool has_model_ending(std::string_view path) {
    const std::string e = ending(path);
    return e == ".obj" || e == ".stl" || e == ".ply" || e == ".off" || e == ".gltf" || e == ".glb";
}

bool is_gltf(std::string_view path) { return ending(path) == ".gltf" || ending(path) == ".glb"; }

namespace {

Result<std::string> model_bytes(const std::string& path) {
    if (!has_model_ending(path))
        return Error{formatted("{}: not a kind of model that is read; the name must end in {}", path, kModelEndings),
                     ErrorKind::Input};
    return bytes_of(path);
}

}  // namespace

Result<Triangles> read(const std::string& path) {
    const std::string e = ending(path);
    const auto bytes = model_bytes(path);
    if (!bytes) return bytes.error();
    if (e == ".obj") return parse_obj(*bytes, path);
    if (e == ".stl") return parse_stl(*bytes, path);
    if (e == ".ply") return parse_ply(*bytes, path);
    if (e == ".off") return parse_off(*bytes, path);
    return parse_gltf(*bytes, path, path.substr(0, path.find_last_of('/') + 1));
}

Result<Drawable> read_drawable(const std::string& path) {
    if (!is_gltf(path)) {
        auto triangles = read(path);
        if (!triangles) return triangles.error();
        return drawable_of(*triangles, path);
    }
    const auto bytes = model_bytes(path);
    if (!bytes) return bytes.error();
    return parse_gltf_drawable(*bytes, path, path.substr(0, path.find_last_of('/') + 1));
}

Result<Triangles> checked(Triangles mesh, const std::string& name) {
    const auto fault = [&](const std::string& what) { return Error{name + ": " + what, ErrorKind::Input}; };
    if (mesh.faces.empty()) return fault("has no triangles; export the model as a triangle mesh");
    if (mesh.faces.size() > kMostTriangles)
        return fault(formatted("has {} triangles; at most {}: simplify the model", mesh.faces.size(), kMostTriangles));
    for (size_t f = 0; f < mesh.faces.size(); ++f) {
        for (const uint32_t corner : mesh.faces[f]) {
            if (corner >= mesh.positions.size())
                return fault(formatted("triangle {} names corner {} of {}; the file is damaged, export it again", f,
                                       corner, mesh.positions.size()));
            const vec3 p = mesh.positions[corner];
            const float far = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
            if (!(far <= kFarthest) || std::isnan(p.x + p.y + p.z))
                return fault(formatted("corner {} is at ({}, {}, {}); coordinates must be finite and at most 1000000",
                                       corner, p.x, p.y, p.z));
        }
    }
    return mesh;
}

}  // namespace kiln::model
