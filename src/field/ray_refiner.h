// SPDX-License-Identifier: MIT
// Rays looked at once more with the bricks' own code. Texels a voxel apart cut what is convex: where a ray only just meets a solid, at its
// outline, the trilinear march passes it by, and elsewhere it arrives a little late. So each hit is moved along its ray to where the code has
// the surface; and the one voxel with a solid corner that a ray passed closest, and left again, is searched for a surface that the texels lost.
// Code is evaluated for all rays of a block that look at one brick together, so what a ray costs depends on its neighbours, and what it finds
// does not.
#pragma once

#include "field/field.h"
#include "field/wide.h"

#include <span>
#include <vector>

namespace kiln::field {

class RayRefiner {
public:
    RayRefiner(const Field& field, const WideRays& rays, std::span<MarchHit> hits, sdf::Isa isa);

    /// `hits` and `passes` are what wide_march() found; slots of hits are known.
    void run(std::span<const NearPass> passes);

private:
    // Points along rays and the code's values there, voxels.
    static constexpr int kLooks = 64;
    struct Looks {
        alignas(64) float x[kLooks], y[kLooks], z[kLooks], d[kLooks];
    };
    struct Target {
        int ray;
        uint32_t slot;
        int next;  // of the same brick; -1: none
        float from, to;
    };

    void collect(int ray, uint32_t slot, float from, float to);
    template <int kMost, typename Fn>
    void each_brick(Fn&& fn);
    void search(uint32_t slot, std::span<const Target*> passes);
    void polish(uint32_t slot, std::span<const Target*> found);
    void place(int ray, float t);
    void look(size_t to, int ray, float t);
    void evaluate(uint32_t slot);

    const Field& field_;
    const WideRays& rays_;
    std::span<MarchHit> hits_;
    sdf::Isa isa_;
    Looks looks_{};
    std::vector<Target> targets_;
    std::vector<int> firsts_;  // of targets_, one a brick
};

}  // namespace kiln::field
