// SPDX-License-Identifier: MIT
// Still texels: bricks whose code an update changes, but nothing that they hold. Culling sees a brick as a ball; here an edit that came or went
// is held against the stored texels themselves, for the price of that one edit. Of the bricks that a bite culls into, two of three stay.
//
// Say that an edit's value, of reach k, is at a texel above w + k + S: w what is stored there, S the reaches of later edits. Then the world has
// one value there with it and without it: the proof beside EditIndex::blend_allowance(), for T = w, has both worlds above T or equal, and one of
// them is w. (Where w is cut off at the band, both are beyond it or equal.) For a cut all of this is upside down. And where a texel is at
// the far end inside, no union that comes can change it: worlds grow with what they are made of, and so do their ends.
// For T = o, what a cell must come nearer than to own a brick, the same says that an empty cell throughout which the edit's value is above o + k + S
// stays as it is. Outside, the world is above T with it and without, or has one value; inside, where the world is below -o, it is not above T, so it
// has one value. For a cut, turned round, inside is above and outside one value.
//
// An edit that comes without blend, and before none but others of its kind, makes of the world the least of both (a cut: the greatest of the
// world and its negative), whatever the order among them. Storing is monotone: so what is stored becomes the least of what was and the
// edit's own, bit for bit.
#pragma once

#include "field/brick_content.h"
#include "field/cell_maker.h"

#include <span>
#include <vector>

namespace kiln::field {

class StillTexels {
public:
    struct Change {
        uint32_t row;
        bool gone;
        bool anywhere;    ///< see cells_reached()
        CellBox reached;  ///< cells in which it may change what is stored
    };
    StillTexels(const sdf::Program& program, const CellLattice& lattice, std::vector<Change> changes);

    /// What is asked next is about cells that these rows reach, of the program as it is now.
    void see(std::span<const uint32_t> rows);
    /// Whether bricks of these cells come to be what joined() says.
    bool joins() const { return joins_; }
    /// Of 64 cells, from the program's values at their centres. Which to ask about is a guess that keeps the price of asking in vain low.
    StillCells look(const sdf::Balls& centres, const float* values) const;
    /// Whether the brick of a cell holds after all changes what it held before. `only`: ListCuller::only_material() of its new code.
    bool hold(ivec3 cell, ivec3 first_texel, const BrickContent& brick, uint16_t only, BrickEvaluator& evaluator) const;

    /// What a brick holds after the one change that joins(), see BrickEvaluator::joined(); empty where the world is to be asked. `only`: as above.
    BrickContent joined(ivec3 first_texel, const BrickContent& brick, uint16_t only, BrickEvaluator& evaluator) const;

private:
    std::span<const sdf::Instruction> code_of(size_t change) const {
        return std::span(code_).subspan(code_first_[change], code_first_[change + 1] - code_first_[change]);
    }

    const sdf::Program* program_;
    float voxel_size_, own_voxels_, farthest_;
    std::vector<Change> changes_;
    std::vector<sdf::Instruction> code_;  // of all changes: each edit's value moved to R0
    std::vector<size_t> code_first_;
    std::vector<float> margins_;  // of each change, voxels; infinite: not to be told this way
    bool joins_ = false;          // one edit comes, and neither it nor what is later, of its kind, blends
};

}  // namespace kiln::field
