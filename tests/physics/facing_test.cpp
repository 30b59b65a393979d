// SPDX-License-Identifier: MIT

#include "physics/facing.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace kiln::physics {
namespace {

TEST(Facing, DirectionsMoreThanFiveDegreesApartHaveDifferentNumbers) {
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    const auto direction = [&] { return normalize(vec3{normal(random), normal(random), normal(random)}); };
    const float most = 0.9962f, least = 0.9903f;  // cosines of 5 and 8 degrees
    int pairs = 0;
    while (pairs < 200000) {
        const vec3 a = direction(), b = normalize(a + direction() * 0.11f);
        if (!(dot(a, b) < most) || dot(a, b) < least) continue;
        ++pairs;
        ASSERT_NE(facing(a), facing(b)) << a.x << ' ' << a.y << ' ' << a.z << " and " << b.x << ' ' << b.y << ' '
                                        << b.z;
    }
}

TEST(Facing, NumbersFitTheirBitsOnEveryAxisAndEdge) {
    std::set<uint32_t> numbers;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x || y || z) numbers.insert(facing({float(x), float(y), float(z)}));
    EXPECT_GE(numbers.size(), 26u);
    EXPECT_LT(*numbers.rbegin(), 1u << kFacingBits);
}

}  // namespace
}  // namespace kiln::physics
