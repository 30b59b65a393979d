// SPDX-License-Identifier: MIT
// What a level's words say beside which brick each cell holds: of an empty cell its jump, of a brick kCellFades where it lies beside a missing
// cell. Both follow from the cells around, but a word may be rough: its jump shorter than it could be, its mark set for nothing. That costs
// rays steps and changes no hit. So what would be wrong is mended at once (come_near), for little; what is merely rough waits in RoughCells
// and is made exact in pieces of like size, as there is time.
#pragma once

#include "field/jumps.h"

#include <cstdint>
#include <vector>

namespace kiln::field {

/// The cells of `box`, of a torus, are no longer empty: the jumps of empty cells around lead no further than to the box. Where they are missing,
/// bricks beside them are marked.
void come_near(CellMap& cells, const CellBox& box, bool missing);

/// Where the words of one torus may be rough, in layers of a page's height. A value.
class RoughCells {
public:
    RoughCells() = default;
    explicit RoughCells(int side) : layers_(size_t(side / kCellPage)) {}

    /// Cells of the box changed: words around it may be rough.
    void add(const CellBox& box);
    bool empty() const { return count_ == 0; }
    /// Makes the words of the next layer that has any exact: some thousand cells. `window`: what is beside what ends at its faces.
    void settle_layer(CellMap& cells, const CellBox& window, bool any_missing);

private:
    // Rows of pages and pages of a row: what is rough lies where both have a bit.
    struct Layer {
        uint32_t y_pages = 0, x_pages = 0;
    };
    std::vector<Layer> layers_;
    int count_ = 0;  // that have any
    int next_ = 0;   // to look at
};

}  // namespace kiln::field
