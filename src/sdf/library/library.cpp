// SPDX-License-Identifier: MIT

#include "sdf/library/library.h"

namespace kiln::sdf {

Object composite_object(uint16_t, const std::array<float, kMaxParams>&) { return {}; }

}  // namespace kiln::sdf
