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
constexpr float kHalfDiagonalOfSide = 0.8661f;  // of a side
constexpr size_t kBodyBricks = 1 << 13;
constexpr size_t kLeastRoom = 1 << 12;  // cells
constexpr size_t kMostBefore = 8;       // tables that bricks are taken over from

uint64_t key_of(ivec3 c) {
    const auto part = [](int v) { return uint64_t(uint32_t(v + kNearCells)) & 0xfffff; };
    return kUsed | part(c.x) | part(c.y) << 20 | part(c.z) << 40;
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
    for (size_t i = 0; i < size(); ++i) {
        if (Brick* b = slots[i].brick.load(std::memory_order_relaxed)) let_go(b);
        if (const SdfField* p = slots[i].part.load(std::memory_order_relaxed); p != &no_part()) delete p;
    }
}

BrickField::Brick* BrickField::Table::brick_of(uint64_t key) const {
    const size_t mask = size() - 1;
    for (size_t at = size_t(key * 0x9e3779b97f4a7c15ull >> shift);; at = (at + 1) & mask) {
        const uint64_t there = slots[at].key.load(std::memory_order_relaxed);
        if (there == key) return slots[at].brick.load(std::memory_order_acquire);
        if (there == 0) return nullptr;  // half of them are
    }
}

BrickField::Brick* BrickField::far_cell() {
    static Brick far{};
    return &far;
}

