// SPDX-License-Identifier: MIT

#include "scene/read_values.h"

#include "base/format.h"
#include "base/suggest.h"

#include <cmath>

namespace kiln::scene {

bool ValueReader::fail(JsonIndex i, const std::string& message) {
    error = doc.error(i, message);
    return false;
}

bool ValueReader::fail_at_key(JsonIndex i, const std::string& message) {
    error = doc.error_at_key(i, message);
    return false;
}

bool ValueReader::wrong_type(JsonIndex i, const std::string& right) {
    if (doc.is(i, JsonType::Null)) return fail(i, "null is no value here; write " + right + ", or leave the key out");
    return fail(i, formatted("{} is {}; write {}", doc.source(i), json_type_name(doc.type(i)), right));
}

bool ValueReader::unknown_key(JsonIndex i, std::span<const std::string_view> known) {
    return fail_at_key(i, "unknown key; " + suggestion(doc.key(i), known));
}

bool ValueReader::unknown_name(JsonIndex i, std::string_view what, std::span<const std::string_view> known) {
    return fail(i, formatted("there is no {} {}; {}", what, doc.source(i), suggestion(doc.text(i), known)));
}

bool ValueReader::numbers(JsonIndex i, const sdf::FieldRow& row, float* out) {
    const auto example = [&] {
        if (row.range == "axis") return std::string("\"x\", \"y\" or \"z\"");
        std::string s;
        for (int k = 0; k < row.arity; ++k) s += (k ? ", " : "") + shortest(row.defaults[size_t(k)]);
        return row.arity == 1 ? "a number such as " + s : formatted("{} numbers such as [{}]", row.arity, s);
    };
    const auto one = [&](JsonIndex at, float* to) {
        if (!doc.is(at, JsonType::Number)) return wrong_type(at, row.arity == 1 ? example() : "a number");
        const float v = doc.number_as_float(at);
        const float limit = row.unit == "m" ? kFarthest : 1e12f;
        if (!(std::abs(v) <= limit))
            return fail(at, formatted("{} is too large; at most {}{}", doc.source(at), shortest(limit),
                                      row.unit == "m" ? " metres" : ""));
        if (const auto why = sdf::out_of_range(row, v)) {
            const bool is_range = why->starts_with('[') || why->starts_with('(');
            return fail(at, formatted("{} is out of range; {}{}", doc.source(at), is_range ? "must be in " : "", *why));
        }
        if (to) *to = v;
        return true;
    };
    if (row.range == "flag") {
        bool on = false;
        if (!boolean(i, &on)) return false;
        if (out) *out = on ? 1.0f : 0.0f;
        return true;
    }
    if (row.range == "axis") {
        for (size_t a = 0; a < kAxisNames.size(); ++a) {
            if (doc.text(i) != kAxisNames[a]) continue;
            if (out) *out = float(a);
            return true;
        }
        return doc.is(i, JsonType::String) ? unknown_name(i, "axis", kAxisNames) : wrong_type(i, example());
    }
    if (row.arity == 1) return one(i, out);
    if (row.arity == 2 && doc.is(i, JsonType::Number)) return one(i, out) && one(i, out ? out + 1 : nullptr);
    if (!doc.is(i, JsonType::Array)) return wrong_type(i, example());
    const uint32_t count = doc.count(i);
    if (count != uint32_t(row.arity))
        return fail(i, formatted("{} numbers where there must be {}; write {}", count, row.arity, example()));
    int k = 0;
    for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c), ++k)
        if (!one(c, out ? out + k : nullptr)) return false;
    return true;
}

bool ValueReader::scale(JsonIndex i, vec3* out) {
    static constexpr sdf::FieldRow kOne{"scale", 1, 0, {1, 1, 1}, "1", "> 0", ""};
    static constexpr sdf::FieldRow kThree{"scale", 3, 0, {1, 1, 1}, "1", "> 0", ""};
    float s[3];
    const bool single = doc.is(i, JsonType::Number);
    if (!single && !doc.is(i, JsonType::Array)) return wrong_type(i, "a number such as 1, or three");
    if (!numbers(i, single ? kOne : kThree, s)) return false;
    if (single) s[1] = s[2] = s[0];
    for (const float v : s)
        if (v < kSmallestScale || v > kLargestScale)
            return fail(i, formatted("{} is out of range; a scale is between {} and {}", shortest(v),
                                     shortest(kSmallestScale), shortest(kLargestScale)));
    if (out) *out = {s[0], s[1], s[2]};
    return true;
}

bool ValueReader::rotation(JsonIndex i, quat* out) {
    const std::string right = "a quaternion [x, y, z, w] such as [0, 0, 0, 1]";
    if (!doc.is(i, JsonType::Array)) return wrong_type(i, right);
    if (doc.count(i) != 4) return fail(i, formatted("{} numbers where there must be 4; write {}", doc.count(i), right));
    float q[4];
    double squares = 0;
    int k = 0;
    for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c), ++k) {
        if (!doc.is(c, JsonType::Number)) return wrong_type(c, "a number");
        q[k] = doc.number_as_float(c);
        squares += double(q[k]) * double(q[k]);
    }
    const double length = std::sqrt(squares);
    if (!(std::abs(length - 1) <= 1e-3))
        return fail(i, formatted("a quaternion of length {}; its length must be 1, such as [0, 0, 0, 1]",
                                 shortest(float(length))));
    quat unit{q[0], q[1], q[2], q[3]};
    make_unit(unit);
    if (out) *out = unit;
    return true;
}

