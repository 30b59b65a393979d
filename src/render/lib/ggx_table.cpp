// SPDX-License-Identifier: MIT

#include "render/lib/ggx_table.h"

#include "base/assert.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::render::shade {

// Written by `KILN_WRITE_GGX_TABLE=FILE render_tests --gtest_filter=Brdf.TheTableIsWhatIntegrationGives`.
static constexpr uint32_t kTable[kGgxTableWords] = {
#include "render/lib/ggx_table.inl"
};

std::span<const uint32_t> ggx_albedo_table() { return kTable; }

// Smith's Lambda for GGX.
static double lambda(double cosine, double alpha) {
    const double c2 = cosine * cosine;
    return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - c2) / c2) - 1);
}

GgxAlbedo integrate_ggx_albedo(double roughness, double n_v, int side) {
    const double alpha = roughness * roughness;
    const double cosine = std::clamp(n_v, 1e-4, 1.0), sine = std::sqrt(1 - cosine * cosine);
    // The view direction where the ellipsoid of microfacets is a sphere.
    const double stretched = std::sqrt(alpha * alpha * sine * sine + cosine * cosine);
    const double wx = alpha * sine / stretched, wz = cosine / stretched;
    const double lambda_v = lambda(cosine, alpha);
    double of_f0 = 0, of_f90 = 0;
    for (int i = 0; i < side; ++i) {
        const double phi = std::numbers::pi * (i + 0.5) / side;  // half the circle: the other half mirrors it
        for (int j = 0; j < side; ++j) {
            // Dense where few microfacets lie far from the normal and send light below the surface.
            const double v = 1 - (j + 0.5) / side, density = 2 * v;
            const double z = v * v * (1 + wz) - wz;
            const double r = std::sqrt(std::max(0.0, 1 - z * z));
            double hx = alpha * (r * std::cos(phi) + wx), hy = alpha * r * std::sin(phi), hz = std::max(z + wz, 0.0);
            const double length = std::sqrt(hx * hx + hy * hy + hz * hz);
            hx /= length, hz /= length;
            const double v_h = std::clamp(sine * hx + cosine * hz, 0.0, 1.0);
            const double n_l = 2 * v_h * hz - cosine;
            if (n_l <= 0) continue;
            const double weight = density * (1 + lambda_v) / (1 + lambda_v + lambda(std::min(n_l, 1.0), alpha));
            const double grazing = std::pow(1 - v_h, 5);
            of_f0 += weight * (1 - grazing);
            of_f90 += weight * grazing;
        }
    }
    return {of_f0 / (side * side), of_f90 / (side * side)};
}

uint32_t make_ggx_table_word(int i) {
    KILN_ASSERT(i >= 0 && i < kGgxTableWords, "word {}", i);
    constexpr int n = kGgxTableSide;
    const int row = i < n * n ? i / n : i - n * n;
    const double roughness = 0.045 + (1 - 0.045) * row / (n - 1);
    GgxAlbedo a;
    if (i < n * n) {
        const double s = double(i % n) / (n - 1);
        a = integrate_ggx_albedo(roughness, s * s, 128);
    } else {
        // 2 n_v d n_v with n_v = s²: 4 s³ ds, midpoints.
        constexpr int steps = 64;
        for (int k = 0; k < steps; ++k) {
            const double s = (k + 0.5) / steps;
            const GgxAlbedo at = integrate_ggx_albedo(roughness, s * s, 48);
            a.of_f0 += 4 * s * s * s * at.of_f0 / steps;
            a.of_f90 += 4 * s * s * s * at.of_f90 / steps;
        }
    }
    return uint32_t(std::lround(a.of_f0 * 65535)) | uint32_t(std::lround(a.of_f90 * 65535)) << 16;
}

}  // namespace kiln::render::shade
