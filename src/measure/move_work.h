// SPDX-License-Identifier: MIT
// The work that `bench world` measures of things that move, apart from the clocks: a world of many dynamic edits.
#pragma once

#include <kiln/result.h>

#include <cstdint>
#include <memory>

namespace kiln {

class MoveWork {
public:
    explicit MoveWork(uint32_t things);
    ~MoveWork();
    MoveWork(const MoveWork&) = delete;
    MoveWork& operator=(const MoveWork&) = delete;

    Result<void> prepare();
    /// Everything goes elsewhere, and a frame is made.
    Result<void> frame(int turn);
    /// Of the last frame: its instances, and the bricks of a field that is the one it was at the beginning; 0 where it is another.
    uint64_t instances() const;
    uint64_t bricks() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
