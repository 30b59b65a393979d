// SPDX-License-Identifier: MIT
#include "field/brick_content.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace kiln::field {
namespace {

constexpr size_t kPalette = size_t(kPaletteSize);

// Distinct materials of a brick and how much of it they make up, in 510ths of a texel: whole numbers, so in any order.
class PaletteBuilder {
public:
    void add(uint16_t id, uint32_t weight) {
        if (last_ >= entries_.size() || entries_[last_].id != id) {
            last_ = size_t(std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.id == id; }) -
                           entries_.begin());
            if (last_ == entries_.size()) entries_.push_back({id, 0});
        }
        entries_[last_].weight += weight;
    }

    // The 16 heaviest, ties to the lower number, in ascending order; the number left out.
    uint32_t finish(std::array<uint32_t, kPalette>& palette) {
        std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
            return a.weight != b.weight ? a.weight > b.weight : a.id < b.id;
        });
        const uint32_t kept = uint32_t(std::min(entries_.size(), kPalette));
        const uint16_t heaviest = entries_.empty() ? uint16_t(0) : entries_[0].id;
        const uint32_t left_out = uint32_t(entries_.size()) - kept;
        entries_.resize(kept);
        std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.id < b.id; });
        for (uint32_t i = 0; i < kPalette; ++i) palette[i] = i < kept ? entries_[i].id : sdf::kNoMaterial;
        heaviest_slot_ = std::max(slot_of(heaviest), 0);
        return left_out;
    }

    int slot_of(uint16_t id) const {
        for (size_t i = 0; i < entries_.size(); ++i) {
            if (entries_[i].id == id) return int(i);
        }
        return -1;
    }
    int heaviest_slot() const { return heaviest_slot_; }
    void clear() { entries_.clear(); }

private:
    struct Entry {
        uint16_t id;
        uint32_t weight;
    };
    std::vector<Entry> entries_;
    size_t last_ = 0;  // that was added to: neighbours are mostly of the same material
    int heaviest_slot_ = 0;
};

// The material of all leaves of `code`, where they have one and the same.
std::optional<uint16_t> one_material(std::span<const sdf::Instruction> code, const AppendArray<float>& params) {
    uint32_t out = sdf::kNoMaterial;
    for (const sdf::Instruction in : code) {
        if (!in.has_material()) continue;
        const uint32_t material = uint32_t(params[in.param + 1]);
        if (material == sdf::kNoMaterial || (out != sdf::kNoMaterial && material != out)) return std::nullopt;
        out = material;
    }
    if (out == sdf::kNoMaterial) return std::nullopt;
    return uint16_t(out);
}

uint16_t known(uint16_t id) { return id == sdf::kNoMaterial ? uint16_t(sdf::kDefaultMaterial) : id; }

}  // namespace

double texel_position(int texel, float voxel_size) {
    if (std::abs(texel) <= kNearCells * kBrickVoxels) return double(float(texel) * voxel_size);
    // 2^-16 of the power of two at or above the voxel.
    const double step = std::exp2(std::ceil(std::log2(double(voxel_size))) - 16);
    return std::round(double(texel) * double(voxel_size) / step) * step;
}

void BrickEvaluator::place(ivec3 first) {
    const auto place_axis = [this](float* to, int begin, float origin) {
        if (origin == 0) {
            for (int i = 0; i < kBrickTexels; ++i) to[i] = float(begin + i) * voxel_size_;
        } else {
            for (int i = 0; i < kBrickTexels; ++i)
                to[i] = float(texel_position(begin + i, voxel_size_) - double(origin));
        }
    };
    // Never corner + i * h: neighbours must see the same position.
    place_axis(x_, first.x, origin_.x);
    place_axis(y_, first.y, origin_.y);
    place_axis(z_, first.z, origin_.z);
}

float BrickEvaluator::evaluate(std::span<const sdf::Instruction> code, ivec3 first) {
    code_ = code;
    place(first);
    const sdf::TapeView tape = sdf::view(*program_, code);
    cut_ = octants_.cut(tape, x_, y_, z_);
    return cut_ ? octants_.evaluate(distances_.data()) : sdf::evaluate_brick(tape, x_, y_, z_, distances_.data());
}

