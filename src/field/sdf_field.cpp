// SPDX-License-Identifier: MIT

#include "field/sdf_field.h"

#include "sdf/octants.h"
#include "sdf/prune.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::field {

namespace {

dvec3 to_double(vec3 p) { return {double(p.x), double(p.y), double(p.z)}; }

constexpr float kHalfDiagonal = 0.867f;          // of a cube of side 1, and room for rounding
constexpr float kNear = 32, kFloatStep = 2e-3f;  // metres

// Step of the differences, metres: far above double's rounding, far below any detail that a body can feel.
double gradient_step(dvec3 p) { return 1e-5 * (1 + 0.01 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)})); }

bool near(vec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < kNear; }

float far_distance(const sdf::TapeView& tape, vec3 at, vec3& gradient) {
    const dvec3 p = to_double(at);
    const double d = sdf::evaluate(tape, p), h = gradient_step(p);
    gradient = {};
    if (!(d < double(sdf::kEmptyTest))) return sdf::kEmpty;
    const auto slope = [&](dvec3 above, dvec3 below) {
        return float((sdf::evaluate(tape, above) - sdf::evaluate(tape, below)) / (2 * h));
    };
    gradient = {slope({p.x + h, p.y, p.z}, {p.x - h, p.y, p.z}), slope({p.x, p.y + h, p.z}, {p.x, p.y - h, p.z}),
                slope({p.x, p.y, p.z + h}, {p.x, p.y, p.z - h})};
    return float(d);
}

// With gradients: each point and its neighbours along the axes, all at once. Rounding is below 4e-6 m near the origin, so slopes over
// 4e-3 m are right to 1e-3.
constexpr size_t kStencil = 7, kStencils = 9;
void ask(const sdf::TapeView& tape, std::span<const vec3> points, float* out, vec3* gradients) {
    constexpr float h = kFloatStep;
    for (size_t first = 0; first < points.size();) {
        if (!near(points[first])) {
            out[first] = far_distance(tape, points[first], gradients[first]);
            ++first;
            continue;
        }
        float x[kStencil * kStencils], y[kStencil * kStencils], z[kStencil * kStencils], d[kStencil * kStencils];
        size_t count = 0;
        for (; count < kStencils && first + count < points.size() && near(points[first + count]); ++count) {
            const vec3 p = points[first + count];
            const float px[kStencil] = {p.x, p.x + h, p.x - h, p.x, p.x, p.x, p.x};
            const float py[kStencil] = {p.y, p.y, p.y, p.y + h, p.y - h, p.y, p.y};
            const float pz[kStencil] = {p.z, p.z, p.z, p.z, p.z, p.z + h, p.z - h};
            std::copy_n(px, kStencil, x + kStencil * count);
            std::copy_n(py, kStencil, y + kStencil * count);
            std::copy_n(pz, kStencil, z + kStencil * count);
        }
        sdf::evaluate(tape, {x, y, z, int(kStencil * count)}, d);
        for (size_t i = 0; i < count; ++i) {
            const float *v = d + kStencil * i, *sx = x + kStencil * i, *sy = y + kStencil * i, *sz = z + kStencil * i;
            const bool empty = !(v[0] < sdf::kEmptyTest);
            out[first + i] = empty ? sdf::kEmpty : v[0];
            gradients[first + i] = empty ? vec3{}
                                         : vec3{(v[1] - v[2]) / (sx[1] - sx[2]), (v[3] - v[4]) / (sy[3] - sy[4]),
                                                (v[5] - v[6]) / (sz[5] - sz[6])};
        }
        first += count;
    }
}

// Code that is right in a cube.
constexpr float kPartMargin = 0.02f;
class Part final : public SdfField {
public:
    Part(std::shared_ptr<const sdf::Program> program, const Box3& bounds)
        : program_(std::move(program)), bounds_(bounds) {}
    float distance(vec3 p) const override {
        if (!near(p)) return float(sdf::evaluate(view(), to_double(p)));
        float d;
        sdf::evaluate(view(), {&p.x, &p.y, &p.z, 1}, &d);
        return d;
    }
    float distance(vec3 p, vec3& gradient) const override {
        float d;
        ask(view(), std::span(&p, 1), &d, &gradient);
        return d;
    }
    void distances(std::span<const vec3> points, float* out, vec3* gradients) const override {
        ask(view(), points, out, gradients);
    }
    void distances(const sdf::Points& points, float* out) const override { sdf::evaluate(view(), points, out); }
    Box3 bounds() const override { return bounds_; }
    size_t cost() const override { return code.size(); }

    std::vector<sdf::Instruction> code;

private:
    sdf::TapeView view() const { return sdf::view(*program_, code); }
    std::shared_ptr<const sdf::Program> program_;
    Box3 bounds_;
};

