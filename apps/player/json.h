// SPDX-License-Identifier: MIT
// Writes one JSON object, key by key, as `--json` and the like print it.
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

namespace kiln::player {

class Json {
public:
    Json& text(std::string_view key, std::string_view value) { return raw(key, quoted(value)); }
    Json& number(std::string_view key, double value) { return raw(key, digits(value)); }
    Json& flag(std::string_view key, bool value) { return raw(key, value ? "true" : "false"); }
    /// `value` is JSON already: an object, an array, null.
    Json& raw(std::string_view key, std::string_view value) {
        body_ += (body_.empty() ? "" : ", ") + quoted(key) + ": ";
        body_ += value;
        return *this;
    }
    std::string object() const { return "{" + body_ + "}"; }
    std::string line() const { return object() + "\n"; }

    /// Infinities and NaN, for which JSON has no word, are null.
    static std::string digits(double value) {
        if (!std::isfinite(value)) return "null";
        char buffer[40];
        return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
    }
    static std::string quoted(std::string_view text) {
        std::string out = "\"";
        for (const char c : text) {
            constexpr char hex[] = "0123456789abcdef";
            if (c == '"' || c == '\\') {
                out += '\\';
                out += c;
            } else if (static_cast<unsigned char>(c) < 0x20) {
                out += "\\u00";
                out += hex[static_cast<unsigned char>(c) >> 4];
                out += hex[static_cast<unsigned char>(c) & 15];
            } else {
                out += c;
            }
        }
        return out + "\"";
    }

private:
    std::string body_;
};

}  // namespace kiln::player
