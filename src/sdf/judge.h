// SPDX-License-Identifier: MIT
// The judge: the ordered list evaluated by walking its trees in double precision, node by node as the scene says. It shares the shape
// texts and resolve.h (references, bounds, Lipschitz factors) with the tape compiler; no tape, no culling, no float. Slow; for tests.
#pragma once

#include "sdf/program.h"

#include <memory>

namespace kiln::sdf {

/// Prepared once for many points; keeps references into `source`, which must outlive it. Any thread.
class Judge {
public:
    /// Fails exactly where compile() fails.
    static Result<Judge> create(const Source& source);
    /// Value of the ordered program, metres; kEmpty (1e30) in an empty world.
    double distance(dvec3 p_world) const;

private:
    friend struct JudgeBuilder;
    struct Prepared;
    std::shared_ptr<const Prepared> prepared_;
};

}  // namespace kiln::sdf
