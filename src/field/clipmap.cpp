// SPDX-License-Identifier: MIT
// Work is done in blocks of 16³ cells (cell_maker.h), several at a time; what they made is put in place by the owner's thread, in order, so
// that with a budget in bricks alone nothing depends on the number of workers.
//
// Order of work: where something that is drawn of the last level is missing, a level of the net (clipmap_net.cpp), its
// coarsest where there is a budget in time, or without a budget the last level itself, whatever it costs; changes, the oldest and finest first, with half of the budget where cells are missing
// too; missing cells from coarse levels to fine, in each from the focus outwards, those that the view may show before all others
// (clipmap_view.cpp). So a cell that is there has the coarser level under it,
// and one mix of two levels is enough everywhere. What is drawn of a level ends at least a cell within its window just moved, so in a
// steady flight the last level's shells are made, within the budget, before they are seen.

#include "field/clipmap.h"

#include "base/assert.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "field/cell_rows.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace kiln::field {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kMostBlocksAtOnce = 64;
// Of a budget in time: for settling, before cells are made; for all, however long move() took.
constexpr double kSettlingShare = 0.25, kLeastShare = 0.5;

CellBox common(const CellBox& a, const CellBox& b) {
    return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
            {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}
CellBox wider(const CellBox& a, int by) { return {a.min - all_of(by), a.max + all_of(by)}; }
int64_t volume(const CellBox& b) {
    return b.empty() ? 0 : int64_t(b.max.x - b.min.x) * (b.max.y - b.min.y) * (b.max.z - b.min.z);
}

template <typename Fn>
void each_cell(const CellBox& box, Fn&& fn) {
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) fn(ivec3{x, y, z});
        }
    }
}

template <typename Fn>
void each_block(const CellBox& box, Fn&& fn) {
    if (box.empty()) return;
    const auto first = [](int a) { return a & ~(kBlockCells - 1); };
    for (int z = first(box.min.z); z < box.max.z; z += kBlockCells) {
        for (int y = first(box.min.y); y < box.max.y; y += kBlockCells) {
            for (int x = first(box.min.x); x < box.max.x; x += kBlockCells) fn(ivec3{x, y, z});
        }
    }
}
// How many levels after the last one that of the net is which needs no more bricks than the budget has, in any world: the first of the
// `most` that there are, else the coarsest. More than a thousand would be too many where the budget is a time.
int net_depth(int cells, int most, uint32_t bricks) {
    const auto worst = [&](int n) {
        const auto side = uint32_t(((cells - 6) >> n) + 2);  // see Clipmap::net_levels()
        return side * side * side;
    };
    int n = std::min(most, 1);
    while (n < most && worst(n) > std::min(bricks, 1024u)) ++n;
    return n;
}
CellBox cells_of(ivec3 block) { return {block, block + all_of(kBlockCells)}; }

}  // namespace

bool Clipmap::Run::goes_on() const { return bricks > 0 && !(timed && Clock::now() >= deadline); }
void Clipmap::Run::spend(size_t n) {
    if (bricks != kUnlimited) bricks -= uint32_t(std::min<size_t>(n, bricks));
}
size_t Clipmap::Run::wave(size_t queued) const {
    size_t n = kMostBlocksAtOnce;
    if (timed) n = 2 * size_t(workers != 0 ? workers : hardware_workers());
    if (bricks != kUnlimited) n = std::min<size_t>(n, std::clamp(bricks / 64u, 1u, 16u));
    return std::min(n, queued);
}

