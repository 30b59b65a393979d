// SPDX-License-Identifier: MIT
#include "render/presenter.h"

#include "base/assert.h"

#include <algorithm>
#include <utility>

namespace kiln::render {

namespace {

constexpr int kTries = 3;  // to set a window up that goes on changing; then it waits for the next picture

// Where a row (or column) of the window lies among those of the picture: between `first` and the next, `share` of 256 towards that.
struct Tap {
    int first, next, share;
};

std::vector<Tap> taps(int from, int to) {
    std::vector<Tap> out;
    for (int i = 0; i < to; ++i) {
        // Middles of pixels, in 256ths of one of the picture's.
        const int64_t at =
            std::clamp<int64_t>((int64_t{2} * i + 1) * from * 128 / to - 128, 0, int64_t{from - 1} * 256);
        const int first = int(at / 256);
        out.push_back({first, std::min(first + 1, from - 1), int(at % 256)});
    }
    return out;
}

// `to` is filled with the picture in as many pixels, 4 bytes each; `swap`: blue first.
template <typename Byte>
void stretch(const Picture& picture, int width, int height, bool swap, std::vector<Byte>& to) {
    KILN_ASSERT(picture.srgb.size() == size_t(picture.width) * size_t(picture.height) * 4);
    to.resize(size_t(width) * size_t(height) * 4);
    const std::vector<Tap> across = taps(picture.width, width), down = taps(picture.height, height);
    const int order[4] = {swap ? 2 : 0, 1, swap ? 0 : 2, 3};
    for (int y = 0; y < height; ++y) {
        const Tap& v = down[size_t(y)];
        const uint8_t* top = picture.srgb.data() + size_t(v.first) * size_t(picture.width) * 4;
        const uint8_t* bottom = picture.srgb.data() + size_t(v.next) * size_t(picture.width) * 4;
        Byte* out = to.data() + size_t(y) * size_t(width) * 4;
        for (int x = 0; x < width; ++x, out += 4) {
            const Tap& u = across[size_t(x)];
            for (int c = 0; c < 4; ++c) {
                const int a = top[u.first * 4 + c] * (256 - u.share) + top[u.next * 4 + c] * u.share;
                const int b = bottom[u.first * 4 + c] * (256 - u.share) + bottom[u.next * 4 + c] * u.share;
                out[order[c]] = Byte((a * (256 - v.share) + b * v.share + 32768) >> 16);
            }
        }
    }
}

}  // namespace
}  // namespace kiln::render

namespace kiln {

Picture Picture::stretched(int to_width, int to_height) const {
    Picture out;
    out.width = to_width;
    out.height = to_height;
    out.view = view;
    render::stretch(*this, to_width, to_height, false, out.srgb);
    return out;
}

}  // namespace kiln

namespace kiln::render {

Presenter::~Presenter() {
    if (surface_) device_.destroy(surface_);
}

Result<rhi::SurfaceState> Presenter::configure(int width, int height, bool wait) {
    ready_ = false;
    if (!surface_) {
        auto made = device_.create_surface({.make = window_.make, .label = "window"});
        if (!made) return made.error();
        surface_ = *made;
    }
    const rhi::SurfaceSettings settings{.width = uint32_t(std::max(width, 0)),
                                        .height = uint32_t(std::max(height, 0)),
                                        .mode = wait ? rhi::PresentMode::Fifo : rhi::PresentMode::Mailbox};
    auto state = device_.configure(surface_, settings);
    if (!state) return state;
    ++configured_;
    if (*state == rhi::SurfaceState::Lost) {
        device_.destroy(std::exchange(surface_, {}));
        return state;
    }
    ready_ = *state == rhi::SurfaceState::Ready;
    width_ = width, height_ = height, waits_ = wait;
    return state;
}

Result<kiln::Shown> Presenter::show(const Picture& picture, int width, int height, bool wait) {
    using rhi::SurfaceState;
    if (width <= 0 || height <= 0) return Shown::Hidden;
    for (int i = 0; i < kTries; ++i) {
        if (!ready_ || width != width_ || height != height_ || wait != waits_) {
            auto state = configure(width, height, wait);
            if (!state) return state.error();
            if (*state == SurfaceState::Hidden) return Shown::Hidden;
            if (*state != SurfaceState::Ready) continue;
        }
        auto image = device_.acquire(surface_);
        if (!image) return image.error();
        if (image->state == SurfaceState::Busy) return Shown::Later;
        if (image->state != SurfaceState::Ready) {
            if (image->state == SurfaceState::Lost) device_.destroy(std::exchange(surface_, {}));
            ready_ = false;
            continue;
        }
        stretch(picture, int(image->width), int(image->height), image->format == rhi::Format::Bgra8Unorm, texels_);
        auto written = device_.write_texture({.place = {.texture = image->texture},
                                              .size = {image->width, image->height},
                                              .before = rhi::Access::Undefined,
                                              .after = rhi::Access::Present},
                                             texels_);
        if (!written) return written.error();
        auto submitted = device_.submit(device_.create_encoder("show"));
        if (!submitted) return submitted.error();
        auto state = device_.present(surface_);
        if (!state) return state.error();
        if (*state == SurfaceState::Lost) device_.destroy(std::exchange(surface_, {}));
        ready_ = *state == SurfaceState::Ready;
        return Shown::Yes;
    }
    return Shown::Later;
}

}  // namespace kiln::render
