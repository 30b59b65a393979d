// SPDX-License-Identifier: MIT
// The march as rays through a box tree; see march_trace.rgen.
#include "render/passes/passes.h"

#include "shaders/march_trace_rchit.spv.h"
#include "shaders/march_trace_rgen.spv.h"
#include "shaders/march_trace_rint.spv.h"
#include "shaders/march_trace_rmiss.spv.h"

namespace kiln::render {

const TraceKernel kMarchTrace{.name = "march by boxes",
                              .raygen = kMarchTraceRgenSpv,
                              .miss = kMarchTraceRmissSpv,
                              .intersection = kMarchTraceRintSpv,
                              .closest_hit = kMarchTraceRchitSpv};

Buffer march_boxes(Graph& g, const TileInputs& in, const Image& ends, Image& words) {
    const auto tiles = [](uint32_t pixels) { return (pixels + kTileGroup - 1) / kTileGroup; };
    Buffer counted = g.create_buffer("march evaluations", uint64_t{tiles(in.size.width)} * tiles(in.size.height) * 4);
    g.clear(counted);
    const FieldHandles& f = in.field;
    g.trace(kMarchTrace, in.size,
            {g.uniform(in.frame), g.read(f.cells), g.read(in.rays), g.read(f.distances), g.write(words),
             g.read(f.tables), g.read_write(counted), g.read(in.boxes.cells), g.read(in.boxes.tree), g.read(ends)});
    return counted;
}

}  // namespace kiln::render
