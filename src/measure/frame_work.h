// SPDX-License-Identifier: MIT
// The work that `bench frame` measures: pictures of a bundled scene on the device that is chosen by itself.
#pragma once

#include <kiln/result.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

struct Frame;

class FrameWork {
public:
    /// Fails where nothing can draw.
    static Result<FrameWork> create();
    FrameWork(FrameWork&&) noexcept;
    ~FrameWork();

    Result<void> load(std::string_view scene);
    void show(const Frame& frame);
    /// One picture of what was loaded or shown: the hash of its bytes. Costs are in `passes`, with "all" last.
    Result<uint64_t> draw(int width, int height);
    std::vector<std::pair<std::string, double>> passes() const;  ///< ms

private:
    struct Impl;
    explicit FrameWork(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
