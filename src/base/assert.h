// SPDX-License-Identifier: MIT
// KILN_ASSERT: our own bugs stop here, with the values. Always on; faults of files, devices and users are Result instead.
#pragma once

#include "base/format.h"

namespace kiln {

/// Prints "file:line: function: `condition` is false: message" to stderr and aborts.
[[noreturn, gnu::cold]] void assert_failed(const char* condition, const char* file, int line, const char* function,
                                           const std::string& message);

}  // namespace kiln

// KILN_ASSERT(brick < capacity, "brick {} of {}", brick, capacity); the message may be left out.
#define KILN_ASSERT(condition, ...)                                                                             \
    do {                                                                                                        \
        if (!(condition)) [[unlikely]] {                                                                        \
            ::kiln::assert_failed(#condition, __FILE__, __LINE__, __func__, ::kiln::formatted("" __VA_ARGS__)); \
        }                                                                                                       \
    } while (false)
