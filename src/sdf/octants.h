// SPDX-License-Identifier: MIT
// The code of a brick cut up once more for its own evaluation: what can matter in each of its eight octants of 4 x 4 x 4 texels. Where many
// edits meet, an octant keeps a half or a third of the brick's list; finding out costs an eighth of evaluating the brick.
#pragma once

#include "sdf/eval.h"

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::sdf {

/// Reused from brick to brick. One thread.
class OctantCodes {
public:
    static constexpr int kOctants = 8;
    static constexpr int kTexels = 64;  ///< of an octant

    /// Cuts up `tape`, the code of the brick whose 512 texels are at (x[i], y[j], z[k]). False where it is too short to be worth it: then
    /// nothing below may be called. What the tape and the arrays refer to must stay until the next cut.
    bool cut(const TapeView& tape, const float* x, const float* y, const float* z, Isa isa = best_isa());

    /// evaluate_brick() of the tape that was cut, bit for bit.
    float evaluate(float* out) const;
    /// The code that has the tape's bits, those of materials too, at the texels of an octant: x + 2 y + 4 z counts them. Valid until the
    /// next call.
    std::span<const Instruction> material_code(int octant);

private:
    enum class Want : uint8_t { Distance, Materials };
    struct Segment {
        uint32_t first, content;  // instructions: the content that makes R1, then what joins it to R0
    };
    bool divide(std::span<const Instruction> code);
    void write(int octant, Want want, std::vector<Instruction>& out) const;

    TapeView tape_{};
    Isa isa_ = Isa::Scalar;
    const float *x_ = nullptr, *y_ = nullptr, *z_ = nullptr;
    bool from_empty_ = false;
    std::vector<Segment> segments_;
    std::vector<FoldEntry> entries_;
    std::vector<uint64_t> left_, right_;
    std::vector<Instruction> code_;
};

/// Texel (i, j, k) of a brick, i fastest, that is texel `t` of an octant, likewise counted.
inline constexpr int texel_of_octant(int octant, int t) {
    const int i = (octant & 1) * 4 + (t & 3), j = (octant >> 1 & 1) * 4 + (t >> 2 & 3),
              k = (octant >> 2) * 4 + (t >> 4);
    return (k * 8 + j) * 8 + i;
}

}  // namespace kiln::sdf
