// SPDX-License-Identifier: MIT
#include "player/hud.h"

#include <algorithm>

namespace kiln::player {

namespace {

// The most useful first: narrow pictures show as many as have room.
constexpr std::string_view kHints[] = {"left mouse digs", "right mouse + WASD flies",
                                       "G throws",        "Ctrl+Z undoes",
                                       "F1 profiler",     "P pauses",
                                       "R restarts",      "V views",
                                       "B adds",          "Esc quits"};
constexpr std::string_view kBetween = " \xc2\xb7 ";

}  // namespace

std::vector<std::pair<std::string, Rect>> Hud::draw(Picture& picture) const {
    std::vector<std::pair<std::string, Rect>> out;
    const int scale = std::max(1, picture.height / 400), pad = 3 * scale;
    Canvas canvas(picture, scale);
    const int tall = canvas.line_height() + pad;
    int bottom = picture.height;
    if (hints) {
        std::string line;
        for (const std::string_view hint : kHints) {
            const std::string longer =
                line.empty() ? std::string(hint) : line + std::string(kBetween) + std::string(hint);
            if (canvas.text_width(longer) + 2 * pad > picture.width) break;
            line = longer;
        }
        const Rect bar{0, bottom - tall, picture.width, tall};
        canvas.fill(bar, 12, 12, 14, 0.6f);
        canvas.text(pad, bar.y + pad, line);
        out.emplace_back("hints", bar);
        bottom = bar.y;
    }
    if (!message.empty()) {
        const Rect bar{0, bottom - tall, std::min(picture.width, canvas.text_width(message) + 2 * pad), tall};
        canvas.fill(bar, 12, 12, 14, 0.6f);
        canvas.text(pad, bar.y + pad, message, 255, 214, 140);
        out.emplace_back("message", bar);
    }
    if (!profiler.empty()) {
        int wide = 0;
        for (const std::string& line : profiler) wide = std::max(wide, canvas.text_width(line));
        const Rect box{0, 0, wide + 2 * pad, int(profiler.size()) * canvas.line_height() + 2 * pad};
        canvas.fill(box, 12, 12, 14, 0.6f);
        for (size_t i = 0; i < profiler.size(); ++i) canvas.text(pad, pad + int(i) * canvas.line_height(), profiler[i]);
        out.emplace_back("profiler", box);
    }
    return out;
}

}  // namespace kiln::player
