// SPDX-License-Identifier: MIT
// From a scene's name to a picture file: what `render` and `demo` share.
#pragma once

#include <kiln/renderer.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace kiln::cli {

struct PictureOptions {
    std::string scene, output, camera, size = "1280x720", view = "shaded", device = "auto", tier = "auto";
    std::string path;  ///< names of cameras, by commas: a sequence of `frames` pictures along them
    int frames = 0;
    double time = 0;               ///< seconds, of the meshes' animations
    uint32_t budget = 0;           ///< bricks a frame of a sequence, 0: no limit
    std::optional<int> reference;  ///< samples a pixel; left out: no path tracing
    bool analytic = false, unpruned = false, no_accelerate = false, no_refine = false, all_lights = false,
         atlas_by_copy = false, no_cull = false;
    std::optional<int> transparent_layers;  ///< left out: as the quality says
    bool taa = false;
    std::string quality;                ///< low, medium, high, ultra or auto; empty: high
    std::string shadows;                ///< of meshes: rays or cascades; empty: as the quality says, else rays
    std::string ao;                     ///< off, half or full; empty: as the quality says, full without one
    std::string lighting = "clusters";  ///< clusters or volumes
    std::string outlines = "seen";      ///< round what is seen; hidden too; or hulls, of meshes
    float scale = 1;                    ///< with taa: rays a pixel along each side
    bool json = false, quiet = false;
    bool transcript = false;  ///< demo: tell the story of the picture
};

/// Renders, writes, reports; answers the exit code.
int render_picture(const PictureOptions& options);

// Parts of it, for sequences of other verbs.

/// Of a word for --quality but "auto".
std::optional<Quality> quality_named(std::string_view name);
/// What the options mean, or which of them means nothing.
Result<RenderSettings> picture_settings(const PictureOptions& options);
/// Sets what --quality asks for; answers its name, "auto" as what it became.
std::string_view choose_quality(const PictureOptions& options, const Renderer& renderer, RenderSettings& settings);

}  // namespace kiln::cli
