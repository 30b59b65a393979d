// SPDX-License-Identifier: MIT
// Which builder belongs to which kind is generated from list.inl.

#include "sdf/library/library.h"

#include "base/assert.h"

#include <cstring>
#include <type_traits>

namespace kiln::sdf {
namespace {

// A record's fields are its numbers in order of declaration.
template <typename Record>
Record record_of(const std::array<float, kMaxParams>& params) {
    static_assert(std::is_trivially_copyable_v<Record> && sizeof(Record) <= sizeof(params));
    Record record;
    std::memcpy(&record, params.data(), sizeof(Record));
    return record;
}

}  // namespace
}  // namespace kiln::sdf

#include "sdf/library.gen.inl"
