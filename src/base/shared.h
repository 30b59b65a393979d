// SPDX-License-Identifier: MIT
// Shared: a counted pointer to a value that several snapshots may hold. write() hands the value out for change: the very one where
// nobody else holds it, a copy where someone does, so a snapshot never sees a change. Counting is for any thread; one Shared object
// belongs to one thread at a time.
#pragma once

#include "base/block_pool.h"

#include <atomic>
#include <cstdint>
#include <utility>

namespace kiln {

template <typename T>
class Shared {
public:
    Shared() = default;
    template <typename... Args>
    static Shared make(Args&&... args) {
        static_assert(alignof(T) <= kBlockAlign);
        Shared out;
        out.box_ = new Box(std::in_place, std::forward<Args>(args)...);
        return out;
    }
    Shared(const Shared& other) : box_(other.box_) {
        if (box_ != nullptr) box_->holders.fetch_add(1, std::memory_order_relaxed);
    }
    Shared(Shared&& other) noexcept : box_(std::exchange(other.box_, nullptr)) {}
    Shared& operator=(Shared other) noexcept {
        std::swap(box_, other.box_);
        return *this;
    }
    ~Shared() {
        if (box_ != nullptr && box_->holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete box_;
    }

    explicit operator bool() const { return box_ != nullptr; }
    const T& operator*() const { return box_->value; }
    const T* operator->() const { return &box_->value; }
    const T* get() const { return box_ != nullptr ? &box_->value : nullptr; }

    /// For the owner alone; makes a default value where there is none.
    T& write() {
        if (box_ == nullptr) {
            *this = make();
        } else if (box_->holders.load(std::memory_order_acquire) != 1) {
            *this = make(std::as_const(box_->value));
        }
        return box_->value;
    }
    /// A fresh value, without copying what was there: default-initialised, so numbers without an initialiser hold anything.
    T& renew() {
        Shared out;
        out.box_ = new Box;
        *this = std::move(out);
        return box_->value;
    }
    /// Asks for the memory that counts holders, which is written when this is copied or dropped. Whoever does that to many asks for all
    /// of them first: writes that count wait for each other, and so would what they wait for.
    void prefetch() const { __builtin_prefetch(box_, 1); }

    friend bool operator==(const Shared& a, const Shared& b) { return a.box_ == b.box_; }

private:
    struct Box {
        std::atomic<uint32_t> holders;
        T value;

        Box() : holders(1) {}
        template <typename... Args>
        explicit Box(std::in_place_t, Args&&... args) : holders(1), value{std::forward<Args>(args)...} {}
        static void* operator new(size_t size) { return take_block(size); }
        static void operator delete(void* box, size_t size) { give_block(box, size); }
    };
    Box* box_ = nullptr;
};

}  // namespace kiln
