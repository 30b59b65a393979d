// SPDX-License-Identifier: MIT
// Edits of the field that moved since the frame before, as the motion pass wants them: whose a pixel is, its own code says, as it does for
// outlines.
#pragma once

#include "render/passes/motion.gpu.h"
#include "render/passes/passes.h"

namespace kiln::render {

struct MovedEdits {
    OutlineCode code;
    std::vector<MovedRecord> records;  // of code.records
    std::vector<ChangedBox> boxes;
};
MovedEdits moved_edits(const Frame& frame, const sdf::Program& program, const FrameParams& params);

}  // namespace kiln::render
