// SPDX-License-Identifier: MIT
// A plane model as large as people's: letters made of thousands of strokes, as a `.vm` file would hold them.
#pragma once

#include "measure/recipes.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace kiln::measure {

/// `glyphs` of strokes (a cut ring and a turned bar) in rows over [-1, 1]², 35 operations each and one more for all, constants among
/// them. With `tail` another one, without its ring: 25 operations. So 224 and the tail are the 7,866 of the model that people measure.
inline std::string letters_model(int glyphs, bool tail = false, uint32_t seed = 1) {
    uint32_t drawn = 0;
    const auto in = [&](double lo, double hi) { return lo + (hi - lo) * double(uniform(seed, drawn++, 0)); };
    std::string out = "# letters\n";
    int count = 0;
    const auto line = [&](const std::string& operation) {
        const std::string name = "_" + std::to_string(count++);
        out += name + " " + operation + "\n";
        return name;
    };
    const auto number = [&](double v) { return line("const " + std::to_string(v)); };
    const std::string x = line("var-x"), y = line("var-y");
    std::vector<std::string> parts;
    const int columns = 24;
    const int all = glyphs + int(tail), rows = (all + columns - 1) / columns;
    for (int g = 0; g < all; ++g) {
        const bool whole = g < glyphs;
        const double cx = -0.95 + 1.9 * (g % columns + 0.5) / columns, cy = 0.95 - 1.9 * (g / columns + 0.5) / rows;
        const double size = 0.9 / columns;
        const std::string dx = line("sub " + x + " " + number(cx)), dy = line("sub " + y + " " + number(cy));
        std::string ring;
        if (whole) {
            const std::string r = line("sqrt " + line("add " + line("square " + dx) + " " + line("square " + dy)));
            ring = line("max " + line("sub " + r + " " + number(size)) + " " +
                        line("sub " + number(0.7 * size) + " " + r));
        }
        const auto cut = [&](const std::string& stroke) {
            return line("max " + stroke + " " + line("sub " + dx + " " + number(in(0, size))));
        };
        const std::string open = whole ? cut(ring) : std::string();
        // A bar, turned.
        const double c = std::cos(in(0, 3)), s = std::sqrt(1 - c * c);
        const std::string u =
            line("add " + line("mul " + dx + " " + number(c)) + " " + line("mul " + dy + " " + number(s)));
        const std::string v =
            line("sub " + line("mul " + dy + " " + number(c)) + " " + line("mul " + dx + " " + number(s)));
        const std::string bar = line("max " + line("sub " + line("abs " + u) + " " + number(size)) + " " +
                                     line("sub " + line("abs " + v) + " " + number(0.15 * size)));
        parts.push_back(whole ? line("min " + open + " " + bar) : cut(bar));
    }
    while (parts.size() > 1) {
        std::vector<std::string> next;
        for (size_t i = 0; i + 1 < parts.size(); i += 2) next.push_back(line("min " + parts[i] + " " + parts[i + 1]));
        if (parts.size() % 2 == 1) next.push_back(parts.back());
        parts = next;
    }
    return out;
}

}  // namespace kiln::measure
