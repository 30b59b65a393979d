// SPDX-License-Identifier: MIT
// Result<T>: a value, or an Error that says what was attempted and on what.
// For faults of the outside world (files, devices, users). Our own bugs stop at KILN_ASSERT instead.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace kiln {

/// What kind of outside fault an error is. The command line maps each to its exit code.
enum class ErrorKind : uint8_t {
    Failed,       ///< the operation was tried and did not work (also an unwritable output)
    Usage,        ///< the caller asked for something that cannot be asked
    Input,        ///< a file or scene is missing, unreadable or wrong
    NoDevice,     ///< no usable graphics device
    OutOfMemory,  ///< host or device memory ran out, or the device was lost
};

/// One sentence for a person: place, what is wrong, what would be right.
struct Error {
    std::string message;
    ErrorKind kind = ErrorKind::Failed;
};

/// Either a T or an Error. `if (!r) return r.error();` passes an error on.
template <typename T>
class [[nodiscard]] Result {
public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    explicit operator bool() const { return state_.index() == 0; }
    /// The value. Only when `*this` is true.
    T& value() & { return std::get<0>(state_); }
    const T& value() const& { return std::get<0>(state_); }
    T&& value() && { return std::get<0>(std::move(state_)); }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T&& operator*() && { return std::move(*this).value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    /// The error. Only when `*this` is false.
    const Error& error() const { return std::get<1>(state_); }

private:
    std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
public:
    Result() = default;
    Result(Error error) : error_(std::move(error)) {}
    explicit operator bool() const { return !error_; }
    const Error& error() const { return *error_; }

private:
    std::optional<Error> error_;
};

}  // namespace kiln
