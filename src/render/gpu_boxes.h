// SPDX-License-Identifier: MIT
// A field's box tree, for the tier that marches by tracing rays: a box around each cell with a brick. A march may end in a solid cell without
// one too, but only in the walk's first (proof in gpu_boxes.cpp), at which the shader looks anyway. Kept between frames, and built again only
// when other cells have bricks: an edit that changes what bricks hold changes no box. Owner's thread.
#pragma once

#include "field/field.h"
#include "render/graph.h"
#include "rhi/device.h"

#include <memory>

namespace kiln::render {

struct BoxHandles {
    Buffer tree;   // none: no cell can end a march
    Buffer cells;  // of each box: its cell, x + size_x * (y + size_y * z)
};

// Cells with boxes, in the order of the map.
std::vector<uint32_t> box_cells(const field::Field& field);

class GpuBoxes {
public:
    explicit GpuBoxes(Runner& runner);
    ~GpuBoxes();
    GpuBoxes(const GpuBoxes&) = delete;
    GpuBoxes& operator=(const GpuBoxes&) = delete;

    Result<void> update(const std::shared_ptr<const field::Field>& field);
    BoxHandles import(Graph& graph) const;

    uint32_t boxes() const { return uint32_t(cells_of_boxes_.size()); }
    uint64_t builds() const { return builds_; }
    uint64_t bytes() const { return tree_bytes_ + cells_bytes_; }
    double build_ms() const { return build_ms_; }  // GPU time of the last update(); 0: nothing was built

private:
    void drop(rhi::BufferHandle& buffer);

    Runner* runner_;
    rhi::Device* device_;
    std::shared_ptr<const field::Field> field_;
    std::vector<uint32_t> cells_of_boxes_;
    int size_x_ = 0, size_y_ = 0;  // cells of the grid, as far as numbers of cells depend on them
    rhi::BufferHandle tree_, cells_;
    uint64_t tree_bytes_ = 0, cells_bytes_ = 0;
    uint64_t builds_ = 0;
    double build_ms_ = 0;
};

}  // namespace kiln::render
