// SPDX-License-Identifier: MIT
// Windows: a swapchain a surface. Two binary semaphores order a picture: the next submit waits until the image has arrived, and showing
// waits until all that was submitted before is done. Swapchains change when windows do, so then the GPU is simply waited for.
#include "rhi/vulkan/device.h"

#include "base/format.h"

#include <algorithm>

namespace kiln::rhi::vulkan {

namespace {

constexpr uint64_t kAcquireWaitNs = 100'000'000;

// Empty where there is none.
std::optional<std::pair<VkSurfaceFormatKHR, Format>> choose_format(std::span<const VkSurfaceFormatKHR> formats) {
    for (const auto& [vk, ours] : {std::pair(VK_FORMAT_R8G8B8A8_UNORM, Format::Rgba8Unorm),
                                   std::pair(VK_FORMAT_B8G8R8A8_UNORM, Format::Bgra8Unorm)})
        for (const VkSurfaceFormatKHR& f : formats)
            if (f.format == vk && f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) return std::pair(f, ours);
    return std::nullopt;
}

VkCompositeAlphaFlagBitsKHR choose_alpha(VkCompositeAlphaFlagsKHR can) {
    for (const auto flag : {VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR, VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR,
                            VK_COMPOSITE_ALPHA_PRE_MULTIPLIED_BIT_KHR})
        if (can & flag) return flag;
    return VK_COMPOSITE_ALPHA_POST_MULTIPLIED_BIT_KHR;
}

}  // namespace

Result<SurfaceHandle> VulkanDevice::create_surface(const SurfaceDesc& desc) {
    if (!instance_->windows().destroy || !desc.make)
        return Error{
            formatted("surface '{}': the device was made without a window (DeviceOptions::window)", desc.label),
            ErrorKind::Usage};
    const uint64_t made = desc.make(instance_->vk());
    if (made == 0)
        return Error{formatted("surface '{}': the window system made none", desc.label), ErrorKind::NoDevice};
    const auto vk = VkSurfaceKHR(made);
    VkBool32 can = VK_FALSE;
    const VkResult r = instance_->windows().support(adapter_.physical, adapter_.queue_family, vk, &can);
    if (r != VK_SUCCESS || !can) {
        instance_->windows().destroy(instance_->vk(), vk, nullptr);
        return Error{formatted("surface '{}': '{}' cannot show pictures in this window", desc.label, info().name),
                     ErrorKind::NoDevice};
    }
    Surface s;
    s.label = desc.label;
    s.vk = vk;
    return surfaces_.insert(std::move(s));
}

Result<VkSemaphore> VulkanDevice::make_semaphore() {
    const VkSemaphoreCreateInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    VkSemaphore out = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateSemaphore(device_, &info, nullptr, &out); r != VK_SUCCESS)
        return fail("semaphore", r);
    return out;
}

void VulkanDevice::drop_swapchain(Surface& s) {
    if (!s.swapchain && s.arrivals.empty()) return;
    vk_.vkDeviceWaitIdle(device_);
    if (s.acquired) textures_.remove(std::exchange(s.acquired, {}));
    for (const Surface::Arrival& a : s.arrivals) {
        std::erase(arrivals_, a.semaphore);
        vk_.vkDestroySemaphore(device_, a.semaphore, nullptr);
    }
    for (const VkSemaphore semaphore : s.drawn) vk_.vkDestroySemaphore(device_, semaphore, nullptr);
    vk_.vkDestroySwapchainKHR(device_, s.swapchain, nullptr);
    s.arrivals.clear();
    s.drawn.clear();
    s.images.clear();
    s.swapchain = VK_NULL_HANDLE;
}

void VulkanDevice::destroy(SurfaceHandle handle) {
    auto s = take(surfaces_, handle, "surface");
    if (!s) return;
    drop_swapchain(*s);
    instance_->windows().destroy(instance_->vk(), s->vk, nullptr);
}