void BrickEvaluator::begin(ivec3 first) {
    place(first);
    distances_.fill(sdf::kEmpty);
}

float BrickEvaluator::join(std::span<const sdf::Instruction> code) {
    return sdf::evaluate_brick(sdf::view(*program_, code), x_, y_, z_, distances_.data());
}

void BrickEvaluator::end(std::span<const sdf::Instruction> code) {
    code_ = code;
    cut_ = false;
}

bool BrickEvaluator::keeps_away(std::span<const sdf::Instruction> edit, ivec3 first, sdf::Away from) {
    place(first);
    from.scale = voxels_per_metre_;
    return sdf::keeps_away(sdf::view(*program_, edit), x_, y_, z_, from);
}

BrickContent BrickEvaluator::joined(std::span<const sdf::Instruction> value, ivec3 first, const HalfCodes& held,
                                    bool cut, uint16_t only, float near) {
    place(first);
    (void)sdf::evaluate_brick(sdf::view(*program_, value), x_, y_, z_, distances_.data());
    BrickContent out;
    HalfCodes& brick = out.half.renew();
    std::array<Slice, 8> solid;
    sdf::store_halves(distances_, cut ? -voxels_per_metre_ : voxels_per_metre_, kBandVoxels, kHalfStepVoxels,
                      brick.codes.data(), solid.data());
    // Codes of sign and size as whole numbers in the same order, and back; there is no negative 0.
    const auto turned = [](int16_t code) { return int16_t(code ^ (code >> 15 & 0x7fff)); };
    int16_t least = 0x7fff;
    for (size_t i = 0; i < brick.codes.size(); ++i) {
        const int16_t a = turned(int16_t(held.codes[i])), b = turned(int16_t(brick.codes[i]));
        const int16_t code = turned(cut ? std::max(a, b) : std::min(a, b));
        brick.codes[i] = uint16_t(code);
        least = std::min(least, int16_t(code & 0x7fff));
    }
    if (!(half_value(uint32_t(least)) < near)) return {};
    out.solid_box = solid_voxels(solid_texels(std::as_bytes(std::span(brick.codes)).data(), 2), brick.solid);
    out.material = only;
    return out;
}

BrickContent BrickEvaluator::content(DistanceFormat format, uint16_t only) const {
    BrickContent out;
    if (format == DistanceFormat::Half) {
        HalfCodes& brick = out.half.renew();
        std::array<Slice, 8> solid;
        sdf::store_halves(distances_, voxels_per_metre_, kBandVoxels, kHalfStepVoxels, brick.codes.data(),
                          solid.data());
        out.solid_box = solid_voxels(solid, brick.solid);
    } else {
        ByteCodes& brick = out.bytes.renew();
        for (size_t i = 0; i < brick.codes.size(); ++i)
            brick.codes[i] = uint8_t(snorm8_code(distances_[i] * voxels_per_metre_));
        out.solid_box = solid_voxels(solid_texels(std::as_bytes(std::span(brick.codes)).data(), 1), brick.solid);
    }
    if (only != sdf::kSeveralMaterials) {
        out.material = only;
    } else {
        BrickMaterials made = materials();
        // Texels of one material need no words.
        const bool one = made.palette[1] == sdf::kNoMaterial &&
                         std::all_of(made.words.begin(), made.words.end(), [](uint16_t word) { return word == 0; });
        if (one && made.palette[0] != sdf::kNoMaterial) {
            out.material = uint16_t(made.palette[0]);
        } else {
            out.materials = Shared<BrickMaterials>::make(std::move(made));
        }
    }
    return out;
}

