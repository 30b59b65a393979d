// SPDX-License-Identifier: MIT
// LDR-FLIP, written from the paper: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM CGIT 3(2), 2020. Section numbers below are the paper's.

#include "image/metrics.h"

#include "base/assert.h"
#include "base/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace kiln::image {
namespace {

using Color = std::array<double, 3>;

double linear_of(double s) { return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4); }

// Linear sRGB to CIE XYZ over the white point D65, so that white is (1, 1, 1); and back. Rows of the standard's matrix
// divided by their sums.
constexpr double kToXyz[3][3] = {
    {0.41239080, 0.35758434, 0.18048079}, {0.21263901, 0.71516868, 0.07219232}, {0.01933082, 0.11919478, 0.95053215}};

struct Matrices {
    double to[3][3], from[3][3];
    Matrices() {
        for (int i = 0; i < 3; ++i) {
            const double sum = kToXyz[i][0] + kToXyz[i][1] + kToXyz[i][2];
            for (int j = 0; j < 3; ++j) to[i][j] = kToXyz[i][j] / sum;
        }
        const auto& m = to;
        const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {  // cofactor of (j, i)
                const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
                from[i][j] = (m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]) / det;
            }
        }
    }
};
const Matrices kMatrices;

Color times(const double (&m)[3][3], const Color& c) {
    Color out;
    for (size_t i = 0; i < 3; ++i) out[i] = m[i][0] * c[0] + m[i][1] * c[1] + m[i][2] * c[2];
    return out;
}

// 3.1: the opponent space YCxCz, linear in XYZ.
Color opponent(const Color& xyz) { return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])}; }
Color from_opponent(const Color& o) {
    const double y = (o[0] + 16) / 116;
    return {y + o[1] / 500, y, y - o[2] / 200};
}

// 4.1.2: CIE L*a*b* with the Hunt effect: colour counts less where it is dark.
Color hunt_lab(const Color& xyz) {
    auto f = [](double t) {
        constexpr double d = 6.0 / 29;
        return t > d * d * d ? std::cbrt(t) : t / (3 * d * d) + 4.0 / 29;
    };
    const double l = 116 * f(xyz[1]) - 16;
    return {l, 0.01 * l * 500 * (f(xyz[0]) - f(xyz[1])), 0.01 * l * 200 * (f(xyz[1]) - f(xyz[2]))};
}

double hyab(const Color& a, const Color& b) { return std::fabs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

struct Plane3 {
    int width, height;
    std::array<std::vector<double>, 3> channels;
};

// A sum of up to two separable kernels, g(x, y) = sum of g_i(x) g_i(y), each given at -radius … radius.
struct Separable {
    std::vector<double> x, y;
};

// Convolves with the border pixels repeated outwards.
std::vector<double> convolved(const std::vector<double>& in, int width, int height, const Separable& kernel) {
    const int rx = int(kernel.x.size() / 2), ry = int(kernel.y.size() / 2);
    std::vector<double> middle(in.size()), out(in.size());
    parallel_for(height, [&](int y) {
        const double* row = in.data() + size_t(y) * size_t(width);
        for (int x = 0; x < width; ++x) {
            double sum = 0;
            for (int k = -rx; k <= rx; ++k) sum += kernel.x[size_t(k + rx)] * row[std::clamp(x + k, 0, width - 1)];
            middle[size_t(y) * size_t(width) + size_t(x)] = sum;
        }
    });
    parallel_for(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            double sum = 0;
            for (int k = -ry; k <= ry; ++k) {
                sum += kernel.y[size_t(k + ry)] *
                       middle[size_t(std::clamp(y + k, 0, height - 1)) * size_t(width) + size_t(x)];
            }
            out[size_t(y) * size_t(width) + size_t(x)] = sum;
        }
    });
    return out;
}

// 4.1.1: contrast sensitivity as Gaussians in degrees, a sqrt(pi / b) exp(-pi² x² / b), one set a channel (their table 1).
constexpr double kSensitivity[3][4] = {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}};

std::vector<Separable> sensitivity_kernels(int channel, double pixels_per_degree) {
    const double pi = std::numbers::pi;
    const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * pi * pi)) * pixels_per_degree));
    std::vector<Separable> out;
    double total = 0;
    for (int part = 0; part < 2; ++part) {
        const double a = kSensitivity[channel][2 * part], b = kSensitivity[channel][2 * part + 1];
        if (a == 0) continue;
        Separable s;
        double sum = 0;
        for (int k = -radius; k <= radius; ++k) {
            const double d = k / pixels_per_degree;
            s.x.push_back(std::exp(-pi * pi * d * d / b));
            sum += s.x.back();
        }
        s.y = s.x;
        for (double& w : s.x) w *= a * std::sqrt(pi / b);
        total += a * std::sqrt(pi / b) * sum * sum;
        out.push_back(s);
    }
    for (Separable& s : out) {
        for (double& w : s.x) w /= total;
    }
    return out;
}

