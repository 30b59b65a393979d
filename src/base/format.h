// SPDX-License-Identifier: MIT
// Text from a pattern and values, in the syntax of std::format: formatted("brick {} of {:.2f} m", i, size).
// The library that does the work is named in the .cpp only, so that this header costs nothing to include.
#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

namespace kiln {

/// One value for a `{}`. Strings are only looked at: they must live until the call returns.
class FormatArg {
public:
    using Value = std::variant<bool, char, int64_t, uint64_t, float, double, std::string_view, const void*>;

    FormatArg(bool v) : value_(v) {}
    FormatArg(char v) : value_(v) {}
    FormatArg(float v) : value_(v) {}
    FormatArg(double v) : value_(v) {}
    FormatArg(std::string_view v) : value_(v) {}
    FormatArg(const std::string& v) : value_(std::string_view(v)) {}
    FormatArg(const char* v) : value_(std::string_view(v ? v : "(null)")) {}
    FormatArg(const void* v) : value_(v) {}
    template <typename T>
    requires(std::signed_integral<T> && !std::same_as<T, char>) FormatArg(T v) : value_(int64_t(v)) {}
    template <typename T>
    requires(std::unsigned_integral<T> && !std::same_as<T, bool> && !std::same_as<T, char>) FormatArg(T v)
        : value_(uint64_t(v)) {}
    template <typename T>
    requires std::is_enum_v<T> FormatArg(T v) : FormatArg(std::underlying_type_t<T>(v)) {}

    const Value& value() const { return value_; }

private:
    Value value_;
};

/// Any thread. A pattern that does not fit its values comes back as itself, with the fault beside it; it never throws.
std::string format_args(std::string_view pattern, std::initializer_list<FormatArg> args);

template <typename... Args>
std::string formatted(std::string_view pattern, const Args&... args) {
    return format_args(pattern, {FormatArg(args)...});
}

/// What a library says, as part of a message of ours: control characters become spaces, and none are left at the end.
std::string one_line(std::string_view text);

}  // namespace kiln
