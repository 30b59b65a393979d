// SPDX-License-Identifier: MIT
#include "measure/frame_work.h"

#include "base/hash.h"

#include <kiln/renderer.h>
#include <kiln/world.h>

namespace kiln {

struct FrameWork::Impl {
    Renderer renderer;
    Frame frame = {};
};

FrameWork::FrameWork(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FrameWork::FrameWork(FrameWork&&) noexcept = default;
FrameWork::~FrameWork() = default;

Result<FrameWork> FrameWork::create() {
    auto renderer = Renderer::create();
    if (!renderer) return renderer.error();
    return FrameWork(std::make_unique<Impl>(Impl{.renderer = std::move(*renderer)}));
}

Result<void> FrameWork::load(std::string_view scene) {
    const auto world = World::load(std::string(scene));
    if (!world) return world.error();
    auto frame = world->frame();
    if (!frame) return frame.error();
    impl_->frame = std::move(*frame);
    return {};
}

void FrameWork::show(const Frame& frame) { impl_->frame = frame; }

Result<uint64_t> FrameWork::draw(int width, int height) {
    const auto picture = impl_->renderer.render(impl_->frame, {.width = width, .height = height});
    if (!picture) return picture.error();
    return hash64(std::as_bytes(std::span(picture->srgb)));
}

std::vector<std::pair<std::string, double>> FrameWork::passes() const {
    auto out = impl_->renderer.stats().passes;
    out.emplace_back("all", impl_->renderer.stats().frame_ms);
    return out;
}

}  // namespace kiln
