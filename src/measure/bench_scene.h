// SPDX-License-Identifier: MIT
// What `bench field` measures: a scene of the recipes, or one from a file, which nobody tuned anything on. Questions are those of the
// recipes in either, brought from the cube [-1, 1]^3 to the scene's box.
#pragma once

#include "measure/bench_run.h"

#include "field/field.h"
#include "sdf/program.h"

#include <kiln/edit.h>
#include <kiln/query.h>

#include <memory>
#include <string>
#include <vector>

namespace kiln::measure {

struct BenchScene {
    std::shared_ptr<const sdf::Program> program;
    field::FieldOptions options;  ///< `resolution` voxels along the longest side of the bounds
    std::vector<Edit> edits;      ///< of a recipe; none of a file, whose objects and images they would need beside them
    int kind = 0;
    std::string file;  ///< none: a recipe

    vec3 middle() const;
    float half() const;  ///< metres, of the longest side
    /// Uniform in the bounds.
    std::vector<vec3> points(uint32_t count) const;
    /// From in front of the bounds, all of which the picture shows.
    std::vector<Ray> rays(int width, int height) const;
};

BenchScene recipe_scene(int kind, const BenchOptions& options);
/// The scene's solids in one level, but for those that move as a whole.
Result<BenchScene> file_scene(const BenchOptions& options);

}  // namespace kiln::measure
