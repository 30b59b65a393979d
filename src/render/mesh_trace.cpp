// SPDX-License-Identifier: MIT
#include "render/mesh_trace.h"

#include "math/math.gpu.h"
#include "render/lib/color.gpu.h"

#include <algorithm>
#include <cmath>

namespace kiln::render {
namespace {

using model::BvhNode;
using model::Matrix;
using model::TextureUse;
using model::Vertex;

dvec3 minus(dvec3 a, dvec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
dvec3 plus(dvec3 a, dvec3 b, double s) { return {a.x + b.x * s, a.y + b.y * s, a.z + b.z * s}; }
double dotted(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
dvec3 crossed(dvec3 a, dvec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
dvec3 unit_or(dvec3 v, dvec3 other) {
    const double size = std::sqrt(dotted(v, v));
    return size > 0 ? dvec3{v.x / size, v.y / size, v.z / size} : other;
}

// Inverse transpose of a map, given its inverse.
dvec3 normal_by(const Matrix& back, dvec3 n) {
    return {back[0] * n.x + back[1] * n.y + back[2] * n.z, back[4] * n.x + back[5] * n.y + back[6] * n.z,
            back[8] * n.x + back[9] * n.y + back[10] * n.z};
}

bool meets(const BvhNode& node, dvec3 o, dvec3 d, double t_last) {
    const double low[] = {node.min.x, node.min.y, node.min.z}, high[] = {node.max.x, node.max.y, node.max.z};
    const double from[] = {o.x, o.y, o.z}, by[] = {d.x, d.y, d.z};
    double first = 0, last = t_last;
    for (size_t i = 0; i < 3; ++i) {
        if (by[i] == 0) {
            if (from[i] < low[i] || from[i] > high[i]) return false;
            continue;
        }
        const double a = (low[i] - from[i]) / by[i], b = (high[i] - from[i]) / by[i];
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return first <= last * (1 + 1e-12);
}

// Bilinear, in linear light.
vec4 texel(const model::Drawable& d, const TextureUse& use, vec2 uv, bool srgb) {
    const model::Image& image = d.images[size_t(use.image)];
    const float u = use.map[0] * uv.x + use.map[2] * uv.y + use.map[4],
                v = use.map[1] * uv.x + use.map[3] * uv.y + use.map[5];
    const auto wrapped = [](int i, int n, model::Wrap wrap) {
        if (wrap == model::Wrap::Clamp) return std::clamp(i, 0, n - 1);
        const int m = ((i % (2 * n)) + 2 * n) % (2 * n);
        if (wrap == model::Wrap::Mirror) return m < n ? m : 2 * n - 1 - m;
        return m % n;
    };
    const float x = std::clamp(u * float(image.width), -1e8f, 1e8f) - (use.nearest ? 0 : 0.5f),
                y = std::clamp(v * float(image.height), -1e8f, 1e8f) - (use.nearest ? 0 : 0.5f);
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const float fx = use.nearest ? 0 : x - std::floor(x), fy = use.nearest ? 0 : y - std::floor(y);
    float sum[4] = {};
    for (int k = 0; k < 4; ++k) {
        const int i = wrapped(x0 + (k & 1), image.width, use.wrap_u),
                  j = wrapped(y0 + (k >> 1), image.height, use.wrap_v);
        const float weight = ((k & 1) ? fx : 1 - fx) * ((k >> 1) ? fy : 1 - fy);
        const uint8_t* p = &image.rgba[(size_t(j) * size_t(image.width) + size_t(i)) * 4];
        for (size_t c = 0; c < 4; ++c) {
            const float value = float(p[c]) / 255;
            sum[c] += weight * (srgb && c < 3 ? shade::linear_from_srgb(value) : value);
        }
    }
    return {sum[0], sum[1], sum[2], sum[3]};
}

vec2 uv_at(const Vertex* const* v, dvec3 w, const TextureUse& use) {
    const auto mixed = [&](auto get) { return float(w.x * get(v[0]) + w.y * get(v[1]) + w.z * get(v[2])); };
    return {mixed([&](const Vertex* q) { return double(q->uv[use.uv_set].x); }),
            mixed([&](const Vertex* q) { return double(q->uv[use.uv_set].y); })};
}

}  // namespace

MeshTrace::MeshTrace(const MeshSet& set) : set_(set) {
    for (const MeshSet::Part& part : set.parts) back_.push_back(model::inverse(part.place));
}

bool MeshTrace::walk(dvec3 origin, dvec3 direction, double t_last, bool seen_only, bool any, Found& found) const {
    found.t = t_last;
    for (uint32_t i = 0; i < set_.tree.size();) {
        const BvhNode& box = set_.tree[i];
        if (!meets(box, origin, direction, found.t)) {
            i = box.skip;
            continue;
        }
        ++i;
        for (uint32_t k = 0; k < (box.leaf & 7u); ++k) {
            const uint32_t which = (box.leaf >> 3) + k;
            const MeshSet::Part& part = set_.parts[which];
            const model::Drawable& d = set_.drawable(part);
            const model::Primitive& p = set_.primitive(part);
            const model::Surface& surface = d.surfaces[p.surface];
            const BvhNode* nodes = set_.nodes(part);
            const Vertex* vertices = set_.vertices(part);
            const dvec3 o = model::transform_point(back_[which], origin),
                        v = model::transform_vector(back_[which], direction);
            for (uint32_t j = 0; j < p.node_count;) {
                const BvhNode& node = nodes[j];
                if (!meets(node, o, v, found.t)) {
                    j = node.skip;
                    continue;
                }
                ++j;
                for (uint32_t n = 0; n < (node.leaf & 7u); ++n) {
                    const uint32_t triangle = (node.leaf >> 3) + n;
                    const uint32_t* c = &d.indices[p.first_index + 3 * triangle];
                    const Vertex* corner[3] = {vertices + c[0], vertices + c[1], vertices + c[2]};
                    const dvec3 a = minus(wide(corner[0]->position), o), b = minus(wide(corner[1]->position), o),
                                e = minus(wide(corner[2]->position), o);
                    const dvec3 volumes{dotted(v, crossed(b, e)), dotted(v, crossed(e, a)), dotted(v, crossed(a, b))};
                    const double sum = volumes.x + volumes.y + volumes.z;
                    if (sum == 0 || volumes.x * sum < 0 || volumes.y * sum < 0 || volumes.z * sum < 0) continue;
                    const dvec3 w{volumes.x / sum, volumes.y / sum, volumes.z / sum};
                    const dvec3 face = crossed(minus(b, a), minus(e, a));
                    const double slope = dotted(face, v);
                    if (slope == 0) continue;
                    const double t = dotted(face, a) / slope;
                    if (!(t > 0 && t < found.t)) continue;
                    // A mirrored part's triangles are turned where they are read, so the world's side is what counts.
                    const double side = slope * (model::determinant(part.place) < 0 ? -1 : 1);
                    if (seen_only && !surface.double_sided && side > 0) continue;
                    if (surface.mask) {
                        double alpha = double(surface.base_color.w) *
                                       (w.x * double(corner[0]->color.w) + w.y * double(corner[1]->color.w) +
                                        w.z * double(corner[2]->color.w));
                        if (surface.base_texture.image >= 0)
                            alpha *=
                                double(texel(d, surface.base_texture, uv_at(corner, w, surface.base_texture), true).w);
                        if (alpha < double(surface.alpha_cutoff)) continue;
                    }
                    found = {which, triangle, t, w};
                    if (any) return true;
                }
            }
        }
    }
    return found.part != UINT32_MAX;
}

MeshHit MeshTrace::look(dvec3 origin, dvec3 direction, const Found& found) const {
    const MeshSet::Part& part = set_.parts[found.part];
    const model::Drawable& d = set_.drawable(part);
    const model::Primitive& p = set_.primitive(part);
    const model::Surface& s = d.surfaces[p.surface];
    const uint32_t* c = &d.indices[p.first_index + 3 * found.triangle];
    const Vertex* all = set_.vertices(part);
    const Vertex* v[3] = {all + c[0], all + c[1], all + c[2]};
    const dvec3 w = found.weights;
    const double weight[3] = {w.x, w.y, w.z};
    const Matrix& back = back_[found.part];

    MeshHit out;
    out.t = found.t;
    dvec3 at[3], n_at[3];
    for (size_t i = 0; i < 3; ++i) {
        at[i] = model::transform_point(part.place, wide(v[i]->position));
        n_at[i] = unit_or(normal_by(back, wide(v[i]->normal)), {0, 1, 0});
    }
    out.face = unit_or(crossed(minus(at[1], at[0]), minus(at[2], at[0])), {0, 1, 0});
    const double side = dotted(out.face, direction) > 0 ? -1 : 1;

    dvec3 n_local{}, t_local{};
    vec4 color{0, 0, 0, 0};
    for (size_t i = 0; i < 3; ++i) {
        n_local = plus(n_local, wide(v[i]->normal), weight[i]);
        t_local = plus(t_local, {v[i]->tangent.x, v[i]->tangent.y, v[i]->tangent.z}, weight[i]);
        const float f = float(weight[i]);
        color = {color.x + f * v[i]->color.x, color.y + f * v[i]->color.y, color.z + f * v[i]->color.z, 1};
    }
    dvec3 n = unit_or(normal_by(back, n_local), out.face);
    if (s.normal_texture.image >= 0) {
        n_local = unit_or(n_local, {0, 1, 0});
        t_local = unit_or(plus(t_local, n_local, -dotted(n_local, t_local)), {1, 0, 0});
        const dvec3 b_local = crossed(n_local, t_local);
        const double hand = v[0]->tangent.w < 0 ? -1 : 1;
        const dvec3 tangent = unit_or(model::transform_vector(part.place, t_local), {});
        const dvec3 bitangent =
            unit_or(model::transform_vector(part.place, {b_local.x * hand, b_local.y * hand, b_local.z * hand}), {});
        const vec4 bump = texel(d, s.normal_texture, uv_at(v, w, s.normal_texture), false);
        n = unit_or(
            plus(plus({n.x * double(2 * bump.z - 1), n.y * double(2 * bump.z - 1), n.z * double(2 * bump.z - 1)},
                      tangent, double((2 * bump.x - 1) * s.normal_scale)),
                 bitangent, double((2 * bump.y - 1) * s.normal_scale)),
            n);
    }
    out.normal = {n.x * side, n.y * side, n.z * side};
    out.face = {out.face.x * side, out.face.y * side, out.face.z * side};

    const dvec3 hit = plus(origin, direction, found.t);
    out.round = hit;
    for (size_t i = 0; i < 3; ++i) {
        const dvec3 m{n_at[i].x * side, n_at[i].y * side, n_at[i].z * side};
        out.round = plus(out.round, m, -weight[i] * std::min(dotted(minus(hit, at[i]), m), 0.0));
    }

    Material& m = out.material;
    m.base_color = {s.base_color.x * color.x, s.base_color.y * color.y, s.base_color.z * color.z};
    if (s.base_texture.image >= 0) {
        const vec4 t = texel(d, s.base_texture, uv_at(v, w, s.base_texture), true);
        m.base_color = {m.base_color.x * t.x, m.base_color.y * t.y, m.base_color.z * t.z};
    }
    m.metallic = s.metallic;
    m.roughness = s.roughness;
    if (s.rough_metal_texture.image >= 0) {
        const vec4 t = texel(d, s.rough_metal_texture, uv_at(v, w, s.rough_metal_texture), false);
        m.roughness *= t.y;
        m.metallic *= t.z;
    }
    m.emissive = s.emissive;
    if (s.emissive_texture.image >= 0) {
        const vec4 t = texel(d, s.emissive_texture, uv_at(v, w, s.emissive_texture), true);
        m.emissive = {m.emissive.x * t.x, m.emissive.y * t.y, m.emissive.z * t.z};
    }
    if (s.occlusion_texture.image >= 0)
        out.ambient =
            1 + s.occlusion_strength * (texel(d, s.occlusion_texture, uv_at(v, w, s.occlusion_texture), false).x - 1);
    return out;
}

std::optional<MeshHit> MeshTrace::hit(dvec3 origin, dvec3 direction, double t_last) const {
    Found found;
    if (!walk(origin, direction, t_last, true, false, found)) return std::nullopt;
    return look(origin, direction, found);
}

bool MeshTrace::hides(dvec3 origin, dvec3 direction, double t_last) const {
    Found found;
    return walk(origin, direction, t_last, false, true, found);
}

}  // namespace kiln::render
