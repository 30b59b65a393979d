// SPDX-License-Identifier: MIT
// Height images come as PNG files; colour images give their mean.

#include "scene/heights.h"

#include "image/png_file.h"

namespace kiln::scene {

Result<sdf::HeightGrid> load_heights(const std::string& path) {
    const auto pixels = image::read_png(path);
    if (!pixels) return pixels.error();
    if (pixels->width < 2 || pixels->height < 2) {
        return Error{path + ": a height image needs at least 2 x 2 pixels", ErrorKind::Input};
    }
    sdf::HeightGrid grid{pixels->width, pixels->height, {}};
    const int colors = pixels->channels >= 3 ? 3 : 1;
    const float white = float((1 << pixels->bits) - 1) * float(colors);
    grid.values.reserve(size_t(grid.columns) * size_t(grid.rows));
    for (int y = 0; y < pixels->height; ++y) {
        for (int x = 0; x < pixels->width; ++x) {
            float sum = 0;
            for (int c = 0; c < colors; ++c) sum += float(pixels->at(x, y, c));
            grid.values.push_back(sum / white);
        }
    }
    return grid;
}

}  // namespace kiln::scene