Result<SurfaceState> VulkanDevice::configure(SurfaceHandle handle, const SurfaceSettings& settings) {
    Surface* s = found(surfaces_.get(handle), "surface");
    if (!s) return Error{"configure: stale surface handle"};
    if (s->acquired) return Error{formatted("configure: '{}' has a texture that is not presented", s->label)};
    const Instance::Windows& windows = instance_->windows();
    VkSurfaceCapabilitiesKHR can{};
    VkResult r = windows.capabilities(adapter_.physical, s->vk, &can);
    if (r == VK_ERROR_SURFACE_LOST_KHR) return SurfaceState::Lost;
    if (r != VK_SUCCESS) return fail(formatted("surface '{}'", s->label), r);
    // 0xffffffff: the window will be as large as we say.
    VkExtent2D size = can.currentExtent;
    if (size.width == UINT32_MAX) {
        size.width = std::clamp(settings.width, can.minImageExtent.width, can.maxImageExtent.width);
        size.height = std::clamp(settings.height, can.minImageExtent.height, can.maxImageExtent.height);
        if (settings.width == 0 || settings.height == 0) size = {};
    }
    if (size.width == 0 || size.height == 0) {
        drop_swapchain(*s);
        return SurfaceState::Hidden;
    }
    uint32_t count = 0;
    windows.formats(adapter_.physical, s->vk, &count, nullptr);
    std::vector<VkSurfaceFormatKHR> formats(count);
    windows.formats(adapter_.physical, s->vk, &count, formats.data());
    const auto format = choose_format(formats);
    if (!format || !(can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT))
        return Error{formatted("surface '{}': '{}' has no 8-bit sRGB window pictures that can be copied into", s->label,
                               info().name),
                     ErrorKind::NoDevice};
    windows.modes(adapter_.physical, s->vk, &count, nullptr);
    std::vector<VkPresentModeKHR> modes(count);
    windows.modes(adapter_.physical, s->vk, &count, modes.data());
    const bool mailbox =
        settings.mode == PresentMode::Mailbox && std::ranges::count(modes, VK_PRESENT_MODE_MAILBOX_KHR);
    uint32_t images = can.minImageCount + 1;
    if (can.maxImageCount > 0) images = std::min(images, can.maxImageCount);

    const VkSwapchainCreateInfoKHR create{
        .sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
        .surface = s->vk,
        .minImageCount = images,
        .imageFormat = format->first.format,
        .imageColorSpace = format->first.colorSpace,
        .imageExtent = size,
        .imageArrayLayers = 1,
        .imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT,
        .imageSharingMode = VK_SHARING_MODE_EXCLUSIVE,
        .preTransform = can.currentTransform,
        .compositeAlpha = choose_alpha(can.supportedCompositeAlpha),
        .presentMode = mailbox ? VK_PRESENT_MODE_MAILBOX_KHR : VK_PRESENT_MODE_FIFO_KHR,
        .clipped = VK_TRUE,
        .oldSwapchain = s->swapchain};
    VkSwapchainKHR made = VK_NULL_HANDLE;
    r = vk_.vkCreateSwapchainKHR(device_, &create, nullptr, &made);
    drop_swapchain(*s);  // the old one is retired even where making a new one failed
    if (r == VK_ERROR_SURFACE_LOST_KHR || r == VK_ERROR_NATIVE_WINDOW_IN_USE_KHR) return SurfaceState::Lost;
    if (r != VK_SUCCESS) return fail(formatted("swapchain of '{}'", s->label), r);
    s->swapchain = made;
    s->format = format->second;
    s->width = size.width;
    s->height = size.height;
    vk_.vkGetSwapchainImagesKHR(device_, made, &count, nullptr);
    s->images.resize(count);
    vk_.vkGetSwapchainImagesKHR(device_, made, &count, s->images.data());
    for (size_t i = 0; i < s->images.size() + 1; ++i) {
        auto arrival = make_semaphore();
        if (!arrival) return arrival.error();
        s->arrivals.push_back({*arrival, 0});
        if (i == s->images.size()) break;
        auto drawn = make_semaphore();
        if (!drawn) return drawn.error();
        s->drawn.push_back(*drawn);
    }
    s->next_arrival = 0;
    return SurfaceState::Ready;
}

