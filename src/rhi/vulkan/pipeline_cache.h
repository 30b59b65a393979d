// SPDX-License-Identifier: MIT
// Compiled pipelines kept on disk between runs: one file per device and driver version. The driver finds a pipeline in it
// by the hash of its shaders and state. A damaged or foreign file is ignored and replaced.
#pragma once

#include "rhi/vulkan/convert.h"

namespace kiln::rhi::vulkan {

// $XDG_CACHE_HOME/kiln or ~/.cache/kiln; empty when neither variable is set.
std::string cache_folder();

// File of this device in `folder`.
std::string cache_path(std::string_view folder, const VkPhysicalDeviceProperties& properties);

// The driver's bytes in the file; empty when there is none or its checksum is wrong.
std::vector<std::byte> load_cache(const std::string& path);

// Writes beside and renames, so that no reader sees half a file. Does nothing where the folder can't be written.
void save_cache(const std::string& path, std::span<const std::byte> bytes);

}  // namespace kiln::rhi::vulkan
