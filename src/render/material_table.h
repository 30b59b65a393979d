// SPDX-License-Identifier: MIT
// Materials by number, those of the same bytes in one row. Numbers stay apart: bricks, blends and views know nothing of rows. A row keeps its
// number while some material has it, and its bytes until another takes it, so that a material that comes back is often there still.
#pragma once

#include "render/passes/materials.gpu.h"

#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace kiln::render {

class MaterialTable {
public:
    using Hash = uint64_t (*)(const MaterialRecord&);
    static uint64_t hash_of_bytes(const MaterialRecord& record);
    // Equal hashes are not taken for equal bytes.
    explicit MaterialTable(Hash hash = hash_of_bytes) : hash_(hash) {}

    // Makes it that of `records`, by number.
    void update(std::span<const MaterialRecord> records);

    std::span<const MaterialEntry> entries() const { return entries_; }  // at least as many as there are numbers
    uint32_t row_of(uint32_t number) const { return entries_[number].row_of_number; }
    uint32_t numbers() const { return numbers_; }
    uint32_t rows() const { return rows_in_use_; }  // that some number has

    // What the last update() changed: ascending, [first, end).
    struct Range {
        uint32_t first, end;
    };
    std::span<const Range> changed() const { return changed_; }
    uint32_t rows_written() const { return rows_written_; }  // by the last update()

private:
    static constexpr uint32_t kNone = UINT32_MAX;
    uint32_t find(const MaterialRecord& record, uint64_t hash) const;
    void give(uint32_t number, uint32_t row);
    uint32_t free_row(uint32_t before);
    void write(uint32_t row, const MaterialRecord& record, uint64_t hash);

    Hash hash_;
    std::vector<MaterialEntry> entries_;
    std::vector<uint32_t> uses_;                           // by row: numbers that have it; rows are [0, size)
    std::vector<uint64_t> hashes_;                         // by row
    std::vector<bool> entry_is_new_;                       // of this update
    std::unordered_multimap<uint64_t, uint32_t> by_hash_;  // rows, also those that nothing has
    std::vector<Range> changed_;
    uint32_t numbers_ = 0, rows_in_use_ = 0, rows_written_ = 0;
    uint32_t look_from_ = 0;  // free rows are not below
};

}  // namespace kiln::render
