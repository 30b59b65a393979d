// SPDX-License-Identifier: MIT
// Draws bars and text over the shown bytes of a picture.
#pragma once

#include <kiln/renderer.h>

#include <string_view>

namespace kiln::player {

struct Rect {
    int x = 0, y = 0, width = 0, height = 0;
};

class Canvas {
public:
    /// `scale`: pixels of the picture a pixel of the typeface.
    Canvas(Picture& picture, int scale) : picture_(picture), scale_(scale) {}

    /// Blends a colour (sRGB, 0 to 255) over a rectangle; what lies outside the picture is left out.
    void fill(const Rect& rect, int red, int green, int blue, float opacity);
    /// Left top corner at x, y. Characters that the typeface lacks leave a gap; the middle dot is drawn as one.
    void text(int x, int y, std::string_view text, int red = 240, int green = 240, int blue = 235);
    int text_width(std::string_view text) const;
    int line_height() const { return 10 * scale_; }

private:
    Picture& picture_;
    int scale_;
};

}  // namespace kiln::player
