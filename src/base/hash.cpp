// SPDX-License-Identifier: MIT
#include "base/hash.h"

#include <xxhash.h>

namespace kiln {

uint64_t hash64(std::span<const std::byte> bytes, uint64_t seed) {
    return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

Hash128 hash128(std::span<const std::byte> bytes, uint64_t seed) {
    const XXH128_hash_t h = XXH3_128bits_withSeed(bytes.data(), bytes.size(), seed);
    return {h.low64, h.high64};
}

uint64_t hash_combine(uint64_t seed, uint64_t value) { return XXH3_64bits_withSeed(&value, sizeof value, seed); }

std::string hex(uint64_t hash) {
    std::string out(16, '0');
    for (size_t i = 0; i < 16; ++i) out[15 - i] = "0123456789abcdef"[(hash >> (4 * i)) & 15];
    return out;
}

}  // namespace kiln
