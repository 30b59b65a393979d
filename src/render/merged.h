// SPDX-License-Identifier: MIT
// A frame's field with its instances in it, as the exact path and the path tracer see them: hard unions of moved programs.
#pragma once

#include <kiln/renderer.h>

namespace kiln::sdf {
class Program;
}

namespace kiln::render {

// The program of the frame's field or levels, then its instances in their order.
Result<sdf::Program> merged_program(const Frame& frame);
// A field of that, of a frame of one level: its options, with bounds that hold the instances. Its map is only for culling.
Result<std::shared_ptr<const field::Field>> merged_field(const Frame& frame);

}  // namespace kiln::render
