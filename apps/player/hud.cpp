// SPDX-License-Identifier: MIT
#include "player/hud.h"

#include <algorithm>
#include <span>

namespace kiln::player {

namespace {

// The most useful first: narrow pictures show as many as have room.
constexpr std::string_view kHints[] = {"left mouse digs", "right mouse + WASD flies",
                                       "F walks",         "G throws",
                                       "Ctrl+Z undoes",   "H all keys",
                                       "F1 profiler",     "P pauses",
                                       "R restarts",      "V views",
                                       "B adds",          "Esc quits"};
constexpr std::string_view kWalkHints[] = {"WASD walks", "mouse looks", "left mouse digs", "Space jumps",
                                           "Shift runs", "G throws",    "Ctrl+Z undoes",   "F flies",
                                           "H all keys", "P pauses"};
constexpr std::string_view kBetween = " \xc2\xb7 ";

// Broken at spaces to lines of so many pixels; a word that is wider has a line of its own.
std::vector<std::string> lines_within(const Canvas& canvas, std::string_view text, int width) {
    std::vector<std::string> out(1);
    while (!text.empty()) {
        const size_t end = std::min(text.find(' '), text.size());
        const std::string word(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        std::string& line = out.back();
        if (line.empty())
            line = word;
        else if (canvas.text_width(line + " " + word) <= width)
            line += " " + word;
        else
            out.push_back(word);
    }
    return out;
}

}  // namespace

std::vector<std::pair<std::string, Rect>> Hud::draw(Picture& picture) const {
    std::vector<std::pair<std::string, Rect>> out;
    const int scale = std::max(1, picture.height / 400), pad = 3 * scale;
    Canvas canvas(picture, scale);
    const int tall = canvas.line_height() + pad;
    int bottom = picture.height;
    if (hints) {
        std::string line;
        for (const std::string_view hint :
             walks ? std::span<const std::string_view>(kWalkHints) : std::span<const std::string_view>(kHints)) {
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
        const auto lines = lines_within(canvas, message, picture.width - 2 * pad);
        int wide = 0;
        for (const std::string& line : lines) wide = std::max(wide, canvas.text_width(line));
        const int high = int(lines.size()) * canvas.line_height() + pad;
        const Rect bar{0, bottom - high, std::min(picture.width, wide + 2 * pad), high};
        canvas.fill(bar, 12, 12, 14, 0.6f);
        for (size_t i = 0; i < lines.size(); ++i)
            canvas.text(pad, bar.y + pad + int(i) * canvas.line_height(), lines[i], 255, 214, 140);
        out.emplace_back("message", bar);
    }
    if (walks) {
        // Light within dark, so that it is seen on anything.
        const int x = picture.width / 2, y = picture.height / 2;
        for (const int wide : {2 * scale, scale})
            for (const bool level : {false, true}) {
                const int a = 3 * scale + wide, b = (wide + 1) / 2;
                const Rect bar = level ? Rect{x - a, y - b, 2 * a, 2 * b} : Rect{x - b, y - a, 2 * b, 2 * a};
                const int shade = wide > scale ? 12 : 240;
                canvas.fill(bar, shade, shade, shade, wide > scale ? 0.4f : 0.9f);
            }
        out.emplace_back("aim", Rect{x - 5 * scale, y - 5 * scale, 10 * scale, 10 * scale});
    }
    const auto box_of = [&](const std::vector<std::string>& lines, bool middle, const char* id) {
        if (lines.empty()) return;
        int wide = 0;
        for (const std::string& line : lines) wide = std::max(wide, canvas.text_width(line));
        Rect box{0, 0, wide + 2 * pad, int(lines.size()) * canvas.line_height() + 2 * pad};
        if (middle) {
            box.x = std::max((picture.width - box.width) / 2, 0);
            box.y = std::max((bottom - box.height) / 2, 0);
        }
        canvas.fill(box, 12, 12, 14, middle ? 0.8f : 0.6f);
        for (size_t i = 0; i < lines.size(); ++i)
            canvas.text(box.x + pad, box.y + pad + int(i) * canvas.line_height(), lines[i]);
        out.emplace_back(id, box);
    };
    box_of(profiler, false, "profiler");
    box_of(help, true, "help");
    return out;
}

}  // namespace kiln::player
