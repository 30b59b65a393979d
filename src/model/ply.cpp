// SPDX-License-Identifier: MIT
// PLY (Turk, "The PLY Polygon File Format", 1994), text and binary of both byte orders. x, y, z of the element `vertex` and the list
// vertex_indices (or vertex_index) of `face` are read; every other element and property is stepped over. Polygons become fans.

#include "model/triangles.h"
#include "model/words.h"

#include "base/format.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace kiln::model {
namespace {

enum class Scalar : uint8_t { I8, U8, I16, U16, I32, U32, F32, F64 };
constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

bool scalar_of(std::string_view word, Scalar& out) {
    constexpr std::string_view kNames[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                              {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                              {"float", "float32"}, {"double", "float64"}};
    for (size_t i = 0; i < std::size(kNames); ++i) {
        if (word != kNames[i][0] && word != kNames[i][1]) continue;
        out = Scalar(i);
        return true;
    }
    return false;
}

struct Property {
    std::string_view name;
    Scalar type = Scalar::F32;
    bool list = false;
    Scalar count_type = Scalar::U8;
};
struct Element {
    std::string_view name;
    uint64_t count = 0;
    std::vector<Property> properties;
};

enum class Encoding : uint8_t { Text, Little, Big };

// One number after another, in the file's encoding.
struct Numbers {
    std::string_view rest;
    Encoding encoding;

    bool next(Scalar type, double& out) {
        if (encoding == Encoding::Text) return number_of(next_word(rest), out);
        const size_t size = kSizes[size_t(type)];
        if (rest.size() < size) return false;
        uint64_t bits = 0;
        for (size_t i = 0; i < size; ++i) {
            const size_t at = encoding == Encoding::Little ? size - 1 - i : i;
            bits = bits << 8 | uint8_t(rest[at]);
        }
        rest.remove_prefix(size);
        switch (type) {
        case Scalar::I8:
            out = int8_t(bits);
            break;
        case Scalar::I16:
            out = int16_t(bits);
            break;
        case Scalar::I32:
            out = int32_t(bits);
            break;
        case Scalar::F32:
            out = double(std::bit_cast<float>(uint32_t(bits)));
            break;
        case Scalar::F64:
            out = std::bit_cast<double>(bits);
            break;
        default:
            out = double(bits);
            break;
        }
        return true;
    }
};

// A float of any double: what is out of range becomes infinite, which checked() refuses.
float narrow(double v) { return std::fabs(v) > 3e38 ? INFINITY : float(v); }

}  // namespace

Result<Triangles> parse_ply(std::string_view bytes, const std::string& name) {
    const auto fault = [&](const std::string& what) { return Error{name + ": " + what, ErrorKind::Input}; };
    std::string_view rest = bytes, line;
    if (!next_line(rest, line) || line != "ply") return fault("does not begin with the line `ply`; is it a PLY file?");
    Numbers numbers{{}, Encoding::Text};
    std::vector<Element> elements;
    bool ended = false;
    while (!ended && next_line(rest, line)) {
        std::string_view words = line;
        const std::string_view key = next_word(words);
        if (key == "format") {
            const std::string_view kind = next_word(words);
            if (kind == "binary_little_endian") {
                numbers.encoding = Encoding::Little;
            } else if (kind == "binary_big_endian") {
                numbers.encoding = Encoding::Big;
            } else if (kind != "ascii") {
                return fault(formatted("format \"{}\" is not known; save as ascii or binary_little_endian", kind));
            }
        } else if (key == "element") {
            Element& e = elements.emplace_back();
            e.name = next_word(words);
            if (!number_of(next_word(words), e.count)) return fault(formatted("`{}` without a count", line));
            if (elements.size() > 64) return fault("more than 64 elements in its head; export it again");
        } else if (key == "property") {
            if (elements.empty()) return fault("a property before any element; export it again");
            if (elements.back().properties.size() > 256) return fault("more than 256 properties; export it again");
            Property p;
            std::string_view type = next_word(words);
            if (type == "list") {
                p.list = true;
                if (!scalar_of(next_word(words), p.count_type)) return fault(formatted("`{}`: unknown type", line));
                type = next_word(words);
            }
            if (!scalar_of(type, p.type)) return fault(formatted("`{}`: unknown type; export it again", line));
            p.name = next_word(words);
            elements.back().properties.push_back(p);
        } else if (key == "end_header") {
            ended = true;
        } else if (key != "comment" && key != "obj_info" && !key.empty()) {
            return fault(formatted("unknown word \"{}\" in its head; export it again", key.substr(0, 20)));
        }
    }
    if (!ended) return fault("its head has no `end_header`; the file is cut off, export it again");
    numbers.rest = rest;

    Triangles out;
    for (const Element& e : elements) {
        if (e.properties.empty()) continue;
        if (e.count > numbers.rest.size())
            return fault(
                formatted("promises {} of `{}`, more than the file can hold; export it again", e.count, e.name));
        const auto cut_off = [&](uint64_t i) {
            return fault(formatted("ends or is damaged at {} {} of {}; export it again", e.name, i, e.count));
        };
        const bool corners = e.name == "vertex", polygons = e.name == "face";
        for (uint64_t i = 0; i < e.count; ++i) {
            vec3 p{NAN, NAN, NAN};
            for (const Property& property : e.properties) {
                double value = 0;
                if (!property.list) {
                    if (!numbers.next(property.type, value)) return cut_off(i);
                    if (property.name == "x") p.x = narrow(value);
                    if (property.name == "y") p.y = narrow(value);
                    if (property.name == "z") p.z = narrow(value);
                    continue;
                }
                if (!numbers.next(property.count_type, value) || !(value >= 0) || value > double(numbers.rest.size()))
                    return cut_off(i);
                const bool faces = polygons && (property.name == "vertex_indices" || property.name == "vertex_index");
                const auto sides = uint64_t(value);
                uint32_t first = 0, last = 0;
                for (uint64_t k = 0; k < sides; ++k) {
                    if (!numbers.next(property.type, value)) return cut_off(i);
                    if (!faces) continue;
                    if (!(value >= 0) || value >= double(UINT32_MAX)) return cut_off(i);
                    const auto corner = uint32_t(value);
                    if (k == 0) first = corner;
                    if (k >= 2) out.faces.push_back({first, last, corner});
                    last = corner;
                }
                if (out.faces.size() > kMostTriangles) return fault("too many triangles; simplify the model");
            }
            if (corners) out.positions.push_back(p);
        }
    }
    return checked(std::move(out), name);
}

}  // namespace kiln::model