void make_unit(quat& q) {
    const double length = std::sqrt(double(q.x) * double(q.x) + double(q.y) * double(q.y) + double(q.z) * double(q.z) +
                                    double(q.w) * double(q.w));
    // Already a unit quaternion in floats: left as it is, so that what was saved reads back as the same bits.
    if (std::abs(length - 1) > 2e-7)
        for (float* v : {&q.x, &q.y, &q.z, &q.w}) *v = float(double(*v) / length);
}

bool ValueReader::boolean(JsonIndex i, bool* out) {
    if (!doc.is(i, JsonType::True) && !doc.is(i, JsonType::False)) return wrong_type(i, "true or false");
    if (out) *out = doc.is(i, JsonType::True);
    return true;
}

bool ValueReader::text(JsonIndex i, std::string_view example, std::string* out) {
    if (!doc.is(i, JsonType::String))
        return wrong_type(i, example.empty() ? "a string" : formatted("a string such as \"{}\"", example));
    if (out) *out = doc.text(i);
    return true;
}

bool ValueReader::choice(JsonIndex i, std::span<const std::string_view> choices, int* out) {
    for (size_t c = 0; c < choices.size(); ++c) {
        if (!doc.is(i, JsonType::String) || doc.text(i) != choices[c]) continue;
        if (out) *out = int(c);
        return true;
    }
    std::string all;
    for (size_t c = 0; c < choices.size(); ++c) all += formatted("{}\"{}\"", c ? ", " : "", choices[c]);
    if (!doc.is(i, JsonType::String)) return wrong_type(i, "one of " + all);
    return fail(i, formatted("{} is not known here; must be one of {}", doc.source(i), all));
}

bool ValueReader::required(JsonIndex i, const Table& table) {
    for (const KeyRow& row : table.rows)
        if (row.required && !doc.find(i, row.name))
            return fail(i, formatted("the key \"{}\" is missing; add it ({})", row.name, row.doc));
    return true;
}

bool ValueReader::value(JsonIndex i, const KeyRow& row, float* floats) {
    switch (row.type) {
    case KeyType::Numbers:
        return numbers(i, row.numbers, floats && row.numbers.offset >= 0 ? floats + row.numbers.offset : nullptr);
    case KeyType::Scale:
        return scale(i, nullptr);
    case KeyType::Rotation:
        return rotation(i, nullptr);
    case KeyType::Bool:
        return boolean(i, nullptr);
    case KeyType::Text:
        return text(i, {}, nullptr);
    case KeyType::Choice:
        return choice(i, row.choices, nullptr);
    case KeyType::Object:
        return table(i, *row.table);
    case KeyType::Node:
        return true;
    case KeyType::TextList:
        if (!doc.is(i, JsonType::Array)) return wrong_type(i, "an array of strings");
        for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c))
            if (!text(c, {}, nullptr)) return false;
        return true;
    case KeyType::List:
        if (!doc.is(i, JsonType::Array)) return wrong_type(i, "an array [...]");
        if (row.table && row.table != &kEditTable)
            for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c))
                if (!table(c, *row.table)) return false;
        return true;
    case KeyType::Map:
        if (!doc.is(i, JsonType::Object)) return wrong_type(i, "an object {\"name\": {...}}");
        for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c)) {
            if (doc.key(c).empty()) return fail_at_key(c, "an empty name; give it a name");
            if (row.table != &kNodeTable && !table(c, *row.table)) return false;
        }
        return true;
    case KeyType::Pinned: {
        if (doc.is(i, JsonType::String)) {
            static constexpr std::string_view kWords[] = {"top", "corners"};
            return choice(i, kWords, nullptr);
        }
        static constexpr sdf::FieldRow kPair{"pinned", 2, 0, {0, 0, 0}, "1", "integer [0, 4095]", ""};
        if (!doc.is(i, JsonType::Array))
            return wrong_type(i, "\"top\", \"corners\" or a list such as [[0, 0], [31, 0]]");
        for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c))
            if (!doc.is(c, JsonType::Array) ? !wrong_type(c, "two numbers such as [0, 0]")
                                            : !numbers(c, kPair, nullptr))
                return false;
        return true;
    }
    }
    return true;
}

bool ValueReader::table(JsonIndex i, const Table& table, float* floats, uint8_t kinds, std::string_view kind_name) {
    if (!doc.is(i, JsonType::Object)) return wrong_type(i, "an object {...}");
    for (JsonIndex c = doc.first(i); c < doc.next(i); c = doc.next(c)) {
        const KeyRow* row = find_row(table, doc.key(c));
        if (row && !(row->kinds & kinds))
            return fail_at_key(c, formatted("a {} light has no such key; remove it", kind_name));
        if (!row) {
            std::vector<std::string_view> known;
            for (const KeyRow& r : table.rows)
                if (r.kinds & kinds) known.push_back(r.name);
            return unknown_key(c, known);
        }
        if (!value(c, *row, floats)) return false;
    }
    if (&table == &kBoundsTable && required(i, table)) {
        const KeyRow& low_row = table.rows[0];
        float low[3], high[3];
        (void)numbers(*doc.find(i, "min"), low_row.numbers, low);
        (void)numbers(*doc.find(i, "max"), low_row.numbers, high);
        for (int k = 0; k < 3; ++k)
            if (!(low[k] < high[k]))
                return fail(i, formatted("min {} is not below max {}; swap or move them apart", shortest(low[k]),
                                         shortest(high[k])));
    }
    return required(i, table);
}

}  // namespace kiln::scene
