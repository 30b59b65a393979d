// SPDX-License-Identifier: MIT
// Reads single values and whole tables of keys, and words the errors. The first fault ends the reading.
#pragma once

#include "scene/format.h"
#include "scene/json_source.h"

#include <kiln/edit.h>

#include <optional>
#include <string>
#include <vector>

namespace kiln::scene {

/// Brings a quaternion near unit length to it; one that is as near as floats come keeps its bits.
void make_unit(quat& q);

class ValueReader {
public:
    explicit ValueReader(const JsonDocument& document) : doc(document) {}

    const JsonDocument& doc;
    std::optional<Error> error;

    // All return false after a fault, with `error` set.
    bool fail(JsonIndex i, const std::string& message);
    bool fail_at_key(JsonIndex i, const std::string& message);
    /// "12 is a number; write <right>".
    bool wrong_type(JsonIndex i, const std::string& right);
    bool unknown_key(JsonIndex i, std::span<const std::string_view> known);
    bool unknown_name(JsonIndex i, std::string_view what, std::span<const std::string_view> known);

    /// `out` may be null: only checked. A field of two numbers may be written as one.
    bool numbers(JsonIndex i, const sdf::FieldRow& row, float* out);
    bool scale(JsonIndex i, vec3* out);
    bool rotation(JsonIndex i, quat* out);
    bool boolean(JsonIndex i, bool* out);
    bool text(JsonIndex i, std::string_view example, std::string* out);
    bool choice(JsonIndex i, std::span<const std::string_view> choices, int* out);

    /// Every key of the object at `i` by its row; numbers with a place in a struct go to `floats`. Rows of type Node, and the
    /// members of lists and maps of nodes, are left to the caller.
    bool table(JsonIndex i, const Table& table, float* floats = nullptr, uint8_t kinds = 0xff,
               std::string_view kind_name = {});
    bool value(JsonIndex i, const KeyRow& row, float* floats);
    bool required(JsonIndex i, const Table& table);
};

}  // namespace kiln::scene