Result<Clipmap> Clipmap::make(std::shared_ptr<const sdf::Program> program, const ClipmapOptions& options,
                              dvec3 focus_world) {
    const float h = options.voxel_size;
    if (!(h > 0) || !std::isfinite(h))
        return Error{"clipmap: voxel size " + std::to_string(h) + "; must be above 0", ErrorKind::Usage};
    if (options.levels < 1 || options.levels > kMostLevels)
        return Error{"clipmap: " + std::to_string(options.levels) + " levels; 1 to " + std::to_string(kMostLevels) +
                         " are possible",
                     ErrorKind::Usage};
    if (options.cells < kFewestLevelCells || options.cells > kMostLevelCells ||
        !std::has_single_bit(uint32_t(options.cells)))
        return Error{"clipmap: " + std::to_string(options.cells) + " cells a side; levels have 32, 64 or 128",
                     ErrorKind::Usage};
    Clipmap out;
    out.options_ = options;
    out.options_.max_bricks = std::min(options.max_bricks, kCellSlotMask);  // the last is kCellMissing's
    out.newest_ = std::move(program);
    out.pool_ = BrickPool(out.options_.max_bricks);
    out.focus_ = focus_world;
    out.levels_.resize(size_t(options.levels + net_levels(options)));
    out.nothing_ = CellMap::torus(options.cells);
    each_cell({{}, all_of(options.cells)}, [&](ivec3 c) { out.nothing_.set(c.x, c.y, c.z, kCellMissing); });
    for (int level = 0; level < out.all_levels(); ++level) {
        Level& l = out.levels_[size_t(level)];
        l.cells = out.nothing_;
        l.rough = RoughCells(options.cells);
        l.counts.missing_cells = out.all_cells();
        l.program = out.newest_;
        l.first = out.first_cell_for(level, focus_world, nullptr);
        if (level < options.levels) out.enter_all(level);
    }
    return out;
}

CellBox Clipmap::window(int level) const {
    const ivec3 first = levels_[size_t(level)].first;
    return {first, first + all_of(options_.cells)};
}

LevelsParams Clipmap::params() const {
    LevelsParams out{};
    const double h = double(options_.voxel_size);
    const double at[3] = {focus_.x / h, focus_.y / h, focus_.z / h};
    const ivec3 whole{int(std::floor(at[0])), int(std::floor(at[1])), int(std::floor(at[2]))};
    out.focus_x = whole.x, out.focus_y = whole.y, out.focus_z = whole.z;
    out.part_x = float(at[0] - whole.x), out.part_y = float(at[1] - whole.y), out.part_z = float(at[2] - whole.z);
    out.cells = options_.cells;
    out.voxel_size = options_.voxel_size;
    out.drawn = options_.levels;
    out.count = shown_levels();
    while (out.first + 1 < out.count && levels_[size_t(out.first)].counts.missing_cells == all_cells()) ++out.first;
    return out;
}

// A voxel more on each side, which normals look at.
CellBox Clipmap::drawn(int level) const {
    const double h = double(voxel_size(level)), reach = double(level_reach(options_.cells)) + 1;
    const auto cell = [&](double at, double by) { return int(std::floor((at / h + by) / kBrickVoxels)); };
    return common(window(level),
                  {{cell(focus_.x, -reach), cell(focus_.y, -reach), cell(focus_.z, -reach)},
                   ivec3{cell(focus_.x, reach), cell(focus_.y, reach), cell(focus_.z, reach)} + all_of(1)});
}

// The window's first cell, an even number: its faces are faces of the coarser level's cells. An axis follows only when the focus is more
// than kSlackCells off its middle.
ivec3 Clipmap::first_cell_for(int level, dvec3 focus, const ivec3* old) const {
    const double side = double(voxel_size(level)) * kBrickVoxels, half = options_.cells / 2;
    const auto axis = [&](double at, const int* was) {
        if (was != nullptr && std::fabs(at / side - (*was + half)) <= kSlackCells) return *was;
        return int(2 * std::lround((at / side - half) / 2));
    };
    return {axis(focus.x, old != nullptr ? &old->x : nullptr), axis(focus.y, old != nullptr ? &old->y : nullptr),
            axis(focus.z, old != nullptr ? &old->z : nullptr)};
}