// 4.1: what the eye resolves of the picture's colours, as Hunt-adjusted L*a*b*.
std::vector<Color> perceived(const Plane3& ycxcz, double pixels_per_degree) {
    const size_t count = ycxcz.channels[0].size();
    Plane3 filtered = ycxcz;
    for (int c = 0; c < 3; ++c) {
        std::vector<double>& out = filtered.channels[size_t(c)];
        std::fill(out.begin(), out.end(), 0.0);
        for (const Separable& kernel : sensitivity_kernels(c, pixels_per_degree)) {
            const std::vector<double> part = convolved(ycxcz.channels[size_t(c)], ycxcz.width, ycxcz.height, kernel);
            for (size_t i = 0; i < count; ++i) out[i] += part[i];
        }
    }
    std::vector<Color> out(count);
    parallel_for(
        int(count), 0,
        [&](int at) {
            const size_t i = size_t(at);
            Color rgb =
                times(kMatrices.from,
                      from_opponent({filtered.channels[0][i], filtered.channels[1][i], filtered.channels[2][i]}));
            for (double& v : rgb) v = std::clamp(v, 0.0, 1.0);
            out[i] = hunt_lab(times(kMatrices.to, rgb));
        },
        4096);
    return out;
}

// 4.2: edges and points of the achromatic channel, by first and second derivatives of a Gaussian that spans 0.082 degrees.
struct Features {
    std::vector<double> edge, point;
};
Features features(const Plane3& ycxcz, double pixels_per_degree) {
    const double sigma = 0.5 * 0.082 * pixels_per_degree;
    const int radius = int(std::ceil(3 * sigma));
    std::vector<double> gauss, first, second;
    double gauss_sum = 0, first_sum = 0, plus = 0, minus = 0;
    for (int k = -radius; k <= radius; ++k) {
        const double g = std::exp(-0.5 * k * k / (sigma * sigma));
        gauss.push_back(g);
        first.push_back(-k * g);
        second.push_back((k * k / (sigma * sigma) - 1) * g);
        gauss_sum += g;
        first_sum += std::max(first.back(), 0.0);
        (second.back() > 0 ? plus : minus) += std::fabs(second.back());
    }
    // Positive weights sum to 1, negative ones to -1.
    for (double& w : gauss) w /= gauss_sum;
    for (double& w : first) w /= first_sum;
    for (double& w : second) w /= w > 0 ? plus : minus;

    std::vector<double> y = ycxcz.channels[0];
    for (double& v : y) v = (v + 16) / 116;
    auto length = [&](const std::vector<double>& kernel) {
        std::vector<double> across = convolved(y, ycxcz.width, ycxcz.height, {kernel, gauss});
        const std::vector<double> down = convolved(y, ycxcz.width, ycxcz.height, {gauss, kernel});
        for (size_t i = 0; i < across.size(); ++i) across[i] = std::hypot(across[i], down[i]);
        return across;
    };
    return {length(first), length(second)};
}

Plane3 opponent_plane(const Rgb& rgb) {
    Plane3 out{rgb.width, rgb.height, {}};
    const size_t count = rgb.values.size() / 3;
    for (auto& c : out.channels) c.resize(count);
    parallel_for(
        int(count), 0,
        [&](int at) {
            const size_t i = size_t(at);
            const Color o =
                opponent(times(kMatrices.to, {linear_of(rgb.values[3 * i]), linear_of(rgb.values[3 * i + 1]),
                                              linear_of(rgb.values[3 * i + 2])}));
            for (size_t c = 0; c < 3; ++c) out.channels[c][i] = o[c];
        },
        4096);
    return out;
}

}  // namespace

std::vector<float> flip_map(const Rgb& reference, const Rgb& test, double pixels_per_degree) {
    KILN_ASSERT(reference.width == test.width && reference.height == test.height && !test.values.empty(),
                "{} x {} and {} x {}", reference.width, reference.height, test.width, test.height);
    const Plane3 a = opponent_plane(reference), b = opponent_plane(test);
    const std::vector<Color> lab_a = perceived(a, pixels_per_degree), lab_b = perceived(b, pixels_per_degree);
    const Features feature_a = features(a, pixels_per_degree), feature_b = features(b, pixels_per_degree);

    // 4.1.3: distances of the gamut's most distant pair, green and blue, become 1; the lower 40 % of them 95 % of the range.
    constexpr double qc = 0.7, pc = 0.4, pt = 0.95, qf = 0.5;
    const double most =
        std::pow(hyab(hunt_lab(times(kMatrices.to, {0, 1, 0})), hunt_lab(times(kMatrices.to, {0, 0, 1}))), qc);
    std::vector<float> out(lab_a.size());
    for (size_t i = 0; i < out.size(); ++i) {
        const double e = std::pow(hyab(lab_a[i], lab_b[i]), qc);
        const double color =
            e < pc * most ? e * pt / (pc * most) : pt + (e - pc * most) / (most - pc * most) * (1 - pt);
        const double difference = std::max(std::fabs(feature_a.edge[i] - feature_b.edge[i]),
                                           std::fabs(feature_a.point[i] - feature_b.point[i]));
        const double feature = std::pow(difference * std::numbers::sqrt2 / 2, qf);
        out[i] = float(std::clamp(std::pow(color, 1 - std::min(feature, 1.0)), 0.0, 1.0));
    }
    return out;
}

double flip(const Rgb& reference, const Rgb& test, double pixels_per_degree) {
    double sum = 0;
    for (const float e : flip_map(reference, test, pixels_per_degree)) sum += e;
    return sum / (double(reference.values.size()) / 3);
}

}  // namespace kiln::image
