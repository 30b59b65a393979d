// SPDX-License-Identifier: MIT
// PagedArray: an array in pages that snapshots share. Copying one copies pointers to groups of pages; changing an element copies its
// page (and its group's pointers) only where another snapshot holds them too. A page that was never written reads as `fill`.
// Reading is for any thread; writing is the owner's.
#pragma once

#include "base/shared.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

template <typename T, size_t kPage>
class PagedArray {
public:
    static constexpr size_t kPageSize = kPage;
    using Page = std::array<T, kPage>;

    PagedArray() = default;
    explicit PagedArray(const T& fill) : fill_(fill) {}

    /// Grows to at least `pages` pages.
    void resize_pages(size_t pages) {
        pages_ = std::max(pages, pages_);
        groups_.resize((pages_ + kGroup - 1) / kGroup);
    }
    size_t pages() const { return pages_; }
    size_t size() const { return pages_ * kPage; }

    const T& operator[](size_t i) const {
        const Page* const page = find(i / kPage);
        return page != nullptr ? (*page)[i % kPage] : fill_;
    }
    /// Null where nothing was ever written.
    const Page* find(size_t page) const {
        const Shared<Group>& group = groups_[page / kGroup];
        return group ? group->pages[page % kGroup].get() : nullptr;
    }
    const T& fill() const { return fill_; }
    bool same_page(const PagedArray& other, size_t page) const {
        return page < other.pages_ && find(page) == other.find(page);
    }

    /// fn(page) for each page that the other, of as many pages, does not share. Groups that are shared are passed over whole.
    template <typename Fn>
    void each_other_page(const PagedArray& other, Fn&& fn) const {
        for (size_t group = 0; group < groups_.size(); ++group) {
            if (groups_[group] == other.groups_[group]) continue;
            for (size_t page = group * kGroup; page < std::min((group + 1) * kGroup, pages_); ++page) {
                if (find(page) != other.find(page)) fn(page);
            }
        }
    }

    T& write(size_t i) { return write_page(i / kPage)[i % kPage]; }
    Page& write_page(size_t page) {
        Shared<Page>& slot = groups_[page / kGroup].write().pages[page % kGroup];
        if (!slot) slot.write().fill(fill_);
        return slot.write();
    }
    void set_page(size_t page, Shared<Page> content) {
        groups_[page / kGroup].write().pages[page % kGroup] = std::move(content);
    }

private:
    static constexpr size_t kGroup = 64;
    struct Group {
        std::array<Shared<Page>, kGroup> pages;
    };
    std::vector<Shared<Group>> groups_;
    size_t pages_ = 0;
    T fill_{};
};

}  // namespace kiln