Result<SurfaceImage> VulkanDevice::acquire(SurfaceHandle handle) {
    Surface* s = found(surfaces_.get(handle), "surface");
    if (!s) return Error{"acquire: stale surface handle"};
    if (s->acquired) return Error{formatted("acquire: '{}' has a texture that is not presented", s->label)};
    if (!s->swapchain) return SurfaceImage{.state = SurfaceState::Outdated};
    Surface::Arrival& arrival = s->arrivals[s->next_arrival];
    if (!completed(arrival.waited_for_by))
        if (auto done = wait(arrival.waited_for_by); !done) return done.error();
    const VkResult r =
        vk_.vkAcquireNextImageKHR(device_, s->swapchain, kAcquireWaitNs, arrival.semaphore, VK_NULL_HANDLE, &s->image);
    if (r == VK_ERROR_OUT_OF_DATE_KHR) return SurfaceImage{.state = SurfaceState::Outdated};
    if (r == VK_TIMEOUT || r == VK_NOT_READY) return SurfaceImage{.state = SurfaceState::Busy};
    if (r == VK_ERROR_SURFACE_LOST_KHR) return SurfaceImage{.state = SurfaceState::Lost};
    if (r != VK_SUCCESS && r != VK_SUBOPTIMAL_KHR) return fail(formatted("next picture of '{}'", s->label), r);
    arrivals_.push_back(arrival.semaphore);
    arrival.waited_for_by = last_submit_ + 1;
    s->next_arrival = (s->next_arrival + 1) % s->arrivals.size();
    s->acquired = textures_.insert(
        {.label = s->label,
         .desc = {.format = s->format, .size = {s->width, s->height}, .mips = 1, .usage = TextureUsage::CopyDst},
         .vk = s->images[s->image],
         .memory = {},
         .whole = {},
         .shown = true});
    return SurfaceImage{SurfaceState::Ready, s->acquired, s->format, s->width, s->height};
}

Result<SurfaceState> VulkanDevice::present(SurfaceHandle handle) {
    Surface* s = found(surfaces_.get(handle), "surface");
    if (!s) return Error{"present: stale surface handle"};
    if (!s->acquired) return Error{formatted("present: '{}' has no texture", s->label)};
    textures_.remove(std::exchange(s->acquired, {}));
    // A signal comes after all that was submitted before it.
    const VkSemaphoreSubmitInfo signal{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                       .semaphore = s->drawn[s->image],
                                       .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
    const VkSubmitInfo2 drawn{
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2, .signalSemaphoreInfoCount = 1, .pSignalSemaphoreInfos = &signal};
    if (const VkResult r = vk_.vkQueueSubmit2(queue_, 1, &drawn, VK_NULL_HANDLE); r != VK_SUCCESS)
        return fail("present", r);
    const VkPresentInfoKHR info{.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
                                .waitSemaphoreCount = 1,
                                .pWaitSemaphores = &signal.semaphore,
                                .swapchainCount = 1,
                                .pSwapchains = &s->swapchain,
                                .pImageIndices = &s->image};
    const VkResult r = vk_.vkQueuePresentKHR(queue_, &info);
    if (r == VK_SUCCESS) return SurfaceState::Ready;
    if (r == VK_SUBOPTIMAL_KHR || r == VK_ERROR_OUT_OF_DATE_KHR) return SurfaceState::Outdated;
    if (r == VK_ERROR_SURFACE_LOST_KHR) return SurfaceState::Lost;
    return fail(formatted("showing a picture in '{}'", s->label), r);
}

}  // namespace kiln::rhi::vulkan
