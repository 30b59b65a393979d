// SPDX-License-Identifier: MIT
// The table of materials on the device, kept between frames: of it only what changed is written. Owner's thread.
#pragma once

#include "render/graph.h"
#include "render/material_table.h"
#include "rhi/device.h"

namespace kiln::render {

class GpuMaterials {
public:
    explicit GpuMaterials(Runner& runner);
    ~GpuMaterials();
    GpuMaterials(const GpuMaterials&) = delete;
    GpuMaterials& operator=(const GpuMaterials&) = delete;

    Result<void> update(std::span<const MaterialRecord> records);  // at least one
    Buffer import(Graph& graph) const;                             // MaterialEntry

    const MaterialTable& table() const { return table_; }
    uint64_t bytes_written() const { return bytes_written_; }  // by the last update()

private:
    void drop();

    Runner* runner_;
    rhi::Device* device_;
    MaterialTable table_;
    rhi::BufferHandle buffer_;  // none: of the table nothing is there
    uint64_t bytes_ = 0, bytes_written_ = 0;
};

}  // namespace kiln::render
