// SPDX-License-Identifier: MIT
#include "field/host_bricks.h"

#include "base/hash.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "sdf/eval.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace kiln::field {
namespace {

constexpr size_t kTexels = size_t(kBrickTexelCount);
constexpr size_t kPalette = size_t(kPaletteSize);
constexpr int kBakeGrain = 4;  // bricks a piece of work: one takes microseconds

size_t texel_at(int x, int y, int z) { return (size_t(z) * 8 + size_t(y)) * 8 + size_t(x); }

// Distinct materials of a brick and how much of it they make up, in 510ths of a texel: whole numbers, so in any order.
class PaletteBuilder {
public:
    void add(uint16_t id, uint32_t weight) {
        for (Entry& entry : entries_) {
            if (entry.id != id) continue;
            entry.weight += weight;
            return;
        }
        entries_.push_back({id, weight});
    }

    // The 16 heaviest, ties to the lower number, in ascending order; the number left out.
    uint32_t finish(uint32_t* palette) {
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
    int heaviest_slot_ = 0;
};

// The texts of march.gpu.h and surface.gpu.h, reading host bricks.
struct Reader {
    const HostBricks& bricks;
    std::span<const uint32_t> cells;
    GridParams grid_params;

    explicit Reader(const HostBricks& host)
        : bricks(host), cells(host.field().cells()), grid_params(host.field().grid()) {}

