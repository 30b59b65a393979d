// SPDX-License-Identifier: MIT

#include "sdf/expression_image.h"

#include "sdf/eval_isa.h"
#include "sdf/expression_run.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::sdf {

namespace {

constexpr uint32_t kInputs = 3;
constexpr uint32_t kUnnamed = UINT32_MAX;
constexpr int kSplit = 4;      // a tile becomes kSplit² = kTileLanes
constexpr int kBlock = 8;      // pixels a side of a chunk of 64 points
constexpr int kSmallest = 16;  // pixels a side of tiles that are not cut further

struct Code {
    std::vector<FormulaOp> ops;
    uint32_t registers = kInputs;
    uint32_t result = 0;
    uint32_t choices = 0;
};

// Registers are dealt out walking backwards: a value gets one where it is used last, and gives it back where it is made.
class Dealer {
public:
    void begin(size_t old_names) {
        new_of_.assign(old_names, kUnnamed);
        free_.clear();
        used_ = kInputs;
    }
    bool alive(uint32_t old_name) const { return new_of_[old_name] != kUnnamed; }
    uint32_t name(uint32_t old_name) {
        if (old_name < kInputs) return old_name;
        uint32_t& out = new_of_[old_name];
        if (out == kUnnamed) {
            if (free_.empty()) {
                out = used_++;
            } else {
                out = free_.back();
                free_.pop_back();
            }
        }
        return out;
    }
    // The value that was used from here on is made here.
    uint32_t made(uint32_t old_name) {
        const uint32_t out = new_of_[old_name];
        new_of_[old_name] = kUnnamed;
        return out;
    }
    void rename(uint32_t old_name, uint32_t as) { new_of_[old_name] = as; }
    void give_back(uint32_t reg) { free_.push_back(reg); }
    uint32_t registers() const { return used_; }

private:
    std::vector<uint32_t> new_of_, free_;
    uint32_t used_ = kInputs;
};

// The code that tile `lane` needs. `choices` as run_formula_tiles left them.
void shorten(const Code& code, const uint16_t* choices, int lane, Dealer& dealer, Code& out) {
    out.ops.clear();
    out.choices = 0;
    dealer.begin(code.registers);
    out.result = dealer.name(code.result);
    size_t choice = code.choices;
    const auto bit = [lane](uint16_t word) { return (word >> lane & 1) != 0; };
    for (size_t i = code.ops.size(); i-- > 0;) {
        const FormulaOp& op = code.ops[i];
        choice -= op.is_choice;
        if (!dealer.alive(op.dst)) continue;
        const uint32_t dst = dealer.made(op.dst);
        int taken = op.fn == uint8_t(Fn::Copy) ? 1 : 0;
        if (op.is_choice != 0) taken = bit(choices[2 * choice]) ? 1 : bit(choices[2 * choice + 1]) ? 2 : 0;
        if (taken != 0) {
            const bool number = (taken == 1 ? op.number_a : op.number_b) != 0;
            const uint32_t from = taken == 1 ? op.a : op.b;
            if (number) {
                out.ops.push_back({.fn = uint8_t(Fn::Constant), .dst = dst, .number = op.number});
                dealer.give_back(dst);
            } else if (from < kInputs || dealer.alive(from)) {
                out.ops.push_back({.fn = uint8_t(Fn::Copy), .dst = dst, .a = dealer.name(from)});
                dealer.give_back(dst);
            } else {
                dealer.rename(from, dst);
            }
            continue;
        }
        FormulaOp next = op;
        next.dst = dst;
        dealer.give_back(dst);
        const int count = operands(Fn(op.fn));
        if (count > 0 && op.number_a == 0) next.a = dealer.name(op.a);
        if (count > 1 && op.number_b == 0) next.b = dealer.name(op.b);
        out.choices += op.is_choice;
        out.ops.push_back(next);
    }
    std::reverse(out.ops.begin(), out.ops.end());
    out.registers = dealer.registers();
}

// Every node as one operation, then given registers by the walk above.
Code code_of(const Formula& formula) {
    Code raw;
    const auto& nodes = formula.nodes;
    std::vector<uint32_t> name(nodes.size());
    uint32_t next = kInputs;
    for (size_t i = 0; i < nodes.size(); ++i) {
        const FormulaNode& n = nodes[i];
        const bool last = i + 1 == nodes.size();
        if (operands(n.fn) == 0 && (n.fn != Fn::Constant || !last)) {
            name[i] = n.fn == Fn::Constant ? 0 : uint32_t(n.fn);
            if (!last) continue;
        }
        FormulaOp op;
        op.fn = uint8_t(n.fn);
        if (n.fn == Fn::Constant) op.number = n.constant;
        if (n.fn <= Fn::Z) {
            op.fn = uint8_t(Fn::Copy);
            op.a = name[i];
        }
        const int count = operands(n.fn);
        for (int k = 0; k < count; ++k) {
            const uint32_t operand = k == 0 ? n.a : n.b;
            if (nodes[operand].fn == Fn::Constant) {
                (k == 0 ? op.number_a : op.number_b) = 1;
                op.number = nodes[operand].constant;
            } else {
                (k == 0 ? op.a : op.b) = name[operand];
            }
        }
        op.is_choice = n.fn == Fn::Min || n.fn == Fn::Max ? 1 : 0;
        raw.choices += op.is_choice;
        name[i] = op.dst = next++;
        raw.ops.push_back(op);
    }
    raw.registers = next;
    raw.result = name.back();
    Code out;
    Dealer dealer;
    const std::vector<uint16_t> undecided(2 * size_t(raw.choices), 0);
    shorten(raw, undecided.data(), 0, dealer, out);
    return out;
}

struct Aligned {
    std::vector<float> floats;
    void* at(size_t count) {
        if (floats.size() < count + 16) floats.resize(count + 16);
        const auto place = reinterpret_cast<uintptr_t>(floats.data());
        return floats.data() + (64 - place % 64) % 64 / sizeof(float);
    }
};

class Painter {
public:
    Painter(const FormulaView& view, Isa isa, std::vector<uint8_t>& pixels)
        : view_(view), pixels_(pixels), step_(2 * view.half_width / float(view.size_px)) {
        points_ = isa == Isa::Avx512 ? &avx512::run_formula_points
                  : isa == Isa::Avx2 ? &avx2::run_formula_points
                  : isa == Isa::Sse4 ? &sse4::run_formula_points
                                     : &scalar::run_formula_points;
        tiles_ = isa == Isa::Avx512 ? &avx512::run_formula_tiles
                 : isa == Isa::Avx2 ? &avx2::run_formula_tiles
                 : isa == Isa::Sse4 ? &sse4::run_formula_tiles
                                    : &scalar::run_formula_tiles;
    }

