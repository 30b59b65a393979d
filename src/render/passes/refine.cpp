// SPDX-License-Identifier: MIT
#include "render/passes/instances.h"
#include "render/passes/passes.h"

#include "base/parallel_for.h"
#include "field/cubic.gpu.h"
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
    std::array<sdf::MaterialMix, kMostAtOnce> mixes, mixes_beside;
    std::array<vec3, kMostAtOnce> direction, gradient;
    std::array<float, kMostAtOnce> t_first, t, t_before, d_before, size, d_here, d_up;
    std::array<bool, kMostAtOnce> holds, up_is_other;
};

// Looks at the batch's first `count` points until each is where `tape` has the surface, then round it for the gradient. at(k, t): the
// place of point k, metres of the tape's frame; `h`: metres of a voxel, in which t counts.
template <typename At>
void look_at(Batch& b, size_t count, const sdf::TapeView& tape, float h, At&& at) {
    const sdf::Points points{b.x.data(), b.y.data(), b.z.data(), int(count)};
    for (size_t k = 0; k < count; ++k) {
        // A copy: of at(k, b.t[k]), GCC 12 read b.t[k] as it was before this loop where the loop runs once.
        const float t = b.t_first[k];
        b.t[k] = b.t_before[k] = t;
        b.d_before[k] = 0;
        const vec3 p = at(k, t);
        b.size[k] = gpu::largest3({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
        b.gradient[k] = {};
    }
    for (int look = -kRefineSteps; look < 7; ++look) {
        const int axis = (look - 1) / 2;
        const float side = look <= 0 ? 0.0f : (look % 2 == 1 ? 1.0f : -1.0f);
        for (size_t k = 0; k < count; ++k) {
            vec3 p = at(k, b.t[k]);
            if (look > 0) {
                const float step = side * refine_gradient_step(h, b.size[k]);
                (axis == 0 ? p.x : axis == 1 ? p.y : p.z) += step;
            }
            b.x[k] = p.x, b.y[k] = p.y, b.z[k] = p.z;
        }
        if (look >= 0) {
            sdf::evaluate_materials(tape, points, b.d.data(), look == 0 ? b.mixes.data() : b.mixes_beside.data());
        } else {
            sdf::evaluate(tape, points, b.d.data());
        }
        bool searching = false;
        for (size_t k = 0; k < count; ++k) {
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
                b.d_here[k] = d;
            } else if (look % 2 == 1) {
                b.d_up[k] = d;
                b.up_is_other[k] = b.mixes_beside[k].id0 != b.mixes[k].id0;
            } else {
                (axis == 0   ? b.gradient[k].x
                 : axis == 1 ? b.gradient[k].y
                             : b.gradient[k].z) =
                    refine_slope(b.d_up[k], d, b.d_here[k], b.up_is_other[k], b.mixes_beside[k].id0 != b.mixes[k].id0);
            }
        }
        if (look < 0 && !searching) look = -1;
    }
}

// The pixels of a picture whose state is `state`, ordered by key and cut into runs of one key, kMostAtOnce at most.
struct Runs {
    std::vector<uint32_t> pixels;
    std::vector<size_t> firsts;

    template <typename Key>
    Runs(std::span<const uint32_t> visibility, uint32_t state, Key&& key) {
        for (size_t i = 0; i < visibility.size() / 4; ++i)
            if (visibility[4 * i + 1] >> 28 == state) pixels.push_back(uint32_t(i));
        std::stable_sort(pixels.begin(), pixels.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
        for (size_t i = 0; i < pixels.size(); ++i)
            if (i == 0 || key(pixels[i]) != key(pixels[i - 1]) || i - firsts.back() == kMostAtOnce) firsts.push_back(i);
    }
    std::span<const uint32_t> run(int number) const {
        const size_t first = firsts[size_t(number)];
        const size_t last = size_t(number) + 1 < firsts.size() ? firsts[size_t(number) + 1] : pixels.size();
        return std::span(pixels).subspan(first, last - first);
    }
};

vec3 direction_of(const FrameParams& frame, uint32_t pixel) {
    const int x = int(pixel) % frame.tile_width + frame.tile_x, y = int(pixel) / frame.tile_width + frame.tile_y;
    return shade::camera_direction_at(frame.camera, float(x) + 0.5f, float(y) + 0.5f);
}

// `t` in finest voxels, the normal in the world.
void write_words(uint32_t* words, float t, vec3 normal, const sdf::MaterialMix& mix) {
    words[0] = std::bit_cast<uint32_t>(t);
    words[1] = shade::pack_unit(normal);
    words[2] = uint32_t(mix.id0) | uint32_t(mix.id1) << 16;
    words[3] = std::bit_cast<uint32_t>(mix.weight);
}

}  // namespace

std::vector<uint32_t> refine_on_host(const BrickCode& bricks, const FrameParams& frame,
                                     std::span<const uint32_t> visibility) {
    std::vector<uint32_t> out(visibility.size());
    for (size_t i = 0; i < visibility.size() / 4; ++i) out[4 * i] = kNotRefined;
    // By brick, so that many points share one piece of code.
    const auto slot_of = [&](uint32_t pixel) { return visibility[4 * size_t{pixel} + 1] & 0x0fffffffu; };
    const Runs runs(visibility, kSeenBrick, slot_of);
    const float finest = frame.grid.voxel_size;
    const vec3 origin{(float(frame.eye_x) + frame.eye_part_x) * finest,
                      (float(frame.eye_y) + frame.eye_part_y) * finest,
                      (float(frame.eye_z) + frame.eye_part_z) * finest};
    parallel_for(int(runs.firsts.size()), bricks.workers, [&](int group) {
        thread_local Batch b;
        const std::span<const uint32_t> run = runs.run(group);
        const field::BrickRecord& record = (*bricks.records)[slot_of(run[0])];
        if (record.far != 0) return;
        const sdf::TapeView tape =
            sdf::view(*bricks.program, bricks.code.subspan(record.code_first, record.code_count));
        const float scale = float(1u << record.level), h = finest * scale;  // t counts voxels of the brick's level
        for (size_t k = 0; k < run.size(); ++k) {
            b.direction[k] = direction_of(frame, run[k]);
            b.t_first[k] = std::bit_cast<float>(visibility[4 * size_t{run[k]}]) / scale;
        }
        look_at(b, run.size(), tape, h, [&](size_t k, float t) { return origin + b.direction[k] * (t * h); });
        for (size_t k = 0; k < run.size(); ++k) {
            const float steep = length(b.gradient[k]);
            if (b.holds[k] && steep > 0)
                write_words(out.data() + 4 * size_t{run[k]}, b.t[k] * scale, b.gradient[k] * (1 / steep), b.mixes[k]);
        }
    });
    return out;
}

void refine_instances_on_host(const GpuInstances& instances, const FrameParams& frame,
                              std::span<const uint32_t> visibility, std::span<uint32_t> refined) {
    // By instance and brick.
    const auto key_of = [&](uint32_t pixel) {
        const uint32_t* const words = visibility.data() + 4 * size_t{pixel};
        return uint64_t(words[1] & 0x0fffffffu) << 32 | words[2] >> kInstanceSlotShift;
    };
    const Runs runs(visibility, kSeenInstance, key_of);
    parallel_for(int(runs.firsts.size()), [&](int group) {
        thread_local Batch b;
        thread_local std::array<field::BrickRay, kMostAtOnce> rays;
        const std::span<const uint32_t> run = runs.run(group);
        const InstanceRecord& r = instances.records()[size_t(key_of(run[0]) >> 32)];
        const field::BrickSet& set = *instances.sets()[r.set];
        const field::Field& field = set.field();
        const uint32_t slot = uint32_t(key_of(run[0]));
        const field::BrickRecord& record = field.records()[slot];
        const field::ivec3 texel{record.texel_x, record.texel_y, record.texel_z};
        const float h = set.voxel_size();
        const auto row = [](vec4 v) { return vec3{v.x, v.y, v.z}; };
        for (size_t k = 0; k < run.size(); ++k) {
            const vec3 d = direction_of(frame, run[k]);
            const field::TexelRay ray = field::texel_ray({r.eye_x, r.eye_y, r.eye_z}, {r.x.w, r.y.w, r.z.w},
                                                         {dot(row(r.x), d), dot(row(r.y), d), dot(row(r.z), d)});
            rays[k] = field::brick_ray(ray, texel);
            b.t_first[k] = std::bit_cast<float>(visibility[4 * size_t{run[k]}]) * r.voxels;
        }
        look_at(b, run.size(), sdf::view(set.program(), field.code_of(slot)), h, [&](size_t k, float t) {
            const field::BrickRay& ray = rays[k];
            const float s = t - ray.t_base;
            const auto along = [&](int first, float high, float low, float lead, float rest) {
                return (float(first) + field::ray_coordinate(0, high, low, lead, rest, s)) * h;
            };
            return vec3{along(texel.x, ray.high.x, ray.low.x, ray.lead.x, ray.rest.x),
                        along(texel.y, ray.high.y, ray.low.y, ray.lead.y, ray.rest.y),
                        along(texel.z, ray.high.z, ray.low.z, ray.lead.z, ray.rest.z)};
        });
        for (size_t k = 0; k < run.size(); ++k) {
            const float steep = length(b.gradient[k]);
            if (!b.holds[k] || !(steep > 0)) continue;
            const vec3 n = b.gradient[k] * (1 / steep);
            write_words(refined.data() + 4 * size_t{run[k]}, b.t[k] / r.voxels,
                        row(r.x) * n.x + row(r.y) * n.y + row(r.z) * n.z, b.mixes[k]);
        }
    });
}

}  // namespace kiln::render
