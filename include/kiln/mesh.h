// SPDX-License-Identifier: MIT
// Meshes of a world's surface, for other programs and for files:
//   auto mesh = world.mesh({.cell = 0.01f, .sharp = true});   mesh->save("part.glb");
// A mesh is closed and a manifold: what leaves the bounds is cut there and capped.
#pragma once

#include <kiln/edit.h>
#include <kiln/math.h>
#include <kiln/result.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

struct MeshSettings {
    float cell = 0;      ///< metres between samples; 0: the world's voxel size
    bool sharp = false;  ///< keeps edges and corners of shapes; else marching cubes, rounder and with smooth normals
    std::optional<Box3> bounds{};  ///< where the mesh is cut; none: the field's bounds
    float simplify_share = 1;      ///< (0, 1]: triangles to keep, where simplify_error allows it
    float simplify_error = 0;  ///< metres the surface may move by simplifying; 0: any, where simplify_share is below 1
    int workers = 0;           ///< 0: all cores; the mesh does not depend on it
};

/// Consecutive triangles of one material.
struct MeshPart {
    std::string name;  ///< the material's
    Material material;
    bool blended = false;  ///< a seam where materials blend: Mesh::colors and the like say how, vertex by vertex
    uint32_t first = 0;    ///< triangle
    uint32_t count = 0;    ///< triangles
};

enum class MeshFormat : uint8_t { Glb, Obj, Stl, Ply };

/// Vertices and triangles in metres, right-handed, +Y up; anticlockwise as seen from outside.
struct Mesh {
    std::vector<vec3> positions;
    std::vector<vec3> normals;        ///< unit; empty in sharp meshes, whose creases have no one normal
    std::vector<vec3> colors;         ///< base colour, linear
    std::vector<float> roughness;     ///< as in Material
    std::vector<float> metallic;      ///< likewise
    std::vector<uint32_t> triangles;  ///< three vertices each
    std::vector<MeshPart> parts;      ///< cover all triangles, in order

    /// Writes .glb, .obj (with an .mtl beside it), .stl or .ply. The file appears whole or not at all.
    Result<void> save(const std::string& path) const;
    /// The file's bytes; an .obj's name no material file.
    Result<std::string> encode(MeshFormat format) const;
};

/// The format that a file name's ending stands for.
std::optional<MeshFormat> mesh_format(std::string_view path);

/// What can be measured on a mesh.
struct MeshReport {
    uint64_t vertices = 0, triangles = 0;
    uint64_t open_edges = 0;          ///< of one triangle: holes
    uint64_t non_manifold_edges = 0;  ///< of more than two triangles, or of two that face opposite ways
    double volume = 0;                ///< cubic metres
    double area = 0;                  ///< square metres
    Box3 bounds;
};
MeshReport measure(const Mesh& mesh);

}  // namespace kiln
