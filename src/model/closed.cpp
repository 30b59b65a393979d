// SPDX-License-Identifier: MIT
#include "model/closed.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

namespace kiln::model {

bool is_closed(std::span<const vec3> positions, std::span<const uint32_t> corners) {
    // Places are numbered in their order; -0 is 0.
    std::vector<std::pair<std::array<uint32_t, 3>, uint32_t>> order;
    order.reserve(positions.size());
    const auto bits = [](float x) { return std::bit_cast<uint32_t>(x == 0 ? 0.0f : x); };
    for (uint32_t i = 0; i < positions.size(); ++i)
        order.push_back({{bits(positions[i].x), bits(positions[i].y), bits(positions[i].z)}, i});
    std::sort(order.begin(), order.end());
    std::vector<uint32_t> place(positions.size());
    for (size_t i = 0; i < order.size(); ++i)
        place[order[i].second] =
            i > 0 && order[i].first == order[i - 1].first ? place[order[i - 1].second] : uint32_t(i);
    std::vector<uint64_t> edges;  // from << 32 | to
    edges.reserve(corners.size());
    for (size_t t = 0; t + 2 < corners.size(); t += 3) {
        const uint32_t p[3] = {place[corners[t]], place[corners[t + 1]], place[corners[t + 2]]};
        if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) continue;
        for (size_t i = 0; i < 3; ++i) edges.push_back(uint64_t{p[i]} << 32 | p[(i + 1) % 3]);
    }
    std::sort(edges.begin(), edges.end());
    if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
    const auto has_twin = [&](uint64_t e) { return std::binary_search(edges.begin(), edges.end(), e << 32 | e >> 32); };
    return !edges.empty() && std::all_of(edges.begin(), edges.end(), has_twin);
}

}  // namespace kiln::model
