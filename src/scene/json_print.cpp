// SPDX-License-Identifier: MIT
// The writing half of JsonDocument: building values in order, and printing them.

#include "scene/json_source.h"

#include <algorithm>
#include <charconv>

namespace kiln::scene {

namespace {
constexpr uint32_t kColumns = 120;  // a value that fits is printed on one line
constexpr uint32_t kDeepestIndent =
    24;  // levels; deeper ones are not indented further, or a deep chain would fill the disk

template <typename T>
void append_number(std::string& out, T value) {
    if (value == 0) value = 0;  // "-0" reads as a slip
    char buffer[40];
    const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
    out.append(buffer, result.ptr);
}
}  // namespace

std::string shortest(float value) {
    std::string out;
    append_number(out, value);
    return out;
}

std::string shortest(double value) {
    std::string out;
    append_number(out, value);
    return out;
}

std::string json_quoted(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        switch (c) {
        case '"':
            out += "\\\"";
            break;
        case '\\':
            out += "\\\\";
            break;
        case '\n':
            out += "\\n";
            break;
        case '\r':
            out += "\\r";
            break;
        case '\t':
            out += "\\t";
            break;
        default:
            if (uint8_t(c) < 0x20) {
                constexpr char digits[] = "0123456789abcdef";
                out += "\\u00";
                out += digits[uint8_t(c) >> 4];
                out += digits[uint8_t(c) & 15];
            } else {
                out += c;
            }
        }
    }
    return out + '"';
}

JsonDocument::Value& JsonDocument::append(JsonType type, std::string_view key) {
    Value v;
    v.type = type;
    v.begin = UINT32_MAX;
    v.end = JsonIndex(nodes_.size()) + 1;
    v.key_offset = uint32_t(made_.size());
    v.key_length = uint32_t(key.size());
    v.flags = kKeyMade;
    made_ += key;
    return nodes_.emplace_back(v);
}

void JsonDocument::open(JsonType container, std::string_view key) {
    append(container, key);
    open_.push_back(JsonIndex(nodes_.size() - 1));
}

void JsonDocument::close() {
    nodes_[open_.back()].end = JsonIndex(nodes_.size());
    open_.pop_back();
}

void JsonDocument::add_number(double value, std::string_view key) { append(JsonType::Number, key).number = value; }

void JsonDocument::add_float(float value, std::string_view key) {
    Value& v = append(JsonType::Number, key);
    v.number = double(value);
    v.flags |= kSingle;
}

void JsonDocument::add_text(std::string_view value, std::string_view key) {
    append(JsonType::String, key);
    Value& v = nodes_.back();
    v.string.offset = uint32_t(made_.size());
    v.string.length = uint32_t(value.size());
    v.flags |= kTextMade;
    made_ += value;
}

void JsonDocument::add_bool(bool value, std::string_view key) { append(value ? JsonType::True : JsonType::False, key); }

void JsonDocument::add_null(std::string_view key) { append(JsonType::Null, key); }

void JsonDocument::add_copy(const JsonDocument& from, JsonIndex i, std::string_view key) {
    const JsonIndex base = JsonIndex(nodes_.size());
    for (JsonIndex j = i; j < from.next(i); ++j) {
        Value& v = append(from.type(j), j == i ? key : from.key(j));
        v.end = from.next(j) - i + base;
        if (v.type == JsonType::Number) {
            v.number = from.number(j);
            v.flags |= uint8_t(from.nodes_[j].flags & kSingle);
        } else if (v.type == JsonType::String) {
            const std::string_view text = from.text(j);
            v.string.offset = uint32_t(made_.size());
            v.string.length = uint32_t(text.size());
            v.flags |= kTextMade;
            made_ += text;
        }
    }
}

