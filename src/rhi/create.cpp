// SPDX-License-Identifier: MIT
#include "rhi/create.h"

#include "base/format.h"
#include "rhi/null/device.h"
#include "rhi/validate/device.h"
#include "rhi/vulkan/device.h"

namespace kiln::rhi {

namespace {

Result<std::unique_ptr<Device>> create_backend(const DeviceOptions& options) {
    if (options.backend == "null") return std::unique_ptr<Device>(std::make_unique<null::NullDevice>());
    if (options.backend == "vulkan") {
        auto instance = vulkan::Instance::create(options.validation, options.window);
        if (!instance) return instance.error();
        auto adapter = (*instance)->choose(options.device);
        if (!adapter) return adapter.error();
        return vulkan::VulkanDevice::create(std::move(*instance), *adapter, options.pipeline_cache);
    }
    return Error{formatted("no graphics backend '{}'; there are 'vulkan' and 'null'", options.backend),
                 ErrorKind::Usage};
}

}  // namespace

Result<std::unique_ptr<Device>> create_device(const DeviceOptions& options) {
    Result<std::unique_ptr<Device>> device = create_backend(options);
    if (!device || !options.validation) return device;
    return std::unique_ptr<Device>(std::make_unique<validate::ValidateDevice>(std::move(*device)));
}

Result<std::vector<DeviceInfo>> list_devices() {
    auto instance = vulkan::Instance::create(false);
    if (!instance) return instance.error();
    std::vector<DeviceInfo> out;
    for (const vulkan::Adapter& a : (*instance)->adapters()) out.push_back(a.info);
    return out;
}

}  // namespace kiln::rhi
