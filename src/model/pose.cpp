// SPDX-License-Identifier: MIT
// Where a model's nodes are at a time (glTF 2.0, "Animations").

#include "model/drawable.h"

#include <algorithm>
#include <cmath>

namespace kiln::model {
namespace {

using Value = std::array<double, 4>;

Value slerp(const Value& a, Value b, double t) {
    double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    if (cosine < 0) {  // the shorter way round
        cosine = -cosine;
        for (double& v : b) v = -v;
    }
    double wa = 1 - t, wb = t;
    if (cosine < 0.9999) {
        const double angle = std::acos(std::min(cosine, 1.0)), s = std::sin(angle);
        wa = std::sin(wa * angle) / s;
        wb = std::sin(wb * angle) / s;
    }
    return {wa * a[0] + wb * b[0], wa * a[1] + wb * b[1], wa * a[2] + wb * b[2], wa * a[3] + wb * b[3]};
}

Value value_at(const Channel& c, double time) {
    const size_t width = c.path == Channel::Path::Rotation ? 4 : 3;
    const size_t parts = c.kind == Channel::Kind::Cubic ? 3 : 1;
    const auto key = [&](size_t k, size_t part) {
        Value out{};
        for (size_t i = 0; i < width; ++i) out[i] = double(c.values[(k * parts + part) * width + i]);
        return out;
    };
    const size_t middle = parts == 3 ? 1 : 0;
    const auto after = std::upper_bound(c.times.begin(), c.times.end(), float(time));
    if (after == c.times.begin()) return key(0, middle);
    if (after == c.times.end()) return key(c.times.size() - 1, middle);
    const size_t k = size_t(after - c.times.begin()) - 1;
    const double step = double(c.times[k + 1]) - double(c.times[k]);
    const double t = step > 0 ? (time - double(c.times[k])) / step : 0;
    if (c.kind == Channel::Kind::Step) return key(k, middle);
    const Value a = key(k, middle), b = key(k + 1, middle);
    if (c.kind == Channel::Kind::Linear) {
        if (c.path == Channel::Path::Rotation) return slerp(a, b, t);
        Value out{};
        for (size_t i = 0; i < width; ++i) out[i] = a[i] + (b[i] - a[i]) * t;
        return out;
    }
    const Value leaving = key(k, 2), arriving = key(k + 1, 0);
    const double t2 = t * t, t3 = t2 * t;
    Value out{};
    for (size_t i = 0; i < width; ++i)
        out[i] = (2 * t3 - 3 * t2 + 1) * a[i] + step * (t3 - 2 * t2 + t) * leaving[i] + (3 * t2 - 2 * t3) * b[i] +
                 step * (t3 - t2) * arriving[i];
    return out;
}

}  // namespace

std::vector<Matrix> pose(const Drawable& d, double time) {
    struct Place {
        std::array<double, 3> translation;
        std::array<double, 4> rotation;
        std::array<double, 3> scale;
        bool moves = false;
    };
    std::vector<Place> places(d.nodes.size());
    for (size_t n = 0; n < places.size(); ++n)
        places[n] = {d.nodes[n].translation, d.nodes[n].rotation, d.nodes[n].scale};
    const double now = d.duration > 0 ? time - d.duration * std::floor(time / d.duration) : 0;
    for (const Channel& c : d.channels) {
        const Value v = value_at(c, now);
        Place& place = places[c.node];
        place.moves = true;
        if (c.path == Channel::Path::Translation) place.translation = {v[0], v[1], v[2]};
        if (c.path == Channel::Path::Scale) place.scale = {v[0], v[1], v[2]};
        if (c.path != Channel::Path::Rotation) continue;
        const double size = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
        if (size > 0) place.rotation = {v[0] / size, v[1] / size, v[2] / size, v[3] / size};
    }
    std::vector<Matrix> out(d.nodes.size());
    for (size_t n = 0; n < out.size(); ++n) {
        const DrawNode& node = d.nodes[n];
        const Place& p = places[n];
        const Matrix local = node.has_matrix && !p.moves
                                 ? node.matrix
                                 : matrix_of(p.translation.data(), p.rotation.data(), p.scale.data());
        out[n] = node.parent < 0 ? local : times(out[size_t(node.parent)], local);
    }
    return out;
}

}  // namespace kiln::model
