// SPDX-License-Identifier: MIT
#include "field/solid.h"

#include "field/codes.gpu.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

namespace kiln::field {
namespace {

TEST(Solid, RowsAndBoxNameTheVoxelsWithASolidCorner) {
    std::mt19937 random(5);
    for (int round = 0; round < 400; ++round) {
        const int texel_bytes = 1 + round % 2;
        const uint32_t rarity = round % 5 == 0 ? 30 : round % 5 == 1 ? 1000000 : 400;  // many, none, a few
        std::vector<std::byte> codes(size_t(kBrickTexelCount * texel_bytes));
        std::vector<float> values(kBrickTexelCount);
        for (size_t i = 0; i < values.size(); ++i) {
            const float d = random() % rarity == 0 ? -1.0f : random() % (3 * rarity) == 0 ? 0.0f : 2.0f;
            const uint32_t code = texel_bytes == 2 ? half_code(d) : snorm8_code(d);
            std::memcpy(codes.data() + i * size_t(texel_bytes), &code, size_t(texel_bytes));
            values[i] = d;
        }
        const auto texels = solid_texels(codes.data(), texel_bytes);
        for (size_t i = 0; i < values.size(); ++i) EXPECT_EQ((texels[i / 64] >> i % 64 & 1) != 0, values[i] <= 0);
        SolidRows rows;
        rows.fill(0xff);
        const uint32_t box = solid_voxels(texels, rows);
        ivec3 first{7, 7, 7}, last{-1, -1, -1};
        for (int v = 0; v < 343; ++v) {
            const int x = v % 7, y = v / 7 % 7, z = v / 49;
            bool solid = false;
            for (int c = 0; c < 8; ++c)
                solid = solid || values[size_t(((z + (c >> 2)) * 8 + y + (c >> 1 & 1)) * 8 + x + (c & 1))] <= 0;
            ASSERT_EQ((rows[size_t(z * 8 + y)] >> x & 1) != 0, solid) << x << " " << y << " " << z;
            if (!solid) continue;
            first = {std::min(first.x, x), std::min(first.y, y), std::min(first.z, z)};
            last = {std::max(last.x, x), std::max(last.y, y), std::max(last.z, z)};
        }
        ASSERT_EQ(box, last.x < 0 ? kNoSolidBox : solid_box(first, last)) << "round " << round;
    }
}

}  // namespace
}  // namespace kiln::field
