// SPDX-License-Identifier: MIT
// What is in a brick, made on the CPU from its pruned code: texel positions, distances, the codes and materials that are stored.
#pragma once

#include "base/paged_array.h"
#include "base/shared.h"
#include "field/brick.gpu.h"
#include "field/codes.gpu.h"
#include "field/solid.h"
#include "sdf/eval.h"
#include "sdf/octants.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace kiln::field {

/// How texels store distance. Half: 16-bit float of voxels; Snorm8: 8-bit, band / 127 a step.
enum class DistanceFormat : uint8_t { Half, Snorm8 };

/// 512 codes, x fastest, then y, then z; before them what a ray asks first. Behind the count of a Shared, codes begin a cache line.
template <typename Code>
struct BrickCodes {
    SolidRows solid;
    std::array<Code, kBrickTexelCount> codes;
};
using HalfCodes = BrickCodes<uint16_t>;
using ByteCodes = BrickCodes<uint8_t>;
/// Of both, from codes back.
inline constexpr int kSolidRowsBeforeCodes = 60;
static_assert(offsetof(HalfCodes, codes) == kSolidRowsBeforeCodes &&
              offsetof(ByteCodes, codes) == kSolidRowsBeforeCodes);

/// Materials of a brick with more than one: a word a texel (codes.gpu.h), 0 outside the band where no surface asks; 16 material numbers,
/// ascending, the unused ones kNoMaterial.
struct BrickMaterials {
    std::array<uint16_t, kBrickTexelCount> words;
    std::array<uint32_t, kPaletteSize> palette;
    uint32_t dropped = 0;  ///< materials that found no place in the palette
};

/// A brick's texels as stored: codes of one of the two formats, and materials, or the one material of all its texels.
struct BrickContent {
    Shared<HalfCodes> half;
    Shared<ByteCodes> bytes;
    Shared<BrickMaterials> materials;
    uint16_t material = 0;
    uint32_t solid_box = kNoSolidBox;

    explicit operator bool() const { return half || bytes; }
    void prefetch() const {
        half.prefetch();
        bytes.prefetch();
        materials.prefetch();
    }
    const std::byte* codes() const {
        return half ? std::as_bytes(std::span(half->codes)).data() : std::as_bytes(std::span(bytes->codes)).data();
    }
    const SolidRows& solid() const { return half ? half->solid : bytes->solid; }
    float distance(size_t texel) const {
        return half ? half_value(half->codes[texel]) : snorm8_value(bytes->codes[texel]);
    }
    uint16_t word(size_t texel) const { return materials ? materials->words[texel] : uint16_t(0); }
    uint32_t palette(size_t slot) const {
        return materials ? materials->palette[slot] : slot == 0 ? uint32_t(material) : sdf::kNoMaterial;
    }
    uint32_t dropped() const { return materials ? materials->dropped : 0; }
};

/// Where a texel lies on one axis, metres. Up to kNearCells from the origin: index * voxel size, in floats. Beyond, that on a lattice of
/// some 2^-16 voxel, which neither doubles nor floats that count from a place near by round. A function of the index alone: bricks
/// agree about the texels they share.
double texel_position(int texel, float voxel_size);
inline constexpr int kNearCells = 2048;
/// By slot. Pages are small: whoever copies one counts a holder more of each of its bricks.
using BrickContents = PagedArray<BrickContent, 4>;

/// Evaluates bricks, one after another. One thread.
class BrickEvaluator {
public:
    /// `origin`: world metres that the program's points count from.
    BrickEvaluator(const sdf::Program& program, float voxel_size, vec3 origin = {})
        : program_(&program), voxel_size_(voxel_size), voxels_per_metre_(1.0f / voxel_size), origin_(origin) {}

    /// Distances of the texels of the brick that begins at global texel `first`; the smallest |distance|, metres.
    float evaluate(std::span<const sdf::Instruction> code, ivec3 first);
    /// The same in parts, of a brick of which much may turn out to be enough: begin() makes it empty, join() runs code that goes on from what is
    /// there and returns the smallest |distance|, highest() is the greatest distance so far, and end() says what all of its code is.
    void begin(ivec3 first);
    float join(std::span<const sdf::Instruction> code);
    float highest() const { return sdf::highest(distances_); }
    void end(std::span<const sdf::Instruction> code);
    /// Of the last evaluate(), metres, not clamped.
    const std::array<float, kBrickTexelCount>& distances() const { return distances_; }
    /// sdf::keeps_away() at the texels of the brick that begins at `first`. `from`: in voxels; its scale is set here.
    bool keeps_away(std::span<const sdf::Instruction> edit, ivec3 first, sdf::Away from);
    /// Of the last evaluate(): what is stored. `only`: the material of all texels, or kSeveralMaterials where one does not know.
    BrickContent content(DistanceFormat format, uint16_t only = sdf::kSeveralMaterials) const;
    /// What the brick that begins at `first` holds once an edit that blends with nothing has joined what it holds: the least of both at each
    /// texel; `cut`: the greatest of what it holds and the edit's negative. `value`: the edit's, moved to R0. `only`: the material of all
    /// texels. Empty where no texel comes to be nearer to the surface than `near` voxels: the world is to say whether there is a brick.
    BrickContent joined(std::span<const sdf::Instruction> value, ivec3 first, const HalfCodes& held, bool cut,
                        uint16_t only, float near);

private:
    void place(ivec3 first);
    BrickMaterials materials() const;
    void mixes(std::span<const uint16_t> texels, sdf::MaterialMix* out) const;

    const sdf::Program* program_;
    float voxel_size_, voxels_per_metre_;
    vec3 origin_;
    std::span<const sdf::Instruction> code_;
    mutable sdf::OctantCodes octants_;
    bool cut_ = false;  // code_ is cut up in octants_
    alignas(64) float x_[kBrickTexels], y_[kBrickTexels], z_[kBrickTexels];
    alignas(64) std::array<float, kBrickTexelCount> distances_;
};

}  // namespace kiln::field