CellLattice Clipmap::lattice(int level, ivec3 block) const {
    const int far = std::max({std::abs(block.x), std::abs(block.y), std::abs(block.z)}) + 2 * kBlockCells;
    const float h = voxel_size(level);
    return {{}, h, kLevelOwnVoxels, float(far) * kBrickVoxels * h, origin_of_block(block, h)};
}

float Clipmap::distance_cells(int level, ivec3 cell) const {
    const double side = double(voxel_size(level)) * kBrickVoxels;
    return float(std::max({std::fabs(cell.x + 0.5 - focus_.x / side), std::fabs(cell.y + 0.5 - focus_.y / side),
                           std::fabs(cell.z + 0.5 - focus_.z / side)}));
}

void Clipmap::queue_blocks(Level& level, const CellBox& box) const {
    each_block(box, [&](ivec3 block) {
        if (std::find(level.blocks.begin(), level.blocks.end(), block) == level.blocks.end())
            level.blocks.push_back(block);
    });
}

// These cells have come into the window, where others were before.
void Clipmap::enter(int level, const CellBox& box) {
    Level& l = levels_[size_t(level)];
    each_word(l.cells, box, [&](uint32_t& word, ivec3) {
        if (word == kCellMissing) return;
        if (is_brick(word)) {
            release(word & kCellSlotMask);
            --l.counts.bricks;
            ++l.counts.evicted;
            room_ = true;
        }
        ++l.counts.missing_cells;
        word = kCellMissing;
    });
    l.counts.entered_cells += uint32_t(volume(box));
    l.shell += uint32_t(volume(box));
    come_near(l.cells, box, true);
    l.rough.add(box);
    queue_blocks(l, box);
    if (l.active) add_parts(*l.active, box);
}

// The same of a whole window. What was there is given back later.
void Clipmap::enter_all(int level) {
    Level& l = levels_[size_t(level)];
    if (l.counts.bricks > 0) {
        left_.push_back({std::move(l.cells)});
        left_bricks_ += l.counts.bricks;
        room_ = true;
        // Those of the net are few, and drop_net() finds them by their level.
        for (const size_t before = left_.size(); level >= options_.levels && left_.size() == before;) release_left();
    }
    l.cells = nothing_;
    l.rough = RoughCells(options_.cells);
    l.counts.evicted += l.counts.bricks;
    l.counts.bricks = 0;
    l.counts.missing_cells = l.counts.entered_cells = all_cells();
    l.shell += all_cells();
    queue_blocks(l, window(level));
    if (l.active) add_parts(*l.active, window(level));
}

void Clipmap::move(dvec3 focus_world) {
    const Clock::time_point began = Clock::now();
    focus_ = focus_world;
    for (int level = 0; level < all_levels(); ++level) {
        Level& l = levels_[size_t(level)];
        l.counts.entered_cells = 0;
        l.counts.evicted = 0;
        const CellBox old = window(level);
        l.first = first_cell_for(level, focus_world, &l.first);
        if (level >= options_.levels && l.counts.missing_cells == all_cells()) continue;
        const CellBox now = window(level);
        if (now.min == old.min) continue;
        std::erase_if(l.blocks, [&](ivec3 b) { return !meet(cells_of(b), now); });
        std::erase_if(l.refused, [&](ivec3 b) { return !meet(cells_of(b), now); });
        l.recount = true;
        if (!meet(old, now)) {
            enter_all(level);
            continue;
        }
        CellBox rest = now;
        const auto shell = [&](int ivec3::*axis) {
            for (const bool low : {true, false}) {
                CellBox slab = rest;
                if (low) {
                    slab.max.*axis = std::max(slab.min.*axis, old.min.*axis);
                    rest.min.*axis = slab.max.*axis;
                } else {
                    slab.min.*axis = std::min(slab.max.*axis, old.max.*axis);
                    rest.max.*axis = slab.min.*axis;
                }
                if (!slab.empty()) enter(level, slab);
            }
        };
        shell(&ivec3::x);
        shell(&ivec3::y);
        shell(&ivec3::z);
    }
    count();
    moved_ += Clock::now() - began;
}

