// SPDX-License-Identifier: MIT
// How to get a device, and how to ask which there are. Works (with an error to show) where no graphics driver is.
#pragma once

#include "rhi/device.h"

namespace kiln::rhi {

struct DeviceOptions {
    std::string backend = "vulkan";  // "vulkan" | "null"
    // "auto": discrete, integrated, virtual, then CPU; "cpu-vulkan": a software rasteriser; else part of a device's name
    std::string device = "auto";
    bool validation =
        false;  // wrap in the validate decorator and switch on the driver's own validation layer if present
    bool pipeline_cache = true;            // keep compiled pipelines in $XDG_CACHE_HOME/kiln
    const WindowSystem* window = nullptr;  // where given, only devices that can show pictures in its window fit
};

// Error of kind NoDevice when there is none that fits: says which there are and what to install.
Result<std::unique_ptr<Device>> create_device(const DeviceOptions& options = {});

// Every device found, usable or not. An error (kind NoDevice) when there is no Vulkan loader or driver at all.
Result<std::vector<DeviceInfo>> list_devices();

}  // namespace kiln::rhi
