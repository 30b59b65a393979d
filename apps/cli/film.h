// SPDX-License-Identifier: MIT
// A sequence of pictures of a play, into a folder: frame_00000.png and so on.
#pragma once

#include "cli/picture.h"

#include <kiln/world.h>

#include <string>

namespace kiln::cli {

class Film {
public:
    /// `options.view` may also be "contacts", "shapes" or "sleeping": the shaded picture with lines over it. The folder must be there.
    static Result<Film> open(const World& world, PictureOptions options, const std::string& folder);
    /// The play as it is, as the next picture.
    Result<void> shoot(Play& play);
    int pictures() const { return count_; }

private:
    Film(Renderer renderer, std::string folder) : renderer_(std::move(renderer)), folder_(std::move(folder)) {}
    Renderer renderer_;
    std::string folder_;
    RenderSettings settings_;
    Camera camera_;
    PlayLines lines_;
    int count_ = 0;
};

}  // namespace kiln::cli
