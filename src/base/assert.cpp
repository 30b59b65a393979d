// SPDX-License-Identifier: MIT
#include "base/assert.h"

#include <cstdio>
#include <cstdlib>

namespace kiln {

void assert_failed(const char* condition, const char* file, int line, const char* function,
                   const std::string& message) {
    std::fflush(stdout);
    std::fprintf(stderr, "%s:%d: %s: `%s` is false%s%s\n", file, line, function, condition, message.empty() ? "" : ": ",
                 message.c_str());
    std::fflush(stderr);
    std::abort();
}

}  // namespace kiln
