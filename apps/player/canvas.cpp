// SPDX-License-Identifier: MIT
#include "player/canvas.h"

#include "player/glyphs.h"

#include <algorithm>
#include <cmath>

namespace kiln::player {

namespace {

constexpr int kAdvance = 6;                    // pixels of the typeface from letter to letter
constexpr std::string_view kDot = "\xc2\xb7";  // the middle dot in UTF-8

const Glyph* find(char c) {
    for (const Glyph& g : kGlyphs)
        if (g.character == c) return &g;
    return nullptr;
}

// The text as characters of the typeface, '\1' for a middle dot, one for each that is shown.
template <typename Each>
void characters(std::string_view text, Each&& each) {
    for (size_t i = 0; i < text.size(); ++i) {
        const auto byte = uint8_t(text[i]);
        if (text.substr(i, 2) == kDot) {
            each('\1');
            ++i;
        } else if (byte < 0x80) {
            each(text[i]);
        } else if (byte >= 0xc0) {
            each('?');  // the first byte of another sign
        }
    }
}

}  // namespace

void Canvas::fill(const Rect& rect, int red, int green, int blue, float opacity) {
    const int colour[3] = {red, green, blue};
    const int share = int(std::lround(opacity * 256));
    const int x0 = std::max(rect.x, 0), x1 = std::min(rect.x + rect.width, picture_.width);
    const int y0 = std::max(rect.y, 0), y1 = std::min(rect.y + rect.height, picture_.height);
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            for (int c = 0; c < 3; ++c) {
                uint8_t& at = picture_.srgb[(size_t(y) * size_t(picture_.width) + size_t(x)) * 4 + size_t(c)];
                at = uint8_t((at * (256 - share) + colour[c] * share + 128) >> 8);
            }
}

void Canvas::text(int x, int y, std::string_view text, int red, int green, int blue) {
    characters(text, [&](char c) {
        if (c == '\1') fill({x + 2 * scale_, y + 3 * scale_, scale_, scale_}, red, green, blue, 1);
        const Glyph* glyph = find(c);
        for (int row = 0; glyph && row < 7; ++row)
            for (int column = 0; column < 5; ++column)
                if ((glyph->rows[size_t(row)] >> (4 - column) & 1) != 0)
                    fill({x + column * scale_, y + row * scale_, scale_, scale_}, red, green, blue, 1);
        x += kAdvance * scale_;
    });
}

int Canvas::text_width(std::string_view text) const {
    int count = 0;
    characters(text, [&](char) { ++count; });
    return count * kAdvance * scale_;
}

}  // namespace kiln::player
