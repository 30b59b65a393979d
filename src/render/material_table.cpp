// SPDX-License-Identifier: MIT
#include "render/material_table.h"

#include "base/assert.h"
#include "base/hash.h"

#include <algorithm>
#include <cstring>

namespace kiln::render {

namespace {

bool same_bytes(const MaterialRecord& a, const MaterialRecord& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

uint64_t MaterialTable::hash_of_bytes(const MaterialRecord& record) {
    return hash64(std::as_bytes(std::span(&record, 1)));
}

uint32_t MaterialTable::find(const MaterialRecord& record, uint64_t hash) const {
    const auto [first, last] = by_hash_.equal_range(hash);
    for (auto it = first; it != last; ++it)
        if (same_bytes(entries_[it->second].row, record)) return it->second;
    return kNone;
}

void MaterialTable::give(uint32_t number, uint32_t row) {
    rows_in_use_ += uses_[row]++ == 0;
    if (entries_[number].row_of_number == row) return;
    entries_[number].row_of_number = row;
    entry_is_new_[number] = true;
}

// `before`, if nothing has it any more: then the number's own entry stays as it is.
uint32_t MaterialTable::free_row(uint32_t before) {
    if (before < uses_.size() && uses_[before] == 0) return before;
    while (look_from_ < uses_.size() && uses_[look_from_] != 0) ++look_from_;
    if (look_from_ == uses_.size()) {
        uses_.push_back(0);
        hashes_.push_back(0);
    }
    // Every row is had by a number, so there are no more rows than entries.
    KILN_ASSERT(look_from_ < entries_.size(), "{} rows of {} numbers", look_from_ + 1, entries_.size());
    return look_from_;
}

void MaterialTable::write(uint32_t row, const MaterialRecord& record, uint64_t hash) {
    const auto [first, last] = by_hash_.equal_range(hashes_[row]);
    const auto old = std::find_if(first, last, [&](const auto& known) { return known.second == row; });
    if (old != last) by_hash_.erase(old);
    by_hash_.emplace(hash, row);
    hashes_[row] = hash;
    entries_[row].row = record;
    entry_is_new_[row] = true;
    ++rows_written_;
}

void MaterialTable::update(std::span<const MaterialRecord> records) {
    changed_.clear();
    rows_written_ = 0;
    const auto count = uint32_t(records.size());
    const auto is_same = [&](uint32_t i) {
        return i < numbers_ && same_bytes(entries_[entries_[i].row_of_number].row, records[i]);
    };
    std::vector<uint32_t> others;
    for (uint32_t i = 0; i < count; ++i)
        if (!is_same(i)) others.push_back(i);
    if (others.empty() && count == numbers_) return;
    // What leaves goes first, so that its rows may be had again.
    const auto leave = [&](uint32_t number) { rows_in_use_ -= --uses_[entries_[number].row_of_number] == 0; };
    for (const uint32_t i : others)
        if (i < numbers_) leave(i);
    for (uint32_t i = count; i < numbers_; ++i) leave(i);
    const auto known = uint32_t(entries_.size());
    if (count > known) entries_.resize(count, {.row_of_number = kNone, .row = {}});
    entry_is_new_.assign(entries_.size(), false);
    look_from_ = 0;
    // Those whose bytes are there, before anything is written over.
    std::vector<std::pair<uint32_t, uint64_t>> unknown;
    for (const uint32_t i : others) {
        const uint64_t hash = hash_(records[i]);
        if (const uint32_t row = find(records[i], hash); row != kNone)
            give(i, row);
        else
            unknown.emplace_back(i, hash);
    }
    for (const auto& [i, hash] : unknown) {
        uint32_t row = find(records[i], hash);  // another of them may be the same
        if (row == kNone) {
            row = free_row(entries_[i].row_of_number);
            write(row, records[i], hash);
        }
        give(i, row);
    }
    numbers_ = count;
    KILN_ASSERT(by_hash_.size() == uses_.size(), "{} hashes of {} rows", by_hash_.size(), uses_.size());
    for (uint32_t i = 0; i < entries_.size(); ++i) {
        if (!entry_is_new_[i]) continue;
        if (!changed_.empty() && changed_.back().end == i)
            ++changed_.back().end;
        else
            changed_.push_back({i, i + 1});
    }
}

}  // namespace kiln::render
