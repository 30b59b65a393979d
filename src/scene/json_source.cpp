// SPDX-License-Identifier: MIT
// The reading half of JsonDocument: lookup and a parser that keeps its own stack. Printing is in json_print.cpp.

#include "scene/json_source.h"

#include "base/format.h"

#include <charconv>
#include <limits>
#include <unordered_set>

namespace kiln::scene {

std::string_view json_type_name(JsonType type) {
    switch (type) {
    case JsonType::Null:
        return "null";
    case JsonType::False:
    case JsonType::True:
        return "true or false";
    case JsonType::Number:
        return "a number";
    case JsonType::String:
        return "a string";
    case JsonType::Array:
        return "an array";
    case JsonType::Object:
        return "an object";
    }
    return "";
}

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Length of the valid UTF-8 sequence at `at`, 0 when there is none (Unicode 15, table 3-7).
size_t utf8_length(std::string_view s, size_t at) {
    const auto byte = [&](size_t i) { return i < s.size() ? uint8_t(s[i]) : uint8_t(0); };
    const uint8_t a = byte(at);
    const auto tail = [&](size_t i, uint8_t low = 0x80, uint8_t high = 0xBF) {
        return byte(i) >= low && byte(i) <= high;
    };
    if (a < 0x80) return 1;
    if (a >= 0xC2 && a <= 0xDF) return tail(at + 1) ? 2 : 0;
    if (a >= 0xE0 && a <= 0xEF) {
        const bool second = a == 0xE0 ? tail(at + 1, 0xA0) : a == 0xED ? tail(at + 1, 0x80, 0x9F) : tail(at + 1);
        return second && tail(at + 2) ? 3 : 0;
    }
    if (a >= 0xF0 && a <= 0xF4) {
        const bool second = a == 0xF0 ? tail(at + 1, 0x90) : a == 0xF4 ? tail(at + 1, 0x80, 0x8F) : tail(at + 1);
        return second && tail(at + 2) && tail(at + 3) ? 4 : 0;
    }
    return 0;
}

void append_utf8(std::string& out, uint32_t code) {
    if (code < 0x80) {
        out += char(code);
    } else if (code < 0x800) {
        out += char(0xC0 | code >> 6);
        out += char(0x80 | (code & 63));
    } else if (code < 0x10000) {
        out += char(0xE0 | code >> 12);
        out += char(0x80 | (code >> 6 & 63));
        out += char(0x80 | (code & 63));
    } else {
        out += char(0xF0 | code >> 18);
        out += char(0x80 | (code >> 12 & 63));
        out += char(0x80 | (code >> 6 & 63));
        out += char(0x80 | (code & 63));
    }
}

}  // namespace

/// One pass over the text. Containers that are open are kept in `open_`.
class JsonParser {
public:
    JsonParser(std::string text, std::string name, uint32_t first_line) {
        doc_.text_ = std::move(text);
        doc_.name_ = std::move(name);
        doc_.first_line_ = first_line;
    }

    Result<JsonDocument> run() {
        const std::string& s = doc_.text_;
        if (s.size() >= (size_t(1) << 31))
            return Error{doc_.name_ + ": larger than 2 GiB; split the scene", ErrorKind::Input};
        if (s.compare(0, 3, "\xEF\xBB\xBF") == 0) at_ = 3;
        if (!document()) return std::move(*error_);
        return std::move(doc_);
    }

private:
    struct Open {
        JsonIndex node;
        bool object;
    };

    bool fail(size_t offset, const std::string& message) {
        error_ = doc_.error_at(uint32_t(offset), JsonIndex(doc_.nodes_.size()), message);
        return false;
    }
    char peek() const { return at_ < doc_.text_.size() ? doc_.text_[at_] : '\0'; }
    bool at_end() const { return at_ >= doc_.text_.size(); }
    void space() {
        while (!at_end() && (peek() == ' ' || peek() == '\n' || peek() == '\t' || peek() == '\r')) ++at_;
    }
    std::string seen() const {
        if (at_end()) return "the file ends here";
        const std::string_view rest = std::string_view(doc_.text_).substr(at_);
        const size_t n = utf8_length(rest, 0);
        if (n == 0 || uint8_t(rest[0]) < 0x20 || rest[0] == 0x7f) return "unreadable character";
        return "found '" + std::string(rest.substr(0, n)) + "'";
    }

    bool document() {
        space();
        if (at_end()) return fail(at_, "the file is empty; a scene is a JSON object, at least {\"format\": 1}");
        if (!value()) return false;
        while (!open_.empty()) {
            if (!member()) return false;
        }
        space();
        if (!at_end()) return fail(at_, seen() + " after the end of the document; remove it");
        return true;
    }

