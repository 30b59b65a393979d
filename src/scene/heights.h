// SPDX-License-Identifier: MIT
// Files of shapes, loaded once each: height images, named by number in what the compiler reads, and models, whose text takes the
// name's place.
#pragma once

#include "sdf/program.h"

#include <map>
#include <string>
#include <vector>

namespace kiln::scene {

/// Images by file name as the scene writes it; kept between compilations.
struct Grids {
    std::vector<sdf::HeightGrid> grids;
    std::map<std::string, uint32_t> by_file;
    std::map<std::string, std::string> models;  ///< text by file name
};

/// The grey values (of colours: red) of a PNG image, 0 for black and 1 for white, as they stand (no gamma).
Result<sdf::HeightGrid> load_heights(const std::string& path);

/// What sdf::compile reads. Edits and objects are copied only when some shape has a file.
struct GridSource {
    std::span<const Edit> edits;
    std::span<const Object> objects;
    std::vector<Edit> own_edits;
    std::vector<Object> own_objects;
    const Grids* grids = nullptr;

    sdf::Source source() const { return {edits, objects, grids->grids}; }
};

/// Loads what is missing from `grids`, which must outlive the result. `folder` is put before relative names.
Result<GridSource> with_grids(std::span<const Edit> edits, const std::vector<Object>& objects,
                              const std::string& folder, Grids& grids, sdf::Fault* fault = nullptr);

}  // namespace kiln::scene
