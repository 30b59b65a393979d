// SPDX-License-Identifier: MIT
// Instances on the GPU: the bricks of their sets, in the reserve of the field's atlas, and, for each frame, who is where. Sets stay as long
// as frames show them; while they do, a frame writes records and the tree, whatever moved. Owner's thread.
#pragma once

#include "field/brick_set.h"
#include "render/gpu_field.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/instances.gpu.h"
#include "rhi/range_allocator.h"

#include <kiln/renderer.h>

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

namespace kiln::render {

// What the passes of a frame read of its instances.
struct InstanceHandles {
    Buffer instances, sets, cells;
    Buffer records, code, numbers;
    Buffer glass;  // GlassRecord of every instance
    // The trees, kNodesARow nodes a row; behind that of things that light goes through, those records again.
    Image nodes, glass_nodes;
    Image ways;  // of every instance, kWaysARow a row
    uint32_t node_count = 0;
    uint32_t glass_node_count = 0;
    TapeUse use;  // of the sets' code
    uint32_t by_tree =
        0;  // 1: rays of the march walk the tree, as those do whose list is too long (the slow twin of the lists)
    explicit operator bool() const { return node_count != 0; }
    bool any() const { return node_count + glass_node_count != 0; }
    // Those that light goes through, for the passes that find and draw instances.
    InstanceHandles of_glass() const {
        InstanceHandles out = *this;
        out.nodes = glass_nodes;
        out.node_count = glass_node_count;
        return out;
    }
};

class GpuInstances {
public:
    GpuInstances(Runner& runner, GpuField& field);
    ~GpuInstances();
    GpuInstances(const GpuInstances&) = delete;
    GpuInstances& operator=(const GpuInstances&) = delete;

    // Sees to it that the atlas will have room for the sets of these instances: before GpuField::update().
    void reserve(std::span<const Instance> instances);
    // Brings sets that are not here yet; after GpuField::update().
    Result<void> update(std::span<const Instance> instances);
    // Where they are, seen by this frame's eye.
    void place(std::span<const Instance> instances, const FrameParams& frame, std::span<const Material> materials = {});

    InstanceHandles import(Graph& graph) const;

    const TapeUse& use() const { return use_; }
    uint32_t bricks() const { return bricks_; }          // resident
    uint32_t bricks_new() const { return bricks_new_; }  // brought by the last update()
    double place_ms() const { return place_ms_; }        // CPU time of the last place()
    const std::vector<InstanceRecord>& records() const { return records_; }
    const std::vector<InstanceNode>& nodes() const { return nodes_; }
    // Of those that light goes through, finest voxels from the eye.
    const std::vector<InstanceNode>& glass_nodes() const { return glass_nodes_; }
    // By InstanceRecord::set.
    const std::vector<std::shared_ptr<const field::BrickSet>>& sets() const { return order_; }

private:
    struct Set {
        std::shared_ptr<const field::BrickSet> bricks;
        std::optional<uint64_t> place;  // in the reserve, from the atlas' end
        uint32_t number = 0;            // in order_
        bool written = false;           // its bricks, to the atlas
        bool shown = false;             // by the frame at hand
    };
    Result<void> write_tables();
    Result<void> buffer_of(rhi::BufferHandle& buffer, std::string_view name, std::span<const std::byte> bytes);
    void drop(rhi::BufferHandle& buffer);

    Runner* runner_;
    GpuField* field_;
    std::unordered_map<const field::BrickSet*, Set> sets_;
    std::vector<std::shared_ptr<const field::BrickSet>> order_;
    rhi::RangeAllocator reserve_{0};
    uint64_t atlas_number_ = 0;
    bool tables_stale_ = true;
    std::vector<InstanceSet> table_;  // of order_
    rhi::BufferHandle cells_, code_, numbers_, brick_records_, set_table_;
    std::vector<InstanceRecord> records_;
    std::vector<InstanceNode> nodes_, glass_nodes_;
    std::vector<GlassRecord> glass_;
    TapeUse use_;
    uint32_t bricks_ = 0, bricks_new_ = 0;
    double place_ms_ = 0;
};

}  // namespace kiln::render