    // Next member of the innermost open container, or its end.
    bool member() {
        const Open top = open_.back();
        JsonDocument::Value& container = doc_.nodes_[top.node];
        const char closing = top.object ? '}' : ']';
        const bool is_first = doc_.nodes_.size() == size_t(top.node) + 1;
        space();
        if (peek() == closing && !at_end()) {
            ++at_;
            container.end = JsonIndex(doc_.nodes_.size());
            open_.pop_back();
            return !top.object || unique_keys(top.node);
        }
        if (!is_first) {
            if (peek() != ',') return fail(at_, seen() + "; expected ',' or '" + closing + "'" + comment_hint());
            const size_t comma = at_++;
            space();
            if (peek() == closing)
                return fail(comma, std::string("a comma before '") + closing + "'; remove the comma");
        }
        key_length_ = 0;
        key_made_ = false;
        if (top.object) {
            if (peek() != '"') return fail(at_, seen() + "; expected a key in double quotes" + comment_hint());
            const size_t begin = at_;
            uint32_t offset = 0, length = 0;
            bool made = false;
            if (!string(offset, length, made)) return false;
            key_begin_ = uint32_t(begin);
            key_offset_ = offset;
            key_length_ = length;
            key_made_ = made;
            space();
            if (peek() != ':') return fail(at_, seen() + "; expected ':' after the key");
            ++at_;
            space();
        }
        return value();
    }

    bool unique_keys(JsonIndex object) {
        const JsonDocument& d = doc_;
        const uint32_t count = d.count(object);
        const auto complain = [&](JsonIndex i) {
            error_ = d.error_at_key(i, "this key is here twice; keep one");
            return false;
        };
        if (count <= 24) {
            for (JsonIndex i = d.first(object); i < d.next(object); i = d.next(i))
                for (JsonIndex j = d.first(object); j < i; j = d.next(j))
                    if (d.key(i) == d.key(j)) return complain(i);
            return true;
        }
        std::unordered_set<std::string_view> keys;
        keys.reserve(count);
        for (JsonIndex i = d.first(object); i < d.next(object); i = d.next(i))
            if (!keys.insert(d.key(i)).second) return complain(i);
        return true;
    }

    std::string comment_hint() const { return peek() == '/' ? " (JSON has no comments)" : ""; }

    JsonDocument::Value& push(JsonType type, size_t begin) {
        JsonDocument::Value v;
        v.begin = uint32_t(begin);
        v.type = type;
        v.end = JsonIndex(doc_.nodes_.size()) + 1;
        if (!open_.empty() && open_.back().object) {
            v.key_begin = key_begin_;
            v.key_offset = key_offset_;
            v.key_length = key_length_;
            if (key_made_) v.flags |= JsonDocument::kKeyMade;
        }
        return doc_.nodes_.emplace_back(v);
    }

    bool word(std::string_view w, JsonType type) {
        if (std::string_view(doc_.text_).substr(at_, w.size()) != w) return wrong_value();
        push(type, at_);
        at_ += w.size();
        return true;
    }

    bool wrong_value() {
        const std::string_view rest = std::string_view(doc_.text_).substr(at_);
        for (const std::string_view w : {"NaN", "nan", "Infinity", "-Infinity", "inf", "-inf"})
            if (rest.substr(0, w.size()) == w)
                return fail(at_, std::string(w) + " is not a JSON number; write a finite number");
        if (peek() == '\'') return fail(at_, "a single quote; JSON strings stand in double quotes");
        return fail(at_, seen() + "; expected a value" + comment_hint());
    }

    bool value() {
        const size_t begin = at_;
        switch (peek()) {
        case '{':
        case '[':
            push(peek() == '{' ? JsonType::Object : JsonType::Array, begin).end = UINT32_MAX;  // until it is closed
            open_.push_back({JsonIndex(doc_.nodes_.size() - 1), peek() == '{'});
            ++at_;
            return true;
        case '"': {
            uint32_t offset = 0, length = 0;
            bool made = false;
            if (!string(offset, length, made)) return false;
            JsonDocument::Value& v = push(JsonType::String, begin);
            v.string.offset = offset;
            v.string.length = length;
            if (made) v.flags |= JsonDocument::kTextMade;
            return true;
        }
        case 't':
            return word("true", JsonType::True);
        case 'f':
            return word("false", JsonType::False);
        case 'n':
            return word("null", JsonType::Null);
        default:
            return is_digit(peek()) || peek() == '-' ? number() : wrong_value();
        }
    }

