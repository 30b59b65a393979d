// SPDX-License-Identifier: MIT
// What the tests of the renderer's kernels share: a device under validation with a runner, and small frames.
#pragma once

#include "field/worlds.h"
#include "render/frame.h"
#include "render/graph_runner.h"
#include "rhi/rhi_test.h"

#include <kiln/renderer.h>

namespace kiln::render {

class GpuTest : public rhi::VulkanTest {
protected:
    void SetUp() override {
        rhi::VulkanTest::SetUp();
        if (device_) runner_ = std::make_unique<Runner>(*device_);
    }
    void TearDown() override {
        runner_.reset();
        rhi::VulkanTest::TearDown();
    }
    std::unique_ptr<Runner> runner_;
};

// The renderer as users have it, under validation: its first complaint fails the call. Null where no device is.
inline std::unique_ptr<Renderer> renderer_or_skip() {
    auto made = Renderer::create({.device = "auto", .validation = true});
    if (made) return std::make_unique<Renderer>(std::move(*made));
    const char* required = std::getenv("REQUIRE_VULKAN");
    EXPECT_FALSE(required && std::string_view(required) == "1") << made.error().message;
    return nullptr;
}

inline Frame frame_of(const field::worlds::World& world, vec3 eye = {2.2f, 1.5f, 2.6f}) {
    Frame frame;
    frame.field = world.field();
    frame.materials.resize(8);
    frame.materials[1].base_color = {0.8f, 0.2f, 0.15f};
    frame.materials[2].base_color = {0.15f, 0.4f, 0.8f};
    frame.materials[3] = {.base_color = {0.9f, 0.7f, 0.3f}, .roughness = 0.3f, .metallic = 1.0f};
    frame.materials[4].base_color = {0.3f, 0.7f, 0.3f};
    frame.materials[5].emissive = {0.4f, 0.2f, 0.0f};
    frame.lights.emplace_back();
    frame.environment = Environment{};
    frame.camera.position = eye;
    frame.camera.tone_map = ToneMap::Neutral;
    return frame;
}

// blends() on a ground that leaves the grid.
inline field::worlds::World on_ground() {
    field::worlds::World w = field::worlds::blends();
    Edit ground = field::worlds::edit(Plane{}, {0, -0.5f, 0});
    ground.node.material = MaterialId{3, 0};
    w.edits.insert(w.edits.begin(), ground);
    return w;
}

}  // namespace kiln::render
