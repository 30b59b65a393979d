// SPDX-License-Identifier: MIT
#include "render/merged.h"

#include "field/brick_set.h"
#include "field/clipmap.h"
#include "field/field.h"
#include "sdf/place.h"

#include <algorithm>

namespace kiln::render {

Result<sdf::Program> merged_program(const Frame& frame) {
    const sdf::Program& beside = frame.levels ? *frame.levels->program() : frame.field->program();
    const auto solid = [](const Instance& i) { return i.glass == 0; };
    if (std::none_of(frame.instances.begin(), frame.instances.end(), solid)) return beside;
    sdf::Program out = sdf::detached(beside);
    uint64_t order = 0;
    for (const uint32_t row : out.rows()) order = std::max(order, out.edits[row].order);
    for (const Instance& i : frame.instances) {
        if (!solid(i)) continue;
        order = sdf::order_between(order, UINT64_MAX);
        auto placed = sdf::place(out, i.bricks->program(), i.pose, i.material, order);
        if (!placed) return placed.error();
    }
    return out;
}

Result<std::shared_ptr<const field::Field>> merged_field(const Frame& frame) {
    auto program = merged_program(frame);
    if (!program) return program.error();
    field::FieldOptions options = frame.field->options();
    const size_t before = frame.field->program().edits.size();
    for (size_t row = before; row < program->edits.size(); ++row) {
        const Box3& box = program->edits[row].bounds;
        if (!box.empty()) options.bounds = box_union(options.bounds, box.inflated(2 * options.voxel_size));
    }
    return field::Field::build(std::make_shared<const sdf::Program>(std::move(*program)), options);
}

}  // namespace kiln::render