// Of those texels, each at its place in `out`; others' places may be written too.
void BrickEvaluator::mixes(std::span<const uint16_t> texels, sdf::MaterialMix* out) const {
    constexpr int kTexels = sdf::OctantCodes::kTexels;
    alignas(64) float points[3][kBrickTexelCount], values[kBrickTexelCount];
    const auto place_point = [&](int at, int texel) {
        points[0][at] = x_[texel & 7];
        points[1][at] = y_[texel >> 3 & 7];
        points[2][at] = z_[texel >> 6];
    };
    if (!cut_) {
        const int count = int(texels.size());
        for (int i = 0; i < count; ++i) place_point(i, texels[size_t(i)]);
        thread_local std::array<sdf::MaterialMix, kBrickTexelCount> mixes;
        sdf::evaluate_materials(sdf::view(*program_, code_), {points[0], points[1], points[2], count}, values,
                                mixes.data());
        for (size_t i = 0; i < texels.size(); ++i) out[texels[i]] = mixes[i];
        return;
    }
    std::array<bool, sdf::OctantCodes::kOctants> wanted{};
    for (const size_t i : texels) wanted[(i >> 2 & 1) | (i >> 5 & 1) << 1 | (i >> 8 & 1) << 2] = true;
    for (int octant = 0; octant < sdf::OctantCodes::kOctants; ++octant) {
        if (!wanted[size_t(octant)]) continue;
        const std::span<const sdf::Instruction> code = octants_.material_code(octant);
        sdf::MaterialMix mixes[kTexels];
        if (const auto only = one_material(code, program_->params)) {
            std::fill(std::begin(mixes), std::end(mixes), sdf::MaterialMix{*only});
        } else {
            for (int t = 0; t < kTexels; ++t) place_point(t, sdf::texel_of_octant(octant, t));
            sdf::evaluate_materials(sdf::view(*program_, code), {points[0], points[1], points[2], kTexels}, values,
                                    mixes);
        }
        for (int t = 0; t < kTexels; ++t) out[sdf::texel_of_octant(octant, t)] = mixes[t];
    }
}

BrickMaterials BrickEvaluator::materials() const {
    constexpr size_t kTexels = size_t(kBrickTexelCount);
    std::array<uint16_t, kTexels> in_band;
    size_t count = 0;
    for (size_t i = 0; i < kTexels; ++i) {
        in_band[count] = uint16_t(i);
        count += std::fabs(distances_[i] * voxels_per_metre_) < kBandVoxels ? 1 : 0;
    }
    const std::span band(in_band.data(), count);
    thread_local std::array<sdf::MaterialMix, kTexels> mixes;
    this->mixes(band, mixes.data());

    BrickMaterials out;
    thread_local PaletteBuilder palette;
    palette.clear();
    for (const size_t i : band) {
        const uint32_t second = mixes[i].weight > 0 ? material_word(0, 0, mixes[i].weight) >> 8 : 0;
        palette.add(known(mixes[i].id0), 510 - second);
        if (second != 0) palette.add(known(mixes[i].id1), second);
    }
    out.dropped = palette.finish(out.palette);
    out.words.fill(0);
    const auto alone = [](int slot) { return uint16_t(material_word(uint32_t(slot), uint32_t(slot), 0.0f)); };
    const sdf::MaterialMix* before = nullptr;  // neighbours are mostly of the same material
    for (const size_t i : band) {
        const sdf::MaterialMix& mix = mixes[i];
        if (before != nullptr && !(mix.weight > 0) && !(before->weight > 0) && mix.id0 == before->id0) {
            out.words[i] = out.words[size_t(before - mixes.data())];
            continue;
        }
        before = &mix;
        int slot0 = palette.slot_of(known(mix.id0));
        int slot1 = mix.weight > 0 ? palette.slot_of(known(mix.id1)) : slot0;
        const bool both = slot0 >= 0 && slot1 >= 0;
        if (slot0 < 0) slot0 = slot1 >= 0 ? slot1 : palette.heaviest_slot();
        out.words[i] = alone(slot0);
        if (!both || !(mix.weight > 0)) continue;
        const uint32_t word = material_word(uint32_t(slot0), uint32_t(slot1), mix.weight);
        if (word >> 8 != 0) out.words[i] = uint16_t(word);
    }
    return out;
}

}  // namespace kiln::field
