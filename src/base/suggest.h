// SPDX-License-Identifier: MIT
// "Did you mean": the known word nearest to a mistyped one.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace kiln {

/// The known word that was most likely meant (also <kiln/world.h>); empty when none is near.
std::string_view nearest_word(std::string_view word, std::span<const std::string_view> known);

/// `did you mean "radius"?`, or `otherwise` when nothing is near.
std::string suggestion(std::string_view word, std::span<const std::string_view> known, std::string otherwise);
/// Otherwise "known are a, b, c" (a dozen at most).
std::string suggestion(std::string_view word, std::span<const std::string_view> known);

}  // namespace kiln