    bool number() {
        const size_t begin = at_;
        const std::string& s = doc_.text_;
        if (peek() == '-') ++at_;
        if (!is_digit(peek())) {
            at_ = begin;
            return wrong_value();
        }
        // Decimal exponent of the leading non-zero digit, to tell overflow from underflow.
        int64_t magnitude = 0;
        bool any = false;
        if (peek() == '0') {
            ++at_;
            if (is_digit(peek())) return fail(begin, "a number with a leading 0; remove the 0");
        } else {
            for (; is_digit(peek()); ++at_) ++magnitude;
            any = true;
        }
        if (peek() == '.') {
            ++at_;
            if (!is_digit(peek())) return fail(begin, "a number that ends in '.'; add a digit or remove the point");
            for (; is_digit(peek()); ++at_) {
                any = any || peek() != '0';
                if (!any) --magnitude;
            }
        }
        if (peek() == 'e' || peek() == 'E') {
            ++at_;
            const bool negative = peek() == '-';
            if (peek() == '+' || peek() == '-') ++at_;
            if (!is_digit(peek())) return fail(begin, "a number without digits after 'e'; add them");
            int64_t exponent = 0;
            for (; is_digit(peek()); ++at_) exponent = std::min<int64_t>(exponent * 10 + (peek() - '0'), 1000000000000);
            magnitude += negative ? -exponent : exponent;
        }
        double result = 0;
        const auto [end, code] = std::from_chars(s.data() + begin, s.data() + at_, result);
        if (code == std::errc::result_out_of_range) {
            if (magnitude > 0) return fail(begin, "the number is too large; at most 1.7e308");
            result = 0;
        }
        push(JsonType::Number, begin).number = result;
        return true;
    }

    // At the opening quote. Strings without escapes stay in the text.
    bool string(uint32_t& offset, uint32_t& length, bool& made) {
        const size_t quote = at_++;
        const std::string& s = doc_.text_;
        const size_t begin = at_;
        std::string decoded;
        made = false;
        while (true) {
            if (at_end()) return fail(quote, "a string without its closing quote; add it");
            const char c = s[at_];
            if (c == '"') break;
            if (c == '\n') return fail(quote, "a string without its closing quote on this line; add it");
            if (uint8_t(c) < 0x20) return fail(at_, "a control character in a string; write it as \\u00XX");
            if (c == '\\') {
                if (!made) decoded.assign(s, begin, at_ - begin);
                made = true;
                if (!escape(decoded)) return false;
                continue;
            }
            const size_t n = utf8_length(s, at_);
            if (n == 0) return fail(at_, "bytes that are not UTF-8; save the file as UTF-8");
            if (made) decoded.append(s, at_, n);
            at_ += n;
        }
        offset = uint32_t(begin);
        length = uint32_t(at_ - begin);
        if (made) {
            offset = uint32_t(doc_.made_.size());
            length = uint32_t(decoded.size());
            doc_.made_ += decoded;
        }
        ++at_;
        return true;
    }

    bool hex4(uint32_t& code) {
        code = 0;
        for (int i = 0; i < 4; ++i, ++at_) {
            const char c = peek();
            const int digit = is_digit(c)            ? c - '0'
                              : c >= 'a' && c <= 'f' ? c - 'a' + 10
                              : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                     : -1;
            if (digit < 0) return false;
            code = code * 16 + uint32_t(digit);
        }
        return true;
    }

    bool escape(std::string& out) {
        const size_t begin = at_++;
        const char c = peek();
        constexpr std::string_view from = "\"\\/bfnrt", to = "\"\\/\b\f\n\r\t";
        if (const size_t i = from.find(c); i != std::string_view::npos && c != '\0') {
            out += to[i];
            ++at_;
            return true;
        }
        if (c != 'u') return fail(begin, "an unknown escape; JSON has \\\" \\\\ \\/ \\b \\f \\n \\r \\t and \\uXXXX");
        ++at_;
        uint32_t code = 0;
        if (!hex4(code)) return fail(begin, "\\u without four hexadecimal digits; add them");
        if (code >= 0xD800 && code < 0xDC00) {
            uint32_t low = 0;
            const bool pair = peek() == '\\' && at_ + 1 < doc_.text_.size() && doc_.text_[at_ + 1] == 'u';
            if (pair) at_ += 2;
            if (!pair || !hex4(low) || low < 0xDC00 || low > 0xDFFF)
                return fail(begin, "half of a surrogate pair; add the other half");
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        } else if (code >= 0xDC00 && code <= 0xDFFF) {
            return fail(begin, "half of a surrogate pair; add the other half");
        }
        append_utf8(out, code);
        return true;
    }

