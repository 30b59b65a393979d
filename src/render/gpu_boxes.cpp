// SPDX-License-Identifier: MIT
#include "render/gpu_boxes.h"

#include "base/format.h"
#include "field/cubic.gpu.h"
#include "render/graph_runner.h"

#include <algorithm>

namespace kiln::render {

// Why no others. Neighbouring cells without bricks share a face of texels and have one sign, and no texel of theirs is nearer than a voxel
// to 0 (jumps.h). So a walk comes into a solid cell without a brick from a cell with one, across a face, edge or corner all of whose texels
// are a voxel deep in solid: there the cubic of the last voxel it looked at ends below 0, and the march has ended in it.
std::vector<uint32_t> box_cells(const field::Field& field) {
    const field::CellMap& map = field.cells();
    const field::ivec3 size = map.size();
    std::vector<uint32_t> out;
    constexpr int kPage = field::kCellPage;
    for (int pz = 0; pz < size.z; pz += kPage)
        for (int py = 0; py < size.y; py += kPage)
            for (int px = 0; px < size.x; px += kPage) {
                if (!map.words().find(map.page_index(px / kPage, py / kPage, pz / kPage))) continue;  // empty
                for (int z = pz; z < std::min(pz + kPage, size.z); ++z)
                    for (int y = py; y < std::min(py + kPage, size.y); ++y)
                        for (int x = px; x < std::min(px + kPage, size.x); ++x)
                            if ((map.at(x, y, z) & field::kCellOccupied) != 0)
                                out.push_back(uint32_t(x) +
                                              uint32_t(size.x) * (uint32_t(y) + uint32_t(size.y) * uint32_t(z)));
            }
    return out;
}

GpuBoxes::GpuBoxes(Runner& runner) : runner_(&runner), device_(&runner.device()) {}

GpuBoxes::~GpuBoxes() {
    drop(tree_);
    drop(cells_);
}

void GpuBoxes::drop(rhi::BufferHandle& buffer) {
    if (!buffer) return;
    runner_->forget(buffer);
    device_->destroy(buffer);
    buffer = {};
}

Result<void> GpuBoxes::update(const std::shared_ptr<const field::Field>& field) {
    build_ms_ = 0;
    if (field == field_) return {};
    const field::ivec3 size = field->cells().size();
    if (uint64_t(size.x) * uint64_t(size.y) * uint64_t(size.z) > UINT32_MAX)
        return Error{
            formatted("tier rt: a grid of {} x {} x {} cells is more than it can number", size.x, size.y, size.z),
            ErrorKind::OutOfMemory};
    std::vector<uint32_t> cells = box_cells(*field);
    const bool same = tree_ && cells == cells_of_boxes_ && size.x == size_x_ && size.y == size_y_;
    field_ = nullptr;  // until all is done
    if (same || cells.empty()) {
        if (cells.empty()) {
            drop(tree_);
            drop(cells_);
            cells_of_boxes_.clear();
            tree_bytes_ = cells_bytes_ = 0;
        }
        field_ = field;
        return {};
    }
    const uint64_t need = device_->box_tree_bytes(uint32_t(cells.size()));
    const uint64_t most = device_->limits().max_buffer;
    if (need > most)
        return Error{
            formatted("tier rt: the tree of {} boxes needs {} bytes, a buffer of this device holds {}; a larger "
                      "voxel size would fit",
                      cells.size(), need, most),
            ErrorKind::OutOfMemory};
    // Room to grow by half, so that a growing world does not make buffers a frame.
    const uint64_t cell_bytes = cells.size() * sizeof(uint32_t);
    if (tree_bytes_ < need) {
        drop(tree_);
        tree_bytes_ = 0;
        const uint64_t room = std::min(need + need / 2, most);
        auto made = device_->create_buffer({.size = room, .usage = rhi::BufferUsage::BoxTree, .label = "box tree"});
        if (!made) return made.error();
        tree_ = *made;
        tree_bytes_ = room;
    }
    if (cells_bytes_ < cell_bytes) {
        drop(cells_);
        cells_bytes_ = 0;
        const uint64_t room = std::min((cell_bytes + cell_bytes / 2 + 255) & ~uint64_t{255}, most);
        auto made = device_->create_buffer({.size = room, .label = "cells of boxes"});
        if (!made) return made.error();
        cells_ = *made;
        cells_bytes_ = room;
    }
    cells_of_boxes_.clear();  // what is in the tree is not known until all is done
    std::vector<rhi::Box> boxes;
    boxes.reserve(cells.size());
    for (const uint32_t at : cells) {
        const uint32_t row = at / uint32_t(size.x);
        const float x = float(int(at % uint32_t(size.x)) * field::kBrickVoxels);
        const float y = float(int(row % uint32_t(size.y)) * field::kBrickVoxels);
        const float z = float(int(row / uint32_t(size.y)) * field::kBrickVoxels);
        constexpr float kSide = float(field::kBrickVoxels) + field::kBoxMargin;
        boxes.push_back(
            {x - field::kBoxMargin, y - field::kBoxMargin, z - field::kBoxMargin, x + kSide, y + kSide, z + kSide});
    }
    if (auto written = device_->write_buffer(cells_, 0, std::as_bytes(std::span(cells))); !written) return written;
    Graph g(*runner_);
    Buffer tree = g.import("box tree", tree_);
    g.build_boxes(g.upload("boxes", std::span<const rhi::Box>(boxes)), tree, uint32_t(boxes.size()));
    g.output(tree, rhi::Access::BoxTreeRead);
    const auto submit = runner_->execute(g);
    if (!submit) return submit.error();
    if (device_->caps().timestamp) {
        const auto times = runner_->times(*submit);
        if (!times) return times.error();
        build_ms_ = times->total_ms;
    }
    ++builds_;
    cells_of_boxes_ = std::move(cells);
    size_x_ = size.x, size_y_ = size.y;
    field_ = field;
    return {};
}

BoxHandles GpuBoxes::import(Graph& graph) const {
    if (!tree_) return {};
    return {graph.import("box tree", tree_), graph.import("cells of boxes", cells_)};
}

}  // namespace kiln::render
