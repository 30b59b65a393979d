// SPDX-License-Identifier: MIT
// The registry: shapes are only ever added, so a reader needs the count alone.

#include "sdf/custom.h"

#include "sdf/eval_isa.h"
#include "sdf/expression_glsl.h"

#include "base/format.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <random>

namespace kiln::sdf {

namespace {

constexpr size_t kMostRows = 1024;

struct Registered {
    CustomShape shape;
    std::vector<std::string> ranges;  // the rows' texts
};

struct Registry {
    std::mutex mutex;  // of writers
    std::array<std::unique_ptr<const Registered>, kMostCustomShapes> shapes;
    std::array<KindRow, kMostRows> rows;
    size_t built_in = 0;
    std::atomic<size_t> count = 0;  // of shapes that readers may see
};
Registry& registry() {
    static Registry all;
    return all;
}

bool is_name(std::string_view text) {
    if (text.empty() || text.size() > 64 || text[0] < 'a' || text[0] > 'z') return false;
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

std::string point_text(const double* p) { return formatted("({:.4g}, {:.4g}, {:.4g})", p[0], p[1], p[2]); }

Result<CustomBounds> sampled(const Shape& shape) {
    const uint32_t index = custom_index(shape.kind);
    const CustomShape& custom = registry().shapes[index]->shape;
    const auto fail = [&](std::string what) { return Error{custom.name + ": " + std::move(what), ErrorKind::Input}; };
    CustomBounds out;
    out.half_extents = custom.half_extents(shape.params.data());
    out.lipschitz = custom.lipschitz;
    if (!custom.glsl.empty()) {
        auto formula = read_glsl(custom.glsl, std::span(shape.params).first(custom.parameters.size()));
        if (!formula) return fail("glsl " + formula.error().message);
        out.formula = std::make_shared<const Formula>(std::move(*formula));
    }
    const double half[3] = {double(out.half_extents.x), double(out.half_extents.y), double(out.half_extents.z)};
    for (const double h : half)
        if (!(h > 0 && h < 1e9)) return fail("half_extents gives no size; it must be above 0 and finite on every axis");
    // Pairs near and far, inside the box; every third point lies on its surface, where nothing may be solid.
    std::mt19937 random(1);
    const auto in = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
    const double size = std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
    for (int i = 0; i < 2048; ++i) {
        double p[3], q[3];
        for (int k = 0; k < 3; ++k) p[k] = half[k] * in();
        const bool on_surface = i % 3 == 0;
        const int face = int(random() % 3);
        if (on_surface) p[face] = p[face] < 0 ? -half[face] : half[face];
        const double step = i % 2 == 0 ? 0.01 : 0.5;
        for (int k = 0; k < 3; ++k) q[k] = std::clamp(p[k] + step * half[k] * in(), -half[k], half[k]);
        const double x[2] = {p[0], q[0]}, y[2] = {p[1], q[1]}, z[2] = {p[2], q[2]};
        double d[2];
        if (out.formula) {
            for (int k = 0; k < 2; ++k) d[k] = evaluate(*out.formula, {x[k], y[k], z[k]});
        } else {
            custom_distances(index, shape.params.data(), {x, y, z, 2}, d);
        }
        if (!std::isfinite(d[0]))
            return fail(formatted("its distance at {} is not a finite number; make it one everywhere in half_extents",
                                  point_text(p)));
        if (on_surface && d[0] < -1e-4 * size)
            return fail(
                formatted("its solid reaches out of half_extents at {}; make half_extents larger", point_text(p)));
        double gap = 0;
        for (int k = 0; k < 3; ++k) gap += (p[k] - q[k]) * (p[k] - q[k]);
        gap = std::sqrt(gap);
        if (std::fabs(d[0] - d[1]) > double(out.lipschitz) * gap * 1.001 + 1e-6 * size)
            return fail(formatted("lipschitz {:.6g} does not hold: at {} the slope is {:.6g}; use at least that",
                                  out.lipschitz, point_text(p), std::fabs(d[0] - d[1]) / gap));
    }
    return out;
}

}  // namespace

std::span<const KindRow> rows_with_custom(std::span<const KindRow> built_in) {
    Registry& all = registry();
    const size_t count = all.count.load(std::memory_order_acquire);
    return count == 0 ? built_in : std::span<const KindRow>(all.rows).first(built_in.size() + count);
}

uint32_t custom_index(uint16_t kind) { return uint32_t(kind - registry().built_in); }

void custom_distances(uint32_t index, const float* params, const CustomShape::Points& points, double* out) {
    try {
        registry().shapes[index]->shape.distance(points, params, out);
    } catch (...) {
        std::fill_n(out, points.count, std::numeric_limits<double>::quiet_NaN());
    }
}

void custom_points(uint32_t index, const float* params, const double* x, const double* y, const double* z, int count,
                   double* out) {
    custom_distances(index, params, {x, y, z, count}, out);
}

Result<CustomBounds> check_custom(const Shape& shape) {
    using Key = std::pair<uint16_t, std::array<float, kMaxParams>>;
    static std::mutex mutex;
    static std::map<Key, Result<CustomBounds>> kept;
    const Key key{shape.kind, shape.params};
    {
        const std::lock_guard lock(mutex);
        if (const auto found = kept.find(key); found != kept.end()) return found->second;
    }
    Result<CustomBounds> made = sampled(shape);
    const std::lock_guard lock(mutex);
    if (kept.size() >= 4096) kept.clear();
    return kept.emplace(key, std::move(made)).first->second;
}

}  // namespace kiln::sdf

namespace kiln {

Result<Shape> register_shape(CustomShape shape) {
    using namespace sdf;
    const auto fail = [&](std::string what) {
        return Error{"register shape \"" + shape.name + "\": " + std::move(what), ErrorKind::Usage};
    };
    if (!is_name(shape.name)) return fail("no name; use lower case letters, digits and _, a letter first");
    if (shape.distance && !shape.glsl.empty()) return fail("a distance in C++ and one in GLSL; keep one of them");
    if (!shape.distance && shape.glsl.empty()) return fail("no distance; give it a function, or GLSL");
    if (!shape.half_extents) return fail("no half_extents; give it a function");
    if (!(shape.lipschitz > 0 && shape.lipschitz < 1e6f)) return fail("lipschitz is no slope; use 1 for a distance");
    auto made = std::make_unique<Registered>();
    KindRow row{"", KindRow::Custom, ""};
    if (shape.parameters.size() > row.field_slots.size())
        return fail(formatted("{} parameters; at most {}", shape.parameters.size(), row.field_slots.size()));
    Shape out;
    for (size_t i = 0; i < shape.parameters.size(); ++i) {
        const CustomShape::Parameter& p = shape.parameters[i];
        if (!is_name(p.name))
            return fail("a parameter without a name; use lower case letters, digits and _, a letter first");
        for (size_t k = 0; k < i; ++k)
            if (shape.parameters[k].name == p.name)
                return fail("two parameters \"" + p.name + "\"; give them different names");
        if (!(p.value >= p.least && p.value <= p.most))
            return fail("the value of \"" + p.name + "\" is out of its range");
        out.params[i] = p.value;
        made->ranges.push_back(formatted("[{}, {}]", p.least, p.most));
    }
    if (!shape.glsl.empty()) {
        const auto formula = read_glsl(shape.glsl, std::span(out.params).first(shape.parameters.size()));
        if (!formula) return fail("glsl " + formula.error().message);
    }
    made->shape = std::move(shape);

    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    const CustomShape& kept = made->shape;
    const size_t count = all.count.load(std::memory_order_relaxed);
    const std::span<const KindRow> before = shape_rows();
    for (const KindRow& other : before)
        if (other.name == kept.name)
            return Error{"register shape \"" + kept.name + "\": there is a shape of this name; choose another",
                         ErrorKind::Usage};
    if (count == size_t(kMostCustomShapes) || before.size() == kMostRows)
        return Error{formatted("register shape \"{}\": {} are registered; no more fit", kept.name, count),
                     ErrorKind::Usage};
    if (count == 0) {
        all.built_in = before.size();
        std::copy(before.begin(), before.end(), all.rows.begin());
    }
    row.name = kept.name;
    row.doc = kept.description;
    for (size_t i = 0; i < kept.parameters.size(); ++i) {
        const CustomShape::Parameter& p = kept.parameters[i];
        row.field_slots[i] = {p.name, 1, int(i), {p.value, 0, 0}, "1", made->ranges[i], p.description};
    }
    out.kind = uint16_t(before.size());
    all.rows[before.size()] = row;
    all.shapes[count] = std::move(made);
    all.count.store(count + 1, std::memory_order_release);
    return out;
}

}  // namespace kiln
