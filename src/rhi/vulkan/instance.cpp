// SPDX-License-Identifier: MIT
#include "rhi/vulkan/instance.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>

namespace kiln::rhi::vulkan {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr const char* kHowToInstall = "apt install mesa-vulkan-drivers (software), or the driver of the graphics card";

// volk keeps global function pointers; they are written by create() only.
std::mutex& volk_mutex() {
    static std::mutex mutex;
    return mutex;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    static_cast<Instance*>(user)->report(std::string("vulkan: ") + data->pMessage);
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(Instance* self) {
    VkDebugUtilsMessengerCreateInfoEXT info{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    info.pfnUserCallback = on_message;
    info.pUserData = self;
    return info;
}

bool has_layer(const char* wanted) {
    uint32_t count = 0;
    vkEnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> layers(count);
    vkEnumerateInstanceLayerProperties(&count, layers.data());
    return std::any_of(layers.begin(), layers.end(), [&](const auto& l) { return !std::strcmp(l.layerName, wanted); });
}

bool has_extension(const char* layer, const char* wanted) {
    uint32_t count = 0;
    vkEnumerateInstanceExtensionProperties(layer, &count, nullptr);
    std::vector<VkExtensionProperties> found(count);
    vkEnumerateInstanceExtensionProperties(layer, &count, found.data());
    return std::any_of(found.begin(), found.end(),
                       [&](const auto& e) { return !std::strcmp(e.extensionName, wanted); });
}

std::string version(uint32_t v) {
    return std::to_string(VK_API_VERSION_MAJOR(v)) + "." + std::to_string(VK_API_VERSION_MINOR(v)) + "." +
           std::to_string(VK_API_VERSION_PATCH(v));
}

DeviceKind kind_of(VkPhysicalDeviceType type) {
    switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return DeviceKind::Discrete;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return DeviceKind::Integrated;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return DeviceKind::Virtual;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return DeviceKind::Cpu;
    default:
        return DeviceKind::Other;
    }
}

// Empty, or why we cannot run on it.
std::string missing(VkPhysicalDevice device, const VkPhysicalDeviceProperties& properties) {
    if (properties.apiVersion < VK_API_VERSION_1_3)
        return "Vulkan " + version(properties.apiVersion) + "; 1.3 is needed";
    VkPhysicalDeviceVulkan13Features v13{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features v12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES, .pNext = &v13};
    VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &v12};
    vkGetPhysicalDeviceFeatures2(device, &features);
    if (!v13.dynamicRendering) return "no dynamicRendering";
    if (!v13.synchronization2) return "no synchronization2";
    if (!v12.timelineSemaphore) return "no timelineSemaphore";
    return {};
}

// What the tiers need, beside the queue.
void find_tiers(VkPhysicalDevice device, DeviceInfo& info) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
    const auto all = [&](std::span<const char* const> wanted) {
        return std::all_of(wanted.begin(), wanted.end(), [&](const char* one) {
            return std::any_of(extensions.begin(), extensions.end(),
                               [&](const auto& e) { return !std::strcmp(e.extensionName, one); });
        });
    };
    if (all(kMeshExtensions)) {
        VkPhysicalDeviceMeshShaderFeaturesEXT mesh{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MESH_SHADER_FEATURES_EXT};
        VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &mesh};
        vkGetPhysicalDeviceFeatures2(device, &features);
        info.mesh_shader = mesh.meshShader;
    }
    if (all(kTraceExtensions)) {
        VkPhysicalDeviceRayTracingPipelineFeaturesKHR rays{
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR};
        VkPhysicalDeviceAccelerationStructureFeaturesKHR trees{
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR, .pNext = &rays};
        VkPhysicalDeviceVulkan12Features v12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                             .pNext = &trees};
        VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &v12};
        vkGetPhysicalDeviceFeatures2(device, &features);
        info.rt_pipeline = rays.rayTracingPipeline && trees.accelerationStructure && v12.bufferDeviceAddress;
    }
}

