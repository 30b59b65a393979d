// SPDX-License-Identifier: MIT
// Windows of the null device: as large as they are configured, never slow and never lost.
#include "rhi/null/device.h"

namespace kiln::rhi::null {

namespace {

std::string size_of(const SurfaceSettings& s) { return std::to_string(s.width) + "x" + std::to_string(s.height); }

}  // namespace

Result<SurfaceHandle> NullDevice::create_surface(const SurfaceDesc& desc) {
    line("create surface '" + std::string(desc.label) + "'");
    return surfaces_.insert({.label = std::string(desc.label), .settings = {}, .acquired = {}});
}

void NullDevice::destroy(SurfaceHandle handle) {
    if (const Surface* s = surfaces_.get(handle); s && s->acquired) destroy(s->acquired);
    forget(surfaces_, handle, "surface");
}

Result<SurfaceState> NullDevice::configure(SurfaceHandle surface, const SurfaceSettings& settings) {
    Surface* s = found(surfaces_.get(surface), "surface");
    if (!s) return Error{"configure: stale surface handle"};
    if (s->acquired) return Error{"configure: '" + s->label + "' has a texture that is not presented"};
    s->settings = settings;
    line("configure '" + s->label + "' " + size_of(settings));
    return settings.width == 0 || settings.height == 0 ? SurfaceState::Hidden : SurfaceState::Ready;
}

Result<SurfaceImage> NullDevice::acquire(SurfaceHandle surface) {
    Surface* s = found(surfaces_.get(surface), "surface");
    if (!s) return Error{"acquire: stale surface handle"};
    if (s->acquired) return Error{"acquire: '" + s->label + "' has a texture that is not presented"};
    if (s->settings.width == 0 || s->settings.height == 0) return SurfaceImage{.state = SurfaceState::Hidden};
    auto texture = create_texture({.format = Format::Bgra8Unorm,
                                   .size = {s->settings.width, s->settings.height},
                                   .usage = TextureUsage::CopyDst,
                                   .label = s->label});
    if (!texture) return texture.error();
    s->acquired = *texture;
    return SurfaceImage{SurfaceState::Ready, *texture, Format::Bgra8Unorm, s->settings.width, s->settings.height};
}

Result<SurfaceState> NullDevice::present(SurfaceHandle surface) {
    Surface* s = found(surfaces_.get(surface), "surface");
    if (!s) return Error{"present: stale surface handle"};
    if (!s->acquired) return Error{"present: '" + s->label + "' has no texture; acquire one"};
    line("present '" + s->label + "' " + size_of(s->settings));
    destroy(std::exchange(s->acquired, {}));
    return SurfaceState::Ready;
}

}  // namespace kiln::rhi::null
