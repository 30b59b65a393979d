// SPDX-License-Identifier: MIT
// Culling of edit lists, 64 balls at a time: which edits can matter in each, and the pruned code of each. What sdf::prune does for one
// ball and a tape, at the speed of the lanes: edits are folded at all centres at once, what each ball needs is found with one bit a
// ball, and only edits that are trees are pruned inside one by one. Where Balls::far is infinite its code is prune()'s, instruction for
// instruction; else edits that are nowhere within `far` in the ball are left out too, and values beyond `far` only stay beyond it.
#pragma once

#include "sdf/eval.h"
#include "sdf/prune.h"

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::sdf {

/// One thread's culling of one program. Lists live on a stack: what was made last is dropped first.
class ListCuller {
public:
    explicit ListCuller(const Program& program) : program_(&program), numbers_(numbers_of(program)) {}

    struct List {
        size_t first = 0, count = 0;  ///< entries
        size_t code = 0;              ///< where the code that was made for it begins
        bool from_empty = true;       ///< begins with empty space
    };
    /// What folding a list says; reused between calls.
    struct Fold {
        List list;
        Balls balls;
        alignas(64) float value[64];        ///< at the centres, metres
        std::vector<float> own;             ///< by entry, where it was asked for: the edit's own values there, 64 each
        std::vector<uint64_t> left, right;  ///< by entry: who wins
        std::vector<uint64_t> kept;         ///< by ball, 64 entries a word: what it keeps
        std::vector<uint64_t> joined;       ///< by entry: kept with what was before it
        std::vector<uint64_t> won, shown;   ///< kept without; likewise, but for its material only
        uint64_t from_empty = 0;            ///< needs the empty space before the first entry
    };

    /// The list of these rows, which are in order.
    List list_of(std::span<const uint32_t> rows);
    /// Fills value, left and right, and `own` if asked to; list and balls are the caller's.
    void fold(Fold& fold, bool own = false);
    /// Then, for the balls in `live`: what each keeps.
    void keep(Fold& fold, uint64_t live);
    /// Then, for one ball: its list, or its code (replacing `out`).
    List child(const Fold& fold, int ball);
    void emit(const Fold& fold, int ball, std::vector<Instruction>& out);
    /// An edit of a ball's code, by its value at the centre.
    struct Depth {
        float value;
        uint32_t entry;
    };
    /// After a fold with `own`: the edits of a ball's code, which is the least of them all; false where it is something else, or where octants
    /// (octants.h) may be cut out of it.
    bool unions_of(const Fold& fold, int ball, std::vector<Depth>& out) const;
    /// Appends code that joins one of them to the others, of which there may be none yet but Empty.
    void emit_union(const Fold& fold, int ball, Depth one, std::vector<Instruction>& out);
    /// Of how many edits it is.
    static size_t kept_count(const Fold& fold, int ball);
    /// The one material of everything in the ball; kSeveralMaterials where its edits have more than one.
    uint16_t only_material(const Fold& fold, int ball) const;
    /// How the ball's code begins. What was before that, and lost, is not in the code; yet it may have lost only because of an edit
    /// that is gone, or has come, and lost with it: code is another where its beginning is.
    struct Start {
        bool from_empty = true;
        uint32_t row = UINT32_MAX;
        friend bool operator==(const Start&, const Start&) = default;
    };
    Start start_of(const Fold& fold, int ball) const;
    static Start start_of(std::span<const Instruction> code, const Program& program);
    /// Drops `list` and all lists made after it.
    void drop(const List& list);

    /// After keep(): the balls in whose code an edit of `rows` is.
    uint64_t balls_with(const Fold& fold, std::span<const uint32_t> rows) const;
    /// After fold(): the balls throughout which what stands before an edit of `rows` decides, for each of them that is in the list.
    uint64_t balls_unchanged_by(const Fold& fold, std::span<const uint32_t> rows) const;

private:
    struct Entry {
        uint32_t row;
        uint32_t code_first, code_count;
        uint16_t material;  // the edit's
        bool plain;  // a union that blends with nothing, of a shape whose leaves run over a whole brick in one loop
        FoldEntry::Join join;
        bool made;  // the code was made for this list; else it is the program's
        bool tree;  // has something to prune inside
    };
    static TapeView numbers_of(const Program& program) {
        return {{}, program.params.data(), program.samples.data(), program.memory_slots};
    }
    std::span<const Instruction> code_of(const Entry& entry) const;
    /// fn(entry number, won, shown) for everything that a ball keeps, in order.
    template <typename Fn>
    static void each_kept(const Fold& fold, int ball, Fn&& fn);
    FoldEntry::Join join_of(const Entry& entry, bool won) const;
    void write_content(const Entry& entry, vec3 center, float radius, bool whole, std::vector<Instruction>& out);
    void write_join(const Entry& entry, FoldEntry::Join join, std::vector<Instruction>& out) const;

    const Program* program_;
    TapeView numbers_;
    std::vector<Entry> entries_;
    std::vector<Instruction> code_;
    std::vector<FoldEntry> fold_entries_;
    PruneScratch prune_;
};

}  // namespace kiln::sdf