Adapter describe(VkPhysicalDevice device) {
    Adapter out{.physical = device, .info = {}};
    vkGetPhysicalDeviceProperties(device, &out.properties);
    out.info.backend = "vulkan";
    out.info.name = out.properties.deviceName;
    out.info.api = version(out.properties.apiVersion);
    out.info.kind = kind_of(out.properties.deviceType);
    if (out.properties.apiVersion >= VK_API_VERSION_1_2) {
        VkPhysicalDeviceVulkan12Properties v12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES};
        VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &v12};
        vkGetPhysicalDeviceProperties2(device, &properties);
        out.info.driver = std::string(v12.driverName) + " " + v12.driverInfo;
    }
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(device, &memory);
    for (uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            out.info.memory_bytes += memory.memoryHeaps[i].size;

    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    bool found = false;
    for (uint32_t i = 0; i < count; ++i) {
        const bool compute = families[i].queueFlags & VK_QUEUE_COMPUTE_BIT;
        const bool graphics = families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT;
        if (!compute || (found && (out.graphics || !graphics))) continue;
        out.queue_family = i;
        out.graphics = graphics;
        found = true;
    }
    out.info.unusable_because = found ? missing(device, out.properties) : "no queue that computes";
    out.info.usable = out.info.unusable_because.empty();
    if (out.info.usable) find_tiers(device, out.info);
    out.info.mesh_shader = out.info.mesh_shader && out.graphics;
    return out;
}

int rank(DeviceKind kind) {
    switch (kind) {
    case DeviceKind::Discrete:
        return 0;
    case DeviceKind::Integrated:
        return 1;
    case DeviceKind::Virtual:
        return 2;
    case DeviceKind::Cpu:
        return 3;
    case DeviceKind::Other:
        return 4;
    }
    return 5;
}

std::string lower(std::string_view text) {
    std::string out(text);
    for (char& c : out)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return out;
}

}  // namespace

