// SPDX-License-Identifier: MIT
// Files of shapes, loaded once each: height images and meshes, named by number in what the compiler reads, and models, whose text takes
// the name's place.
#pragma once

#include "model/bake.h"
#include "sdf/program.h"

#include <kiln/shapes.h>

#include <map>
#include <string>
#include <vector>

namespace kiln::scene {

/// Images by file name as the scene writes it; kept between compilations.
struct Grids {
    std::vector<sdf::HeightGrid> grids;
    std::map<std::string, uint32_t> by_file;

    /// What was found in a mesh, in the order of first use; beside `meshes`.
    struct MeshNote {
        std::string file;
        int resolution = 0;
        model::BakeReport report;
    };
    std::vector<sdf::MeshGrid> meshes;
    std::vector<MeshNote> mesh_notes;
    std::map<std::pair<std::string, int>, uint32_t> by_mesh;  ///< file and resolution
    std::map<std::string, std::string> models;                ///< text by file name
};

/// What stands in "file" of a sampled shape: an example and what it is.
struct Resource {
    std::string_view example, what;
};
inline Resource resource_of(uint16_t shape_kind) {
    if (ShapeKind(shape_kind) == ShapeKind::SampledMesh)
        return {"bunny.obj", "a model (.glb, .gltf, .obj, .off, .ply, .stl)"};
    return {"heights.png", "a PNG image"};
}

/// The grey values (of colours: red) of a PNG image, 0 for black and 1 for white, as they stand (no gamma).
Result<sdf::HeightGrid> load_heights(const std::string& path);

/// What sdf::compile reads. Edits and objects are copied only when some shape has a file.
struct GridSource {
    std::span<const Edit> edits;
    std::span<const Object> objects;
    std::vector<Edit> own_edits;
    std::vector<Object> own_objects;
    const Grids* grids = nullptr;

    sdf::Source source() const { return {edits, objects, grids->grids, {}, 0, grids->meshes}; }
};

/// Loads what is missing from `grids`, which must outlive the result. `folder` is put before relative names.
Result<GridSource> with_grids(std::span<const Edit> edits, const std::vector<Object>& objects,
                              const std::string& folder, Grids& grids, sdf::Fault* fault = nullptr);

}  // namespace kiln::scene
