// SPDX-License-Identifier: MIT
// Loose parts: what a change of the solid cut off from the rest. Connection is looked at on a lattice, and only near the change and along
// what it cut: solid points, six neighbours each. Parts that hung together before and do not now are walked side by side; those whose
// walk ends while another goes on, or is larger, are loose. What is larger than `most_points` counts as the world, which stays.
//
// A part is a region, a mask of lattice points with its distance, whose border lies in air: the part is what of the solid lies in it, the
// rest what lies outside. So both keep their exact surface.
#pragma once

#include "field/sdf_field.h"
#include "field/words.gpu.h"

#include <vector>

namespace kiln::field {

/// Lattice points, `inside` by (z * size.y + y) * size.x + x; the outermost are outside.
struct RegionMask {
    ivec3 first, size;
    float voxel_size = 0;
    std::vector<bool> inside;
};

/// Distance to a mask, each point with its voxel around it; trilinear between samples, divided by its steepest slope. Any thread.
class RegionField final : public SdfField {
public:
    explicit RegionField(const RegionMask& mask);

    float distance(vec3 p) const override;
    float distance(vec3 p, vec3& gradient) const override;
    void distances(const sdf::Points& points, float* out) const override;
    Box3 bounds() const override { return box_; }  ///< of the samples
    const std::vector<float>& samples() const { return samples_; }

private:
    vec3 low_;
    ivec3 size_;
    float voxel_size_;
    Box3 box_;
    std::vector<float> samples_;
};

struct LoosePart {
    RegionMask region;
    Box3 box;           ///< of its points, a voxel around it
    size_t points = 0;  ///< lattice points in it
};

struct LooseOptions {
    float voxel_size = 0.1f;       ///< of the lattice, metres
    size_t most_points = 1 << 18;  ///< a part may have
    size_t most_looked_at =
        1 << 22;              ///< lattice points of the change; larger ones (and endless ones) cut nothing loose
    size_t least_points = 8;  ///< smaller parts are crumbs: they go with the world
    int workers = 0;          ///< threads that look at the change, 0 for every core
};
/// The largest of the parts that were one before stays. By place: the part with the least first point first.
std::vector<LoosePart> loose_parts(const SdfField& before, const SdfField& after, const Box3& changed,
                                   const LooseOptions& options);

}  // namespace kiln::field