void Clipmap::add_parts(Batch& batch, const CellBox& clip) const {
    each_block(clip, [&](ivec3 block) {
        const CellBox part = common(cells_of(block), clip);
        if (std::any_of(batch.boxes.begin(), batch.boxes.end(), [&](const CellBox& b) { return meet(b, part); }))
            batch.parts.push_back({block, part, {}});
    });
}

// The batch is what its level is to show next.
void Clipmap::begin(Batch& batch, int level) const {
    const std::shared_ptr<const sdf::Program>& shown = levels_[size_t(level)].program;
    const bool renumbered = shown == nullptr || shown->numbering != batch.program->numbering;
    for (const std::vector<uint32_t>* rows : {&batch.removed, &batch.inserted}) {
        for (const uint32_t row : *rows) {
            const bool anywhere = renumbered && rows == &batch.removed;
            const CellBox box = cells_reached(*batch.program, row, lattice(level, {}), anywhere).stored;
            if (!box.empty()) batch.boxes.push_back(box);
        }
    }
    std::sort(batch.removed.begin(), batch.removed.end());
    std::sort(batch.inserted.begin(), batch.inserted.end());
    add_parts(batch, window(level));
}

// The level has nothing that could show an old state.
void Clipmap::forget_changes(Level& level) const {
    level.program = newest_;
    level.active.reset();
    level.waiting.reset();
}

void Clipmap::edit(std::shared_ptr<const sdf::Program> program, std::span<const RowChange> changes) {
    newest_ = std::move(program);
    for (Level& l : levels_) {
        const int level = int(&l - levels_.data());
        if (l.counts.missing_cells == all_cells()) {  // nothing shows an old state
            forget_changes(l);
            continue;
        }
        std::optional<Batch>& batch = l.active ? l.waiting : l.active;
        if (!batch) batch.emplace().since = works_;
        batch->program = newest_;
        ++batch->changes;
        for (const RowChange& change : changes) {
            if (change.removed != kNoRow) batch->removed.push_back(change.removed);
            if (change.inserted != kNoRow) batch->inserted.push_back(change.inserted);
        }
        if (&batch != &l.active) continue;
        begin(*batch, level);
        if (batch->parts.empty()) {  // out of sight
            l.program = newest_;
            batch.reset();
        }
    }
}

namespace {

// Between the cells of one block and what is made of them.
template <typename Made>
struct SinkBase {
    Made& made;
    DistanceFormat format;
    uint32_t allowance;
    bool timed;
    Clock::time_point deadline;

    bool stop() {
        if (made.leaves.size() >= allowance || (timed && Clock::now() >= deadline)) made.stopped = true;
        return made.stopped;
    }
    void add_brick(ivec3 cell, CellMaker& maker) {
        ++made.cells;
        made.leaves.push_back({cell, uint32_t(made.code.size()), maker.code_count(),
                               maker.evaluator().content(format, maker.only_material())});
        maker.append_code(made.code);
    }
};

}  // namespace

