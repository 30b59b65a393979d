// SPDX-License-Identifier: MIT
// BrickField: a field as bodies touch it. Near the surface its distances are read from host bricks of one voxel size, made where
// somebody asks and kept; far from it, and far from the origin, the exact field answers. What a point is told is a function of
// that field, voxel size and point alone, whoever asked before and whatever is kept: so steps do not depend on threads, cameras or budgets.
//
// A brick here has the values of its 8x8x8 texels as floats in metres, cut off nowhere: bodies ask deeper and farther than pictures do.
// Between texels values are trilinear, so they may exceed the true distance by 0.8661 voxel (docs/architecture.md): contacts are found
// by them, casts advance by the exact field.
#pragma once

#include "field/brick.gpu.h"
#include "field/sdf_field.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace kiln::field {

struct BrickFieldOptions {
    float voxel_size = 0.02f;      ///< metres, > 0
    float near = 0.1f;             ///< metres: cells that may hold a value as small as this have bricks
    size_t most_bricks = 1 << 16;  ///< kept at a time, 2 KiB each; what is asked beyond is made anew each time
};

/// All functions but renewed() and after(): any thread.
class BrickField final : public SdfField {
public:
    BrickField(std::shared_ptr<const SdfField> exact, const BrickFieldOptions& options);
    /// Of a bounded body: voxels of at most `most_voxel`, and 32 across its least extent; bricks all around it.
    static std::shared_ptr<const BrickField> of_body(std::shared_ptr<const SdfField> exact, float most_voxel);
    /// The field of `exact`, whose solid differs from this one's in `changed` only. Bricks that stay what they were are taken over when
    /// somebody asks for them, from this one's table and from up to eight before it: an edit copies nothing.
    std::shared_ptr<const BrickField> after(std::shared_ptr<const SdfField> exact, const Box3& changed) const;

    float distance(vec3 p) const override {
        Trail trail;
        return ask(p, nullptr, trail);
    }
    float distance(vec3 p, vec3& gradient) const override {
        Trail trail;
        return ask(p, &gradient, trail);
    }
    float distance(vec3 p, vec3& gradient, Trail& trail) const override { return ask(p, &gradient, trail); }
    void distances(std::span<const vec3> points, float* out, vec3* gradients) const override {
        Trail trail;
        distances(points, out, gradients, trail);
    }
    void distances(std::span<const vec3> points, float* out, vec3* gradients, Trail& trail) const override;
    /// The exact field's bits, by the part of it that matters in the cell.
    void measure(std::span<const vec3> points, float* out, vec3* gradients, Trail& trail) const override;
    void distances(const sdf::Points& points, float* out) const override;
    uint32_t material(vec3 p) const override { return exact_->material(p); }
    Box3 bounds() const override { return exact_->bounds(); }
    /// Half a voxel at corners and edges of right angles; less than the square of a voxel over 8 radii where the surface is smooth.
    float error() const override { return 0.5f * options_.voxel_size; }
    std::shared_ptr<const SdfField> renewed() const override;

    const SdfField& exact() const { return *exact_; }
    float voxel_size() const { return options_.voxel_size; }
    size_t brick_count() const { return table_->bricks.load(std::memory_order_relaxed); }
    /// Those of them that are an earlier field's.
    size_t taken_over() const { return taken_over_.load(std::memory_order_relaxed); }

private:
    struct Room {
        size_t cells;
    };

public:
    /// Of after() and renewed(), whose tables grow with what is asked.
    BrickField(std::shared_ptr<const SdfField> exact, const BrickFieldOptions& options, Room room);

private:
    struct alignas(64) Brick {
        std::atomic<uint32_t> holders{1};  // tables
        std::array<float, kBrickTexelCount> distance;
    };
    // Open addressing. A key is claimed first, then its brick published; nothing is ever taken out.
    struct Slot {
        std::atomic<uint64_t> key{0};
        std::atomic<Brick*> brick{nullptr};
        std::atomic<const SdfField*> part{nullptr};  // of the exact field, once somebody measured here
        std::atomic<uint32_t> asked{0};              // last generation in which someone did
    };
    struct Table {
        explicit Table(size_t slots);
        ~Table();
        Table(const Table&) = delete;
        Table& operator=(const Table&) = delete;
        size_t size() const { return size_t(1) << (64 - shift); }
        Brick* brick_of(uint64_t key) const;  // null for none
        std::unique_ptr<Slot[]> slots;
        int shift;
        std::atomic<size_t> bricks = 0, cells = 0;
    };
    // What was before, the youngest first; its bricks in `changed` (empty: none) are those of another solid.
    struct Before {
        std::shared_ptr<const Table> table;
        Box3 changed;
    };
    float ask(vec3 p, vec3* gradient, Trail& trail) const;
    /// The slot of a cell, its brick made; null where there is no room for either.
    Slot* find(uint64_t key, ivec3 cell) const;
    /// Of the exact field, in a cell.
    const SdfField& part(Slot& slot, ivec3 cell) const;
    bool make(ivec3 cell, Brick& out) const;
    /// Of those before; null for none. Held once more.
    Brick* take_over(uint64_t key, ivec3 cell) const;
    void adopt(const BrickField& old, uint32_t asked_since);
    static Brick* far_cell();
    static const SdfField& no_part();
    static void let_go(Brick* brick);

    std::shared_ptr<const SdfField> exact_;
    BrickFieldOptions options_;
    float voxels_per_metre_;
    std::shared_ptr<Table> table_;
    std::vector<Before> before_;
    size_t room_;  // cells the table takes
    mutable std::atomic<size_t> taken_over_ = 0;
    mutable std::atomic<uint32_t> generation_ = 1;
};

}  // namespace kiln::field
