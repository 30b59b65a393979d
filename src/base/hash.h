// SPDX-License-Identifier: MIT
// Content hashes (XXH3). The same bytes give the same hash on every machine and in every version of Kiln that keeps a file format.
// Not for secrets: anyone can make two inputs of equal hash.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace kiln {

struct Hash128 {
    uint64_t low = 0, high = 0;
    friend auto operator<=>(const Hash128&, const Hash128&) = default;
};

uint64_t hash64(std::span<const std::byte> bytes, uint64_t seed = 0);
Hash128 hash128(std::span<const std::byte> bytes, uint64_t seed = 0);

inline uint64_t hash64(std::string_view text, uint64_t seed = 0) {
    return hash64(std::as_bytes(std::span(text.data(), text.size())), seed);
}

/// The bytes of a plain array. T must have no padding and no floats whose equal values differ in bytes where that matters (−0, NaN).
template <typename T>
requires std::is_trivially_copyable_v<T> uint64_t hash64_of(std::span<const T> values, uint64_t seed = 0) {
    return hash64(std::as_bytes(values), seed);
}

/// Order matters: hash_combine(hash_combine(s, a), b) differs from (s, b), a.
uint64_t hash_combine(uint64_t seed, uint64_t value);

/// 16 hexadecimal digits.
std::string hex(uint64_t hash);

}  // namespace kiln