// Makes missing cells of a part of the window, `only` those of some groups. True when the level has none left there but refused ones.
bool Clipmap::fill(int level, Run& run, const CellBox& where, const CellGroups* only) {
    Level& l = levels_[size_t(level)];
    if (l.blocks.empty()) return true;
    const CellBox window = this->window(level);

    struct Sink : SinkBase<Made> {
        const CellMap& cells;
        const CellBox& where;
        uint64_t groups;
        bool wants(ivec3 c) const {
            return contains(where, c) && (groups & CellGroups::bit(c)) != 0 && cells.at(c.x, c.y, c.z) == kCellMissing;
        }
        bool wants(const CellBox& box) const {
            for (int z = box.min.z; z < box.max.z; ++z) {
                for (int y = box.min.y; y < box.max.y; ++y) {
                    for (int x = box.min.x; x < box.max.x; ++x) {
                        if (wants(ivec3{x, y, z})) return true;
                    }
                }
            }
            return false;
        }
        void air(const CellBox& box) {
            each_cell(box, [&](ivec3 c) {
                if (wants(c)) empty(c, false);
            });
        }
        void empty(ivec3 c, bool inside) {
            ++made.cells;
            made.empties.push_back({c, inside});
        }
        static bool keeps(ivec3, Inserted, sdf::ListCuller::Start) { return false; }
        void brick(ivec3 c, CellMaker& maker) { add_brick(c, maker); }
    };

    std::sort(l.blocks.begin(), l.blocks.end(), [&](ivec3 a, ivec3 b) {
        const ivec3 middle = all_of(kBlockCells / 2);
        const float da = distance_cells(level, a + middle), db = distance_cells(level, b + middle);
        return da != db ? da < db : before(a, b);
    });
    // Blocks with cells that are not asked for stay queued.
    constexpr uint64_t kAllGroups = ~uint64_t(0);
    const auto groups_of = [&](ivec3 block) { return only != nullptr ? only->of(block) : kAllGroups; };
    const auto inside = [&](ivec3 block) {
        if (groups_of(block) != kAllGroups) return false;
        const CellBox part = common(cells_of(block), window), here = common(part, where);
        return here.min == part.min && here.max == part.max;
    };
    std::vector<ivec3> outside;
    std::erase_if(l.blocks, [&](ivec3 block) {
        if (meet(cells_of(block), where) && groups_of(block) != 0) return false;
        outside.push_back(block);
        return true;
    });
    // A block that has had its share of the budget has its turn again when all have.
    std::vector<ivec3> left;
    size_t next = 0;
    while (run.goes_on()) {
        if (next == l.blocks.size()) {
            if (left.empty()) break;
            l.blocks = std::exchange(left, {});
            next = 0;
        }
        const std::span<const ivec3> wave = std::span(l.blocks).subspan(next, run.wave(l.blocks.size() - next));
        next += wave.size();
        std::vector<Made> made(wave.size());
        const uint32_t share = run.bricks == kUnlimited ? kUnlimited : std::max(run.bricks / uint32_t(wave.size()), 1u);
        parallel_for(wave.size(), run.workers, [&](int i) {
            CellMaker maker(*l.program, lattice(level, wave[size_t(i)]));
            Sink sink{{made[size_t(i)], options_.format, share, run.timed, run.deadline},
                      l.cells,
                      where,
                      groups_of(wave[size_t(i)])};
            maker.run_block(wave[size_t(i)], common(window, where), sink);
        });
        for (size_t i = 0; i < wave.size(); ++i) {
            run.spend(made[i].leaves.size());
            l.counts.baked += uint32_t(made[i].leaves.size());
            l.counts.cells_made += made[i].cells;
            publish(level, made[i], window);
            // A block that found no room waits for some with the rest of its cells: those it was refused would be made again first, for ever.
            if (std::find(l.refused.begin(), l.refused.end(), wave[i]) != l.refused.end()) continue;
            if (made[i].stopped)
                left.push_back(wave[i]);
            else if (!inside(wave[i]))
                outside.push_back(wave[i]);
        }
    }
    left.insert(left.end(), l.blocks.begin() + ptrdiff_t(next), l.blocks.end());
    const bool done = left.empty();
    left.insert(left.end(), outside.begin(), outside.end());
    l.blocks = std::move(left);
    return done;
}

