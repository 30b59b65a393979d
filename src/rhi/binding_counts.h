// SPDX-License-Identifier: MIT
// How many bindings of each kind a stage has, beside the floor's most.
#pragma once

#include "rhi/types.h"

#include <array>
#include <string_view>

namespace kiln::rhi {

class BindingCounts {
public:
    struct Row {
        std::string_view what;
        uint32_t is, most;
    };

    void add(BindingKind kind) {
        switch (kind) {
        case BindingKind::UniformBuffer:
            ++rows_[4].is;
            break;
        case BindingKind::StorageBuffer:
        case BindingKind::StorageBufferReadOnly:
            ++rows_[0].is;
            break;
        case BindingKind::StorageTexture:
        case BindingKind::StorageTextureReadOnly:
            ++rows_[1].is;
            break;
        case BindingKind::SampledTexture:
            ++rows_[2].is;
            break;
        case BindingKind::Sampler:
            ++rows_[3].is;
            break;
        case BindingKind::BoxTree:  // the tier that has them has room for them
            break;
        }
    }
    const std::array<Row, 5>& rows() const { return rows_; }

private:
    std::array<Row, 5> rows_{{{"storage buffers", 0, kMaxStorageBuffersPerStage},
                              {"storage textures", 0, kMaxStorageTexturesPerStage},
                              {"sampled textures", 0, kMaxSampledTexturesPerStage},
                              {"samplers", 0, kMaxSamplersPerStage},
                              {"uniform buffers", 0, kMaxUniformBuffersPerStage}}};
};

}  // namespace kiln::rhi
