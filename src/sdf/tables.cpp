// SPDX-License-Identifier: MIT
// The generated rows, and the one reader of their ranges.

#include "sdf/tables.h"

#include "sdf/custom.h"

#include <charconv>
#include <cmath>

namespace kiln::sdf {
namespace {

#include "sdf/tables.gen.inl"

std::optional<uint16_t> find(std::span<const KindRow> rows, std::string_view name) {
    for (size_t i = 0; i < rows.size(); ++i) {
        if (rows[i].name == name) return uint16_t(i);
    }
    return std::nullopt;
}

float number(std::string_view text) {
    float v = 0;
    std::from_chars(text.data(), text.data() + text.size(), v);
    return v;
}

}  // namespace

std::span<const KindRow> shape_rows() { return rows_with_custom(kShapeRows); }
std::span<const KindRow> warp_rows() { return kWarpRows; }
std::optional<uint16_t> shape_kind(std::string_view name) { return find(shape_rows(), name); }
std::optional<uint16_t> warp_kind(std::string_view name) { return find(kWarpRows, name); }
int primitive_count() { return kPrimitiveCount; }

std::optional<std::string_view> out_of_range(const FieldRow& field, float value) {
    std::string_view range = field.range;
    if (!std::isfinite(value)) return "must be a finite number";
    if (range == "any" || range == "internal") return std::nullopt;
    if (range == "flag")
        return value == 0 || value == 1 ? std::nullopt : std::optional<std::string_view>("must be 0 or 1");
    if (range == "axis") {
        return value == 0 || value == 1 || value == 2 ? std::nullopt
                                                      : std::optional<std::string_view>("must be x, y or z");
    }
    if (range == "> 0") return value > 0 ? std::nullopt : std::optional<std::string_view>("must be greater than 0");
    if (range == ">= 0") return value >= 0 ? std::nullopt : std::optional<std::string_view>("must not be negative");
    const bool whole = range.starts_with("integer ");
    if (whole) {
        range.remove_prefix(8);
        if (value != std::floor(value)) return "must be a whole number";
    }
    // "[a, b]", "(a, b]", …
    const size_t comma = range.find(',');
    const float lo = number(range.substr(1, comma - 1));
    const float hi = number(range.substr(range.find_first_not_of(' ', comma + 1)));
    const bool above = range.front() == '[' ? value >= lo : value > lo;
    const bool below = range.back() == ']' ? value <= hi : value < hi;
    if (above && below) return std::nullopt;
    return range;
}

}  // namespace kiln::sdf