    uint field_cell(ivec3 cell) const {
        return cells[(size_t(cell.z) * size_t(grid_params.size_y) + size_t(cell.y)) * size_t(grid_params.size_x) +
                     size_t(cell.x)];
    }
    int field_slot(ivec3 cell) const {
        const uint32_t word = bricks.field().cell_word(cell.x, cell.y, cell.z);
        return (word & kCellOccupied) != 0 ? int(word & kCellSlotMask) : -1;
    }
    float field_texel(int slot, ivec3 texel) const { return bricks.texel(uint32_t(slot), texel.x, texel.y, texel.z); }
    Corners field_corners(int slot, ivec3 voxel) const { return bricks.corners(uint32_t(slot), voxel); }
    uint field_material(int slot, ivec3 texel) const {
        return bricks.materials()[size_t(slot) * kTexels + texel_at(texel.x, texel.y, texel.z)];
    }

#include "field/march.gpu.h"

#include "field/surface.gpu.h"
};

vec3 unit(vec3 v) {
    const float size = length(v);
    return size > 0 ? v / size : vec3{};
}

int floor_div(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

}  // namespace

void bake_brick(const Field& field, const BrickJob& job, BrickTexels& out) {
    const float h = field.grid().voxel_size;
    const sdf::TapeView tape = sdf::view(field.program(), field.code().subspan(job.code_first, job.code_count));
    thread_local std::vector<sdf::MaterialMix> mixes(kTexels);
    thread_local std::vector<float> points(3 * kTexels);
    float* const x = points.data();
    float* const y = x + kTexels;
    float* const z = y + kTexels;
    for (int k = 0; k < kBrickTexels; ++k) {
        for (int j = 0; j < kBrickTexels; ++j) {
            for (int i = 0; i < kBrickTexels; ++i) {
                const size_t at = texel_at(i, j, k);
                x[at] = float(job.texel[0] + i) * h;  // never origin + i * h: neighbours must see the same position
                y[at] = float(job.texel[1] + j) * h;
                z[at] = float(job.texel[2] + k) * h;
            }
        }
    }
    sdf::evaluate_materials(tape, {x, y, z, kBrickTexelCount}, out.distance, mixes.data());

    thread_local PaletteBuilder palette;
    palette.clear();
    const auto in_band = [&](size_t i) { return std::fabs(out.distance[i] / h) < kBandVoxels; };
    const auto known = [](uint16_t id) { return id == sdf::kNoMaterial ? uint16_t(sdf::kDefaultMaterial) : id; };
    for (size_t i = 0; i < kTexels; ++i) {
        if (!in_band(i)) continue;
        const uint32_t second = material_word(0, 0, mixes[i].weight) >> 8;
        palette.add(known(mixes[i].id0), 510 - second);
        if (second != 0) palette.add(known(mixes[i].id1), second);
    }
    out.dropped = palette.finish(out.palette);
    for (size_t i = 0; i < kTexels; ++i) {
        out.material[i] = 0;
        if (!in_band(i)) continue;
        const sdf::MaterialMix& mix = mixes[i];
        int slot0 = palette.slot_of(known(mix.id0));
        int slot1 = mix.weight > 0 ? palette.slot_of(known(mix.id1)) : slot0;
        const bool both = slot0 >= 0 && slot1 >= 0;
        if (slot0 < 0) slot0 = slot1 >= 0 ? slot1 : palette.heaviest_slot();
        if (!both) slot1 = slot0;
        out.material[i] = uint16_t(material_word(uint32_t(slot0), uint32_t(slot1), both ? mix.weight : 0.0f));
        if (out.material[i] >> 8 == 0)
            out.material[i] = uint16_t(material_word(uint32_t(slot0), uint32_t(slot0), 0.0f));
    }
}

HostBricks HostBricks::bake(std::shared_ptr<const Field> field, int workers) {
    HostBricks out;
    out.field_ = std::move(field);
    std::vector<BrickJob> jobs;
    const std::span<const BrickRecord> records = out.field_->records();
    for (uint32_t slot = 0; slot < records.size(); ++slot) {
        const BrickRecord& r = records[slot];
        if (r.code_count != 0) jobs.push_back({slot, {r.texel_x, r.texel_y, r.texel_z}, r.code_first, r.code_count});
    }
    out.bake_jobs(jobs, workers);
    return out;
}

void HostBricks::update(std::shared_ptr<const Field> next, int workers) {
    if (!field_ || next->parent_revision() != field_->revision()) {
        *this = bake(std::move(next), workers);
        return;
    }
    field_ = std::move(next);
    bake_jobs(field_->jobs(), workers);
    for (size_t slot = 0; slot < dropped_.size(); ++slot) {
        if (field_->records()[slot].code_count == 0) dropped_[slot] = 0;
    }
}

void HostBricks::bake_jobs(std::span<const BrickJob> jobs, int workers) {
    KILN_PROFILE("host bake");
    const size_t slots = field_->slot_count();
    distances_.resize(slots * kTexels * size_t(texel_bytes()));
    materials_.resize(slots * kTexels);
    palettes_.resize(slots * kPalette, sdf::kNoMaterial);
    dropped_.resize(slots);
    parallel_for(
        jobs.size(), workers,
        [&](int i) {
            BrickTexels texels;
            bake_brick(*field_, jobs[size_t(i)], texels);
            store(jobs[size_t(i)], texels);
        },
        kBakeGrain);
}

void HostBricks::store(const BrickJob& job, const BrickTexels& texels) {
    const float h = field_->grid().voxel_size;
    const size_t first = size_t(job.slot) * kTexels;
    if (texel_bytes() == 2) {
        std::array<uint16_t, kTexels> codes;
        for (size_t i = 0; i < kTexels; ++i) codes[i] = uint16_t(half_code(texels.distance[i] / h));
        std::memcpy(distances_.data() + first * 2, codes.data(), sizeof codes);
    } else {
        for (size_t i = 0; i < kTexels; ++i) distances_[first + i] = std::byte(snorm8_code(texels.distance[i] / h));
    }
    std::copy_n(texels.material, kTexels, materials_.begin() + ptrdiff_t(first));
    std::copy_n(texels.palette, kPalette, palettes_.begin() + ptrdiff_t(size_t(job.slot) * kPalette));
    dropped_[job.slot] = texels.dropped;
}

uint64_t HostBricks::dropped_materials() const {
    uint64_t sum = 0;
    for (const uint32_t dropped : dropped_) sum += dropped;
    return sum;
}

float HostBricks::texel(uint32_t slot, int x, int y, int z) const {
    const size_t at = size_t(slot) * kTexels + texel_at(x, y, z);
    if (texel_bytes() == 1) return snorm8_value(uint32_t(distances_[at]));
    uint16_t code;
    std::memcpy(&code, distances_.data() + at * 2, 2);
    return half_value(code);
}

Corners HostBricks::corners(uint32_t slot, ivec3 v) const {
    return {texel(slot, v.x, v.y, v.z),         texel(slot, v.x + 1, v.y, v.z),
            texel(slot, v.x, v.y + 1, v.z),     texel(slot, v.x + 1, v.y + 1, v.z),
            texel(slot, v.x, v.y, v.z + 1),     texel(slot, v.x + 1, v.y, v.z + 1),
            texel(slot, v.x, v.y + 1, v.z + 1), texel(slot, v.x + 1, v.y + 1, v.z + 1)};
}

vec3 HostBricks::gradient(uint32_t slot, ivec3 cell, vec3 p, NormalKind kind) const {
    Reader reader(*this);
    switch (kind) {
    case NormalKind::Dual:
        return reader.dual_gradient(int(slot), cell, p);
    case NormalKind::Central:
        return reader.central_gradient(int(slot), cell, p);
    case NormalKind::Tetrahedral:
        return reader.tetrahedral_gradient(int(slot), cell, p);
    }
    return {};
}

void HostBricks::surface_at(uint32_t slot, ivec3 cell, ivec3 voxel, vec3 p, NormalKind kind, Sample& out) const {
    const vec3 in_brick{float(voxel.x) + p.x, float(voxel.y) + p.y, float(voxel.z) + p.z};
    out.normal = unit(gradient(slot, cell, in_brick, kind));
    Reader reader(*this);
    const Reader::SurfaceMaterial material = reader.surface_material(int(slot), voxel, p);
    const uint32_t* palette = palettes_.data() + size_t(slot) * kPalette;
    out.material0 = uint16_t(palette[material.slot0]);
    out.material1 = uint16_t(palette[material.slot1]);
    out.share = material.share;
    out.from_brick = true;
}

HostBricks::Sample HostBricks::sample(dvec3 p_world, NormalKind kind) const {
    const double h = double(field_->grid().voxel_size);
    const double t[3] = {p_world.x / h, p_world.y / h, p_world.z / h};
    Sample out;
    if (std::max({std::fabs(t[0]), std::fabs(t[1]), std::fabs(t[2])}) < double(1 << 24)) {
        const ivec3 global{int(std::floor(t[0])), int(std::floor(t[1])), int(std::floor(t[2]))};
        const ivec3 cell{floor_div(global.x, kBrickVoxels), floor_div(global.y, kBrickVoxels),
                         floor_div(global.z, kBrickVoxels)};
        const uint32_t word = field_->cell_word(cell.x, cell.y, cell.z);
        if ((word & kCellOccupied) != 0) {
            const uint32_t slot = word & kCellSlotMask;
            const ivec3 voxel{global.x - cell.x * kBrickVoxels, global.y - cell.y * kBrickVoxels,
                              global.z - cell.z * kBrickVoxels};
            const vec3 p{float(t[0] - global.x), float(t[1] - global.y), float(t[2] - global.z)};
            const Corners c = corners(slot, voxel);
            bool whole = true;
            for (const float v : {c.v000, c.v100, c.v010, c.v110, c.v001, c.v101, c.v011, c.v111}) {
                whole = whole && std::fabs(v) < kBandVoxels - 0.05f;
            }
            if (whole) {
                out.distance = double(trilinear_value(c, p)) * h;
                surface_at(slot, cell, voxel, p, kind, out);
                return out;
            }
        }
    }
    const sdf::TapeView tape = sdf::view(field_->program());
    out.distance = sdf::evaluate(tape, p_world);
    const double step = 0.01 * h;
    const auto slope = [&](dvec3 a, dvec3 b) {
        return float((sdf::evaluate(tape, a) - sdf::evaluate(tape, b)) / (2 * step));
    };
    out.normal = unit({slope({p_world.x + step, p_world.y, p_world.z}, {p_world.x - step, p_world.y, p_world.z}),
                       slope({p_world.x, p_world.y + step, p_world.z}, {p_world.x, p_world.y - step, p_world.z}),
                       slope({p_world.x, p_world.y, p_world.z + step}, {p_world.x, p_world.y, p_world.z - step})});
    const float x = float(p_world.x), y = float(p_world.y), z = float(p_world.z);
    float value;
    sdf::MaterialMix mix;
    sdf::evaluate_materials(tape, {&x, &y, &z, 1}, &value, &mix);
    out.material0 = mix.id0;
    out.material1 = mix.weight > 0 ? mix.id1 : mix.id0;
    out.share = mix.weight;
    return out;
}

MarchHit HostBricks::march(const TexelRay& ray, float t_min, float t_max, bool accelerate) const {
    Reader reader(*this);
    return reader.field_march(field_->grid(), ray, t_min, t_max, accelerate);
}

HostBricks::Hit HostBricks::cast(dvec3 origin_world, vec3 direction, double t_max, NormalKind kind,
                                 bool accelerate) const {
    const float h = field_->grid().voxel_size;
    Hit out;
    out.march = march(texel_ray_of(origin_world, direction, h), 0.0f,
                      float(std::min(t_max / double(h), double(kFarVoxels))), accelerate);
    out.state = out.march.state;
    out.t = double(out.march.t) * double(h);
    if (out.state == kMarchHit)
        surface_at(uint32_t(out.march.slot), out.march.cell, out.march.voxel, out.march.p, kind, out.surface);
    return out;
}

uint64_t HostBricks::hash() const {
    uint64_t sum = 0;
    for (const uint32_t word : field_->cells()) {
        if ((word & kCellOccupied) == 0) {
            sum = hash_combine(sum, word);
            continue;
        }
        const size_t slot = word & kCellSlotMask;
        const size_t texels = kTexels * size_t(texel_bytes());
        sum = hash_combine(sum, hash64(std::span(distances_).subspan(slot * texels, texels)));
        sum = hash_combine(sum, hash64_of(std::span<const uint16_t>(materials_).subspan(slot * kTexels, kTexels)));
        sum = hash_combine(sum, hash64_of(std::span<const uint32_t>(palettes_).subspan(slot * kPalette, kPalette)));
    }
    return sum;
}

TexelRay texel_ray_of(dvec3 origin_world, vec3 direction, float voxel_size) {
    const double h = double(voxel_size);
    const double t[3] = {origin_world.x / h, origin_world.y / h, origin_world.z / h};
    const ivec3 whole{int(std::floor(t[0])), int(std::floor(t[1])), int(std::floor(t[2]))};
    return texel_ray(whole, {float(t[0] - whole.x), float(t[1] - whole.y), float(t[2] - whole.z)}, direction);
}

}  // namespace kiln::field
