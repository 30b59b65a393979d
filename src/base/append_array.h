// SPDX-License-Identifier: MIT
// AppendArray: an array that only grows, cheap to copy. Elements never change or move while anyone looks at them; a copy keeps its own
// length, so snapshots of different lengths share one buffer and the newest may append while others are read on other threads.
// Appending to a copy that is not the newest, or past the room there is, goes to a buffer of its own.
#pragma once

#include "base/assert.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

namespace kiln {

template <typename T>
class AppendArray {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    AppendArray() = default;

    size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    const T* data() const { return buffer_ ? buffer_->items : nullptr; }
    const T* begin() const { return data(); }
    const T* end() const { return data() + size_; }
    const T& operator[](size_t i) const { return buffer_->items[i]; }
    const T& back() const { return buffer_->items[size_ - 1]; }
    operator std::span<const T>() const { return {data(), size_}; }
    std::span<const T> subspan(size_t first, size_t count) const { return {data() + first, count}; }

    /// Index of the first of the new elements.
    size_t append(std::span<const T> more) {
        const size_t at = size_;
        std::copy(more.begin(), more.end(), extend(more.size()));
        return at;
    }
    size_t append(std::initializer_list<T> more) { return append(std::span<const T>(more.begin(), more.size())); }
    void push_back(const T& one) { append(std::span<const T>(&one, 1)); }
    /// `count` new elements for the caller to fill before anyone else sees this array.
    T* extend(size_t count) {
        if (!buffer_ || buffer_->used != size_ || buffer_->room - size_ < count) grow(size_ + count);
        T* const at = buffer_->items + size_;
        size_ += count;
        buffer_->used = size_;
        return at;
    }
    /// Untouched room costs address space only, so the first request may be generous.
    void reserve(size_t room) {
        if (!buffer_ || buffer_->room < room) grow(room);
    }

    /// Whether this array's beginning is all of `older`, in the same memory.
    bool extends(const AppendArray& older) const { return buffer_ == older.buffer_ && size_ >= older.size_; }

private:
    struct Buffer {
        T* items;
        size_t room;
        size_t used;  // by the newest holder; only that one writes it
        explicit Buffer(size_t wanted)
            : items(static_cast<T*>(std::malloc(std::max<size_t>(wanted, 1) * sizeof(T)))), room(wanted), used(0) {
            if (items == nullptr) throw std::bad_alloc();
        }
        ~Buffer() { std::free(items); }
        Buffer(const Buffer&) = delete;
        Buffer& operator=(const Buffer&) = delete;
    };

    void grow(size_t least) {
        auto next = std::make_shared<Buffer>(std::max({least, 2 * size_, size_t(64)}));
        std::copy_n(data(), size_, next->items);
        next->used = size_;
        buffer_ = std::move(next);
    }

    std::shared_ptr<Buffer> buffer_;
    size_t size_ = 0;
};

}  // namespace kiln
