// SPDX-License-Identifier: MIT
// Exact answers: the compiled list of edits evaluated in double precision. Parts of the list that cannot matter near a question
// are pruned first, which does not change the answer (sdf/prune.h). Any thread.
#pragma once

#include "sdf/eval.h"
#include "sdf/program.h"

#include <kiln/query.h>

#include <span>

namespace kiln::scene {

class ExactField {
public:
    explicit ExactField(const sdf::Program& program) : program_(program) {}

    /// Metres; +infinity where nothing exists.
    double distance(dvec3 p) const;
    FieldSample sample(vec3 p) const;
    void sample(std::span<const vec3> points, FieldSample* out) const;
    /// RayHit::edit.index is the edit's row in the program; its generation is 0.
    RayHit cast(const Ray& ray) const;

private:
    const sdf::Program& program_;
};

/// Material of a number in tapes and bricks; none for the default grey.
inline MaterialId material_of(uint32_t number) {
    return number == sdf::kDefaultMaterial || number == sdf::kNoMaterial ? MaterialId{} : MaterialId{number - 1, 0};
}

}  // namespace kiln::scene
