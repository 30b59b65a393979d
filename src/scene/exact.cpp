// SPDX-License-Identifier: MIT

#include "scene/exact.h"

#include "sdf/prune.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace kiln::scene {

namespace {

dvec3 add(dvec3 a, dvec3 b, double s) { return {a.x + b.x * s, a.y + b.y * s, a.z + b.z * s}; }
vec3 to_float(dvec3 p) { return {float(p.x), float(p.y), float(p.z)}; }
double largest(dvec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

// The part of a tape that matters in a ball, made again when a question leaves it.
class Local {
public:
    explicit Local(const sdf::Program& program) : program_(program) {}

    void move_to(dvec3 center, double radius) {
        center_ = center;
        radius_ = radius;
        // The centre is rounded to float: a little more room for that.
        sdf::prune(sdf::view(program_), to_float(center), float(radius + 1e-6 * largest(center)) * 1.001f, code_,
                   scratch_);
    }
    bool covers(dvec3 p) const {
        const dvec3 d = add(p, center_, -1);
        return radius_ >= 0 && d.x * d.x + d.y * d.y + d.z * d.z <= radius_ * radius_;
    }
    double at(dvec3 p, sdf::MaterialMix* mix = nullptr, bool edits = false) const {
        return sdf::evaluate(sdf::view(program_, code_), p, mix, edits);
    }
    std::span<const sdf::Instruction> code() const { return code_; }

private:
    const sdf::Program& program_;
    std::vector<sdf::Instruction> code_;
    sdf::PruneScratch scratch_;
    dvec3 center_;
    double radius_ = -1;  // nowhere yet
};

// Step of the central differences, metres: far above double's rounding, far below any detail.
double gradient_step(dvec3 p) { return 1e-5 * (1 + 0.01 * largest(p)); }

vec3 gradient(const Local& local, dvec3 p) {
    const double h = gradient_step(p);
    const double x = local.at({p.x + h, p.y, p.z}) - local.at({p.x - h, p.y, p.z});
    const double y = local.at({p.x, p.y + h, p.z}) - local.at({p.x, p.y - h, p.z});
    const double z = local.at({p.x, p.y, p.z + h}) - local.at({p.x, p.y, p.z - h});
    const double size = std::sqrt(x * x + y * y + z * z);
    if (!(size > 1e-6 * h)) return {0, 0, 0};
    return {float(x / size), float(y / size), float(z / size)};
}

FieldSample sample_one(Local& local, vec3 at) {
    FieldSample out;
    const dvec3 p{double(at.x), double(at.y), double(at.z)};
    local.move_to(p, 2 * gradient_step(p));
    sdf::MaterialMix mix;
    const double d = local.at(p, &mix);
    if (!(d < double(sdf::kEmptyTest))) {
        out.distance = std::numeric_limits<float>::infinity();
        return out;
    }
    out.distance = float(d);
    out.normal = gradient(local, p);
    out.material = material_of(mix.id0);
    return out;
}

double length_of(const Box3& box) { return double(length(box.max - box.min)); }

// The edit with the largest share at p, ties to the later. Shares carry 16-bit numbers, so the few edits that matter here are
// renumbered: each instruction gets its own copy of its numbers (none has more than kMost), with the edit's rank in it.
uint32_t edit_at(const sdf::Program& program, std::span<const sdf::Instruction> code, dvec3 p) {
    constexpr size_t kMost = 3 + 2 * size_t(kMaxParams);
    constexpr size_t kEditWord = 2;  // of a Shape's numbers: scale, material, edit
    const auto has_edit = [](const sdf::Instruction& i) { return i.has_material(); };
    std::vector<uint32_t> edits;
    for (const sdf::Instruction& i : code)
        if (has_edit(i)) edits.push_back(uint32_t(program.params[i.param + kEditWord]));
    std::sort(edits.begin(), edits.end(),
              [&](uint32_t a, uint32_t b) { return program.edits[a].order < program.edits[b].order; });
    edits.erase(std::unique(edits.begin(), edits.end()), edits.end());
    if (edits.empty()) return UINT32_MAX;
    std::vector<sdf::Instruction> copy(code.begin(), code.end());
    std::vector<float> params;
    params.reserve(copy.size() * kMost);
    for (sdf::Instruction& i : copy) {
        const auto first =
            program.params.begin() + std::min<std::ptrdiff_t>(i.param, std::ptrdiff_t(program.params.size()));
        const auto last = first + std::min<std::ptrdiff_t>(kMost, program.params.end() - first);
        const size_t at = params.size();
        params.insert(params.end(), first, last);
        params.resize(at + kMost);
        if (has_edit(i)) {
            const auto rank = std::find(edits.begin(), edits.end(), uint32_t(params[at + kEditWord])) - edits.begin();
            params[at + kEditWord] = float(rank);
        }
        i.param = uint32_t(at);
    }
    sdf::MaterialMix mix;
    (void)sdf::evaluate(sdf::TapeView{copy, params.data(), program.samples.data(), program.memory_slots}, p, &mix,
                        true);
    uint32_t rank = mix.id0;
    if (mix.weight >= 0.5f && mix.id1 != uint16_t(sdf::kNoMaterial)) rank = std::max<uint32_t>(mix.id0, mix.id1);
    if (rank >= edits.size()) return UINT32_MAX;
    // A hard union keeps the earlier of two equal operands; the question wants the later one.
    uint32_t found = edits[rank];
    const double surface = sdf::evaluate(sdf::view(program, code), p);
    std::vector<sdf::Instruction> alone;
    for (const uint32_t e : edits) {
        const sdf::EditSpan& span = program.edits[e];
        if (span.order <= program.edits[found].order || span.op != Op::Union) continue;
        alone.assign(1, sdf::Instruction::make(sdf::Opcode::Empty, 0, 0, 0, 0, 0));
        alone.insert(alone.end(), program.code.begin() + span.first, program.code.begin() + span.first + span.count);
        if (std::abs(sdf::evaluate(sdf::view(program, alone), p) - surface) <= 1e-7 * (1 + largest(p))) found = e;
    }
    return found;
}

// Where the ray is inside a box, metres along it; from > to when it misses.
void clip(dvec3 o, dvec3 d, const Box3& box, double& from, double& to) {
    const auto axis = [&](double origin, double direction, double low, double high) {
        if (direction == 0) {
            if (origin < low || origin > high) to = -1;
            return;
        }
        const double a = (low - origin) / direction, b = (high - origin) / direction;
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    };
    axis(o.x, d.x, double(box.min.x), double(box.max.x));
    axis(o.y, d.y, double(box.min.y), double(box.max.y));
    axis(o.z, d.z, double(box.min.z), double(box.max.z));
}

}  // namespace

double ExactField::distance(dvec3 p) const {
    const double d = sdf::evaluate(sdf::view(program_), p);
    return d < double(sdf::kEmptyTest) ? d : std::numeric_limits<double>::infinity();
}

FieldSample ExactField::sample(vec3 p) const {
    Local local(program_);
    return sample_one(local, p);
}

void ExactField::sample(std::span<const vec3> points, FieldSample* out) const {
    constexpr size_t kChunk = 64;
    parallel_for((points.size() + kChunk - 1) / kChunk, [&](int chunk) {
        Local local(program_);
        const size_t first = size_t(chunk) * kChunk;
        for (size_t i = first; i < std::min(first + kChunk, points.size()); ++i) out[i] = sample_one(local, points[i]);
    });
}

RayHit ExactField::cast(const Ray& ray) const {
    RayHit out;
    const double length = std::sqrt(double(dot(ray.direction, ray.direction)));
    if (!(length > 0) || program_.index.size() == 0) return out;
    const dvec3 o{double(ray.origin.x), double(ray.origin.y), double(ray.origin.z)};
    const dvec3 dir{double(ray.direction.x) / length, double(ray.direction.y) / length,
                    double(ray.direction.z) / length};
    double t = 0, end = std::min(double(ray.t_max), 1e10);
    double extent = 64;  // metres: how large the pruned balls are
    if (!program_.unbounded) {
        if (program_.bounds.empty()) return out;
        const float reach = program_.index.largest_reach();  // smooth unions bulge beyond their operands
        const Box3 box = program_.bounds.inflated(reach + 1e-3f * (1 + float(length_of(program_.bounds))));
        extent = length_of(box);
        clip(o, dir, box, t, end);
        if (t > end) return out;
    }
    // Sphere tracing (Hart, 1996) on a 1-Lipschitz field, then bisection of the last step where it crossed.
    Local local(program_);
    double before = t;
    bool hit = false;
    for (int steps = 0; t <= end && steps < 200000; ++steps) {
        const dvec3 p = add(o, dir, t);
        if (!local.covers(p)) {
            const double d = sdf::evaluate(sdf::view(program_), p);
            local.move_to(p, std::max(1.5 * std::min(std::abs(d), extent), extent / 64));
        }
        const double d = local.at(p);
        const double tolerance = 1e-7 * (1 + largest(p));
        if (d <= tolerance) {
            hit = true;
            break;
        }
        before = t;
        t += d;
    }
    if (!hit) return out;
    if (local.at(add(o, dir, t)) < 0 && t > before) {
        double low = before, high = t;
        for (int i = 0; i < 60; ++i) {
            const double middle = 0.5 * (low + high);
            (local.at(add(o, dir, middle)) > 0 ? low : high) = middle;
        }
        t = high;
    }
    const dvec3 p = add(o, dir, t);
    local.move_to(p, 4 * gradient_step(p));
    out.hit = true;
    out.t = float(t);
    out.position = to_float(p);
    out.normal = gradient(local, p);
    out.edit = {edit_at(program_, local.code(), p), 0};
    return out;
}

}  // namespace kiln::scene