// Says that the field is no shorter in a cell than anywhere.
const SdfField& BrickField::no_part() {
    struct None final : SdfField {
        float distance(vec3) const override { return sdf::kEmpty; }
        float distance(vec3, vec3&) const override { return sdf::kEmpty; }
        void distances(const sdf::Points&, float*) const override {}
        Box3 bounds() const override { return {}; }
    };
    static const None none;
    return none;
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
      table_(std::make_shared<Table>(2 * room.cells)),
      room_(room.cells) {}

std::shared_ptr<const BrickField> BrickField::of_body(std::shared_ptr<const SdfField> exact, float most_voxel) {
    const vec3 size = exact->bounds().max - exact->bounds().min;
    const float least = std::min({size.x, size.y, size.z}), voxel = std::min(most_voxel, least / 16);
    return std::make_shared<const BrickField>(
        std::move(exact), BrickFieldOptions{.voxel_size = voxel, .near = least, .most_bricks = kBodyBricks});
}

std::shared_ptr<const BrickField> BrickField::after(std::shared_ptr<const SdfField> exact, const Box3& changed) const {
    // Room for what was asked for lately, so that an edit costs little; it grows between steps.
    size_t asked = table_->cells.load(std::memory_order_relaxed);
    for (const Before& b : before_) asked = std::max(asked, b.table->cells.load(std::memory_order_relaxed));
    const size_t most = options_.most_bricks;
    const size_t room = std::clamp(2 * asked, std::min(kLeastRoom, room_), 2 * most);
    auto out = std::make_shared<BrickField>(std::move(exact), options_, Room{room});
    // A value can change only where the change is nearer than the value is large, and bricks hold values up to `near` and a diagonal.
    const float reach = options_.near + 3 * kHalfDiagonalOfSide * kBrickVoxels * options_.voxel_size;
    out->before_.push_back({table_, changed.empty() ? changed : changed.inflated(reach)});
    // As many as one may have is as many as are kept for those who have others.
    size_t bricks = table_->bricks.load(std::memory_order_relaxed);
    for (const Before& b : before_) {
        bricks += b.table->bricks.load(std::memory_order_relaxed);
        if (bricks > most || out->before_.size() == kMostBefore) break;
        out->before_.push_back(b);
    }
    return out;
}

std::shared_ptr<const SdfField> BrickField::renewed() const {
    const uint32_t now = generation_.fetch_add(1, std::memory_order_relaxed);
    const size_t most = options_.most_bricks;
    const size_t cells = table_->cells.load(std::memory_order_relaxed);
    if (room_ < 2 * most && 2 * cells > room_) {
        auto larger = std::make_shared<BrickField>(exact_, options_, Room{std::min(4 * room_, 2 * most)});
        larger->adopt(*this, 0);
        larger->before_ = before_;
        return larger;
    }
    if (brick_count() < most && cells < 2 * most) return nullptr;
    // What nobody asked for in this generation goes.
    auto out = std::make_shared<BrickField>(exact_, options_);
    out->adopt(*this, now);
    return out;
}

void BrickField::adopt(const BrickField& old, uint32_t asked_since) {
    Table& to = *table_;
    for (size_t i = 0; i < old.table_->size(); ++i) {
        const Slot& slot = old.table_->slots[i];
        Brick* b = slot.brick.load(std::memory_order_acquire);
        if (b == nullptr) continue;
        if (asked_since != 0 && (b == far_cell() || slot.asked.load(std::memory_order_relaxed) < asked_since)) continue;
        const uint64_t key = slot.key.load(std::memory_order_relaxed);
        size_t at = size_t(key * 0x9e3779b97f4a7c15ull >> to.shift);
        while (to.slots[at].key.load(std::memory_order_relaxed) != 0) at = (at + 1) & (to.size() - 1);
        if (b != far_cell()) {
            b->holders.fetch_add(1, std::memory_order_relaxed);
            to.bricks.fetch_add(1, std::memory_order_relaxed);
        }
        to.cells.fetch_add(1, std::memory_order_relaxed);
        to.slots[at].key.store(key, std::memory_order_relaxed);
        to.slots[at].brick.store(b, std::memory_order_release);
    }
}

BrickField::Brick* BrickField::take_over(uint64_t key, ivec3 cell) const {
    const float side = kBrickVoxels * options_.voxel_size;
    const vec3 low{float(cell.x) * side, float(cell.y) * side, float(cell.z) * side};
    const Box3 box{low, low + vec3{side, side, side}};
    for (const Before& b : before_) {
        if (!b.changed.empty() && b.changed.overlaps(box)) return nullptr;  // as in all that were before
        Brick* brick = b.table->brick_of(key);
        if (brick == nullptr) continue;
        if (brick == far_cell()) return brick;
        brick->holders.fetch_add(1, std::memory_order_relaxed);
        taken_over_.fetch_add(1, std::memory_order_relaxed);
        return brick;
    }
    return nullptr;
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

BrickField::Slot* BrickField::find(uint64_t key, ivec3 cell) const {
    Table& table = *table_;
    const size_t mask = table.size() - 1;
    size_t at = size_t(key * 0x9e3779b97f4a7c15ull >> table.shift);
    for (int probe = 0; probe < kMostProbes; ++probe, at = (at + 1) & mask) {
        Slot& slot = table.slots[at];
        uint64_t there = slot.key.load(std::memory_order_relaxed);
        if (there == 0) {
            if (table.bricks.load(std::memory_order_relaxed) >= options_.most_bricks ||
                table.cells.load(std::memory_order_relaxed) >= room_)
                return nullptr;
            if (slot.key.compare_exchange_strong(there, key, std::memory_order_relaxed)) {
                table.cells.fetch_add(1, std::memory_order_relaxed);
                there = key;
            }
        }
        if (there != key) continue;
        const uint32_t now = generation_.load(std::memory_order_relaxed);
        if (slot.asked.load(std::memory_order_relaxed) != now) slot.asked.store(now, std::memory_order_relaxed);
        if (slot.brick.load(std::memory_order_acquire) != nullptr) return &slot;
        Brick* fresh = take_over(key, cell);
        if (fresh == nullptr) {
            auto made = std::make_unique<Brick>();
            fresh = make(cell, *made) ? made.release() : far_cell();
        }
        Brick* none = nullptr;
        if (!slot.brick.compare_exchange_strong(none, fresh, std::memory_order_acq_rel)) {
            let_go(fresh);  // another thread was first, with the same bits
        } else if (fresh != far_cell()) {
            table.bricks.fetch_add(1, std::memory_order_relaxed);
        }
        return &slot;
    }
    return nullptr;
}

const SdfField& BrickField::part(Slot& slot, ivec3 cell) const {
    const SdfField* p = slot.part.load(std::memory_order_acquire);
    if (p == nullptr) {
        const float side = kBrickVoxels * options_.voxel_size;
        const vec3 low{float(cell.x) * side, float(cell.y) * side, float(cell.z) * side};
        auto made = exact_->within(low + vec3{side, side, side} * 0.5f, side);
        const SdfField* fresh = made != nullptr ? made.release() : &no_part();
        if (slot.part.compare_exchange_strong(p, fresh, std::memory_order_acq_rel)) {
            p = fresh;
        } else if (fresh != &no_part()) {
            delete fresh;  // another thread was first, with the same bits
        }
    }
    return p != &no_part() ? *p : *exact_;
}

namespace {

struct Place {
    vec3 t;  // in voxels
    ivec3 texel, cell;
    bool near = false;  // enough to the origin for cells
};
Place place_of(vec3 p, float voxels_per_metre) {
    Place out;
    out.t = p * voxels_per_metre;
    constexpr float kMost = float(kMostCell * kBrickVoxels);
    out.near = std::abs(out.t.x) < kMost && std::abs(out.t.y) < kMost && std::abs(out.t.z) < kMost;
    if (!out.near) return out;
    out.texel = {floor_of(out.t.x), floor_of(out.t.y), floor_of(out.t.z)};
    out.cell = {cell_on_axis(out.texel.x), cell_on_axis(out.texel.y), cell_on_axis(out.texel.z)};
    return out;
}

}  // namespace

float BrickField::ask(vec3 p, vec3* gradient, Trail& trail) const {
    const auto by = [&](const SdfField& exact) {
        return gradient != nullptr ? exact.distance(p, *gradient) : exact.distance(p);
    };
    const Place at = place_of(p, voxels_per_metre_);
    if (!at.near) return by(*exact_);
    const uint64_t key = key_of(at.cell);
    if (key != trail.key) trail = {key, find(key, at.cell)};
    const Brick* b = nullptr;
    if (trail.place != nullptr) {
        Slot& slot = *static_cast<Slot*>(const_cast<void*>(trail.place));
        b = slot.brick.load(std::memory_order_acquire);
        if (b == far_cell()) return by(part(slot, at.cell));
    } else {  // no room: made for this question alone
        thread_local Brick scratch;
        if (!make(at.cell, scratch)) return by(*exact_);
        b = &scratch;
    }
    const ivec3 v{at.texel.x - at.cell.x * kBrickVoxels, at.texel.y - at.cell.y * kBrickVoxels,
                  at.texel.z - at.cell.z * kBrickVoxels};
    const float* d = b->distance.data() + (size_t(v.z) * 8 + size_t(v.y)) * 8 + size_t(v.x);
    const Corners c{d[0], d[1], d[8], d[9], d[64], d[65], d[72], d[73]};
    const vec3 in{at.t.x - float(at.texel.x), at.t.y - float(at.texel.y), at.t.z - float(at.texel.z)};
    if (gradient != nullptr) *gradient = trilinear_gradient(c, in) * voxels_per_metre_;
    return trilinear_value(c, in);
}

void BrickField::distances(std::span<const vec3> points, float* out, vec3* gradients, Trail& trail) const {
    for (size_t i = 0; i < points.size(); ++i) out[i] = ask(points[i], gradients + i, trail);
}

void BrickField::distances(const sdf::Points& points, float* out) const {
    Trail trail;
    for (int i = 0; i < points.count; ++i) out[i] = ask({points.x[i], points.y[i], points.z[i]}, nullptr, trail);
}

void BrickField::measure(std::span<const vec3> points, float* out, vec3* gradients, Trail& trail) const {
    for (size_t first = 0; first < points.size();) {
        // A run of points of one cell.
        const Place at = place_of(points[first], voxels_per_metre_);
        size_t last = first + 1;
        const auto in_cell = [&](const Place& next) { return next.near && next.cell == at.cell; };
        while (at.near && last < points.size() && in_cell(place_of(points[last], voxels_per_metre_))) ++last;
        const SdfField* exact = exact_.get();
        if (at.near) {
            const uint64_t key = key_of(at.cell);
            if (key != trail.key) trail = {key, find(key, at.cell)};
            if (trail.place != nullptr) exact = &part(*static_cast<Slot*>(const_cast<void*>(trail.place)), at.cell);
        }
        exact->distances(points.subspan(first, last - first), out + first, gradients + first);
        first = last;
    }
}

}  // namespace kiln::field
