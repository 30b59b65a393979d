// SPDX-License-Identifier: MIT
// What every reader of models promises of any bytes, for the deterministic tests and for libFuzzer. Each answers the broken promise, or
// nothing. `name` is the file's, as the reader was told.
#pragma once

#include "complaint.h"
#include "model/drawable.h"
#include "model/triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

namespace kiln::model {

inline std::string triangles_complaint(const Result<Triangles>& mesh, const std::string& name) {
    if (!mesh) return error_complaint(mesh.error(), name);
    if (mesh->faces.empty()) return "no triangles and no error";
    for (const Face& f : mesh->faces)
        for (const uint32_t c : f) {
            if (c >= mesh->positions.size()) return "a face names a corner that is none";
            if (!std::isfinite(length(mesh->positions[c]))) return "a corner that is nowhere";
        }
    return "";
}

inline std::string drawable_complaint(const Result<Drawable>& drawable, const std::string& name) {
    if (!drawable) return error_complaint(drawable.error(), name);
    const Drawable& d = *drawable;
    if (!std::ranges::all_of(d.indices, [&](uint32_t c) { return c < d.vertices.size(); }))
        return "an index beyond the vertices";
    for (const Primitive& p : d.primitives) {
        if (p.surface >= d.surfaces.size()) return "a primitive of no surface";
        if (size_t(p.first_index) + p.index_count > d.indices.size()) return "a primitive beyond the indices";
    }
    for (const Vertex& v : d.vertices)
        if (!std::isfinite(v.position.x + v.normal.x + v.uv[0].x + v.tangent.x)) return "a vertex that is not finite";
    for (const Matrix& m : pose(d, 0.3))
        if (std::isnan(m[0])) return "a node of no place";
    for (const Image& image : d.images)
        if (image.rgba.size() != size_t(4) * size_t(image.width) * size_t(image.height))
            return "an image whose size is not that of its texels";
    return "";
}

// The readers in memory, each by its ending. Files beside the model are not looked for.
inline constexpr std::array<std::string_view, 6> kReaders{".obj", ".off", ".stl", ".ply", ".gltf", ".glb"};
inline Result<Triangles> parse(std::string_view ending, std::string_view bytes) {
    const std::string name = "m" + std::string(ending);
    if (ending == ".obj") return parse_obj(bytes, name);
    if (ending == ".off") return parse_off(bytes, name);
    if (ending == ".stl") return parse_stl(bytes, name);
    if (ending == ".ply") return parse_ply(bytes, name);
    return parse_gltf(bytes, name, "/nowhere/");
}

}  // namespace kiln::model