Result<std::unique_ptr<Instance>> Instance::create(bool validation, const WindowSystem* window) {
    const std::lock_guard lock(volk_mutex());
    // llvmpipe 22.3 crashes when it compiles shaders for 512-bit vectors, which it picks by itself on CPUs that have them.
    // The driver reads this when the loader opens it, in vkCreateInstance. A value set by the user stays.
    setenv("LP_NATIVE_VECTOR_WIDTH", "256", 0);
    if (volkInitialize() != VK_SUCCESS)
        return Error{std::string("no Vulkan loader (libvulkan.so.1): apt install libvulkan1 mesa-vulkan-drivers"),
                     ErrorKind::NoDevice};
    if (volkGetInstanceVersion() < VK_API_VERSION_1_3)
        return Error{"the Vulkan loader is of version " + version(volkGetInstanceVersion()) + "; 1.3 is needed",
                     ErrorKind::NoDevice};

    std::unique_ptr<Instance> out(new Instance);
    std::vector<const char*> layers;
    std::vector<const char*> extensions;
    if (validation && has_layer(kValidationLayer)) {
        layers.push_back(kValidationLayer);
        out->validating_ = true;
    }
    if (validation && (has_extension(nullptr, VK_EXT_DEBUG_UTILS_EXTENSION_NAME) ||
                       (out->validating_ && has_extension(kValidationLayer, VK_EXT_DEBUG_UTILS_EXTENSION_NAME)))) {
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        out->debug_ = true;
    }

    if (window) {
        for (const std::string& wanted : window->extensions) {
            if (!has_extension(nullptr, wanted.c_str()))
                return Error{"the Vulkan loader cannot draw into this display's windows: it lacks " + wanted,
                             ErrorKind::NoDevice};
            extensions.push_back(wanted.c_str());
        }
    }

    const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                        .pApplicationName = "kiln",
                                        .pEngineName = "kiln",
                                        .apiVersion = VK_API_VERSION_1_3};
    VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    const VkValidationFeatureEnableEXT enables[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    VkValidationFeaturesEXT features{.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                     .enabledValidationFeatureCount = 1,
                                     .pEnabledValidationFeatures = enables};
    VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(out.get());
    if (out->validating_) {
        if (has_extension(kValidationLayer, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME)) {
            extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
            features.pNext = info.pNext;
            info.pNext = &features;
        }
        if (out->debug_) {
            messenger.pNext = info.pNext;
            info.pNext = &messenger;
        }
    }
    info.enabledLayerCount = uint32_t(layers.size());
    info.ppEnabledLayerNames = layers.data();
    info.enabledExtensionCount = uint32_t(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();

    const VkResult result = vkCreateInstance(&info, nullptr, &out->instance_);
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
        return Error{std::string("no Vulkan driver: ") + kHowToInstall, ErrorKind::NoDevice};
    if (result != VK_SUCCESS) return Error{"vkCreateInstance: " + name(result), ErrorKind::NoDevice};
    volkLoadInstanceOnly(out->instance_);
    if (out->debug_) {
        messenger.pNext = nullptr;
        out->set_name = vkSetDebugUtilsObjectNameEXT;
        out->begin_label = vkCmdBeginDebugUtilsLabelEXT;
        out->end_label = vkCmdEndDebugUtilsLabelEXT;
        vkCreateDebugUtilsMessengerEXT(out->instance_, &messenger, nullptr, &out->messenger_);
    }
    if (Result<void> found = out->find_adapters(); !found) return found.error();
    if (window)
        if (Result<void> found = out->find_presenting(*window); !found) return found.error();
    return out;
}

Instance::~Instance() {
    if (!instance_) return;
    const std::lock_guard lock(volk_mutex());
    if (messenger_) {
        const auto destroy =
            PFN_vkDestroyDebugUtilsMessengerEXT(vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(instance_, messenger_, nullptr);
    }
    vkDestroyInstance(instance_, nullptr);
}

void Instance::report(std::string_view text) {
    if (reporter_) (*reporter_)(text);
}

Result<void> Instance::find_adapters() {
    uint32_t count = 0;
    VkResult result = vkEnumeratePhysicalDevices(instance_, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    if (result == VK_SUCCESS) result = vkEnumeratePhysicalDevices(instance_, &count, devices.data());
    if (result != VK_SUCCESS || count == 0)
        return Error{std::string("no Vulkan driver: ") + kHowToInstall, ErrorKind::NoDevice};
    for (const VkPhysicalDevice device : devices) adapters_.push_back(describe(device));
    std::stable_sort(adapters_.begin(), adapters_.end(),
                     [](const Adapter& a, const Adapter& b) { return rank(a.info.kind) < rank(b.info.kind); });
    return {};
}

Result<void> Instance::find_presenting(const WindowSystem& window) {
    const auto load = [&](auto& function, const char* text) {
        function =
            reinterpret_cast<std::remove_reference_t<decltype(function)>>(vkGetInstanceProcAddr(instance_, text));
        return function != nullptr;
    };
    const bool loaded = load(windows_.destroy, "vkDestroySurfaceKHR") &&
                        load(windows_.support, "vkGetPhysicalDeviceSurfaceSupportKHR") &&
                        load(windows_.capabilities, "vkGetPhysicalDeviceSurfaceCapabilitiesKHR") &&
                        load(windows_.formats, "vkGetPhysicalDeviceSurfaceFormatsKHR") &&
                        load(windows_.modes, "vkGetPhysicalDeviceSurfacePresentModesKHR");
    const uint64_t made = loaded && window.make_surface ? window.make_surface(instance_) : 0;
    if (made == 0) return Error{"no Vulkan surface can be made of the window", ErrorKind::NoDevice};
    const auto surface = VkSurfaceKHR(made);
    for (Adapter& a : adapters_) {
        if (!a.info.usable) continue;
        VkBool32 can = VK_FALSE;
        if (windows_.support(a.physical, a.queue_family, surface, &can) == VK_SUCCESS && can) continue;
        a.info.usable = false;
        a.info.unusable_because = "it cannot show pictures in this window";
    }
    windows_.destroy(instance_, surface, nullptr);
    return {};
}

Result<Adapter> Instance::choose(std::string_view wanted) const {
    std::string there_are;
    for (const Adapter& a : adapters_) {
        there_are += (there_are.empty() ? "'" : ", '") + a.info.name + "'";
        if (!a.info.usable) there_are += " (unusable: " + a.info.unusable_because + ")";
        if (!a.info.usable) continue;
        const bool fits = wanted == "auto"         ? true
                          : wanted == "cpu-vulkan" ? a.info.kind == DeviceKind::Cpu
                                                   : lower(a.info.name).find(lower(wanted)) != std::string::npos;
        if (fits) return a;
    }
    return Error{"no Vulkan device fits '" + std::string(wanted) + "'; there are: " + there_are +
                     (wanted == "cpu-vulkan" ? "; apt install mesa-vulkan-drivers" : ""),
                 ErrorKind::NoDevice};
}

}  // namespace kiln::rhi::vulkan
