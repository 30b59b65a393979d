// SPDX-License-Identifier: MIT
// How often a test of chance tries, and how much of a long proof is gone through. Under a sanitizer each try is ten to thirty times as dear, and
// looks for faults that are in most tries or in none: a quarter of them are made there, or what kSanitized chooses. What is proved of values is
// proved by the release build, which makes all.
#pragma once

#include <algorithm>

namespace kiln {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

constexpr int rounds(int all) { return kSanitized ? std::max(all / 4, 1) : all; }

}  // namespace kiln