    float x_of(int column) const { return (float(column) + 0.5f) * step_ - view_.half_width; }
    float y_of(int row) const { return view_.half_width - (float(row) + 0.5f) * step_; }

    // A square of `side` pixels, cut where the picture ends.
    void points(const Code& code, int left, int top, int side) {
        float* registers = static_cast<float*>(memory_.at(64 * size_t(code.registers)));
        for (int row0 = top; row0 < std::min(top + side, view_.size_px); row0 += kBlock) {
            for (int column0 = left; column0 < std::min(left + side, view_.size_px); column0 += kBlock) {
                for (int i = 0; i < 64; ++i) {
                    registers[i] = x_of(column0 + i % kBlock);
                    registers[64 + i] = y_of(row0 + i / kBlock);
                    registers[128 + i] = view_.z;
                }
                alignas(64) float values[64];
                points_(code.ops.data(), code.ops.size(), registers, code.result, values);
                const int columns = std::min(kBlock, view_.size_px - column0),
                          rows = std::min(kBlock, view_.size_px - row0);
                for (int row = 0; row < rows; ++row) {
                    uint8_t* to = pixels_.data() + size_t(row0 + row) * size_t(view_.size_px) + size_t(column0);
                    for (int column = 0; column < columns; ++column)
                        to[column] = values[row * kBlock + column] < 0 ? 255 : 0;
                }
                stats.point_operations += 64 * code.ops.size();
            }
        }
    }

    void fill(int left, int top, int side, uint8_t with) {
        const int right = std::min(left + side, view_.size_px);
        for (int row = top; row < std::min(top + side, view_.size_px); ++row)
            std::fill(pixels_.begin() + ptrdiff_t(row) * view_.size_px + left,
                      pixels_.begin() + ptrdiff_t(row) * view_.size_px + right, with);
    }

