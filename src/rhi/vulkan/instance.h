// SPDX-License-Identifier: MIT
// The Vulkan loader, one instance of it, and the devices behind.
#pragma once

#include "rhi/create.h"
#include "rhi/reporter.h"
#include "rhi/vulkan/convert.h"

namespace kiln::rhi::vulkan {

// Device extensions of the tiers above the floor.
inline constexpr std::array kMeshExtensions{VK_EXT_MESH_SHADER_EXTENSION_NAME};
inline constexpr std::array kTraceExtensions{VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
                                             VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
                                             VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME};

struct Adapter {
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties{};
    DeviceInfo info;
    uint32_t queue_family = 0;
    bool graphics = false;  // the queue family draws
};

class Instance {
public:
    // Errors of kind NoDevice when there is no loader or no driver.
    // With a window: only adapters that can show pictures in it are usable.
    static Result<std::unique_ptr<Instance>> create(bool validation, const WindowSystem* window = nullptr);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    const std::vector<Adapter>& adapters() const { return adapters_; }
    // Best adapter that fits DeviceOptions::device, or an error that says what there is.
    Result<Adapter> choose(std::string_view wanted) const;

    VkInstance vk() const { return instance_; }
    bool debug() const { return debug_; }            // object names and labels go somewhere
    bool validating() const { return validating_; }  // the driver-side validation layer is on
    // Null unless debug(). Taken from this instance: volk's own are those of the instance made last.
    PFN_vkSetDebugUtilsObjectNameEXT set_name = nullptr;
    PFN_vkCmdBeginDebugUtilsLabelEXT begin_label = nullptr;
    PFN_vkCmdEndDebugUtilsLabelEXT end_label = nullptr;
    // Null without a window; likewise.
    struct Windows {
        PFN_vkDestroySurfaceKHR destroy = nullptr;
        PFN_vkGetPhysicalDeviceSurfaceSupportKHR support = nullptr;
        PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR capabilities = nullptr;
        PFN_vkGetPhysicalDeviceSurfaceFormatsKHR formats = nullptr;
        PFN_vkGetPhysicalDeviceSurfacePresentModesKHR modes = nullptr;
    };
    const Windows& windows() const { return windows_; }
    // Messages of the validation layer go there. The reporter must outlive the instance.
    void report_to(Reporter* reporter) { reporter_ = reporter; }
    void report(std::string_view text);

private:
    Instance() = default;
    Result<void> find_adapters();
    Result<void> find_presenting(const WindowSystem& window);

    VkInstance instance_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    bool debug_ = false;
    bool validating_ = false;
    Reporter* reporter_ = nullptr;
    Windows windows_;
    std::vector<Adapter> adapters_;
};

}  // namespace kiln::rhi::vulkan
