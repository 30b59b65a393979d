// SPDX-License-Identifier: MIT
#include "sdf/edit_index.h"

#include "random_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace kiln::sdf {
namespace {

IndexedEdit random_edit(Random& r, uint32_t row) {
    IndexedEdit e;
    e.row = row;
    const float spread = r.below(10) == 0 ? 1e4f : 10;
    const vec3 middle = r.point(spread), half{r.in(0.01f, 2), r.in(0.01f, 2), r.in(0.01f, 2)};
    e.solid = {middle - half, middle + half};
    if (r.below(30) == 0) e.solid.max.x = INFINITY;
    if (r.below(3) == 0) e.reach = r.in(0, 1);
    e.bulge = 0.25f * e.reach;
    e.slowness = r.below(4) == 0 ? r.in(1, 4) : 1;
    e.adds = r.below(3) != 0;
    e.everywhere = r.below(40) == 0;
    return e;
}

std::vector<uint32_t> brute(const std::map<uint32_t, IndexedEdit>& all, const Box3& box, float value) {
    std::vector<uint32_t> out;
    for (const auto& [row, e] : all) {
        if (e.everywhere || !e.solid.finite() || e.influence(value).overlaps(box)) out.push_back(row);
    }
    return out;
}

void expect_finds(const EditIndex& index, const std::map<uint32_t, IndexedEdit>& all, Random& r) {
    EXPECT_EQ(index.size(), all.size());
    for (int i = 0; i < 20; ++i) {
        const vec3 middle = r.point(r.below(4) == 0 ? 1e4f : 11);
        const Box3 box = Box3{middle, middle}.inflated(r.in(0, 3));
        const float value = r.in(0, 1);
        std::vector<uint32_t> rows;
        index.find(box, value, rows);
        std::sort(rows.begin(), rows.end());
        ASSERT_EQ(rows, brute(all, box, value));
    }
    std::vector<uint32_t> rows;
    index.all(rows);
    EXPECT_EQ(rows.size(), all.size());
    for (const auto& [row, e] : all) {
        if (!e.solid.finite()) continue;
        const Box3 has = e.adds ? index.solids() : index.others();
        if (!e.everywhere || !e.adds) {
            EXPECT_TRUE(box_union(has, e.solid.inflated(e.bulge)) == has) << row;
        }
        EXPECT_GE(index.largest_reach(), e.reach);
    }
}

TEST(EditIndex, FindsWhatABruteSearchFindsAfterRandomChangesAndSnapshotsStay) {
    for (uint32_t seed = 0; seed < 6; ++seed) {
        Random r(seed);
        EditIndex index, snapshot;
        std::map<uint32_t, IndexedEdit> all, all_then;
        for (uint32_t step = 0; step < 900; ++step) {
            const bool add = all.empty() || r.below(5) < (step < 500 ? 4 : 1);
            if (add) {
                const IndexedEdit e = random_edit(r, step);
                index.insert(e);
                all.emplace(step, e);
            } else {
                const auto victim = std::next(all.begin(), r.below(int(all.size())));
                index.remove(victim->second);
                all.erase(victim);
            }
            if (step == 450) {
                snapshot = index;
                all_then = all;
            }
            if (step % 150 == 149) expect_finds(index, all, r);
        }
        expect_finds(snapshot, all_then, r);
        while (!all.empty()) {
            index.remove(all.begin()->second);
            all.erase(all.begin());
        }
        EXPECT_EQ(index.size(), 0u);
        EXPECT_TRUE(index.solids().empty());
    }
}

// Centres on the borders of octants, of the root's own cube too, before and after it grows.
TEST(EditIndex, WhatLiesOnBordersOfOctantsIsFoundAgain) {
    for (const float start : {1.0f, 16.0f}) {
        EditIndex index;
        std::map<uint32_t, IndexedEdit> all;
        uint32_t row = 0;
        for (float at = start; at <= 64 * start; at *= 2) {
            for (const float sign : {1.0f, -1.0f}) {
                for (uint32_t i = 0; i < 40; ++i, ++row) {
                    IndexedEdit e;
                    e.row = row;
                    const float middle = sign * at, across = i % 2 == 0 ? middle : float(i) - 20;
                    e.solid = {vec3{middle, across, across} - vec3{0.2f}, vec3{middle, across, across} + vec3{0.2f}};
                    e.adds = true;
                    all[row] = e;
                    index.insert(e);
                }
            }
        }
        for (const auto& [number, e] : all) index.remove(e);
        EXPECT_EQ(index.size(), 0u);
    }
}

TEST(EditIndex, TheAllowanceIsForBlendsThatAreNearAndNoMoreThanSixRadii) {
    EditIndex index;
    const auto edit = [](uint32_t row, float at, float reach) {
        IndexedEdit e;
        e.row = row;
        e.solid = {{at - 1, -1, -1}, {at + 1, 1, 1}};
        e.reach = reach;
        return e;
    };
    index.insert(edit(0, 0, 0));
    const Box3 here{{-1, -1, -1}, {1, 1, 1}};
    EXPECT_EQ(index.blend_allowance(here, 0.5f), 0.0f);
    index.insert(edit(1, 2, 0.4f));
    EXPECT_FLOAT_EQ(index.blend_allowance(here, 0.5f), 0.4f);
    EXPECT_EQ(index.blend_allowance(here, 0.5f, 1), 0.0f);
    index.insert(edit(2, 100, 3));
    EXPECT_FLOAT_EQ(index.blend_allowance(here, 0.5f), 0.4f) << "far away";
    for (uint32_t i = 3; i < 20; ++i) index.insert(edit(i, 1, 0.4f));
    EXPECT_FLOAT_EQ(index.blend_allowance(here, 0.5f), 2.4f);
}

}  // namespace
}  // namespace kiln::sdf
