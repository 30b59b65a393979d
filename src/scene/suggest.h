// SPDX-License-Identifier: MIT
// "Did you mean": the known word nearest to a mistyped one.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::scene {

/// Fewest insertions, deletions, changes and swaps of neighbours between two words
/// (Damerau, "A technique for computer detection and correction of spelling errors", 1964; optimal string alignment).
int edit_distance(std::string_view a, std::string_view b);

/// "did you mean \"radius\"?", or "known are a, b, c" when nothing is near (a dozen at most).
std::string suggestion(std::string_view word, std::span<const std::string_view> known);

}  // namespace kiln::scene
