// SPDX-License-Identifier: MIT
#include "render/reference_glass.h"

#include "render/lib/glass.gpu.h"

#include <algorithm>
#include <cmath>

namespace kiln::render {
namespace {

dvec3 normal_of(const ReferenceField& field, dvec3 p) {
    const double h = 1e-5 * std::max(1.0, std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z));
    const dvec3 g{field.distance({p.x + h, p.y, p.z}) - field.distance({p.x - h, p.y, p.z}),
                  field.distance({p.x, p.y + h, p.z}) - field.distance({p.x, p.y - h, p.z}),
                  field.distance({p.x, p.y, p.z + h}) - field.distance({p.x, p.y, p.z - h})};
    const double size = std::sqrt(g.x * g.x + g.y * g.y + g.z * g.z);
    return size > 0 ? dvec3{g.x / size, g.y / size, g.z / size} : dvec3{0, 1, 0};
}

}  // namespace

GlassTrace::GlassTrace(std::span<const ReferenceGlass> glass) {
    for (const ReferenceGlass& g : glass) {
        Thing& thing = things_.emplace_back();
        thing.material = g.material;
        thing.outside.distance = g.distance;
        thing.outside.bounds = g.bounds;
        thing.inside.distance = [distance = g.distance](dvec3 p) { return -distance(p); };
        // Rays that leave it end in the air around.
        thing.inside.bounds = g.bounds.inflated(1);
        if (!(g.material.attenuation_distance > 0)) continue;
        const auto absorbed = [&](float left) {
            return -std::log(std::clamp(double(left), 1e-6, 1.0)) / double(g.material.attenuation_distance);
        };
        const vec3 c = g.material.attenuation_color;
        thing.absorbed = {absorbed(c.x), absorbed(c.y), absorbed(c.z)};
    }
}

GlassTrace::Hit GlassTrace::first(dvec3 origin, dvec3 direction, double t_last, int inside) const {
    Hit out;
    if (inside >= 0) {
        const Thing& thing = things_[size_t(inside)];
        out.t = reference_hit(thing.inside, origin, direction, t_last);
        out.which = inside;
        if (out.t >= 0) out.normal = normal_of(thing.outside, along(origin, direction, out.t));
        return out;
    }
    for (size_t i = 0; i < things_.size(); ++i) {
        const double t = reference_hit(things_[i].outside, origin, direction, out.which < 0 ? t_last : out.t);
        if (t >= 0 && (out.which < 0 || t < out.t)) out.t = t, out.which = int(i);
    }
    if (out.which >= 0) out.normal = normal_of(things_[size_t(out.which)].outside, along(origin, direction, out.t));
    return out;
}

vec3 GlassTrace::left_after(int which, double metres) const {
    const dvec3 a = things_[size_t(which)].absorbed;
    return {float(std::exp(-a.x * metres)), float(std::exp(-a.y * metres)), float(std::exp(-a.z * metres))};
}

vec3 GlassTrace::straight(dvec3 origin, dvec3 direction, double distance) const {
    vec3 left{1, 1, 1};
    for (size_t i = 0; i < things_.size(); ++i) {
        const Material& m = things_[i].material;
        dvec3 from = origin;
        double rest = distance;
        int inside = things_[i].outside.distance(origin) < 0 ? int(i) : -1;
        for (int surfaces = 0; surfaces < 32; ++surfaces) {
            const ReferenceField& field = inside < 0 ? things_[i].outside : things_[i].inside;
            const double t = reference_hit(field, from, direction, rest);
            const double way = t < 0 ? rest : t;
            if (inside >= 0) left = left * left_after(int(i), way);
            if (t < 0) break;
            const dvec3 at = along(from, direction, t), n = normal_of(things_[i].outside, at);
            const float cosine = float(std::fabs(n.x * direction.x + n.y * direction.y + n.z * direction.z));
            left = left * (1 - shade::dielectric_reflectance(cosine, 1 / m.ior));
            if (inside < 0) left = left * (1 - m.opacity);
            inside = inside < 0 ? int(i) : -1;
            const double past = 1e-5 * std::max(0.1, t);
            from = along(at, direction, past);
            rest -= t + past;
        }
    }
    return left;
}

}  // namespace kiln::render