void JsonDocument::print_scalar(JsonIndex i, std::string& out) const {
    switch (type(i)) {
    case JsonType::Null:
        out += "null";
        break;
    case JsonType::False:
        out += "false";
        break;
    case JsonType::True:
        out += "true";
        break;
    case JsonType::Number:
        if (nodes_[i].flags & kSingle) {
            append_number(out, float(nodes_[i].number));
        } else {
            append_number(out, nodes_[i].number);
        }
        break;
    case JsonType::String:
        out += json_quoted(text(i));
        break;
    case JsonType::Array:
        out += first(i) == next(i) ? "[]" : "[";
        break;
    case JsonType::Object:
        out += first(i) == next(i) ? "{}" : "{";
        break;
    }
}

std::string JsonDocument::source(JsonIndex i) const {
    if (type(i) == JsonType::Array) return "[...]";
    if (type(i) == JsonType::Object) return "{...}";
    std::string out;
    print_scalar(i, out);
    if (out.size() > 60) out = out.substr(0, 56) + "...\"";
    return out;
}

std::string JsonDocument::line() const {
    std::string out;
    std::vector<JsonIndex> open;
    const auto close = [&](JsonIndex before) {
        for (; !open.empty() && next(open.back()) == before; open.pop_back())
            out += type(open.back()) == JsonType::Object ? '}' : ']';
    };
    for (JsonIndex i = 0; i < nodes_.size(); ++i) {
        close(i);
        if (!open.empty() && first(open.back()) != i) out += ',';
        if (!open.empty() && type(open.back()) == JsonType::Object) out += json_quoted(key(i)) + ":";
        print_scalar(i, out);
        if (type(i) >= JsonType::Array && first(i) != next(i)) open.push_back(i);
    }
    close(JsonIndex(nodes_.size()));
    return out;
}

std::string JsonDocument::print() const {
    if (nodes_.empty()) return {};
    // Width of each value on one line, its key included; members come after their container, so backwards.
    std::vector<uint32_t> width(nodes_.size());
    std::string scratch;
    for (JsonIndex i = JsonIndex(nodes_.size()); i-- > 0;) {
        scratch.clear();
        print_scalar(i, scratch);
        uint32_t w = uint32_t(scratch.size());
        if (type(i) >= JsonType::Array && first(i) != next(i)) {
            w += type(i) == JsonType::Object ? 3 : 1;  // closing bracket; objects have spaces inside their braces
            uint32_t members = 0;
            for (JsonIndex c = first(i); c < next(i) && w <= kColumns; c = next(c), ++members)
                w += width[c] + (members ? 2 : 0);
        }
        if (nodes_[i].key_length) w += uint32_t(json_quoted(key(i)).size()) + 2;
        width[i] = std::min(w, kColumns + 1);
    }

    struct Open {
        JsonIndex node, at;
        bool inline_;
    };
    std::vector<Open> stack;
    std::string out;
    const auto begin = [&](JsonIndex i) {
        const bool in_object = !stack.empty() && type(stack.back().node) == JsonType::Object;
        if (in_object) out += json_quoted(key(i)) + ": ";
        print_scalar(i, out);
        if (type(i) < JsonType::Array || first(i) == next(i)) return;
        const uint32_t indent = 2 * std::min(uint32_t(stack.size()), kDeepestIndent);
        const bool inside = !stack.empty() && stack.back().inline_;
        const bool fits = inside || (!stack.empty() && width[i] + indent + 1 <= kColumns);  // the root is always spread
        stack.push_back({i, first(i), fits});
    };
    begin(0);
    while (!stack.empty()) {
        const Open top = stack.back();
        const bool object = type(top.node) == JsonType::Object;
        if (top.at < next(top.node)) {
            if (top.at != first(top.node)) out += top.inline_ ? ", " : ",";
            if (top.inline_) {
                if (object && top.at == first(top.node)) out += ' ';
            } else {
                out += '\n';
                out.append(2 * std::min(uint32_t(stack.size()), kDeepestIndent), ' ');
            }
            stack.back().at = next(top.at);
            begin(top.at);
            continue;
        }
        stack.pop_back();
        if (!top.inline_) {
            out += '\n';
            out.append(2 * std::min(uint32_t(stack.size()), kDeepestIndent), ' ');
        } else if (object) {
            out += ' ';
        }
        out += object ? '}' : ']';
    }
    return out + '\n';
}

}  // namespace kiln::scene
