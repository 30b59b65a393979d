// SPDX-License-Identifier: MIT
// Regions as text and as shapes.
#include "scene/region.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

using namespace kiln;
using namespace kiln::scene;
using testing::HasSubstr;

namespace {

// A blob of `share` of the points, the outermost outside.
field::RegionMask random_mask(uint32_t seed, field::ivec3 size, float share) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    field::RegionMask out{{int(rng() % 50) - 25, -7, int(rng() % 9)}, size, 0.05f, {}};
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x)
                out.inside.push_back(x > 0 && y > 0 && z > 0 && x + 1 < size.x && y + 1 < size.y && z + 1 < size.z &&
                                     uniform(rng) < share);
    return out;
}

TEST(Regions, ReadBackAsTheyWereWritten) {
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const auto mask = random_mask(seed, {3 + int(seed % 5), 3 + int(seed % 7), 40}, float(seed % 5) / 4);
        const std::string text = region_text(mask);
        EXPECT_TRUE(is_region(text));
        const auto read = read_region(text);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->inside, mask.inside) << seed;
        EXPECT_EQ(read->first, mask.first);
        EXPECT_EQ(read->size, mask.size);
        EXPECT_EQ(read->voxel_size, mask.voxel_size);
    }
}

TEST(Regions, WhatIsNoRegionIsToldAndNothingIsMadeOfIt) {
    const std::string good = region_text(random_mask(1, {4, 5, 6}, 0.5f));
    ASSERT_TRUE(read_region(good));
    for (size_t cut = 7; cut < good.size(); ++cut) EXPECT_FALSE(read_region(good.substr(0, cut))) << cut;
    EXPECT_FALSE(read_region(good + "AAAAAAAA"));
    EXPECT_FALSE(read_region(good.substr(0, good.size() - 1) + "*"));
    for (const char* text :
         {"region:", "region:0:0,0,0:2,2,2:I", "region:nan:0,0,0:2,2,2:I", "region:1:0,0:2,2,2:I",
          "region:1:0,0,0:0,2,2:", "region:1:0,0,0:100000,100000,100000:I", "region:1:0,0,0:1,1,1000000:I",
          "region:1:99999999,0,0:2,2,2:I", "region:1:0,0,0:2,2,2:////////", "region:1:0,0,0:-2,2,2:I"})
        EXPECT_FALSE(read_region(text)) << text;
    // In a scene it is an error with its place.
    const auto world = World::parse(R"({"format": 1,
 "edits": [{"id": "e", "shape": "mesh", "file": "region:1:0,0,0:2,2,2:*"}]})",
                                    "s.kiln.json");
    ASSERT_FALSE(world);
    EXPECT_THAT(world.error().message, testing::AllOf(HasSubstr("s.kiln.json:2:"), HasSubstr("region")));
}

TEST(Regions, AShapeHasTheDistanceOfTheMask) {
    for (const float share : {0.9f, 0.3f}) {
        const auto mask = random_mask(7, {17, 12, 23}, share);
        const field::RegionField field(mask);
        auto world = World::parse(
            R"({"format": 1, "edits": [{"id": "e", "shape": "mesh", "file": ")" + region_text(mask) + R"("}]})",
            "s.kiln.json");
        ASSERT_TRUE(world) << world.error().message;
        std::mt19937 rng(3);
        const Box3 box = field.bounds().inflated(0.3f);
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        const auto place = [&] {
            return vec3{uniform(box.min.x, box.max.x), uniform(box.min.y, box.max.y), uniform(box.min.z, box.max.z)};
        };
        int inside = 0;
        for (int i = 0; i < 4000; ++i) {
            const vec3 p = place();
            const float d = world->distance(p);
            if (field.bounds().contains(p)) {
                EXPECT_NEAR(d, field.distance(p), 2e-5f);
                inside += d < 0;
            } else {
                EXPECT_GT(d, 0);
            }
            const vec3 q = p + vec3{uniform(-0.1f, 0.1f), uniform(-0.1f, 0.1f), uniform(-0.1f, 0.1f)};
            EXPECT_LE(std::abs(d - world->distance(q)), length(p - q) * 1.001f + 1e-5f);
        }
        EXPECT_GT(inside, 100);
        EXPECT_EQ(World::parse(world->to_json(), "s.kiln.json")->to_json(), world->to_json());
    }
}

}  // namespace