// Makes what changes reach, and shows it when it is whole. True when no change is left.
bool Clipmap::apply(int level, Run& run) {
    Level& l = levels_[size_t(level)];

    struct Sink : SinkBase<Made> {
        const Clipmap& map;
        const Level& level;
        const Batch& batch;
        std::span<const CellBox> boxes;  // of the batch, those that meet the part
        Part& part;

        size_t bit(ivec3 c) const {
            const ivec3 p = c - part.block;
            return size_t((p.z * kBlockCells + p.y) * kBlockCells + p.x);
        }
        bool done(ivec3 c) const { return (part.done[bit(c) / 64] >> (bit(c) % 64) & 1u) != 0; }
        void set_done(ivec3 c) {
            ++made.cells;
            part.done[bit(c) / 64] |= uint64_t(1) << (bit(c) % 64);
        }
        bool wants(const CellBox& box) const {
            return std::any_of(boxes.begin(), boxes.end(), [&](const CellBox& b) { return meet(b, box); });
        }
        bool wants(ivec3 c) const {
            return !done(c) &&
                   std::any_of(boxes.begin(), boxes.end(), [&](const CellBox& b) { return contains(b, c); });
        }
        void air(const CellBox& box) {
            each_cell(box, [&](ivec3 c) {
                if (wants(c)) empty(c, false);
            });
        }
        void empty(ivec3 c, bool inside) {
            set_done(c);
            const uint32_t word = level.cells.at(c.x, c.y, c.z);
            if ((word & kCellOccupied) != 0 || ((word & kCellInside) != 0) != inside)
                made.empties.push_back({c, inside});
        }
        bool keeps(ivec3 c, Inserted inserted, sdf::ListCuller::Start start) {
            const uint32_t word = level.cells.at(c.x, c.y, c.z);
            if (inserted == Inserted::Shows || word == kCellMissing || (word & kCellOccupied) == 0) return false;
            if (!stays(map.code_of(word & kCellSlotMask), *batch.program, batch.removed, start)) return false;
            set_done(c);
            return true;
        }
        void brick(ivec3 c, CellMaker& maker) {
            add_brick(c, maker);
            part.done[bit(c) / 64] |= uint64_t(1) << (bit(c) % 64);
        }
    };

    while (l.active) {
        const CellBox window = this->window(level);
        Batch& batch = *l.active;
        std::vector<Part> left;
        size_t next = 0;
        while (next < batch.parts.size() && run.goes_on()) {
            const size_t count = run.wave(batch.parts.size() - next);
            const std::span<Part> wave = std::span(batch.parts).subspan(next, count);
            next += count;
            std::vector<Made> made(count);
            const uint32_t share = run.bricks == kUnlimited ? kUnlimited : std::max(run.bricks / uint32_t(count), 1u);
            parallel_for(count, run.workers, [&](int i) {
                Part& part = wave[size_t(i)];
                const CellBox bounds = common(part.clip, window);
                if (bounds.empty()) return;
                std::vector<CellBox> boxes;
                for (const CellBox& b : batch.boxes)
                    if (meet(b, bounds)) boxes.push_back(b);
                CellMaker maker(*batch.program, lattice(level, part.block), batch.inserted);
                Sink sink{
                    {made[size_t(i)], options_.format, share, run.timed, run.deadline}, *this, l, batch, boxes, part};
                maker.run_block(part.block, bounds, sink);
            });
            for (size_t i = 0; i < count; ++i) {
                run.spend(made[i].leaves.size());
                l.counts.baked += uint32_t(made[i].leaves.size());
                l.counts.cells_made += made[i].cells;
                if (made[i].stopped) left.push_back(wave[i]);
                made[i].stopped = false;
                batch.made.push_back(std::move(made[i]));
            }
        }
        left.insert(left.end(), batch.parts.begin() + ptrdiff_t(next), batch.parts.end());
        batch.parts = std::move(left);
        if (!batch.parts.empty()) return false;
        std::vector<Made> made = std::move(batch.made);
        l.program = batch.program;
        l.active = std::move(l.waiting);
        l.waiting.reset();
        for (Made& m : made) publish(level, m, window);
        if (!l.active) break;
        begin(*l.active, level);
    }
    return true;
}

