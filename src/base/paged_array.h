// SPDX-License-Identifier: MIT
// PagedArray: an array in pages that snapshots share: a tree of nodes of 16, its root a list. Copying one copies the root's pointers; changing
// an element copies its page, and the nodes on the way, only where another snapshot holds them too. Nodes are small because each pointer
// that is copied counts one holder more, and later one less. A page that was never written reads as `fill`.
// Reading is for any thread; writing is the owner's.
#pragma once

#include "base/shared.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace kiln {

/// Elements that hold Shareds: their counters are asked for together when all are copied or dropped.
template <typename T, size_t kCount>
struct CountedArray : std::array<T, kCount> {
    CountedArray() = default;
    CountedArray(const CountedArray& other) : std::array<T, kCount>(other.prefetched()) {}
    CountedArray& operator=(const CountedArray&) = delete;
    ~CountedArray() { prefetched(); }

private:
    const std::array<T, kCount>& prefetched() const {
        for (const T& one : *this) one.prefetch();
        return *this;
    }
};

template <typename T, size_t kPage>
class PagedArray {
    static constexpr bool kCounted = requires(const T& one) { one.prefetch(); };

public:
    static constexpr size_t kPageSize = kPage;
    using Page = std::conditional_t<kCounted, CountedArray<T, kPage>, std::array<T, kPage>>;

    PagedArray() = default;
    explicit PagedArray(const T& fill) : fill_(fill) {}

    /// Grows to at least `pages` pages.
    void resize_pages(size_t pages) {
        pages_ = std::max(pages, pages_);
        root_.resize((pages_ + kBranchPages - 1) / kBranchPages);
    }
    size_t pages() const { return pages_; }
    size_t size() const { return pages_ * kPage; }

    const T& operator[](size_t i) const {
        const Page* const page = find(i / kPage);
        return page != nullptr ? (*page)[i % kPage] : fill_;
    }
    /// Null where nothing was ever written.
    const Page* find(size_t page) const {
        const Branch* const branch = root_[page / kBranchPages].get();
        if (branch == nullptr) return nullptr;
        const Twig* const twig = branch->twigs[page / kNode % kNode].get();
        return twig != nullptr ? twig->pages[page % kNode].get() : nullptr;
    }
    const T& fill() const { return fill_; }
    bool same_page(const PagedArray& other, size_t page) const {
        return page < other.pages_ && find(page) == other.find(page);
    }

    /// fn(page) for each page that the other, of as many pages, does not share. Nodes that are shared are passed over whole.
    template <typename Fn>
    void each_other_page(const PagedArray& other, Fn&& fn) const {
        const auto twig = [](const Shared<Branch>& branch, size_t i) {
            return branch ? branch->twigs[i].get() : nullptr;
        };
        for (size_t at = 0; at < root_.size() * kNode; ++at) {
            const Shared<Branch>&mine = root_[at / kNode], &theirs = other.root_[at / kNode];
            if (mine == theirs || twig(mine, at % kNode) == twig(theirs, at % kNode)) continue;
            for (size_t page = at * kNode; page < std::min((at + 1) * kNode, pages_); ++page) {
                if (find(page) != other.find(page)) fn(page);
            }
        }
    }

    T& write(size_t i) { return write_page(i / kPage)[i % kPage]; }
    Page& write_page(size_t page) {
        Shared<Page>& place = place_of(page);
        if (!place) place.write().fill(fill_);
        return place.write();
    }
    void set_page(size_t page, Shared<Page> content) { place_of(page) = std::move(content); }

private:
    static constexpr size_t kNode = 16;
    static constexpr size_t kBranchPages = kNode * kNode;
    struct Twig {
        CountedArray<Shared<Page>, kNode> pages;
    };
    struct Branch {
        CountedArray<Shared<Twig>, kNode> twigs;
    };

    Shared<Page>& place_of(size_t page) {
        return root_[page / kBranchPages].write().twigs[page / kNode % kNode].write().pages[page % kNode];
    }

    std::vector<Shared<Branch>> root_;
    size_t pages_ = 0;
    T fill_{};
};

}  // namespace kiln
