// SPDX-License-Identifier: MIT

#include "field/sdf_field.h"

#include <algorithm>
#include <cmath>

namespace kiln::field {

namespace {

dvec3 to_double(vec3 p) { return {double(p.x), double(p.y), double(p.z)}; }

constexpr float kNear = 32, kFloatStep = 2e-3f;  // metres

// Step of the differences, metres: far above double's rounding, far below any detail that a body can feel.
double gradient_step(dvec3 p) { return 1e-5 * (1 + 0.01 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)})); }

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

float ProgramField::distance(vec3 p) const {
    sdf::Regions::Cursor cursor = nullptr;
    return float(regions_.at(to_double(p), cursor));
}

float ProgramField::distance(vec3 at, vec3& gradient) const {
    sdf::Regions::Cursor cursor = nullptr;
    const dvec3 p = to_double(at);
    const sdf::TapeView tape = regions_.tape(p, cursor);  // right a margin around its region
    gradient = {};
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) < kNear) {
        // All seven at once, in float: rounding is below 4e-6 m here, so slopes over 4e-3 m are right to 1e-3.
        constexpr float h = kFloatStep;
        const float x[7] = {at.x, at.x + h, at.x - h, at.x, at.x, at.x, at.x};
        const float y[7] = {at.y, at.y, at.y, at.y + h, at.y - h, at.y, at.y};
        const float z[7] = {at.z, at.z, at.z, at.z, at.z, at.z + h, at.z - h};
        float d[7];
        sdf::evaluate(tape, {x, y, z, 7}, d);
        if (!(d[0] < sdf::kEmptyTest)) return sdf::kEmpty;
        gradient = {(d[1] - d[2]) / (x[1] - x[2]), (d[3] - d[4]) / (y[3] - y[4]), (d[5] - d[6]) / (z[5] - z[6])};
        return d[0];
    }
    const double d = sdf::evaluate(tape, p), h = gradient_step(p);
    if (!(d < double(sdf::kEmptyTest))) return sdf::kEmpty;
    const auto slope = [&](dvec3 above, dvec3 below) {
        return float((sdf::evaluate(tape, above) - sdf::evaluate(tape, below)) / (2 * h));
    };
    gradient = {slope({p.x + h, p.y, p.z}, {p.x - h, p.y, p.z}), slope({p.x, p.y + h, p.z}, {p.x, p.y - h, p.z}),
                slope({p.x, p.y, p.z + h}, {p.x, p.y, p.z - h})};
    return float(d);
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
