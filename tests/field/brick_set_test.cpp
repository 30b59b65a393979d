// SPDX-License-Identifier: MIT
// Starts threads.
#include "field/brick_set.h"

#include "sdf/place.h"
#include "worlds.h"

#include <gtest/gtest.h>

namespace kiln::field {
namespace {

using worlds::compiled;
using worlds::edit;

TEST(BrickSet, HowFarMaterialsBlendMakesItNoLarger) {
    std::vector<Edit> edits{edit(Sphere{.radius = 0.5f}), edit(Sphere{.radius = 0.5f}, {0.6f, 0, 0})};
    const Box3 plain = sdf::solid_box(*compiled(edits));
    edits[0].material_blend_radius = 1000;
    edits[1].material_blend_radius = 2000;
    const auto object = compiled(edits);
    const Box3 box = sdf::solid_box(*object);
    EXPECT_EQ(box.min, plain.min);
    EXPECT_EQ(box.max, plain.max);
    auto made = BrickSet::make(object, BrickSet::voxel_size_for(*object, 0.05f));
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_LT((*made)->field().cells().words().size(), 4096u);
}

TEST(BrickSet, WhatIsBlendedFarBeyondItsPartsHasNoMoreThanTheMostVoxels) {
    const auto object =
        compiled({edit(Sphere{.radius = 0.5f}), edit(Sphere{.radius = 0.5f}, {0.6f, 0, 0}, Op::Union, 1000)});
    auto made = BrickSet::make(object, BrickSet::voxel_size_for(*object, 0.05f));
    ASSERT_TRUE(made) << made.error().message;
    const Box3 box = (*made)->box();
    EXPECT_GT(box.max.x, 1000);
    EXPECT_LE(box.max.x - box.min.x, (BrickSet::kMostVoxels + 8) * (*made)->voxel_size());
}

}  // namespace
}  // namespace kiln::field
