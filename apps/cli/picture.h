// SPDX-License-Identifier: MIT
// From a scene's name to a picture file: what `render` and `demo` share.
#pragma once

#include <kiln/renderer.h>

#include <string>

namespace kiln::cli {

struct PictureOptions {
    std::string scene, output, camera, size = "1280x720", view = "shaded", device = "auto";
    int reference = 0;
    bool analytic = false, unpruned = false, no_accelerate = false, no_refine = false, atlas_by_copy = false;
    bool json = false, quiet = false;
    bool transcript = false;  ///< demo: tell the story of the picture
};

/// Renders, writes, reports; answers the exit code.
int render_picture(const PictureOptions& options);

}  // namespace kiln::cli
