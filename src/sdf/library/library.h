// SPDX-License-Identifier: MIT
// Composite shapes: object trees made of primitives, by name, one file and one line in list.inl each.
#pragma once

#include <kiln/edit.h>

namespace kiln::sdf {

/// The tree of a composite shape (kind >= primitive_count()).
Object composite_object(uint16_t kind, const std::array<float, kMaxParams>& params);

}  // namespace kiln::sdf
