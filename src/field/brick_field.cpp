// SPDX-License-Identifier: MIT

#include "field/brick_field.h"

#include "field/brick_content.h"
#include "field/trilinear.gpu.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln::field {

namespace {

constexpr int kMostProbes = 32;
constexpr int kMostCell = kNearCells - 1;  // beyond, floats of texels are too coarse
constexpr uint64_t kUsed = uint64_t(1) << 63;
constexpr float kHalfDiagonal = 0.8661f;  // of a side
constexpr size_t kBodyBricks = 1 << 13;
constexpr size_t kLeastRoom = 1 << 12;  // cells

uint64_t key_of(ivec3 c) {
    const auto part = [](int v) { return uint64_t(uint32_t(v + kNearCells)) & 0xfffff; };
    return kUsed | part(c.x) | part(c.y) << 20 | part(c.z) << 40;
}
ivec3 cell_of(uint64_t key) {
    const auto part = [&](int shift) { return int(key >> shift & 0xfffff) - kNearCells; };
    return {part(0), part(20), part(40)};
}

// Rounded down; |v| below 2^30.
int floor_of(float v) {
    const int whole = int(v);
    return whole - (float(whole) > v ? 1 : 0);
}
int cell_on_axis(int texel) {
    return int(uint32_t(texel + kNearCells * kBrickVoxels) / uint32_t(kBrickVoxels)) - kNearCells;
}

}  // namespace

BrickField::Table::Table(size_t count) {
    const size_t size = std::bit_ceil(std::max<size_t>(count, 64));
    slots = std::make_unique<Slot[]>(size);
    shift = 64 - std::countr_zero(size);
}

BrickField::Table::~Table() {
    const size_t size = size_t(1) << (64 - shift);
    for (size_t i = 0; i < size; ++i)
        if (Brick* b = slots[i].brick.load(std::memory_order_relaxed)) let_go(b);
}

BrickField::Brick* BrickField::far_cell() {
    static Brick far{};
    return &far;
}

