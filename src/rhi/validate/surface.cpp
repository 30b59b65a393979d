// SPDX-License-Identifier: MIT
// Windows: one texture at a time, filled before it is shown.
#include "rhi/validate/device.h"

#include "base/format.h"

#include <algorithm>

namespace kiln::rhi::validate {

Result<SurfaceHandle> ValidateDevice::create_surface(const SurfaceDesc& desc) {
    Result<SurfaceHandle> out = below_->create_surface(desc);
    if (out) objects_.surfaces.set(*out, {.label = std::string(desc.label)});
    return out;
}

void ValidateDevice::expire(TextureHandle texture) {
    if (!objects_.textures.find(texture)) return;
    tracker_.remove(texture);
    objects_.textures.erase(texture);
    std::erase_if(written_textures_, [&](const TextureWrite& w) { return w.place.texture == texture; });
}

void ValidateDevice::destroy(SurfaceHandle handle) {
    if (const SurfaceInfo* s = objects_.surfaces.find(handle)) expire(s->acquired);
    forget(objects_.surfaces, handle);
}

Result<SurfaceState> ValidateDevice::configure(SurfaceHandle surface, const SurfaceSettings& settings) {
    SurfaceInfo* s = objects_.surfaces.find(surface);
    if (!s) return refuse("configure: " + objects_.surfaces.why_not(surface));
    if (s->acquired)
        return refuse(formatted("configure: '{}' has a texture that is not presented; present it first", s->label));
    if (std::max(settings.width, settings.height) > kMaxTexture2d)
        return refuse(formatted("configure: '{}' of {}x{} is beyond the floor of {} along an edge", s->label,
                                settings.width, settings.height, kMaxTexture2d));
    Result<SurfaceState> out = below_->configure(surface, settings);
    s->configured = out && *out == SurfaceState::Ready;
    return out;
}

Result<SurfaceImage> ValidateDevice::acquire(SurfaceHandle surface) {
    SurfaceInfo* s = objects_.surfaces.find(surface);
    if (!s) return refuse("acquire: " + objects_.surfaces.why_not(surface));
    if (!s->configured) return refuse(formatted("acquire: '{}' is not configured", s->label));
    if (s->acquired)
        return refuse(formatted("acquire: '{}' has a texture that is not presented; present it first", s->label));
    Result<SurfaceImage> out = below_->acquire(surface);
    if (!out || out->state != SurfaceState::Ready) return out;
    s->acquired = out->texture;
    objects_.textures.set(
        out->texture,
        {.label = s->label,
         .desc = {.format = out->format, .size = {out->width, out->height}, .usage = TextureUsage::CopyDst},
         .need = {},
         .whole = {},
         .shown = true});
    tracker_.add(out->texture);
    return out;
}

Result<SurfaceState> ValidateDevice::present(SurfaceHandle surface) {
    SurfaceInfo* s = objects_.surfaces.find(surface);
    if (!s) return refuse("present: " + objects_.surfaces.why_not(surface));
    if (!s->acquired) return refuse(formatted("present: '{}' has no texture; acquire one", s->label));
    // Writes are learnt of when they are submitted.
    if (!tracker_.ready_to_present(s->acquired))
        return refuse(
            formatted("present: nothing that was submitted left the texture of '{}' ready for Present", s->label));
    expire(std::exchange(s->acquired, {}));
    return below_->present(surface);
}

}  // namespace kiln::rhi::validate
