// SPDX-License-Identifier: MIT
// How often a test of chance tries. Under a sanitizer each try is ten to thirty times as dear, and looks for faults that are in most tries or in
// none: a quarter of them are made there. What is proved of values is proved by the release build, which makes all.
#pragma once

#include <algorithm>

namespace kiln {

constexpr int rounds(int all) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return std::max(all / 4, 1);
#else
    return all;
#endif
}

}  // namespace kiln