void BrickField::let_go(Brick* b) {
    if (b != far_cell() && b->holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete b;
}

BrickField::BrickField(std::shared_ptr<const SdfField> exact, const BrickFieldOptions& options)
    : BrickField(std::move(exact), options, Room{2 * options.most_bricks}) {}

BrickField::BrickField(std::shared_ptr<const SdfField> exact, const BrickFieldOptions& options, Room room)
    : exact_(std::move(exact)),
      options_(options),
      voxels_per_metre_(1 / options.voxel_size),
      table_(2 * room.cells),
      room_(room.cells) {}

std::shared_ptr<const BrickField> BrickField::of_body(std::shared_ptr<const SdfField> exact, float most_voxel) {
    const vec3 size = exact->bounds().max - exact->bounds().min;
    const float least = std::min({size.x, size.y, size.z}), voxel = std::min(most_voxel, least / 16);
    return std::make_shared<const BrickField>(
        std::move(exact), BrickFieldOptions{.voxel_size = voxel, .near = least, .most_bricks = kBodyBricks});
}

std::shared_ptr<const BrickField> BrickField::after(std::shared_ptr<const SdfField> exact, const Box3& changed) const {
    // Small, so that an edit costs little; it grows between steps.
    const size_t room =
        std::clamp(2 * cells_.load(std::memory_order_relaxed), std::min(kLeastRoom, room_), 2 * options_.most_bricks);
    auto out = std::make_shared<BrickField>(std::move(exact), options_, Room{room});
    // A value can change only where the change is nearer than the value is large, and bricks hold values up to `near` and a diagonal.
    const float reach = options_.near + 3 * kHalfDiagonal * kBrickVoxels * options_.voxel_size;
    out->adopt(*this, changed.empty() ? changed : changed.inflated(reach), 0);
    return out;
}

std::shared_ptr<const SdfField> BrickField::renewed() const {
    const uint32_t now = generation_.fetch_add(1, std::memory_order_relaxed);
    const size_t most = options_.most_bricks;
    const size_t cells = cells_.load(std::memory_order_relaxed);
    if (room_ < 2 * most && 2 * cells > room_) {
        auto larger = std::make_shared<BrickField>(exact_, options_, Room{std::min(4 * room_, 2 * most)});
        larger->adopt(*this, {}, 0);
        return larger;
    }
    if (bricks_.load(std::memory_order_relaxed) < most && cells < 2 * most) return nullptr;
    // What nobody asked for in this generation goes.
    auto out = std::make_shared<BrickField>(exact_, options_);
    out->adopt(*this, {}, now);
    return out;
}

void BrickField::adopt(const BrickField& old, const Box3& changed, uint32_t asked_since) {
    const size_t size = size_t(1) << (64 - old.table_.shift);
    const float side = kBrickVoxels * options_.voxel_size;
    for (size_t i = 0; i < size; ++i) {
        Brick* b = old.table_.slots[i].brick.load(std::memory_order_acquire);
        if (b == nullptr) continue;
        if (asked_since != 0 &&
            (b == far_cell() || old.table_.slots[i].asked.load(std::memory_order_relaxed) < asked_since))
            continue;
        const uint64_t key = old.table_.slots[i].key.load(std::memory_order_relaxed);
        const ivec3 c = cell_of(key);
        const vec3 low{float(c.x) * side, float(c.y) * side, float(c.z) * side};
        if (!changed.empty() && changed.overlaps({low, low + vec3{side, side, side}})) continue;
        size_t at = size_t(key * 0x9e3779b97f4a7c15ull >> table_.shift);
        const size_t mask = (size_t(1) << (64 - table_.shift)) - 1;
        while (table_.slots[at].key.load(std::memory_order_relaxed) != 0) at = (at + 1) & mask;
        if (b != far_cell()) {
            b->holders.fetch_add(1, std::memory_order_relaxed);
            bricks_.fetch_add(1, std::memory_order_relaxed);
        }
        cells_.fetch_add(1, std::memory_order_relaxed);
        table_.slots[at].key.store(key, std::memory_order_relaxed);
        table_.slots[at].brick.store(b, std::memory_order_release);
    }
}

bool BrickField::make(ivec3 cell, Brick& out) const {
    const float h = options_.voxel_size, side = kBrickVoxels * h;
    const ivec3 first{cell.x * kBrickVoxels, cell.y * kBrickVoxels, cell.z * kBrickVoxels};
    alignas(64) float x[kBrickTexels], y[kBrickTexels], z[kBrickTexels];
    for (int i = 0; i < kBrickTexels; ++i) {
        x[i] = float(first.x + i) * h;
        y[i] = float(first.y + i) * h;
        z[i] = float(first.z + i) * h;
    }
    const vec3 center{0.5f * (x[0] + x[7]), 0.5f * (y[0] + y[7]), 0.5f * (z[0] + z[7])};
    return exact_->texels(center, side, options_.near, x, y, z, out.distance.data());
}

const BrickField::Brick* BrickField::find(uint64_t key, ivec3 cell) const {
    const size_t mask = (size_t(1) << (64 - table_.shift)) - 1;
    size_t at = size_t(key * 0x9e3779b97f4a7c15ull >> table_.shift);
    Slot* place = nullptr;
    for (int probe = 0; probe < kMostProbes; ++probe, at = (at + 1) & mask) {
        Slot& slot = table_.slots[at];
        uint64_t there = slot.key.load(std::memory_order_relaxed);
        if (there == 0) {
            if (bricks_.load(std::memory_order_relaxed) >= options_.most_bricks ||
                cells_.load(std::memory_order_relaxed) >= room_)
                break;
            if (slot.key.compare_exchange_strong(there, key, std::memory_order_relaxed)) {
                cells_.fetch_add(1, std::memory_order_relaxed);
                there = key;
            }
        }
        if (there != key) continue;
        const uint32_t now = generation_.load(std::memory_order_relaxed);
        if (slot.asked.load(std::memory_order_relaxed) != now) slot.asked.store(now, std::memory_order_relaxed);
        if (const Brick* b = slot.brick.load(std::memory_order_acquire)) return b;
        place = &slot;
        break;
    }
    if (place == nullptr) {  // no room: made for this question alone
        thread_local Brick scratch;
        return make(cell, scratch) ? &scratch : far_cell();
    }
    auto made = std::make_unique<Brick>();
    Brick* fresh = make(cell, *made) ? made.release() : far_cell();
    Brick* none = nullptr;
    if (place->brick.compare_exchange_strong(none, fresh, std::memory_order_acq_rel)) {
        if (fresh != far_cell()) bricks_.fetch_add(1, std::memory_order_relaxed);
        return fresh;
    }
    let_go(fresh);  // another thread was first, with the same bits
    return none;
}

float BrickField::ask(vec3 p, vec3* gradient, Cursor& cursor) const {
    const vec3 t = p * voxels_per_metre_;
    constexpr float kMost = float(kMostCell * kBrickVoxels);
    if (!(std::abs(t.x) < kMost && std::abs(t.y) < kMost && std::abs(t.z) < kMost))
        return gradient != nullptr ? exact_->distance(p, *gradient) : exact_->distance(p);
    const ivec3 texel{floor_of(t.x), floor_of(t.y), floor_of(t.z)};
    const ivec3 cell{cell_on_axis(texel.x), cell_on_axis(texel.y), cell_on_axis(texel.z)};
    const uint64_t key = key_of(cell);
    if (key != cursor.key) cursor = {key, find(key, cell)};
    const Brick* b = cursor.brick;
    if (b == far_cell()) return gradient != nullptr ? exact_->distance(p, *gradient) : exact_->distance(p);
    const ivec3 v{texel.x - cell.x * kBrickVoxels, texel.y - cell.y * kBrickVoxels, texel.z - cell.z * kBrickVoxels};
    const float* d = b->distance.data() + (size_t(v.z) * 8 + size_t(v.y)) * 8 + size_t(v.x);
    const Corners c{d[0], d[1], d[8], d[9], d[64], d[65], d[72], d[73]};
    const vec3 at{t.x - float(texel.x), t.y - float(texel.y), t.z - float(texel.z)};
    if (gradient != nullptr) *gradient = trilinear_gradient(c, at) * voxels_per_metre_;
    return trilinear_value(c, at);
}

void BrickField::distances(std::span<const vec3> points, float* out, vec3* gradients) const {
    Cursor cursor;
    for (size_t i = 0; i < points.size(); ++i) out[i] = ask(points[i], gradients + i, cursor);
}

void BrickField::distances(const sdf::Points& points, float* out) const {
    Cursor cursor;
    for (int i = 0; i < points.count; ++i) out[i] = ask({points.x[i], points.y[i], points.z[i]}, nullptr, cursor);
}

}  // namespace kiln::field
