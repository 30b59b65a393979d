// SPDX-License-Identifier: MIT

#include "scene/exact.h"

#include "sdf/nearest.h"
#include "sdf/prune.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace kiln::scene {

namespace {

dvec3 add(dvec3 a, dvec3 b, double s) { return {a.x + b.x * s, a.y + b.y * s, a.z + b.z * s}; }
dvec3 to_double(vec3 p) { return {double(p.x), double(p.y), double(p.z)}; }
bool finite(vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }
vec3 to_float(dvec3 p) { return {float(p.x), float(p.y), float(p.z)}; }
double largest(dvec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

// Step of the central differences, metres: far above double's rounding, far below any detail.
double gradient_step(dvec3 p) { return 1e-5 * (1 + 0.01 * largest(p)); }

vec3 gradient(const sdf::Regions& regions, dvec3 p, sdf::Regions::Cursor& cursor) {
    const double h = gradient_step(p);
    const sdf::TapeView tape = regions.tape(p, cursor);  // right a margin around its region
    const auto slope = [&](dvec3 above, dvec3 below) {
        return sdf::evaluate(tape, above) - sdf::evaluate(tape, below);
    };
    const double x = slope({p.x + h, p.y, p.z}, {p.x - h, p.y, p.z});
    const double y = slope({p.x, p.y + h, p.z}, {p.x, p.y - h, p.z});
    const double z = slope({p.x, p.y, p.z + h}, {p.x, p.y, p.z - h});
    const double size = std::sqrt(x * x + y * y + z * z);
    if (!(size > 1e-6 * h)) return {0, 0, 0};
    return {float(x / size), float(y / size), float(z / size)};
}

FieldSample sample_one(const sdf::Regions& regions, vec3 at, sdf::Regions::Cursor& cursor) {
    FieldSample out;
    out.distance = std::numeric_limits<float>::infinity();
    if (!finite(at)) return out;
    const dvec3 p = to_double(at);
    sdf::MaterialMix mix;
    const double d = sdf::evaluate(regions.tape(p, cursor), p, &mix);
    if (!(d < double(sdf::kEmptyTest))) return out;
    out.distance = float(d);
    out.normal = gradient(regions, p, cursor);
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

// How far a search for the nearest point may miss, metres: relative where floats are coarser.
double tolerance_at(dvec3 p) { return std::max(5e-5, 2e-7 * largest(p)); }

constexpr size_t kChunk = 64;       // questions that share a cursor
constexpr int kMostSteps = 200000;  // of a ray; only endless rows of things that it always just passes ask for so many

// answer(i, cursor) for every i, on all cores.
template <typename Answer>
void for_each_question(size_t count, Answer&& answer) {
    parallel_for((count + kChunk - 1) / kChunk, [&](int chunk) {
        sdf::Regions::Cursor cursor = nullptr;
        const size_t first = size_t(chunk) * kChunk;
        for (size_t i = first; i < std::min(first + kChunk, count); ++i) answer(i, cursor);
    });
}

// A ray in double precision, between where solids can be met.
struct Way {
    dvec3 origin, direction;
    double from = 0, to = -1;

    Way(const sdf::Program& program, double reach, const Ray& ray, double radius) {
        const double length = std::sqrt(double(dot(ray.direction, ray.direction)));
        if (!(length > 0) || !std::isfinite(length) || !finite(ray.origin) || !(ray.t_max >= 0) ||
            program.index.size() == 0)
            return;
        origin = to_double(ray.origin);
        direction = {double(ray.direction.x) / length, double(ray.direction.y) / length,
                     double(ray.direction.z) / length};
        to = std::min(double(ray.t_max), 1e10);
        if (program.unbounded) return;
        if (program.bounds.empty()) {
            to = -1;
            return;
        }
        const double around = reach + radius + 1e-3 * (1 + length_of(program.bounds));
        clip(origin, direction, program.bounds.inflated(float(around)), from, to);
    }
    dvec3 at(double t) const { return add(origin, direction, t); }
};

// How far to go on along a ray. Sphere tracing takes steps as short as the nearest solid is near, without end where a ray runs along a
// plane. Where steps stay short, whole pieces of the way are shown to be free instead, which grow while that succeeds.
class Strides {
public:
    Strides(const sdf::Regions& regions, const Way& way) : regions_(regions), way_(way) {}

    // From t, where the value is `value`; no value up to there is below `room`.
    double next(double t, double value, double room, sdf::Regions::Cursor cursor) {
        const double step = value - room;
        if (--until_ > 0) return step;
        const double leap = passes(t, value, room, kWorth * step, cursor);
        wait_ = leap > 0 ? 0 : std::clamp(2 * wait_, kPatience, kMostPatience);
        until_ = wait_;
        return std::max(leap, step);
    }

    // How far all values from t on are above `room`: at least `least` or as far as code is known, else 0.
    double passes(double t, double value, double room, double least, sdf::Regions::Cursor cursor) {
        // Where the last leap came nearer to something, this one goes almost as far as that would be met.
        if (before_ >= 0 && value < value_)
            stride_ = std::min(stride_, 0.9 * (value - room) * (t - before_) / (value_ - value));
        before_ = -1;
        const double end = end_of(t, cursor);
        least = std::min(least, end);
        for (double length = std::clamp(stride_, least, end);; length = std::max(0.25 * length, least)) {
            stride_ = length;
            if (free(t, length, room, cursor)) {
                before_ = t, value_ = value;
                stride_ = 4 * length;
                return length;
            }
            if (length <= least) return 0;
        }
    }

private:
    static constexpr int kPatience = 16, kMostPatience = 64;  // steps before the next try
    static constexpr double kWorth = 4;                       // steps that a leap must replace

    bool free(double t, double length, double room, sdf::Regions::Cursor cursor) const {
        const double half = 0.5 * length;
        const dvec3 reach{way_.direction.x * half, way_.direction.y * half, way_.direction.z * half};
        const sdf::Program& program = regions_.program();
        return sdf::least_on_segment(program, cursor != nullptr ? cursor->code : program.tape(), way_.at(t + half),
                                     reach) > room;
    }

    // How far the code that is right at t stays so: a little way beyond the region's border, that the next point may lie in the next one.
    double end_of(double t, sdf::Regions::Cursor cursor) const {
        if (cursor == nullptr) return std::max(way_.to - t, 0.0) + 1;
        const dvec3 p = way_.at(t), d = way_.direction, c = cursor->center;
        const auto axis = [&](double at, double direction, double center) {
            if (direction == 0) return std::numeric_limits<double>::infinity();
            return (center + std::copysign(cursor->half, direction) - at) / direction;
        };
        const double exit = std::min({axis(p.x, d.x, c.x), axis(p.y, d.y, c.y), axis(p.z, d.z, c.z)});
        return std::max(exit, 0.0) + 0.5 * sdf::region_margin(c, cursor->half);
    }

    const sdf::Regions& regions_;
    const Way& way_;
    int wait_ = kPatience, until_ = kPatience;
    double stride_ = 0;               // metres to try next
    double before_ = -1, value_ = 0;  // where the last leap began, and the value there; -1: none just now
};

// What counts as touching, metres: relative where floats are coarser. A ray that passes by so near does not, if it does so for some of them.
double touch_at(dvec3 p) { return 1e-7 * (1 + largest(p)); }
constexpr double kPassTouches = 10;

}  // namespace

ExactField::ExactField(const sdf::Program& program)
    : program_(program), regions_(program), reach_(double(program.index.largest_reach())) {}

double ExactField::distance(dvec3 p) const {
    sdf::Regions::Cursor cursor = nullptr;
    return distance(p, cursor);
}

double ExactField::distance(dvec3 p, sdf::Regions::Cursor& cursor) const {
    const double d = regions_.at(p, cursor);
    return d < double(sdf::kEmptyTest) ? d : std::numeric_limits<double>::infinity();
}

void ExactField::distance(std::span<const vec3> points, float* out) const {
    for_each_question(points.size(), [&](size_t i, sdf::Regions::Cursor& cursor) {
        out[i] =
            finite(points[i]) ? float(distance(to_double(points[i]), cursor)) : std::numeric_limits<float>::infinity();
    });
}

FieldSample ExactField::sample(vec3 p) const {
    sdf::Regions::Cursor cursor = nullptr;
    return sample_one(regions_, p, cursor);
}

void ExactField::sample(std::span<const vec3> points, FieldSample* out) const {
    for_each_question(points.size(), [&](size_t i, sdf::Regions::Cursor& cursor) {
        out[i] = sample_one(regions_, points[i], cursor);
    });
}

RayHit ExactField::cast(const Ray& ray) const {
    sdf::Regions::Cursor cursor = nullptr;
    return cast(ray, cursor);
}

void ExactField::cast(std::span<const Ray> rays, RayHit* out) const {
    for_each_question(rays.size(), [&](size_t i, sdf::Regions::Cursor& cursor) { out[i] = cast(rays[i], cursor); });
}

// Sphere tracing (Hart, 1996) on a 1-Lipschitz field, with leaps; then bisection of the last step where it crossed.
RayHit ExactField::cast(const Ray& ray, sdf::Regions::Cursor& cursor) const {
    const Way way(program_, reach_, ray, 0);
    double t = way.from, before = t;
    bool hit = false;
    Strides strides(regions_, way);
    for (int steps = 0; t <= way.to && steps < kMostSteps; ++steps) {
        const dvec3 p = way.at(t);
        const double d = regions_.at(p, cursor), touch = touch_at(p);
        double step = 0;
        if (d > touch) {
            step = strides.next(t, d, 0, cursor);
        } else if (d > 0) {
            step = strides.passes(t, d, 0, kPassTouches * touch, cursor);
        }
        hit = !(step > 0);
        if (hit) break;
        before = t;
        t += step;
    }
    if (!hit) return {};
    if (regions_.at(way.at(t), cursor) < 0 && t > before) {
        double low = before, high = t;
        for (int i = 0; i < 60; ++i) {
            const double middle = 0.5 * (low + high);
            (regions_.at(way.at(middle), cursor) > 0 ? low : high) = middle;
        }
        t = high;
    }
    RayHit out;
    const dvec3 p = way.at(t);
    out.hit = true;
    out.t = float(t);
    out.position = to_float(p);
    describe(p, out, cursor);
    return out;
}

void ExactField::describe(dvec3 p, RayHit& hit, sdf::Regions::Cursor& cursor) const {
    hit.normal = gradient(regions_, p, cursor);
    hit.edit = {edit_near(p, cursor), 0};
}

void ExactField::describe(std::span<RayHit* const> hits) const {
    for_each_question(hits.size(), [&](size_t i, sdf::Regions::Cursor& cursor) {
        describe(to_double(hits[i]->position), *hits[i], cursor);
    });
}

// Conservative advancement (Mirtich, "Timewarp Rigid Body Simulation", 2000): by the program's value while that is far from the
// radius, by the true distance near contact.
RayHit ExactField::cast_sphere(const Ray& ray, float radius) const {
    if (!(radius > 0)) return radius == 0 ? cast(ray) : RayHit{};
    const double r = double(radius);
    const Way way(program_, reach_, ray, r);
    sdf::Regions::Cursor cursor = nullptr;
    double t = way.from;
    Strides strides(regions_, way);
    for (int steps = 0; t <= way.to && steps < 20000; ++steps) {
        const dvec3 center = way.at(t);
        const double touch = 0.4 * tolerance_at(center);
        const double value = regions_.at(center, cursor);
        if (value - r > touch) {
            t += strides.next(t, value, r, cursor);
            continue;
        }
        sdf::Nearest near{.found = true, .distance = 0, .least = 0, .point = center};
        if (value > 0) near = sdf::nearest_surface(regions_, center, 2 * r + touch, touch);
        if (!near.found || near.distance - r > 2 * touch) {
            t += std::max((near.found ? near.least : 2 * r) - r, touch);
            continue;
        }
        RayHit out;
        out.hit = true;
        out.t = float(t);
        out.position = to_float(near.point);
        const dvec3 away = add(center, near.point, -1);
        out.normal = value > 0 ? normalize(to_float(away)) : gradient(regions_, center, cursor);
        out.edit = {edit_near(near.point, cursor), 0};
        return out;
    }
    return {};
}

NearestPoint ExactField::nearest(vec3 p, float within) const {
    sdf::Regions::Cursor cursor = nullptr;
    return nearest(p, within, cursor);
}

void ExactField::nearest(std::span<const vec3> points, float within, NearestPoint* out) const {
    for_each_question(points.size(),
                      [&](size_t i, sdf::Regions::Cursor& cursor) { out[i] = nearest(points[i], within, cursor); });
}

NearestPoint ExactField::nearest(vec3 at, float within, sdf::Regions::Cursor& cursor) const {
    if (!finite(at) || !(within >= 0)) return {};
    const dvec3 p = to_double(at);
    const sdf::Nearest near = sdf::nearest_surface(regions_, p, double(within), tolerance_at(p));
    if (!near.found) return {};
    NearestPoint out;
    out.found = true;
    const bool inside = regions_.at(p, cursor) < 0;
    out.distance = float(inside ? -near.distance : near.distance);
    out.error = float(near.distance - near.least);
    out.position = to_float(near.point);
    const dvec3 away = inside ? add(near.point, p, -1) : add(p, near.point, -1);
    out.normal = near.distance > 1e-6 * (1 + largest(p)) ? to_float(away) / float(near.distance)
                                                         : gradient(regions_, near.point, cursor);
    sdf::MaterialMix mix;
    (void)sdf::evaluate(regions_.tape(near.point, cursor), near.point, &mix);
    out.material = material_of(mix.id0);
    out.edit = {edit_near(near.point, cursor), 0};
    return out;
}

bool ExactField::overlaps_sphere(vec3 center, float radius) const {
    if (!finite(center) || !(radius >= 0)) return false;
    const dvec3 c = to_double(center);
    sdf::Regions::Cursor cursor = nullptr;
    const double value = regions_.at(c, cursor);
    if (value <= 0) return true;
    if (!(value <= double(radius))) return false;
    return sdf::nearest_surface(regions_, c, double(radius) + 0.5 * tolerance_at(c), 0.5 * tolerance_at(c)).found;
}

bool ExactField::overlaps_box(vec3 center, vec3 half, quat rotation) const {
    if (!finite(center) || !finite(half) || !(half.x >= 0 && half.y >= 0 && half.z >= 0)) return false;
    return sdf::solid_in_box(regions_, to_double(center), half, rotation, 2e-3 * double(length(half)));
}

uint32_t ExactField::edit_near(dvec3 p, sdf::Regions::Cursor& cursor) const {
    thread_local std::vector<sdf::Instruction> code;
    thread_local sdf::PruneScratch scratch;
    const double radius = 4 * gradient_step(p);
    sdf::prune(regions_.tape(p, cursor), to_float(p), float(radius + 1e-6 * largest(p)) * 1.001f, code, scratch);
    return edit_at(program_, code, p);
}

}  // namespace kiln::scene
