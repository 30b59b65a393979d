// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "base/parallel_for.h"
#include "render/lib/octahedral.gpu.h"
#include "render/passes/refine.gpu.h"
#include "sdf/eval.h"
#include "shaders/refine.spv.h"

#include <algorithm>
#include <array>
#include <bit>

namespace kiln::render {

const Kernel kRefine{"refine", kRefineSpv};

Image refine(Graph& g, const TileInputs& in, const Image& visibility) {
    Image out = g.create("refined", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    const FieldHandles& f = in.field;
    g.dispatch(specialised(kRefine, in.use_of_bricks), in.size,
               {g.uniform(in.frame), g.read(f.records), g.read(f.code), g.read(f.program), g.read(f.numbers),
                g.read(in.rays), g.read(visibility), g.write(out)});
    return out;
}

namespace {

constexpr size_t kMostAtOnce = 256;  // points of one brick

// Points of one brick, looked at together.
struct Batch {
    std::array<float, kMostAtOnce> x, y, z, d;
    std::array<sdf::MaterialMix, kMostAtOnce> mixes;
    std::array<vec3, kMostAtOnce> direction, gradient;
    std::array<float, kMostAtOnce> t_first, t, t_before, d_before, size;
    std::array<bool, kMostAtOnce> holds;
};

}  // namespace

std::vector<uint32_t> refine_on_host(const BrickCode& bricks, const FrameParams& frame,
                                     std::span<const uint32_t> visibility) {
    const size_t pixels = visibility.size() / 4;
    std::vector<uint32_t> out(visibility.size());
    for (size_t i = 0; i < pixels; ++i) out[4 * i] = kNotRefined;
    std::vector<uint32_t> asked;  // by brick, so that many points share one piece of code
    for (size_t i = 0; i < pixels; ++i)
        if (visibility[4 * i + 1] >> 28 == kSeenBrick) asked.push_back(uint32_t(i));
    const auto slot_of = [&](uint32_t pixel) { return visibility[4 * size_t{pixel} + 1] & 0x0fffffffu; };
    std::stable_sort(asked.begin(), asked.end(), [&](uint32_t a, uint32_t b) { return slot_of(a) < slot_of(b); });
    std::vector<size_t> firsts;
    for (size_t i = 0; i < asked.size(); ++i)
        if (i == 0 || slot_of(asked[i]) != slot_of(asked[i - 1]) || i - firsts.back() == kMostAtOnce)
            firsts.push_back(i);

    const float finest = frame.grid.voxel_size;
    const vec3 origin{(float(frame.eye_x) + frame.eye_part_x) * finest,
                      (float(frame.eye_y) + frame.eye_part_y) * finest,
                      (float(frame.eye_z) + frame.eye_part_z) * finest};
    parallel_for(int(firsts.size()), bricks.workers, [&](int group) {
        thread_local Batch b;
        const size_t first = firsts[size_t(group)];
        const size_t last = size_t(group) + 1 < firsts.size() ? firsts[size_t(group) + 1] : asked.size();
        const std::span<const uint32_t> here(asked.data() + first, last - first);
        const field::BrickRecord& record = (*bricks.records)[slot_of(here[0])];
        if (record.far != 0) return;
        const sdf::TapeView tape =
            sdf::view(*bricks.program, bricks.code.subspan(record.code_first, record.code_count));
        const float scale = float(1u << record.level), h = finest * scale;  // t counts voxels of the brick's level
        const sdf::Points points{b.x.data(), b.y.data(), b.z.data(), int(here.size())};
        for (size_t k = 0; k < here.size(); ++k) {
            const int x = int(here[k]) % frame.tile_width + frame.tile_x,
                      y = int(here[k]) / frame.tile_width + frame.tile_y;
            b.direction[k] = shade::camera_direction_at(frame.camera, float(x) + 0.5f, float(y) + 0.5f);
            b.t_first[k] = b.t[k] = b.t_before[k] = std::bit_cast<float>(visibility[4 * size_t{here[k]}]) / scale;
            b.d_before[k] = 0;
            const vec3 at = origin + b.direction[k] * (b.t[k] * h);
            b.size[k] = gpu::largest3({std::fabs(at.x), std::fabs(at.y), std::fabs(at.z)});
            b.gradient[k] = {};
        }
        for (int look = -kRefineSteps; look < 7; ++look) {
            const int axis = (look - 1) / 2;
            const float side = look <= 0 ? 0.0f : (look % 2 == 1 ? 1.0f : -1.0f);
            for (size_t k = 0; k < here.size(); ++k) {
                vec3 p = origin + b.direction[k] * (b.t[k] * h);
                if (look > 0) {
                    const float step = side * refine_gradient_step(h, b.size[k]);
                    (axis == 0 ? p.x : axis == 1 ? p.y : p.z) += step;
                }
                b.x[k] = p.x, b.y[k] = p.y, b.z[k] = p.z;
            }
            if (look == 0) {
                sdf::evaluate_materials(tape, points, b.d.data(), b.mixes.data());
            } else {
                sdf::evaluate(tape, points, b.d.data());
            }
            bool searching = false;
            for (size_t k = 0; k < here.size(); ++k) {
                const float d = b.d[k] / h;
                if (look < 0) {
                    if (std::fabs(d) <= refine_enough(h, b.size[k])) continue;
                    searching = true;
                    const float next = refine_next(look + kRefineSteps, b.t_before[k], b.d_before[k], b.t[k], d);
                    b.t_before[k] = b.t[k];
                    b.d_before[k] = d;
                    b.t[k] = next;
                } else if (look == 0) {
                    b.holds[k] = refine_holds(b.t_first[k], b.t[k], d);
                } else {
                    (axis == 0 ? b.gradient[k].x : axis == 1 ? b.gradient[k].y : b.gradient[k].z) += side * d;
                }
            }
            if (look < 0 && !searching) look = -1;
        }
        for (size_t k = 0; k < here.size(); ++k) {
            const float steep = length(b.gradient[k]);
            if (!b.holds[k] || !(steep > 0)) continue;
            uint32_t* const words = out.data() + 4 * size_t{here[k]};
            words[0] = std::bit_cast<uint32_t>(b.t[k] * scale);
            words[1] = shade::pack_unit(b.gradient[k] * (1 / steep));
            words[2] = uint32_t(b.mixes[k].id0) | uint32_t(b.mixes[k].id1) << 16;
            words[3] = std::bit_cast<uint32_t>(b.mixes[k].weight);
        }
    });
    return out;
}

}  // namespace kiln::render
