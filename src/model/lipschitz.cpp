// SPDX-License-Identifier: MIT
// The corners' bounds are a convex set; each pass projects the samples of every corner that breaks its bound onto it, one after another
// (Kaczmarz's method, with weights). One thread: the order is part of the answer.

#include "model/lipschitz.h"

#include <algorithm>
#include <cmath>

namespace kiln::model {
namespace {

constexpr int kRounds = 40, kPasses = 4;
/// Rounds end when nothing is steeper than this.
constexpr float kEnough = 1.2f;
/// What is less steep is left alone: near any convex part a distance is a little steeper than 1 between samples. Projections aim below
/// it, or they would only creep up to it.
constexpr float kTarget = 1.1f;
constexpr float kAim = 1.08f;
/// Beyond this many cells from the surface a sample may also move outwards: it must meet the coarse lattice.
constexpr float kFarCells = 3;

// Squared lengths of the differences at a cell's corners.
float steepest_squared(const float* v) {
    float most = 0;
    float x[4], y[4], z[4];  // squares of the differences along each axis
    for (int i = 0; i < 4; ++i) {
        const float dx = v[2 * i + 1] - v[2 * i];
        const int j = (i & 1) | (i & 2) << 1;  // 0 1 4 5
        const float dy = v[j + 2] - v[j];
        const float dz = v[i + 4] - v[i];
        x[i] = dx * dx;
        y[i] = dy * dy;
        z[i] = dz * dz;
    }
    for (int c = 0; c < 8; ++c) most = std::max(most, x[c >> 1] + y[(c & 1) | (c >> 1 & 2)] + z[c & 3]);
    return most;
}

}  // namespace

// Moves the samples of a cell's corners that are too steep; true when one moved.
bool LipschitzCells::flatten_cell(const Corners& ids, std::span<float> values, std::span<const float> first,
                                  std::span<const float> mobility) const {
    const float bound = kTarget * kTarget * cell_ * cell_;
    float v[8];
    for (size_t c = 0; c < 8; ++c) v[c] = values[ids[c]];
    if (!(steepest_squared(v) > bound)) return false;
    bool any = false;
    for (size_t c = 0; c < 8; ++c) {
        const size_t at[4] = {c, c ^ 1, c ^ 2, c ^ 4};
        float d[4], weight[4], slope[4], squared = 0, norm = 0;
        for (size_t i = 1; i < 4; ++i) {
            d[i] = v[at[i]] - v[c];
            squared += d[i] * d[i];
        }
        if (!(squared > bound)) continue;
        // The constraint's gradient: d / |d| at the three, minus their sum at the corner itself.
        const float length = std::sqrt(squared);
        slope[0] = -(d[1] + d[2] + d[3]) / length;
        for (size_t i = 1; i < 4; ++i) slope[i] = d[i] / length;
        for (size_t i = 0; i < 4; ++i) {
            const float near = std::min(std::fabs(v[at[i]]) / cell_, 1.0f);
            weight[i] = mobility[ids[at[i]]] * near * near;
            norm += weight[i] * slope[i] * slope[i];
        }
        // With all four free the norm is at least 1. Where those that may move hardly matter, they move less than the bound asks: a
        // whole projection would throw them far.
        const float by = (length - kAim * cell_) / std::max(norm, 0.5f);
        for (size_t i = 0; i < 4; ++i) {
            const float old = v[at[i]];
            const float start = std::fabs(first[ids[at[i]]]);
            // At most half way to the surface, and farther out than at first only where that is far.
            const float most = start < kFarCells * cell_ ? start : 2 * start;
            const float moved = old - by * weight[i] * slope[i];
            const float size = std::clamp(old < 0 ? -moved : moved, 0.5f * std::fabs(old), most);
            const float next = old < 0 ? -size : size;
            any = any || next != old;
            v[at[i]] = values[ids[at[i]]] = next;
        }
    }
    return any;
}

void LipschitzCells::flatten(std::span<float> values, std::span<const float> mobility) const {
    const std::vector<float> first(values.begin(), values.end());
    std::vector<uint32_t> steep;
    for (int round = 0; round < kRounds; ++round) {
        steep.clear();
        for (uint32_t n = 0; n < cells_.size(); ++n)
            if (flatten_cell(cells_[n], values, first, mobility)) steep.push_back(n);
        float most = 0;
        for (const uint32_t n : steep) most = std::max(most, steepness(cells_[n], values));
        if (most < kEnough) return;
        // Neighbours that this makes steep wait for the next round.
        for (int pass = 0; pass < kPasses; ++pass) {
            bool any = false;
            for (const uint32_t n : steep) any = flatten_cell(cells_[n], values, first, mobility) || any;
            if (!any) break;
        }
    }
}

float LipschitzCells::steepness(const Corners& ids, std::span<const float> values) const {
    float v[8];
    for (size_t c = 0; c < 8; ++c) v[c] = values[ids[c]];
    return std::sqrt(steepest_squared(v)) / cell_;
}

float LipschitzCells::steepest(std::span<const float> values) const {
    float most = 0;
    for (const Corners& ids : cells_) most = std::max(most, steepness(ids, values));
    return most;
}

}  // namespace kiln::model
