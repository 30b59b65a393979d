// SPDX-License-Identifier: MIT
// The tables of wide.h for one state of host bricks: made when it is first asked, from those of an earlier state where they were made:
// then only cells that changed since are looked at, and pages of cells that did not change are shared.
#pragma once

#include "base/shared.h"
#include "field/brick_content.h"
#include "field/field.h"
#include "field/ways.h"
#include "field/wide.h"

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace kiln::field {

class WideTables {
public:
    WideTables() = default;
    /// For the state after one in which the texels of `baked` slots, and cells, changed. `before` may be in use elsewhere.
    static std::shared_ptr<WideTables> after(const std::shared_ptr<WideTables>& before, const MadeBricks& baked);

    /// Of the one state they are for. Any thread.
    const WideView& view(const Field& field, const BrickContents& contents) {
        if (!ready_.load(std::memory_order_acquire)) make(field, contents);
        return view_;
    }

private:
    using Pages = PagedArray<WideEntry, std::tuple_size_v<WidePage>>;

    void make(const Field& field, const BrickContents& contents);
    void set(size_t page, size_t index, WidePage& to, const BrickContents& contents);
    void make_page(size_t page, const BrickContents& contents);
    void change_page(size_t page, const CellMap& before, const BrickContents& contents);
    void change_brick(uint32_t slot, const Field& field, const BrickContents& contents);

    std::atomic<bool> ready_ = false;
    std::mutex mutex_;

    // Once ready:
    CellMap cells_;  // the words that entries were made from
    Pages pages_;
    std::vector<const WidePage*> top_;
    Shared<Ways> ways_;
    std::shared_ptr<const std::array<std::vector<uint64_t>, 3>> places_;
    WideView view_;

    // Until then: tables that are ready, and slots baked since. None: everything is to be made.
    std::shared_ptr<WideTables> base_;
    std::vector<uint32_t> baked_;
};

}  // namespace kiln::field
