// SPDX-License-Identifier: MIT

#include "base/suggest.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace kiln {

namespace {

// Fewest insertions, deletions, changes and swaps of neighbours between two words
// (Damerau, "A technique for computer detection and correction of spelling errors", 1964; optimal string alignment).
int edit_distance(std::string_view a, std::string_view b) {
    a = a.substr(0, 64);
    b = b.substr(0, 64);
    std::vector<int> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); ++j) last[j] = int(j);
    for (size_t i = 1; i <= a.size(); ++i) {
        row[0] = int(i);
        for (size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        std::swap(before, last);
        std::swap(last, row);
    }
    return last[b.size()];
}

}  // namespace

std::string_view nearest_word(std::string_view word, std::span<const std::string_view> known) {
    std::string_view best;
    int best_distance = std::max(1, int(word.size()) / 3) + 1;
    for (const std::string_view candidate : known) {
        // A word that begins with what was typed counts as one slip away.
        const bool begins = word.size() >= 3 && candidate.starts_with(word);
        const int d = begins ? 1 : edit_distance(word, candidate);
        if (d < best_distance && d < int(candidate.size())) {
            best = candidate;
            best_distance = d;
        }
    }
    return best;
}

std::string suggestion(std::string_view word, std::span<const std::string_view> known, std::string otherwise) {
    const std::string_view near = nearest_word(word, known);
    return near.empty() ? otherwise : "did you mean \"" + std::string(near) + "\"?";
}

std::string suggestion(std::string_view word, std::span<const std::string_view> known) {
    if (known.empty()) return "there are none here";
    std::string all = "known are ";
    for (size_t i = 0; i < known.size() && i < 12; ++i) all += (i ? ", " : "") + std::string(known[i]);
    return suggestion(word, known, known.size() > 12 ? all + ", ..." : all);
}

}  // namespace kiln
