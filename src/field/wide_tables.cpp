// SPDX-License-Identifier: MIT
#include "field/wide_tables.h"

namespace kiln::field {
namespace {

constexpr size_t kMostBaked = 1 << 16;  // slots waiting; with more, everything is made anew

// Cells of a page that was never written.
const WidePage& far_page() {
    static const WidePage one = [] {
        WidePage page;
        page.fill(wide_entry_of_empty(uint32_t(kMaxJump)));
        return page;
    }();
    return one;
}

}  // namespace

std::shared_ptr<WideTables> WideTables::after(const std::shared_ptr<WideTables>& before, const MadeBricks& baked) {
    auto out = std::make_shared<WideTables>();
    const std::lock_guard lock(before->mutex_);
    if (before->ready_.load(std::memory_order_relaxed)) {
        out->base_ = before;
    } else {
        out->base_ = before->base_;
        out->baked_ = before->baked_;
    }
    if (!out->base_) return out;
    for (const auto& [slot, content] : baked) out->baked_.push_back(slot);
    if (out->baked_.size() > kMostBaked) {
        out->base_.reset();
        out->baked_.clear();
    }
    return out;
}

void WideTables::make(const Field& field, const BrickContents& contents) {
    const std::lock_guard lock(mutex_);
    if (ready_.load(std::memory_order_relaxed)) return;
    cells_ = field.cells();
    if (base_) {
        pages_ = base_->pages_;
        top_ = base_->top_;
        ways_ = base_->ways_;
        places_ = base_->places_;
        const CellMap before = base_->cells_;
        base_.reset();  // its pages are this one's alone where nobody else asks them
        cells_.words().each_other_page(before.words(), [&](size_t page) { change_page(page, before, contents); });
        for (const uint32_t slot : baked_) change_brick(slot, field, contents);
        baked_ = {};
    } else {
        const size_t pages = cells_.words().pages();
        pages_.resize_pages(pages);
        top_.assign(pages, &far_page());
        ways_ = Shared<Ways>::make(cells_.size());
        const ivec3 size = cells_.size();
        places_ = std::make_shared<const std::array<std::vector<uint64_t>, 3>>(
            std::array{wide_places(0, size), wide_places(1, size), wide_places(2, size)});
        for (size_t page = 0; page < pages; ++page) {
            if (cells_.words().find(page) != nullptr) make_page(page, contents);
        }
    }
    ways_.write().settle();
    const ivec3 pages = cells_.pages();
    view_ = WideView(field.grid(), top_.data(), pages.x, pages.y, ways_->words(),
                     field.options().format == DistanceFormat::Half ? 2 : 1,
                     {(*places_)[0].data(), (*places_)[1].data(), (*places_)[2].data()});
    ready_.store(true, std::memory_order_release);
}

// Word number `index` of a page, and its cell's way.
void WideTables::set(size_t page, size_t index, WidePage& to, const BrickContents& contents) {
    const uint32_t word = (*cells_.words().find(page))[index];
    const BrickContent* const brick = (word & kCellOccupied) != 0 ? &contents[word & kCellSlotMask] : nullptr;
    to[index] = brick != nullptr ? wide_entry_of_brick(brick->codes()) : wide_entry_of_empty(word);
    const ivec3 pages = cells_.pages(), size = cells_.size();
    const auto along = [](size_t at, int place) { return int(at >> (3 * place) & 7); };
    const int p = int(page);
    const ivec3 cell{p % pages.x * kCellPage + along(index, 0), p / pages.x % pages.y * kCellPage + along(index, 1),
                     p / (pages.x * pages.y) * kCellPage + along(index, 2)};
    if (cell.x >= size.x || cell.y >= size.y || cell.z >= size.z) return;
    Ways& ways = ways_.write();
    if (brick != nullptr && brick->solid_box != kNoSolidBox) {
        ways.set_solid(cell, brick->solid_box);
    } else if (brick == nullptr && (word & kCellInside) != 0) {
        ways.set_inside(cell);
    } else {
        ways.set_free(cell);
    }
}

void WideTables::make_page(size_t page, const BrickContents& contents) {
    WidePage& out = pages_.write_page(page);
    for (size_t i = 0; i < out.size(); ++i) set(page, i, out, contents);
    top_[page] = &out;
}

void WideTables::change_page(size_t page, const CellMap& before, const BrickContents& contents) {
    const CellMap::Words::Page* const old = before.words().find(page);
    const CellMap::Words::Page* const now = cells_.words().find(page);
    if (old == nullptr || now == nullptr) {  // a page that was written stays so
        make_page(page, contents);
        return;
    }
    WidePage& out = pages_.write_page(page);
    for (size_t i = 0; i < out.size(); ++i) {
        if ((*old)[i] != (*now)[i]) set(page, i, out, contents);
    }
    top_[page] = &out;
}

void WideTables::change_brick(uint32_t slot, const Field& field, const BrickContents& contents) {
    const BrickRecord& record = field.records()[slot];
    if (record.code_count == 0) return;  // gone again
    const GridParams g = field.grid();
    const size_t index =
        cells_.index(record.texel_x / kBrickVoxels - g.cell_x, record.texel_y / kBrickVoxels - g.cell_y,
                     record.texel_z / kBrickVoxels - g.cell_z);
    const size_t page = index / Pages::kPageSize;
    WidePage& out = pages_.write_page(page);
    set(page, index % Pages::kPageSize, out, contents);
    top_[page] = &out;
}

}  // namespace kiln::field
