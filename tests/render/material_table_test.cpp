// SPDX-License-Identifier: MIT
// One row for materials of the same bytes, and no write that the device does not need.
#include "gpu_worlds.h"

#include "render/gpu_materials.h"

#include <array>
#include <cstring>
#include <map>
#include <set>

namespace kiln::render {
namespace {

using Bytes = std::array<std::byte, sizeof(MaterialRecord)>;

Bytes bytes_of(const MaterialRecord& record) {
    Bytes out;
    std::memcpy(out.data(), &record, sizeof record);
    return out;
}

MaterialRecord of(float red) {
    return {.base_red = red,
            .base_green = 0.5f,
            .base_blue = 0.25f,
            .roughness = 1,
            .emissive_red = 0,
            .emissive_green = 0,
            .emissive_blue = 0,
            .metallic = 0};
}

std::vector<uint32_t> rows_of(const MaterialTable& table) {
    std::vector<uint32_t> out;
    for (uint32_t i = 0; i < table.numbers(); ++i) out.push_back(table.row_of(i));
    return out;
}

TEST(MaterialTable, EqualMaterialsShareARowAndNumbersStayApart) {
    MaterialTable table;
    table.update(std::vector{of(0), of(1), of(0), of(1), of(0)});
    EXPECT_EQ(rows_of(table), (std::vector<uint32_t>{0, 1, 0, 1, 0}));
    EXPECT_EQ(table.rows(), 2u);
    EXPECT_EQ(table.rows_written(), 2u);
    // One of them becomes another: those that shared its row keep theirs.
    table.update(std::vector{of(0), of(1), of(2), of(1), of(0)});
    EXPECT_EQ(rows_of(table), (std::vector<uint32_t>{0, 1, 2, 1, 0}));
    EXPECT_EQ(table.rows_written(), 1u);
    // Only it has its row, which stays its own; nothing is written of the number.
    table.update(std::vector{of(0), of(1), of(3), of(1), of(0)});
    EXPECT_EQ(rows_of(table), (std::vector<uint32_t>{0, 1, 2, 1, 0}));
    ASSERT_EQ(table.changed().size(), 1u);
    EXPECT_EQ(table.changed()[0].first, 2u);
    EXPECT_EQ(table.changed()[0].end, 3u);
    // Also where a lower one is free.
    table.update(std::vector{of(1), of(1), of(3), of(1), of(1)});
    table.update(std::vector{of(1), of(1), of(4), of(1), of(1)});
    EXPECT_EQ(rows_of(table), (std::vector<uint32_t>{1, 1, 2, 1, 1}));
    EXPECT_EQ(table.changed().size(), 1u);
}

TEST(MaterialTable, WhatIsThereAlreadyIsNotWritten) {
    MaterialTable table;
    const std::vector a{of(0), of(1), of(2)};
    table.update(a);
    table.update(a);
    EXPECT_EQ(table.rows_written(), 0u);
    EXPECT_TRUE(table.changed().empty());
    table.update(std::vector{of(2), of(0), of(1)});  // the same, under other numbers
    EXPECT_EQ(table.rows_written(), 0u);
    EXPECT_EQ(rows_of(table), (std::vector<uint32_t>{2, 0, 1}));
    table.update(std::vector{of(2)});
    table.update(std::vector{of(2), of(0), of(1)});  // nobody took their rows
    EXPECT_EQ(table.rows_written(), 0u);
    EXPECT_EQ(table.rows(), 3u);
    // Bytes, not values: what tells 0 from -0 may be told.
    table.update(std::vector{of(2), of(-0.0f), of(0)});
    EXPECT_EQ(table.rows(), 3u);
    EXPECT_EQ(table.rows_written(), 1u);
}

uint64_t always_one(const MaterialRecord&) { return 1; }

// A device that gets only what is said to have changed; few kinds of materials, so that many share and many come back.
void check_against_a_device(MaterialTable table) {
    field::worlds::Random random{7};
    std::vector<MaterialEntry> device;
    std::vector<MaterialRecord> records;
    for (int step = 0; step < 300; ++step) {
        const std::vector<MaterialRecord> before = records;
        const std::vector<uint32_t> rows_before = rows_of(table);
        if (random.below(4) == 0) records.resize(size_t(random.below(24)), of(0));
        for (int k = random.below(4); k > 0 && !records.empty(); --k)
            records[size_t(random.below(int(records.size())))] = of(float(random.below(30)));
        table.update(records);
        device.resize(table.entries().size(), {.row_of_number = 0xdeadu, .row = of(-1)});
        for (const MaterialTable::Range& r : table.changed())
            for (uint32_t i = r.first; i < r.end; ++i) device[i] = table.entries()[i];
        std::map<Bytes, uint32_t> rows;
        std::set<Bytes> were, comes;
        for (const MaterialRecord& record : before) were.insert(bytes_of(record));
        for (uint32_t i = 0; i < records.size(); ++i) {
            const uint32_t row = device[i].row_of_number;
            ASSERT_LT(row, device.size()) << "step " << step;
            ASSERT_EQ(bytes_of(device[row].row), bytes_of(records[i])) << "step " << step << " number " << i;
            ASSERT_EQ(rows.emplace(bytes_of(records[i]), row).first->second, row) << "step " << step;
            if (i < before.size() && bytes_of(before[i]) == bytes_of(records[i])) {
                ASSERT_EQ(row, rows_before[i]) << "step " << step << ": a row of what did not change has moved";
            }
            if (!were.contains(bytes_of(records[i]))) comes.insert(bytes_of(records[i]));
        }
        ASSERT_EQ(table.rows(), rows.size()) << "step " << step;
        ASSERT_LE(table.rows_written(), comes.size()) << "step " << step;
        ASSERT_LE(table.entries().size(), 24u);
    }
}

TEST(MaterialTable, ADeviceThatGetsOnlyWhatChangedHasEveryMaterial) { check_against_a_device(MaterialTable()); }

TEST(MaterialTable, EqualHashesAreNotTakenForEqualMaterials) { check_against_a_device(MaterialTable(always_one)); }

class MaterialTableGpu : public GpuTest {};

TEST_F(MaterialTableGpu, TheDeviceHoldsTheTableAndAStillFrameWritesNothing) {
    GpuMaterials materials(*runner_);
    std::vector<MaterialRecord> records{of(0), of(1), of(0)};
    const auto check = [&](uint64_t written) {
        rhi::must(materials.update(records));
        EXPECT_EQ(materials.bytes_written(), written);
        Graph g(*runner_);
        const Readback back = g.readback(materials.import(g));
        rhi::must(runner_->execute(g));
        const auto device = rhi::must(back.get_as<MaterialEntry>());
        for (size_t i = 0; i < records.size(); ++i)
            EXPECT_EQ(bytes_of(device[device[i].row_of_number].row), bytes_of(records[i])) << i;
    };
    check(3 * sizeof(MaterialEntry));
    check(0);
    records[1] = of(2);
    check(sizeof(MaterialEntry));
    for (int i = 0; i < 100; ++i) records.push_back(of(float(i % 5)));  // beyond the buffer's room
    check(103 * sizeof(MaterialEntry));
    EXPECT_EQ(materials.table().rows(), 5u);
    records[50] = of(9);
    check(2 * sizeof(MaterialEntry));  // its number's, and the row that it takes
    records[50] = of(3);
    check(sizeof(MaterialEntry));
}

// 0 and -0 are two rows, and shade alike.
TEST(MaterialTableGpuPictures, AreTheSameBytesWhetherMaterialsShareARowOrNot) {
    const auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP() << "no Vulkan device";
    Frame frame = frame_of(field::worlds::blends());
    const auto shown = [&](float red_of_second, View view) {
        for (size_t i = 1; i < 5; ++i)
            frame.materials[i] = {.base_color = {i % 2 == 0 ? red_of_second : 0.0f, 0.4f, 0.8f}};
        auto picture = renderer->render(frame, {.width = 40, .height = 30, .view = view});
        EXPECT_TRUE(picture) << picture.error().message;
        return picture ? picture->srgb : std::vector<uint8_t>();
    };
    for (const View view : {View::Albedo, View::Shaded}) {
        const auto shared = shown(0, view);
        EXPECT_EQ(shown(-0.0f, view), shared);
        EXPECT_NE(shown(1, view), shared);
        EXPECT_EQ(shown(0, view), shared);
    }
}

}  // namespace
}  // namespace kiln::render
