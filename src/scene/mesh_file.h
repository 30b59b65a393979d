// SPDX-License-Identifier: MIT
// Mesh files as bytes.
#pragma once

#include <kiln/mesh.h>

namespace kiln::scene {

/// Binary glTF 2.0: a primitive a part; seams carry COLOR_0 over a white material, and _ROUGHNESS and _METALLIC beside it.
Result<std::string> encode_glb(const Mesh& mesh);
/// `material_file`: what mtllib names; empty for none.
std::string encode_obj(const Mesh& mesh, const std::string& material_file);
std::string encode_mtl(const Mesh& mesh);
std::string encode_stl(const Mesh& mesh);
std::string encode_ply(const Mesh& mesh);

/// Names of the parts' materials in a file, by part: a seam's differs from its material's own.
std::vector<std::string> part_names(const Mesh& mesh);

}  // namespace kiln::scene
