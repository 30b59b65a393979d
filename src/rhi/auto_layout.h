// SPDX-License-Identifier: MIT
// Layouts that pipelines make from their shaders. Equal lists of entries give the same BindGroupLayout, so that bind
// groups can be shared between pipelines. The layouts belong to the device and live as long as it does.
#pragma once

#include "rhi/device.h"

#include <algorithm>

namespace kiln::rhi {

class AutoLayouts {
public:
    // `make` creates a BindGroupLayout for entries that were not seen before.
    template <typename Make>
    Result<std::vector<BindGroupLayout>> groups(std::span<const Reflection* const> shaders, Make&& make) {
        uint32_t count = 0;
        for (const Reflection* shader : shaders)
            for (const ReflectedBinding& b : shader->bindings) count = std::max(count, b.set + 1);
        if (count > kMaxBindGroups)
            return Error{
                "shader uses bind group " + std::to_string(count - 1) + "; there are " + std::to_string(kMaxBindGroups),
                ErrorKind::Failed};
        std::vector<BindGroupLayout> out;
        for (uint32_t set = 0; set < count; ++set) {
            Result<std::vector<BindGroupLayoutEntry>> entries = layout_entries(shaders, set);
            if (!entries) return entries.error();
            const auto known =
                std::find_if(known_.begin(), known_.end(), [&](const Known& k) { return k.entries == *entries; });
            if (known != known_.end()) {
                out.push_back(known->layout);
                continue;
            }
            Result<BindGroupLayout> layout = make(BindGroupLayoutDesc{.entries = *entries, .label = "auto"});
            if (!layout) return layout.error();
            known_.push_back({std::move(*entries), *layout});
            out.push_back(*layout);
        }
        return out;
    }

private:
    struct Known {
        std::vector<BindGroupLayoutEntry> entries;
        BindGroupLayout layout;
    };
    std::vector<Known> known_;
};

}  // namespace kiln::rhi
