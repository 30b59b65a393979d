// SPDX-License-Identifier: MIT
// Words and numbers of text formats, line by line, without copies.
#pragma once

#include <charconv>
#include <string_view>

namespace kiln::model {

inline bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }

/// The next word of `rest`, which is cut behind it; empty at the end.
inline std::string_view next_word(std::string_view& rest) {
    size_t from = 0;
    while (from < rest.size() && is_space(rest[from])) ++from;
    size_t to = from;
    while (to < rest.size() && !is_space(rest[to])) ++to;
    const std::string_view word = rest.substr(from, to - from);
    rest.remove_prefix(to);
    return word;
}

/// The next line of `rest`, without its end; false when there is none.
inline bool next_line(std::string_view& rest, std::string_view& line) {
    if (rest.empty()) return false;
    const size_t end = rest.find('\n');
    line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return true;
}

/// The whole word as a number. "nan" and "inf" are numbers here: checked() refuses them where they matter.
template <typename T>
bool number_of(std::string_view word, T& out) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
    return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

}  // namespace kiln::model