    JsonDocument doc_;
    size_t at_ = 0;
    std::vector<Open> open_;
    uint32_t key_begin_ = 0, key_offset_ = 0, key_length_ = 0;
    bool key_made_ = false;
    std::optional<Error> error_;
};

Result<JsonDocument> JsonDocument::parse(std::string text, std::string name, uint32_t first_line) {
    return JsonParser(std::move(text), std::move(name), first_line).run();
}

bool is_utf8(std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const size_t n = utf8_length(text, at);
        if (n == 0) return false;
        at += n;
    }
    return true;
}

float JsonDocument::number_as_float(JsonIndex i) const {
    const Value& v = nodes_[i];
    if (v.flags & kSingle || v.begin >= text_.size()) return float(v.number);
    float out = 0;
    const auto result = std::from_chars(text_.data() + v.begin, text_.data() + text_.size(), out);
    if (result.ec != std::errc::result_out_of_range) return out;
    return v.number > 1    ? std::numeric_limits<float>::infinity()
           : v.number < -1 ? -std::numeric_limits<float>::infinity()
                           : 0.0f;
}

std::string_view JsonDocument::text(JsonIndex i) const {
    const Value& v = nodes_[i];
    if (v.type != JsonType::String) return {};
    return std::string_view(v.flags & kTextMade ? made_ : text_).substr(v.string.offset, v.string.length);
}

std::string_view JsonDocument::key(JsonIndex i) const {
    const Value& v = nodes_[i];
    return std::string_view(v.flags & kKeyMade ? made_ : text_).substr(v.key_offset, v.key_length);
}

uint32_t JsonDocument::count(JsonIndex i) const {
    uint32_t n = 0;
    for (JsonIndex c = first(i); c < next(i); c = next(c)) ++n;
    return n;
}

std::optional<JsonIndex> JsonDocument::find(JsonIndex object, std::string_view wanted) const {
    if (!is(object, JsonType::Object)) return std::nullopt;
    for (JsonIndex c = first(object); c < next(object); c = next(c))
        if (key(c) == wanted) return c;
    return std::nullopt;
}

TextPlace JsonDocument::place_at(uint32_t offset) const {
    TextPlace place{first_line_, 1};
    for (uint32_t i = text_.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0; i < offset && i < text_.size(); ++i) {
        if (text_[i] == '\n') {
            ++place.line;
            place.column = 1;
        } else if ((uint8_t(text_[i]) & 0xC0) != 0x80) {
            ++place.column;
        }
    }
    return place;
}

std::string JsonDocument::path(JsonIndex target) const {
    if (nodes_.empty()) return {};
    std::vector<std::string> parts;
    JsonIndex at = 0;
    while (at != target) {
        JsonIndex child = first(at);
        uint32_t number = 0;
        while (child < nodes_.size() && nodes_[child].end <= target) {
            child = nodes_[child].end;
            ++number;
        }
        if (child >= nodes_.size()) break;
        if (nodes_[at].type == JsonType::Object) {
            parts.push_back((parts.empty() ? "" : ".") + std::string(key(child)));
        } else {
            parts.push_back("[" + std::to_string(number) + "]");
        }
        at = child;
    }
    std::string out;
    for (size_t i = 0; i < parts.size(); ++i) {
        if (i == 8 && parts.size() > 16) {
            out += "...";
            i = parts.size() - 8;
        }
        out += parts[i].size() > 80 ? parts[i].substr(0, 77) + "..." : parts[i];
    }
    return out;
}

Error JsonDocument::error_at(uint32_t offset, JsonIndex i, const std::string& message) const {
    const TextPlace p = place_at(offset);
    std::string told;
    if (i < nodes_.size()) {
        if (const std::string where = path(i); !where.empty()) told = where + ": ";
    }
    told += message;
    std::string out = name_ + ":" + std::to_string(p.line) + ":" + std::to_string(p.column) + ": ";
    for (const char c : told) {  // keys and values may hold ends of lines; an error is one line
        if (uint8_t(c) < 0x20 || c == 0x7f) {
            out += formatted("\\u{:04x}", unsigned(uint8_t(c)));
        } else {
            out += c;
        }
    }
    return {out, ErrorKind::Input};
}

Error JsonDocument::error(JsonIndex i, const std::string& message) const {
    return error_at(nodes_[i].begin, i, message);
}
Error JsonDocument::error_at_key(JsonIndex i, const std::string& message) const {
    return error_at(nodes_[i].key_begin, i, message);
}

}  // namespace kiln::scene
