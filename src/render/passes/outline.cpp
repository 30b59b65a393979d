// SPDX-License-Identifier: MIT
#include "render/passes/forward.h"
#include "render/passes/upscale.h"
#include "render/passes/outline.gpu.h"
#include "field/brick_set.h"
#include "render/passes/passes.h"

#include "shaders/outline_draw.spv.h"
#include "shaders/outline_flood.spv.h"
#include "shaders/outline_mask.spv.h"

#include <algorithm>

namespace kiln::render {

const Kernel kOutlineMask{"outline mask", kOutlineMaskSpv};
const Kernel kOutlineFlood{"outline flood", kOutlineFloodSpv};
const Kernel kOutlineDraw{"outline draw", kOutlineDrawSpv};

OutlineCode outline_code(std::span<const EditOutline> outlines, const sdf::Program& field,
                         std::span<const Instance> instances) {
    OutlineCode out;
    for (const EditOutline& o : outlines) {
        if (o.instance != kNoInstance && o.instance >= instances.size()) continue;
        const sdf::Program& program = o.instance == kNoInstance ? field : instances[o.instance].bricks->program();
        if (o.row >= program.edits.size()) continue;
        const sdf::EditSpan& row = program.edits[o.row];
        if (row.count == 0) continue;
        const uint32_t first = uint32_t(out.code.size());
        bool on_gpu = true;
        for (uint32_t i = 0; i + 1 < row.count; ++i) {  // the last combines it with the world
            out.code.push_back(program.code[row.first + i]);
            on_gpu = on_gpu && !out.code.back().cpu_only();
        }
        if (!on_gpu) {
            out.code.resize(first);
            ++out.left_out;
            continue;
        }
        out.code.push_back(sdf::Instruction::make(sdf::Opcode::Move, 0, 0, 1, 0, 0));
        OutlineRecord r{};
        r.red = o.outline.color.x, r.green = o.outline.color.y, r.blue = o.outline.color.z;
        r.width_px = o.outline.width_px;
        r.code_first = first;
        r.code_count = uint32_t(out.code.size()) - first;
        r.blend = 0.25f * row.blend;
        r.paints = row.op == Op::Paint ? 1 : 0;
        r.instance = o.instance;
        out.records.push_back(r);
        out.of.push_back(uint32_t(&o - outlines.data()));
        out.widest = std::max(out.widest, o.outline.width_px);
    }
    return out;
}

OutlineMask edit_owners(Graph& g, const TileInputs& in, const OwnerHandles& asked, const Image& visibility) {
    OutlineMask out;
    out.owners = g.create("outline owners", {.size = in.size, .format = rhi::Format::R32Uint});
    out.seeds = g.create("outline seeds", {.size = in.size, .format = rhi::Format::R32Uint});
    const OutlinePush push{int(in.size.width), int(in.size.height), 0, asked.count};
    const InstanceHandles& i = in.instances;
    g.dispatch(
        specialised(kOutlineMask, asked.use), in.size,
        {g.uniform(in.frame), g.read(in.rays), g.read(asked.code), g.read(in.field.numbers), g.read(asked.records),
         g.read(visibility), g.write(out.owners), g.write(out.seeds), g.read(i ? i.instances : in.field.numbers),
         g.read(i ? i.sets : in.field.numbers), g.read(i ? i.numbers : in.field.numbers)},
        push);
    return out;
}

OutlineMask outline_mask(Graph& g, const TileInputs& in, const Image& visibility) {
    return edit_owners(g, in, {in.outlines, in.outline_code, in.outline_count, in.use_of_outlines}, visibility);
}

Image outline_flood(Graph& g, const Buffer& records, const OutlineMask& mask, float widest) {
    int step = 1;
    while (float(step) < widest + 1) step *= 2;
    Image seeds = mask.seeds;
    const auto flood = [&](int by) {
        Image next = g.create("outline seeds", {.size = seeds.size, .format = rhi::Format::R32Uint});
        g.dispatch(kOutlineFlood, seeds.size, {g.read(records), g.read(mask.owners), g.read(seeds), g.write(next)},
                   OutlinePush{int(seeds.size.width), int(seeds.size.height), by, 0});
        seeds = next;
    };
    // A step of one before and after leaves hardly a pixel with another seed than the nearest.
    flood(1);
    for (; step > 0; step /= 2) flood(step);
    flood(1);
    return seeds;
}

Image outline(Graph& g, const TileInputs& in, const Image& visibility, const Image& shown) {
    OutlineMask mask;
    if (in.outline_count > 0) {
        mask = outline_mask(g, in, visibility);
    } else {
        mask.owners = g.create("outline owners", {.size = in.size, .format = rhi::Format::R32Uint});
        mask.seeds = g.create("outline seeds", {.size = in.size, .format = rhi::Format::R32Uint});
    }
    mark_meshes(g, in, visibility, in.outline_count, mask);
    if (in.outline_hidden) mark_hidden(g, in, mask);
    if (in.upscales) mask = upscale_mask(g, in, mask);
    const Image seeds = outline_flood(g, in.outlines, mask, in.widest_outline);
    Image out = g.create("shown outlined", {.size = shown.size, .format = rhi::Format::Rgba8Unorm});
    g.dispatch(kOutlineDraw, shown.size,
               {g.read(in.outlines), g.read(mask.owners), g.read(seeds), g.read(shown), g.write(out)},
               OutlinePush{int(shown.size.width), int(shown.size.height), 0, 0});
    return out;
}

}  // namespace kiln::render
