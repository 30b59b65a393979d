// SPDX-License-Identifier: MIT
#include "render/gpu_materials.h"

#include "base/format.h"
#include "render/graph_runner.h"

#include <algorithm>

namespace kiln::render {

GpuMaterials::GpuMaterials(Runner& runner) : runner_(&runner), device_(&runner.device()) {}

GpuMaterials::~GpuMaterials() { drop(); }

void GpuMaterials::drop() {
    if (!buffer_) return;
    runner_->forget(buffer_);
    device_->destroy(buffer_);
    buffer_ = {};
    bytes_ = 0;
}

Result<void> GpuMaterials::update(std::span<const MaterialRecord> records) {
    bytes_written_ = 0;
    table_.update(records);
    const std::span<const MaterialEntry> entries = table_.entries();
    const auto store = [&](size_t first, size_t end) -> Result<void> {
        const auto bytes = std::as_bytes(entries.subspan(first, end - first));
        bytes_written_ += bytes.size();
        auto written = device_->write_buffer(buffer_, first * sizeof(MaterialEntry), bytes);
        if (!written) drop();  // what is in it is not known
        return written;
    };
    if (buffer_ && bytes_ >= entries.size_bytes()) {
        for (const MaterialTable::Range& range : table_.changed())
            if (auto done = store(range.first, range.end); !done) return done;
        return {};
    }
    drop();
    const uint64_t most = std::min(device_->limits().max_storage_binding, device_->limits().max_buffer);
    if (entries.size_bytes() > most)
        return Error{formatted("{} materials need {} bytes, a buffer of this device holds {}", entries.size(),
                               entries.size_bytes(), most),
                     ErrorKind::OutOfMemory};
    // Room to grow by half, so that a growing world does not make a buffer a frame.
    const uint64_t room = std::min((entries.size_bytes() * 3 / 2 + 255) & ~uint64_t{255}, most);
    auto made = device_->create_buffer({.size = room, .label = "materials"});
    if (!made) return made.error();
    buffer_ = *made;
    bytes_ = room;
    return store(0, entries.size());
}

Buffer GpuMaterials::import(Graph& graph) const { return graph.import("materials", buffer_); }

}  // namespace kiln::render
