// SPDX-License-Identifier: MIT
// Devices for the tests of this module. Whatever a device complains about is collected; a test that expects no complaint
// fails on the first one.
#pragma once

#include "rhi/create.h"

#include <gtest/gtest.h>

#include <cstring>

namespace kiln::rhi {

// Barriers are the graph's; here we stand in for it.
struct BarrierKeyForTests {
    static BarrierKey key() { return {}; }
};

inline void barrier(CommandEncoder& encoder, const Barrier& b) { encoder.barrier(BarrierKeyForTests::key(), {&b, 1}); }

// Takes the value or fails the test with the error's text.
template <typename T>
T must(Result<T> result) {
    EXPECT_TRUE(bool(result)) << (result ? "" : result.error().message);
    return result ? std::move(*result) : T{};
}
inline void must(Result<void> result) { EXPECT_TRUE(bool(result)) << (result ? "" : result.error().message); }

template <typename T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

template <typename T>
std::vector<T> mapped(Device& device, BufferHandle buffer, size_t count) {
    const std::span<std::byte> bytes = must(device.map(buffer));
    std::vector<T> out(count);
    EXPECT_GE(bytes.size(), count * sizeof(T));
    if (bytes.size() >= count * sizeof(T)) std::memcpy(out.data(), bytes.data(), count * sizeof(T));
    device.unmap(buffer);
    return out;
}

class NullTest : public testing::Test {
protected:
    void SetUp() override { make("null"); }

    void make(const char* backend) {
        Result<std::unique_ptr<Device>> made =
            create_device({.backend = backend, .validation = true, .pipeline_cache = pipeline_cache_});
        if (made) {
            device_ = std::move(*made);
            device_->set_error_sink([this](std::string_view sentence) { complaints_.emplace_back(sentence); });
        } else {
            no_device_because_ = made.error().message;
        }
    }

    void TearDown() override {
        if (!device_) return;
        EXPECT_TRUE(device_->wait_idle());
        if (expects_none_) {
            EXPECT_EQ(device_->live_handle_count(), 0u) << device_->live_handles();
        }
        device_.reset();
        if (!expects_none_) return;
        for (const std::string& c : complaints_) ADD_FAILURE() << c;
    }

    // True when some complaint holds `part`; then none of them fails the test.
    bool complained(std::string_view part) {
        expects_none_ = false;
        for (const std::string& c : complaints_)
            if (c.find(part) != std::string::npos) return true;
        for (const std::string& c : complaints_) std::fprintf(stderr, "complaint: %s\n", c.c_str());
        return false;
    }

    bool pipeline_cache_ = false;
    bool expects_none_ = true;
    std::string no_device_because_;
    std::unique_ptr<Device> device_;
    std::vector<std::string> complaints_;
};

// Skipped where no Vulkan device is, unless REQUIRE_VULKAN=1 says that there must be one.
class VulkanTest : public NullTest {
protected:
    void SetUp() override {
        make("vulkan");
        if (device_) return;
        const char* required = std::getenv("REQUIRE_VULKAN");
        if (required && std::string_view(required) == "1") FAIL() << no_device_because_;
        GTEST_SKIP() << no_device_because_;
    }
};

}  // namespace kiln::rhi
