// SPDX-License-Identifier: MIT
// Names, fields and ranges of every shape and warp, as generated from the texts' own records.
// Scene format, schema, documentation and editors are made from these rows; nothing about a shape is written twice.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace kiln::sdf {

/// One field of a parameter struct.
struct FieldRow {
    std::string_view name;
    int arity = 0;   ///< 1, 2 or 3 numbers; 0 ends the list
    int offset = 0;  ///< of the first number in Shape::params
    std::array<float, 3> defaults{};
    std::string_view unit;  ///< "m", "rad", "1/m", "rad/m", "1"
    std::string_view
        range;  ///< "any", "> 0", ">= 0", "[a, b]", "(a, b]", "integer [a, b]", "axis", "flag" (true or false), "internal"
    std::string_view doc;
};

/// One shape or warp.
struct KindRow {
    enum How : uint8_t {
        Exact,
        Bound,
        Sampled,
        Formula,
        Composite,
        Custom,  // shapes: true distance outside; lower bound; also reads samples; Shape::data compiled; a library object; a program's own
        Point,
        Value,
        Copies,  // warps: moves the point; changes the distance; several copies
    };
    std::string_view name;
    How how;
    std::string_view doc;
    std::array<FieldRow, 9> field_slots{};

    constexpr std::span<const FieldRow> fields() const {
        size_t n = 0;
        while (n < field_slots.size() && field_slots[n].arity != 0) ++n;
        return std::span(field_slots).first(n);
    }
};

/// Shape rows, indexed by Shape::kind: primitives first, then composites, then what the program has registered (kiln/edit.h).
std::span<const KindRow> shape_rows();
/// Warp rows, indexed by Warp::kind.
std::span<const KindRow> warp_rows();
std::optional<uint16_t> shape_kind(std::string_view name);
std::optional<uint16_t> warp_kind(std::string_view name);
/// Rows below this index are primitives: built in, and no trees of others.
int primitive_count();

/// Why `value` may not stand in `field`, as "what is wrong; what would be right"; nothing when it may.
/// NaN and infinities are never allowed.
std::optional<std::string_view> out_of_range(const FieldRow& field, float value);

}  // namespace kiln::sdf