// Puts made cells in place; those that have left the window are dropped. Words are right at once, if rough.
void Clipmap::publish(int level, Made& made, const CellBox& window) {
    Level& l = levels_[size_t(level)];
    CellBox changed{}, grown{};
    const auto cell_of = [](ivec3 c) { return CellBox{c, c + all_of(1)}; };
    for (const Emptied& e : made.empties) {
        if (!contains(window, e.cell)) continue;
        const uint32_t word = l.cells.at(e.cell.x, e.cell.y, e.cell.z);
        uint32_t jump = 1;
        if (word == kCellMissing) {
            --l.counts.missing_cells;
        } else if (is_brick(word)) {
            release(word & kCellSlotMask);
            --l.counts.bricks;
            room_ = true;
        } else {
            jump = word & uint32_t(kMaxJump);
        }
        l.cells.set(e.cell.x, e.cell.y, e.cell.z, (e.inside ? kCellInside : 0u) | jump);
        changed = joined(changed, cell_of(e.cell));
    }
    const uint32_t base = uint32_t(code_.append(made.code));
    for (Leaf& leaf : made.leaves) {
        const ivec3 c = leaf.cell;
        if (!contains(window, c)) continue;
        const uint32_t word = l.cells.at(c.x, c.y, c.z);
        const bool had = is_brick(word);
        const uint32_t slot = had ? word & kCellSlotMask : take_slot(level, c);
        if (!had) changed = joined(changed, cell_of(c));
        if (slot == kNoSlot) {
            if (word != kCellMissing) lose(level, c);
            refuse(level, c);
            continue;
        }
        records_.resize_pages(slot / Field::Records::kPageSize + 1);
        contents_.resize_pages(slot / Contents::kPageSize + 1);
        BrickRecord& record = records_.write(slot);
        live_code_ += uint64_t(leaf.code_count) - record.code_count;
        const bool far = std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)}) >= kNearCells;
        record = {c.x * kBrickVoxels, c.y * kBrickVoxels, c.z * kBrickVoxels, base + leaf.code_first,
                  leaf.code_count,    uint32_t(level),    far ? 1u : 0u,      0};
        contents_.write(slot) = std::move(leaf.content);
        if (had) continue;
        if (word == kCellMissing)
            --l.counts.missing_cells;
        else
            grown = joined(grown, cell_of(c));
        ++l.counts.bricks;
        l.cells.set(c.x, c.y, c.z, kCellOccupied | (l.counts.missing_cells != 0 ? kCellFades : 0u) | slot);
    }
    l.rough.add(changed);
    if (grown.empty()) return;
    const CellBox reached = wider(grown, kMaxJump - 1);
    const ivec3 size = reached.max - reached.min;
    update_jumps(l.cells, std::max({size.x, size.y, size.z}) >= options_.cells ? window : reached);
}

