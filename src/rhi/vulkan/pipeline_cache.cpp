// SPDX-License-Identifier: MIT
#include "rhi/vulkan/pipeline_cache.h"

#include "base/atomic_file.h"
#include "base/format.h"
#include "base/hash.h"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace kiln::rhi::vulkan {

namespace {

// In front of the driver's bytes, which some drivers read without checking them.
struct Header {
    char magic[8];
    uint64_t size;
    Hash128 hash;
};
constexpr char kMagic[8] = {'K', 'I', 'L', 'N', 'P', 'C', '0', '1'};

}  // namespace

std::string cache_folder() {
    if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg == '/') return std::string(xdg) + "/kiln";
    if (const char* home = std::getenv("HOME"); home && *home == '/') return std::string(home) + "/.cache/kiln";
    return {};
}

std::string cache_path(std::string_view folder, const VkPhysicalDeviceProperties& properties) {
    std::string uuid;
    for (const uint8_t byte : properties.pipelineCacheUUID) uuid += formatted("{:02x}", byte);
    return formatted("{}/pipelines-{}-{:08x}.bin", folder, uuid, properties.driverVersion);
}

std::vector<std::byte> load_cache(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    Header header{};
    if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return {};
    std::error_code error;
    const uint64_t file_size = std::filesystem::file_size(path, error);
    if (error || std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 || header.size != file_size - sizeof header)
        return {};
    std::vector<std::byte> bytes(header.size);
    if (!file.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()))) return {};
    if (hash128(bytes) != header.hash) return {};
    return bytes;
}

void save_cache(const std::string& path, std::span<const std::byte> bytes) {
    std::error_code error;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
    if (error) return;
    Result<AtomicFile> file = AtomicFile::create(path);
    if (!file) return;
    Header header{.magic = {}, .size = bytes.size(), .hash = hash128(bytes)};
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    if (!file->write(std::as_bytes(std::span(&header, 1))) || !file->write(bytes)) return;
    // A cache that couldn't be written is only slower next time.
    static_cast<void>(file->commit());
}

}  // namespace kiln::rhi::vulkan
