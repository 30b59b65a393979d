// SPDX-License-Identifier: MIT
// The past of a scene that is edited: SCENE.history, a record file (base/record_file.h) with what saving takes out of the journal, so that
// undo reaches beyond saves, in this program and in later ones.
//   record 1         the text of the scene file that the past begins with
//   {"journal": N}   what follows is the journal's from its record N on, up to a `saved`
// Applied one after another they lead to the scene file. Nothing depends on the file: where it is damaged, or leads to another scene, the
// scene and its journal are whole without it, and history begins with them.
#pragma once

#include "scene/journal.h"

#include "base/record_file.h"

#include <string>

namespace kiln::scene {

/// A past keeps no more than this beside the text that it begins with. A save that would make it longer begins it anew, at the save before.
inline constexpr uint64_t kMostPastBytes = uint64_t(64) << 20;

std::string past_path(const std::string& scene);

/// The records that lead to a scene of this hash, and the bytes they take; none where the past does not lead there.
Records records_to(std::string_view bytes, const Hash128& scene);

std::string chunk_record(uint32_t first);

/// Of a scene that is open for editing.
class Past {
public:
    /// `bytes` is what was in the file.
    static Result<Past> open(const std::string& scene, std::string& bytes);

    /// The file continues behind these records, which lead to the scene file of this hash; what the journal has from `next` on is not in it.
    Result<void> resume(const Records& records, const Hash128& scene, uint32_t next);
    /// Nothing leads to the scene file.
    void begin(const Hash128& scene, uint32_t next);
    /// Before the scene file is replaced: takes in what the journal has, up to its mark of what is to be saved, a scene of that hash. On the
    /// disk when this returns; where it fails the file is as it was.
    Result<void> take_in(const Journal& journal, const Hash128& scene);
    /// The scene file is that of this hash now; the journal's record `next` is the first behind it.
    void saved(const Hash128& scene, uint32_t next) { scene_ = end_ = scene, after_scene_ = after_end_ = next; }

private:
    explicit Past(RecordFile file) : file_(std::move(file)) {}

    RecordFile file_;
    Hash128 scene_, end_;  // of the scene file; what the file leads to: a save that failed may lie between
    uint32_t after_scene_ = 1, after_end_ = 1;  // the journal's records
    bool leads_ = false;                        // it leads anywhere
    uint64_t first_bytes_ = 0;                  // of the text that it begins with
};

}  // namespace kiln::scene
