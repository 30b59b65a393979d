// SPDX-License-Identifier: MIT
// Small pictures against committed ones, by LDR-FLIP. `./test --accept NAME` writes one anew; look at it before committing it.
#include "golden.h"
#include "gpu_worlds.h"
#include "image/metrics.h"

#include <filesystem>
#include <string>

namespace kiln::render {
namespace {

struct GoldenGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    void compare(const std::string& name, const Frame& frame, RenderSettings settings) {
        settings.width = 160;
        settings.height = 120;
        const Picture picture = rhi::must(renderer->render(frame, settings));
        const std::filesystem::path golden =
            std::filesystem::path(KILN_SOURCE_DIR) / "tests/golden/images" / (name + ".png");
        const std::filesystem::path made = std::filesystem::path(KILN_BINARY_DIR) / ("golden-" + name + ".png");
        rhi::must(picture.save(made.string()));
        if (golden_accepted(name)) {
            std::string change = "(none) -> new";
            if (std::filesystem::exists(golden)) {
                change = "old -> new: FLIP " +
                         std::to_string(rhi::must(image::compare_files(golden.string(), made.string())).flip);
            }
            std::filesystem::create_directories(golden.parent_path());
            std::filesystem::copy_file(made, golden, std::filesystem::copy_options::overwrite_existing);
            golden_renewed(name, change);
            return;
        }
        const auto apart = rhi::must(image::compare_files(golden.string(), made.string()));
        // They are of llvmpipe. Another device rounds otherwise: a step of a colour, a pixel of an edge (0.0113 at most on an H100).
        const bool same_device = renderer->stats().device.starts_with("llvmpipe");
        EXPECT_LE(apart.flip, same_device ? 0.005 : 0.02)
            << golden << " and " << made << "; `./test --accept " << name << "` renews";
    }
    std::unique_ptr<Renderer> renderer;
};

TEST_F(GoldenGpu, BlendedSolidsOnTheGround) { compare("ground", frame_of(on_ground()), {}); }

TEST_F(GoldenGpu, NormalsOfBlendedSolids) {
    compare("normals", frame_of(field::worlds::blends()), {.view = View::Normal});
}

TEST_F(GoldenGpu, LampsAndSoftShadows) {
    Frame frame = frame_of(on_ground());
    frame.environment->intensity = 0.15f;
    frame.lights = {{.kind = Light::Kind::Point,
                     .color = {1, 0.8f, 0.6f},
                     .position = {0.6f, 1.6f, 0.9f},
                     .intensity = 4,
                     .radius = 0.15f},
                    {.kind = Light::Kind::Spot,
                     .color = {0.5f, 0.7f, 1},
                     .direction = {0.7f, -1, -0.4f},
                     .position = {-1.5f, 1.8f, 0.8f},
                     .intensity = 8,
                     .inner_deg = 18,
                     .outer_deg = 26}};
    compare("lamps", frame, {});
}

}  // namespace
}  // namespace kiln::render
