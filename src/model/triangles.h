// SPDX-License-Identifier: MIT
// Triangle meshes as files hold them: positions and corner numbers, nothing more. What is read here becomes a shape in bake.h.
// Every reader takes any bytes: it answers triangles whose corners exist and are finite, or one error "NAME: what; mend".
#pragma once

#include <kiln/math.h>
#include <kiln/result.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::model {

using Face = std::array<uint32_t, 3>;

struct Triangles {
    std::vector<vec3> positions;  ///< as the file writes them: its own unit, its own up
    std::vector<Face> faces;      ///< anticlockwise seen from outside, where the file is right about that
};

/// Most triangles or corners of one file.
inline constexpr size_t kMostTriangles = size_t(1) << 26;

/// By the ending of the name: .obj .stl .ply .off .gltf .glb. Any thread.
Result<Triangles> read(const std::string& path);

/// Endings that read() knows, for messages.
inline constexpr std::string_view kModelEndings = ".glb, .gltf, .obj, .off, .ply or .stl";
bool has_model_ending(std::string_view path);
/// glTF is in metres with +Y up by itself; the other formats do not say.
bool is_gltf(std::string_view path);

// The formats. `name` stands in errors.
Result<Triangles> parse_obj(std::string_view text, const std::string& name);
Result<Triangles> parse_off(std::string_view text, const std::string& name);
Result<Triangles> parse_ply(std::string_view bytes, const std::string& name);
Result<Triangles> parse_stl(std::string_view bytes, const std::string& name);
/// `folder`, with its slash, is where buffers outside the file are.
Result<Triangles> parse_gltf(std::string_view bytes, const std::string& name, const std::string& folder);

/// What every reader ends with: triangles, corners in range, finite positions.
Result<Triangles> checked(Triangles mesh, const std::string& name);

}  // namespace kiln::model
