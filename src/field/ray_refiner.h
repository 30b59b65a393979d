// SPDX-License-Identifier: MIT
// Rays looked at once more with the bricks' own code. Texels a voxel apart cut what is convex: where a ray only just meets a solid, at its
// outline, the trilinear march passes it by, and elsewhere it arrives a little late. So each hit is moved along its ray to where the code has
// the surface; and the two voxels with a solid corner that a ray passed closest, and left again, are searched for a surface that the texels lost.
// Code is evaluated for all rays of a block that look at one brick together, so what a ray costs depends on its neighbours, and what it finds
// does not.
#pragma once

#include "field/field.h"
#include "field/wide.h"

#include <array>
#include <span>

namespace kiln::field {

class RayRefiner {
public:
    static constexpr int kMostRays = 1024;

    RayRefiner(const Field& field, sdf::Isa isa) : field_(field), isa_(isa) {}

    /// `hits` and `notes` are what wide_march() found of `rays`, kMostRays at most. Slots of hits are filled in.
    void run(std::span<const WideRay> rays, std::span<MarchHit> hits, std::span<const RayNote> notes);

private:
    // A brick that rays look at, and those rays: first the one that came last; -1: none. Number k of a ray's passes is 2 * ray + k.
    struct Brick {
        ivec3 cell;
        uint32_t slot;
        std::span<const sdf::Instruction> code;
        int passed_by, hit_by;
    };

    int brick_at(ivec3 cell);
    void search(const Brick& brick);
    void polish(const Brick& brick);
    void polish_all(const Brick& brick, int count);
    std::array<float, 3> in_brick(const Brick& brick, int ray, float t) const;
    void evaluate(const Brick& brick, int count);

    const Field& field_;
    sdf::Isa isa_;

    // Of the block at hand:
    std::span<const WideRay> rays_;
    std::span<MarchHit> hits_;
    std::span<const RayNote> notes_;
    static constexpr int kMostBricks = 3 * kMostRays;
    std::array<Brick, kMostBricks> bricks_;
    int brick_count_ = 0, last_ = 0;
    static constexpr int kRemembered = 256;
    std::array<int16_t, kRemembered> remembered_;  // bricks by a hash of the cell; -1: none
    // The next ray that passed by, or hit, the same brick. A hit that the search found: where, and how values fall there.
    std::array<int16_t, 2 * size_t(kMostRays)> next_passed_;
    std::array<int16_t, kMostRays> next_hit_;
    struct Found {
        int pass;  // -1: none
        float slope;
        std::array<float, 3> in_brick;
    };
    std::array<Found, kMostRays> found_;

    RayPolish polish_;
    std::array<int, RayPolish::kMost> polished_;

    // Points and the code's values there, metres.
    static constexpr int kLooks = 64;
    struct Looks {
        alignas(64) std::array<float, kLooks> x{}, y{}, z{}, d{};
    } looks_;
};

}  // namespace kiln::field
