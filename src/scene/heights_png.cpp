// SPDX-License-Identifier: MIT

#include "scene/heights.h"

#include "image/png_file.h"

#include "base/format.h"

namespace kiln::scene {

Result<sdf::HeightGrid> load_heights(const std::string& path) {
    const auto pixels = image::read_png(path);
    if (!pixels)
        return Error{pixels.error().message + "; name a PNG image, relative to the scene file", ErrorKind::Input};
    if (pixels->width < 2 || pixels->height < 2)
        return Error{
            formatted("{}: {} by {} pixels; a heightfield needs 2 by 2 at least", path, pixels->width, pixels->height),
            ErrorKind::Input};
    sdf::HeightGrid grid;
    grid.columns = pixels->width;
    grid.rows = pixels->height;
    grid.values.reserve(size_t(grid.columns) * size_t(grid.rows));
    // Grey as it stands; of colours the first channel, red.
    const float white = pixels->bits == 16 ? 65535.0f : 255.0f;
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x) grid.values.push_back(float(pixels->at(x, y, 0)) / white);
    return grid;
}

}  // namespace kiln::scene
