// SPDX-License-Identifier: MIT
// Room for a clipmap's bricks: slots of the pool and the code behind them, who gives them back where there are none left, and which cells go without.

#include "field/clipmap.h"

#include "field/cell_rows.h"

#include <algorithm>
#include <utility>

namespace kiln::field {

// A cell that held something holds nothing: it is missing again.
void Clipmap::lose(int level, ivec3 cell) {
    Level& l = levels_[size_t(level)];
    const CellBox box{cell, cell + all_of(1)};
    ++l.counts.missing_cells;
    l.cells.set(cell.x, cell.y, cell.z, kCellMissing);
    come_near(l.cells, box, true);
    l.rough.add(box);
}

void Clipmap::refuse(int level, ivec3 cell) {
    Level& l = levels_[size_t(level)];
    const auto first = [](int a) { return a & ~(kBlockCells - 1); };
    const ivec3 block{first(cell.x), first(cell.y), first(cell.z)};
    l.recount = true;
    if (std::find(l.refused.begin(), l.refused.end(), block) == l.refused.end()) l.refused.push_back(block);
}

void Clipmap::release(uint32_t slot) {
    live_code_ -= records_[slot].code_count;
    pool_.release(slot);
    records_.write(slot) = {};
    contents_.write(slot) = {};
}

// The bricks of another page of a window that left.
void Clipmap::release_left() {
    Left& left = left_.back();
    if (const CellMap::Words::Page* const page = left.cells.words().find(left.page)) {
        for (const uint32_t word : *page) {
            if (!is_brick(word)) continue;
            release(word & kCellSlotMask);
            --left_bricks_;
        }
    }
    if (++left.page == left.cells.words().pages()) left_.pop_back();
}

uint32_t Clipmap::take_slot(int level, ivec3 cell) {
    while (pool_.in_use() == options_.max_bricks && !left_.empty()) release_left();
    if (pool_.in_use() == options_.max_bricks && !give_back(level, cell)) return kNoSlot;
    return pool_.allocate();
}

// Makes room for a brick by dropping the farthest one of the finest level that has any, where that matters less.
bool Clipmap::give_back(int level, ivec3 cell) {
    int finest = 0;
    while (finest <= level && levels_[size_t(finest)].counts.bricks == 0) ++finest;
    if (finest > level) return false;
    Level& l = levels_[size_t(finest)];
    if (victims_level_ != finest) {
        victims_level_ = finest;
        victims_.clear();
        each_word(std::as_const(l.cells), window(finest), [&](uint32_t word, ivec3 c) {
            if (is_brick(word)) victims_.push_back({distance_cells(finest, c), c});
        });
        std::sort(victims_.begin(), victims_.end(), [](const Victim& a, const Victim& b) {
            return a.distance != b.distance ? a.distance < b.distance : before(a.cell, b.cell);
        });
    }
    while (!victims_.empty()) {
        const Victim victim = victims_.back();
        const ivec3 c = victim.cell;
        if (finest == level && victim.distance <= distance_cells(level, cell)) return false;
        victims_.pop_back();
        const uint32_t word = l.cells.at(c.x, c.y, c.z);
        if (!is_brick(word)) continue;
        release(word & kCellSlotMask);
        --l.counts.bricks;
        ++l.counts.evicted;
        lose(finest, c);
        refuse(finest, c);
        return true;
    }
    victims_level_ = -1;  // those that came since
    return false;
}

// Code that no brick uses any more is dropped once it is the larger part.
void Clipmap::compact_code() {
    if (code_.size() <= 2 * live_code_ + 4096) return;
    AppendArray<sdf::Instruction> packed;
    packed.reserve(size_t(3 * live_code_));
    for (uint32_t slot = 0; slot < pool_.slot_count(); ++slot) {
        if (!pool_.used(slot)) continue;
        BrickRecord& record = records_.write(slot);
        record.code_first = uint32_t(packed.append(code_.subspan(record.code_first, record.code_count)));
    }
    code_ = std::move(packed);
}

}  // namespace kiln::field