bool Clipmap::work(const BakeBudget& budget, const std::optional<BakeView>& view) {
    KILN_PROFILE("clipmap work");
    ++works_;
    victims_level_ = -1;
    for (Level& l : levels_) {
        l.counts.baked = 0;
        l.counts.cells_made = 0;
        l.counts.skipped = false;
        if (!room_) continue;
        for (const ivec3 block : l.refused) queue_blocks(l, cells_of(block));
        l.refused.clear();
        l.recount = true;
    }
    room_ = false;

    Run run{budget.bricks, std::isfinite(budget.seconds), {}, options_.workers};
    Run all{.workers = options_.workers};
    uint32_t layers = budget.layers;
    const auto after = [](double seconds) {
        return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    };
    if (run.timed) {
        const double moved = std::chrono::duration<double>(moved_).count();
        run.deadline = after(std::max(budget.seconds - moved, kLeastShare * budget.seconds));
        // What waits to be settled costs rays steps in the meantime.
        all.timed = true;
        all.deadline = after(kSettlingShare * std::max(budget.seconds - moved, 0.0));
        (void)settle(all, layers);
        all.timed = false;
    }
    moved_ = {};
    const int last = options_.levels - 1;
    const bool limited = run.timed || run.bricks != kUnlimited;
    const int at_once = limited ? last + net_depth(options_.cells, all_levels() - options_.levels, run.bricks) : last;
    // How long bricks take is not known beforehand: where time counts, only the least is made at once.
    const int coarsest = all_levels() - 1;
    const bool hurries = run.timed && coarsest > last;
    net_ = net_ || ((hurries || at_once > last) && needs_net());
    const int first = hurries ? coarsest : at_once;
    if (first == last)
        fill(last, all, drawn(last));
    else if (net_)
        fill_net(first, all);
    run.spend(levels_[size_t(first)].counts.baked);
    // However long that took: were nothing else made, the net would be needed for ever.
    if (run.timed) run.deadline = std::max(run.deadline, after(kLeastShare * budget.seconds));
    std::vector<int> changes;
    bool missing = false;
    for (int level = 0; level < all_levels(); ++level) {
        Level& l = levels_[size_t(level)];
        if (l.active) changes.push_back(level);
        // As many bricks as a sheet through the shell has, or twice that where a window is 64 cells.
        l.counts.skipped = level < last && 2 * uint64_t(l.shell) / uint64_t(options_.cells) > budget.bricks;
        missing = missing || (!l.blocks.empty() && !l.counts.skipped);
    }
    std::stable_sort(changes.begin(), changes.end(),
                     [&](int a, int b) { return levels_[size_t(a)].active->since < levels_[size_t(b)].active->since; });
    const auto apply_all = [&](Run& with) {
        for (const int level : changes) {
            if (!apply(level, with)) return;
        }
    };
    if (missing && run.bricks != kUnlimited) {
        Run half = run;
        half.bricks = (run.bricks + 1) / 2;
        const uint32_t given = half.bricks;
        apply_all(half);
        run.spend(given - half.bricks);
    } else {
        apply_all(run);
    }
    bool whole = true;
    const auto fill_all = [&](const std::vector<CellGroups>* seen) {
        for (int level = last; level >= 0 && whole; --level)
            whole = !levels_[size_t(level)].counts.skipped &&
                    fill(level, run, window(level), seen != nullptr ? &(*seen)[size_t(level)] : nullptr);
    };
    if (missing && limited && view) {
        const std::vector<CellGroups> seen = seen_groups(*view);
        fill_all(&seen);
    }
    fill_all(nullptr);
    apply_all(run);
    for (Level& l : levels_) l.shell = 0;
    if (net_ && !needs_net()) drop_net();
    all.timed = run.timed;
    all.deadline = run.deadline;
    const bool settled = settle(all, layers);
    compact_code();
    count();
    return settled &&
           std::all_of(levels_.begin(), levels_.end(), [](const Level& l) { return l.blocks.empty() && !l.active; });
}

// Gives back what left, and makes words exact that are rough. True when all are.
bool Clipmap::settle(const Run& run, uint32_t& layers) {
    while (!left_.empty()) {
        if (!run.goes_on()) return false;
        release_left();
    }
    for (int level = 0; level < all_levels(); ++level) {
        Level& l = levels_[size_t(level)];
        while (!l.rough.empty()) {
            if (layers == 0 || !run.goes_on()) return false;
            --layers;
            l.rough.settle_layer(l.cells, window(level), l.counts.missing_cells != 0);
        }
    }
    return true;
}

void Clipmap::count() {
    for (int level = 0; level < all_levels(); ++level) {
        Level& l = levels_[size_t(level)];
        l.counts.edits_waiting = (l.active ? l.active->changes : 0) + (l.waiting ? l.waiting->changes : 0);
        if (!l.recount) continue;
        l.recount = false;
        l.counts.refused_cells = 0;
        for (const ivec3 block : l.refused) {
            each_word(std::as_const(l.cells), common(cells_of(block), window(level)),
                      [&](uint32_t word, ivec3) { l.counts.refused_cells += word == kCellMissing ? 1u : 0u; });
        }
    }
}

}  // namespace kiln::field
