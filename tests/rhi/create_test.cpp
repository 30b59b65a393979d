// SPDX-License-Identifier: MIT
// Getting a device, and not getting one.
#include "rhi_test.h"

#include <cstdlib>

namespace kiln::rhi {
namespace {

// The loader reads the variable whenever an instance is made.
class WithoutDrivers : public testing::Test {
protected:
    void SetUp() override {
        if (const char* old = std::getenv("VK_DRIVER_FILES")) old_ = old;
        setenv("VK_DRIVER_FILES", "/nonexistent/driver.json", 1);
    }
    void TearDown() override {
        if (old_) {
            setenv("VK_DRIVER_FILES", old_->c_str(), 1);
        } else {
            unsetenv("VK_DRIVER_FILES");
        }
    }
    std::optional<std::string> old_;
};

TEST_F(WithoutDrivers, TheErrorSaysWhatToInstall) {
    const auto device = create_device();
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().kind, ErrorKind::NoDevice);
    EXPECT_NE(device.error().message.find("apt install"), std::string::npos) << device.error().message;
    EXPECT_NE(device.error().message.find("mesa-vulkan-drivers"), std::string::npos) << device.error().message;
    const auto list = list_devices();
    ASSERT_FALSE(list);
    EXPECT_EQ(list.error().kind, ErrorKind::NoDevice);
}

TEST_F(WithoutDrivers, TheNullDeviceStillWorks) { EXPECT_TRUE(create_device({.backend = "null"})); }

TEST(Create, UnknownBackendIsAUsageError) {
    const auto device = create_device({.backend = "glide"});
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().kind, ErrorKind::Usage);
}

using CreateGpu = VulkanTest;

TEST_F(CreateGpu, UnknownDeviceIsAnErrorThatListsThem) {
    const auto device = create_device({.device = "voodoo"});
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().kind, ErrorKind::NoDevice);
    EXPECT_NE(device.error().message.find(device_->info().name), std::string::npos) << device.error().message;
}

TEST_F(CreateGpu, ADeviceIsFoundByPartOfItsNameInAnyCase) {
    std::string part = device_->info().name.substr(1, 4);
    for (char& c : part) c = char(std::toupper(c));
    const auto device = create_device({.device = part});
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_EQ((*device)->info().backend, "vulkan");
}

TEST_F(CreateGpu, TheListNamesDriverAndInterface) {
    const std::vector<DeviceInfo> list = must(list_devices());
    ASSERT_FALSE(list.empty());
    for (const DeviceInfo& d : list) {
        EXPECT_FALSE(d.name.empty());
        EXPECT_FALSE(d.api.empty());
        EXPECT_EQ(d.usable, d.unusable_because.empty());
    }
}

// Two devices at once must not disturb each other.
TEST_F(CreateGpu, DevicesLiveSideBySide) {
    std::unique_ptr<Device> other = must(create_device({.pipeline_cache = false}));
    ASSERT_TRUE(other);
    const BufferHandle mine = must(device_->create_buffer({.size = 64, .label = "mine"}));
    const BufferHandle theirs = must(other->create_buffer({.size = 64, .label = "theirs"}));
    must(other->submit(other->create_encoder("theirs")));
    other->destroy(theirs);
    other.reset();
    must(device_->wait(must(device_->submit(device_->create_encoder("mine")))));
    device_->destroy(mine);
}

}  // namespace
}  // namespace kiln::rhi