// Smooth unions bulge beyond the solids of their operands by at most a quarter of the blend radius.
Box3 solid_of(const sdf::Program& program) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (program.unbounded) return {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    float reach = 0;
    Box3 unions;
    for (const uint32_t row : program.rows()) {
        const sdf::EditSpan& edit = program.edits[row];
        reach = std::max(reach, edit.reach);
        if (edit.op == Op::Union) unions = box_union(unions, edit.bounds);
    }
    return unions.empty() ? unions : unions.inflated(0.25f * reach);
}

}  // namespace

ProgramField::ProgramField(std::shared_ptr<const sdf::Program> program)
    : program_(std::move(program)), regions_(*program_), bounds_(solid_of(*program_)) {}

void SdfField::distances(std::span<const vec3> points, float* out, vec3* gradients) const {
    for (size_t i = 0; i < points.size(); ++i) out[i] = distance(points[i], gradients[i]);
}

float ProgramField::distance(vec3 at) const {
    sdf::Regions::Cursor cursor = nullptr;
    if (!near(at)) return float(regions_.at(to_double(at), cursor));
    float d;
    sdf::evaluate(regions_.tape(to_double(at), cursor), {&at.x, &at.y, &at.z, 1}, &d);
    return d;
}

float ProgramField::distance(vec3 at, vec3& gradient) const {
    float d;
    distances(std::span(&at, 1), &d, &gradient);
    return d;
}

void ProgramField::distances(std::span<const vec3> points, float* out, vec3* gradients) const {
    sdf::Regions::Cursor cursor = nullptr;
    for (size_t first = 0; first < points.size();) {
        const sdf::TapeView tape = regions_.tape(to_double(points[first]), cursor);  // right a margin around its region
        size_t count = 1;
        while (count < kStencils && first + count < points.size() && cursor != nullptr &&
               cursor->contains(to_double(points[first + count])))
            ++count;
        ask(tape, points.subspan(first, count), out + first, gradients + first);
        first += count;
    }
}

std::unique_ptr<const SdfField> ProgramField::within(vec3 center, float side) const {
    thread_local sdf::PruneScratch scratch;
    auto out = std::make_unique<Part>(program_, bounds_);
    (void)sdf::prune(regions_.tape_around(to_double(center), 0.5 * double(side) + double(kPartMargin)), center,
                     kHalfDiagonal * (side + 2 * kPartMargin), out->code, scratch);
    out->code.shrink_to_fit();
    return out;
}

size_t ProgramField::cost() const { return program_->tape().size(); }

bool SdfField::texels(vec3 center, float side, float near, const float* x, const float* y, const float* z,
                      float* out) const {
    if (!(std::abs(distance(center)) <= near + kHalfDiagonal * side)) return false;  // 1-Lipschitz
    std::array<float, 64> xs, ys, zs;
    for (size_t k = 0; k < 8; ++k) {
        for (size_t i = 0; i < 64; ++i) xs[i] = x[i & 7], ys[i] = y[i >> 3], zs[i] = z[k];
        distances({xs.data(), ys.data(), zs.data(), 64}, out + 64 * k);
    }
    return true;
}

bool ProgramField::texels(vec3 center, float side, float near, const float* x, const float* y, const float* z,
                          float* out) const {
    thread_local sdf::PruneScratch scratch;
    thread_local std::vector<sdf::Instruction> code;
    const float radius = kHalfDiagonal * side;
    const float value =
        sdf::prune(regions_.tape_around(to_double(center), 0.5 * double(side)), center, radius, code, scratch);
    if (!(std::abs(value) <= near + radius)) return false;
    thread_local sdf::OctantCodes octants;
    const sdf::TapeView tape = sdf::view(*program_, code);
    (void)(octants.cut(tape, x, y, z) ? octants.evaluate(out) : sdf::evaluate_brick(tape, x, y, z, out));
    return true;
}

uint32_t ProgramField::material(vec3 p) const {
    sdf::Regions::Cursor cursor = nullptr;
    sdf::MaterialMix mix;
    (void)sdf::evaluate(regions_.tape(to_double(p), cursor), to_double(p), &mix);
    return mix.id0 == uint16_t(sdf::kNoMaterial) ? sdf::kDefaultMaterial : mix.id0;
}

void ProgramField::distances(const sdf::Points& points, float* out) const {
    // Runs of neighbours that lie in one region share its short tape.
    sdf::Regions::Cursor cursor = nullptr;
    for (int first = 0; first < points.count;) {
        const auto at = [&](int i) { return to_double({points.x[i], points.y[i], points.z[i]}); };
        const sdf::TapeView tape = regions_.tape(at(first), cursor);
        int last = first + 1;
        while (last < points.count &&
               (cursor != nullptr ? cursor->contains(at(last)) : regions_.leaf(at(last)) == nullptr))
            ++last;
        sdf::evaluate(tape, {points.x + first, points.y + first, points.z + first, last - first}, out + first);
        first = last;
    }
}

}  // namespace kiln::field
