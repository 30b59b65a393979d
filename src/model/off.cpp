// SPDX-License-Identifier: MIT
// OFF (Geomview): counts, positions, polygons; colours behind a polygon are passed over. Polygons become fans.

#include "model/triangles.h"
#include "model/words.h"

#include "base/format.h"

#include <algorithm>

namespace kiln::model {

Result<Triangles> parse_off(std::string_view text, const std::string& name) {
    size_t number = 0;
    const auto fault = [&](const std::string& what) {
        return Error{formatted("{}:{}: {}", name, std::max(number, size_t{1}), what), ErrorKind::Input};
    };
    // Lines with something in them, comments cut off.
    const auto line_with_words = [&](std::string_view& line) {
        while (next_line(text, line)) {
            ++number;
            line = line.substr(0, line.find('#'));
            std::string_view rest = line;
            if (!next_word(rest).empty()) return true;
        }
        return false;
    };
    std::string_view line;
    if (!line_with_words(line)) return fault("is empty; an OFF file begins with the word OFF");
    std::string_view rest = line;
    const std::string_view magic = next_word(rest);
    if (magic != "OFF" && magic != "COFF" && magic != "NOFF")
        return fault(
            formatted("begins with \"{}\"; an OFF file of text begins with the word OFF", magic.substr(0, 20)));
    uint64_t corners = 0, polygons = 0;
    std::string_view counts = rest;
    if (std::string_view look = counts; next_word(look).empty() && line_with_words(line)) counts = line;
    if (!number_of(next_word(counts), corners) || !number_of(next_word(counts), polygons))
        return fault("no counts of corners and polygons; write for example 4 4 6");
    if (corners > text.size() || polygons > text.size())
        return fault(formatted("promises {} corners and {} polygons, more than the file can hold; export it again",
                               corners, polygons));
    Triangles out;
    out.positions.reserve(corners);
    for (uint64_t i = 0; i < corners; ++i) {
        if (!line_with_words(line)) return fault(formatted("ends after {} of {} corners; export it again", i, corners));
        vec3 p;
        for (float* c : {&p.x, &p.y, &p.z})
            if (!number_of(next_word(line), *c)) return fault("not a position; write three numbers");
        out.positions.push_back(p);
    }
    for (uint64_t i = 0; i < polygons; ++i) {
        if (!line_with_words(line))
            return fault(formatted("ends after {} of {} polygons; export it again", i, polygons));
        uint64_t sides = 0;
        if (!number_of(next_word(line), sides) || sides > line.size())
            return fault("not a polygon; write the number of corners, then the corners");
        uint32_t first = 0, last = 0;
        for (uint64_t k = 0; k < sides; ++k) {
            uint32_t corner = 0;
            if (!number_of(next_word(line), corner)) return fault("a corner that is no number; corners count from 0");
            if (k == 0) first = corner;
            if (k >= 2) out.faces.push_back({first, last, corner});
            last = corner;
        }
        if (out.faces.size() > kMostTriangles) return fault("too many triangles; simplify the model");
    }
    return checked(std::move(out), name);
}

}  // namespace kiln::model
