// SPDX-License-Identifier: MIT
// Makes a trilinear interpolant 1-Lipschitz. Along each axis, with the other two fixed, two components of its gradient are linear and
// one is constant: the gradient's square is convex there, so its largest value over a cell is at one of the eight corners, where the
// gradient is the three differences that meet. Samples of a true distance break this bound near corners and ridges (up to sqrt 3).
// flatten() moves samples towards 0 until most corners keep it, those near the surface least; steepest() tells what is left.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace kiln::model {

class LipschitzCells {
public:
    using Corners = std::array<uint32_t, 8>;
    explicit LipschitzCells(float cell) : cell_(cell) {}

    /// Numbers of the samples at a cell's corners; bit 0 of the corner is +x, bit 1 +y, bit 2 +z.
    void add(const Corners& corners) { cells_.push_back(corners); }

    /// Mobility 0 holds a sample still, 1 lets it move. Signs are kept.
    void flatten(std::span<float> values, std::span<const float> mobility) const;
    /// Largest length of the interpolant's gradient.
    float steepest(std::span<const float> values) const;

private:
    bool flatten_cell(const Corners& ids, std::span<float> values, std::span<const float> first,
                      std::span<const float> mobility) const;
    float steepness(const Corners& ids, std::span<const float> values) const;

    float cell_;
    std::vector<Corners> cells_;
};

}  // namespace kiln::model
