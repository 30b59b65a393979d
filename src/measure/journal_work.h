// SPDX-License-Identifier: MIT
// The work that `bench journal` measures, apart from the clocks: a world of many edits, as a file that is open for editing or without one.
#pragma once

#include <kiln/edit.h>
#include <kiln/result.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace kiln {

class JournalWork {
public:
    /// `voxel_size`: of the field over [-1, 1]^3, metres.
    JournalWork(std::vector<Edit> edits, float voxel_size);
    ~JournalWork();
    JournalWork(const JournalWork&) = delete;
    JournalWork& operator=(const JournalWork&) = delete;

    /// A fresh world with a history, in a file with an empty journal or in no file.
    Result<void> prepare(bool journaled);
    /// Of four commands one adds an edit, two change one and one removes the edit that was added, so the world keeps its size.
    Result<void> change(uint32_t commands);
    /// Reads the file and its journal again, and answers the hash of the scene's text.
    Result<uint64_t> reopen() const;
    uint64_t hash() const;

    /// Moves the i-th edit a little, or takes that back, until the field holds it.
    Result<void> edit(uint32_t i);
    Result<void> undo();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