    // Cuts the square into 4x4 tiles and calls below(tile code, left, top, side) for those that are not decided; it may use deeper levels.
    template <typename Below>
    void cut(const Code& code, int left, int top, int side, size_t level, Below below) {
        const int part = side / kSplit;
        alignas(64) float bounds[6 * kTileLanes];
        // The intervals run from the first pixel's centre to the last one's: the same numbers that points() computes.
        for (int i = 0; i < kTileLanes; ++i) {
            const int l = left + i % kSplit * part, t = top + i / kSplit * part;
            bounds[i] = x_of(l);
            bounds[16 + i] = x_of(l + part - 1);
            bounds[32 + i] = y_of(t + part - 1);
            bounds[48 + i] = y_of(t);
            bounds[64 + i] = bounds[80 + i] = view_.z;
        }
        alignas(64) float out[2 * kTileLanes];
        Level& here = levels_[level];
        here.choices.resize(2 * size_t(code.choices) + 2);
        tiles_(code.ops.data(), code.ops.size(), bounds, memory_.at(32 * size_t(code.registers)), code.result,
               here.choices.data(), out);
        stats.interval_operations += code.ops.size();
        for (int i = 0; i < kTileLanes; ++i) {
            const int l = left + i % kSplit * part, t = top + i / kSplit * part;
            if (l >= view_.size_px || t >= view_.size_px) continue;
            // An end that is not finite says nothing of NaN; NaN is not below 0.
            const bool known = std::isfinite(out[i]) && std::isfinite(out[16 + i]);
            if (known && out[16 + i] < 0) {
                fill(l, t, part, 255);
            } else if (known && out[i] >= 0) {
                fill(l, t, part, 0);
            } else {
                shorten(code, here.choices.data(), i, dealer_, here.code);
                stats.copied_operations += code.ops.size();
                below(here.code, l, t, part);
            }
        }
    }

    void paint(const Code& code, int left, int top, int side, size_t level) {
        if (side <= kSmallest || side % (kSplit * kBlock) != 0) return points(code, left, top, side);
        cut(code, left, top, side, level,
            [this, level](const Code& own, int l, int t, int part) { paint(own, l, t, part, level + 1); });
    }

    FormulaImageStats stats;

private:
    struct Level {
        Code code;
        std::vector<uint16_t> choices;
    };

    FormulaView view_;
    std::vector<uint8_t>& pixels_;
    float step_;
    decltype(&scalar::run_formula_points) points_;
    decltype(&scalar::run_formula_tiles) tiles_;
    Aligned memory_;
    Dealer dealer_;
    std::array<Level, 12> levels_;  // sides are powers of four
};

}  // namespace

std::vector<uint8_t> formula_image(const Formula& formula, const FormulaView& view, Isa isa, FormulaImageStats* stats,
                                   int workers) {
    std::vector<uint8_t> pixels(size_t(view.size_px) * size_t(view.size_px));
    const Code code = code_of(formula);
    // A power of four times the smallest tile; what lies outside the picture is left out.
    int side = kSmallest;
    while (side < view.size_px) side *= kSplit;
    // The first cut by hand, so that its tiles are the threads' work.
    struct Tile {
        Code code;
        int left, top, side;
    };
    std::vector<Tile> tiles;
    Painter first(view, isa, pixels);
    FormulaImageStats sum;
    if (side == kSmallest) {
        first.points(code, 0, 0, side);
        sum = first.stats;
    } else {
        first.cut(code, 0, 0, side, 0, [&](const Code& own, int l, int t, int part) {
            tiles.push_back({own, l, t, part});
        });
        sum = first.stats;
        std::vector<FormulaImageStats> each(tiles.size());
        parallel_for(tiles.size(), workers, [&](int i) {
            Painter painter(view, isa, pixels);
            const Tile& tile = tiles[size_t(i)];
            painter.paint(tile.code, tile.left, tile.top, tile.side, 0);
            each[size_t(i)] = painter.stats;
        });
        for (const FormulaImageStats& s : each) {
            sum.interval_operations += s.interval_operations;
            sum.point_operations += s.point_operations;
            sum.copied_operations += s.copied_operations;
        }
    }
    if (stats != nullptr) *stats = sum;
    return pixels;
}

std::vector<uint8_t> formula_image_slow(const Formula& formula, const FormulaView& view, Isa isa, int workers) {
    std::vector<uint8_t> pixels(size_t(view.size_px) * size_t(view.size_px));
    const Code code = code_of(formula);
    const int rows = (view.size_px + kBlock - 1) / kBlock;
    parallel_for(size_t(rows), workers, [&](int row) {
        Painter painter(view, isa, pixels);
        for (int left = 0; left < view.size_px; left += kBlock) painter.points(code, left, row * kBlock, kBlock);
    });
    return pixels;
}

}  // namespace kiln::sdf
