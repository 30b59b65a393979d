// SPDX-License-Identifier: MIT
// A JSON document that remembers where in its file everything stood, and in which order.
// Strict RFC 8259 and a little stricter: duplicate keys, invalid UTF-8 and numbers beyond double are refused.
// Values lie in one array in document order (a container's members follow it), so no depth of nesting needs a stack of calls.
// The same class is built up by the scene writer and printed.
#pragma once

#include <kiln/result.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::scene {

/// Index of a value in its document; 0 is the root.
using JsonIndex = uint32_t;

enum class JsonType : uint8_t { Null, False, True, Number, String, Array, Object };
/// "a number", "an object", … for messages.
std::string_view json_type_name(JsonType type);

/// Both start at 1; columns count characters, not bytes.
struct TextPlace {
    uint32_t line = 1, column = 1;
};

class JsonDocument {
public:
    /// Errors read "NAME:LINE:COLUMN: what is wrong; what would be right" (kind Input).
    /// `first_line`: where the text begins in its file.
    static Result<JsonDocument> parse(std::string text, std::string name, uint32_t first_line = 1);

    bool empty() const { return nodes_.empty(); }
    const std::string& name() const { return name_; }
    JsonType type(JsonIndex i) const { return nodes_[i].type; }
    bool is(JsonIndex i, JsonType t) const { return nodes_[i].type == t; }
    double number(JsonIndex i) const { return nodes_[i].number; }
    /// The number read as a float straight from its digits (no double rounding). +-infinity when it does not fit.
    float number_as_float(JsonIndex i) const;
    std::string_view text(JsonIndex i) const;
    /// Key of a member of an object; empty for others.
    std::string_view key(JsonIndex i) const;
    /// How the value stands in the file: "1.50", "\"box\"", "[...]" (shortened).
    std::string source(JsonIndex i) const;

    /// Past the last value inside `i`: also the next sibling.
    JsonIndex next(JsonIndex i) const { return nodes_[i].end; }
    /// First member, or next(i) when there is none.
    JsonIndex first(JsonIndex i) const { return i + 1; }
    uint32_t count(JsonIndex i) const;
    std::optional<JsonIndex> find(JsonIndex object, std::string_view key) const;

    TextPlace place(JsonIndex i) const { return place_at(nodes_[i].begin); }
    /// "edits[3].domain[0].rate"; shortened in the middle when very deep.
    std::string path(JsonIndex i) const;
    /// "NAME:LINE:COLUMN: path: message" at the value, or at its key.
    Error error(JsonIndex i, const std::string& message) const;
    Error error_at_key(JsonIndex i, const std::string& message) const;

    // Building, in document order. `key` is used inside objects only.
    void open(JsonType container, std::string_view key = {});
    void close();
    void add_number(double value, std::string_view key = {});
    void add_float(float value, std::string_view key = {});
    void add_text(std::string_view value, std::string_view key = {});
    void add_bool(bool value, std::string_view key = {});
    void add_null(std::string_view key = {});
    /// A value of another document with all inside it.
    void add_copy(const JsonDocument& from, JsonIndex i, std::string_view key = {});

    /// The document as text: values that fit in 120 columns on one line, two spaces a level, shortest numbers, a final newline.
    std::string print() const;
    /// The same on one line, as short as it goes, without an end.
    std::string line() const;

private:
    friend class JsonParser;
    enum Flag : uint8_t { kTextMade = 1, kKeyMade = 2, kSingle = 4 };  // in made_, not text_; number came from a float
    struct Value {
        uint32_t begin = 0;      // byte offset in text_
        uint32_t end = 0;        // index past the subtree
        uint32_t key_begin = 0;  // byte offset in text_
        uint32_t key_offset = 0, key_length = 0;
        JsonType type = JsonType::Null;
        uint8_t flags = 0;
        union {
            double number = 0;
            struct {
                uint32_t offset, length;
            } string;
        };
    };

    TextPlace place_at(uint32_t offset) const;
    Error error_at(uint32_t offset, JsonIndex i, const std::string& message) const;
    Value& append(JsonType type, std::string_view key);
    void print_scalar(JsonIndex i, std::string& out) const;

    std::string name_, text_, made_;
    uint32_t first_line_ = 1;
    std::vector<Value> nodes_;
    std::vector<JsonIndex> open_;  // while building
};

/// Whether a document may hold it.
bool is_utf8(std::string_view text);
/// `text` as a JSON string with its quotes.
std::string json_quoted(std::string_view text);
/// Shortest digits that read back as the same float, also where JSON has no word for the value ("nan", "inf").
std::string shortest(float value);
std::string shortest(double value);

}  // namespace kiln::scene
