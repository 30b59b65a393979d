// SPDX-License-Identifier: MIT
// STL, text and binary. A binary file is known by its length, since many of them begin with the word "solid" too.

#include "model/triangles.h"
#include "model/words.h"

#include "base/format.h"

#include <cstring>

namespace kiln::model {
namespace {

constexpr size_t kHead = 84;    // 80 bytes of anything, then the count
constexpr size_t kRecord = 50;  // normal, three corners, two bytes

uint32_t little32(const char* at) {
    uint8_t b[4];
    std::memcpy(b, at, 4);
    return uint32_t(b[0]) | uint32_t(b[1]) << 8 | uint32_t(b[2]) << 16 | uint32_t(b[3]) << 24;
}

void add_corner(Triangles& out, vec3 p) {
    const auto index = uint32_t(out.positions.size());
    out.positions.push_back(p);
    if (index % 3 == 2) out.faces.push_back({index - 2, index - 1, index});
}

Result<Triangles> parse_text(std::string_view text, const std::string& name) {
    Triangles out;
    size_t number = 0;
    for (std::string_view line; next_line(text, line);) {
        ++number;
        std::string_view rest = line;
        if (next_word(rest) != "vertex") continue;
        vec3 p;
        for (float* c : {&p.x, &p.y, &p.z}) {
            const std::string_view word = next_word(rest);
            if (!number_of(word, *c))
                return Error{
                    formatted("{}:{}: `vertex` with \"{}\" for a coordinate; write three numbers", name, number, word),
                    ErrorKind::Input};
        }
        if (out.faces.size() >= kMostTriangles)
            return Error{name + ": too many triangles; simplify the model", ErrorKind::Input};
        add_corner(out, p);
    }
    if (out.positions.size() % 3 != 0)
        return Error{name + ": ends inside a triangle; export it again", ErrorKind::Input};
    return checked(std::move(out), name);
}

}  // namespace

Result<Triangles> parse_stl(std::string_view bytes, const std::string& name) {
    const uint64_t count = bytes.size() >= kHead ? little32(bytes.data() + 80) : 0;
    const bool whole = bytes.size() >= kHead && kHead + kRecord * count <= bytes.size();
    std::string_view head = bytes;
    const bool says_text = next_word(head) == "solid" && bytes.find("vertex") != std::string_view::npos;
    if (says_text && !(whole && kHead + kRecord * count == bytes.size())) return parse_text(bytes, name);
    if (bytes.size() < kHead) return Error{name + ": too short for an STL file; export it again", ErrorKind::Input};
    if (!whole)
        return Error{formatted("{}: promises {} triangles, which take {} bytes, but has {}; export it again", name,
                               count, kHead + kRecord * count, bytes.size()),
                     ErrorKind::Input};
    Triangles out;
    out.positions.reserve(3 * count);
    out.faces.reserve(count);
    for (uint64_t i = 0; i < count; ++i) {
        const char* record = bytes.data() + kHead + kRecord * i;
        for (size_t corner = 1; corner <= 3; ++corner) {
            float c[3];
            for (size_t axis = 0; axis < 3; ++axis) {
                const uint32_t bits = little32(record + 12 * corner + 4 * axis);
                std::memcpy(&c[axis], &bits, 4);
            }
            add_corner(out, {c[0], c[1], c[2]});
        }
    }
    return checked(std::move(out), name);
}

}  // namespace kiln::model
