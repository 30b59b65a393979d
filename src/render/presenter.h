// SPDX-License-Identifier: MIT
// Shows finished pictures in a window: stretches them to its pixels, in its order of channels, and keeps its surface in shape when it is
// resized, hidden, or lost.
#pragma once

#include "rhi/device.h"

#include <kiln/renderer.h>

namespace kiln::render {

class Presenter {
public:
    Presenter(rhi::Device& device, WindowSurface window) : device_(device), window_(std::move(window)) {}
    ~Presenter();
    Presenter(const Presenter&) = delete;
    Presenter& operator=(const Presenter&) = delete;

    Result<kiln::Shown> show(const Picture& picture, int width, int height, bool wait);
    // Times that the surface was set up.
    int configured() const { return configured_; }

private:
    Result<rhi::SurfaceState> configure(int width, int height, bool wait);

    rhi::Device& device_;
    WindowSurface window_;
    rhi::SurfaceHandle surface_;
    bool ready_ = false, waits_ = false;
    int width_ = 0, height_ = 0;  // that it was configured for
    int configured_ = 0;
    std::vector<std::byte> texels_;
};

}  // namespace kiln::render
