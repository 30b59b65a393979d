// SPDX-License-Identifier: MIT

#include "render/lib/shading.gpu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <numbers>

using namespace kiln::render::shade;
using kiln::vec3;

namespace {

vec3 from_angles(double cosine, double phi) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {float(sine * std::cos(phi)), float(sine * std::sin(phi)), float(cosine)};
}

// Integral over the hemisphere of brdf * cosine seen from a cosine n_v: light directions by midpoints, dense around the mirror
// direction, where a smooth surface reflects: cosine and azimuth are both warped by cubes.
double directional_sum(const SurfaceOptics& optics, double n_v) {
    const SurfaceView s = surface_view(optics, {0, 0, 1}, from_angles(n_v, 0));
    const int n = 500;
    double sum = 0;
    // mu = n_v + sign(a) |a|³, over a in [a0, a1]; phi = pi + pi b³, over b in [-1, 1].
    const double a0 = -std::cbrt(n_v), a1 = std::cbrt(1 - n_v);
    for (int i = 0; i < n; ++i) {
        const double a = a0 + (a1 - a0) * (i + 0.5) / n, mu = n_v + a * a * a;
        for (int j = 0; j < n / 2; ++j) {
            const double b = (j + 0.5) / (n / 2);
            const double weight = 3 * a * a * (a1 - a0) / n * 2 * std::numbers::pi * 3 * b * b / (n / 2);
            sum += weight * brdf_times_cosine(s, from_angles(mu, std::numbers::pi * (1 + b * b * b))).x;
        }
    }
    return sum;
}

SurfaceOptics mirror(double roughness, float f0) { return surface_optics({f0, f0, f0}, 1, float(roughness)); }

}  // namespace

// Gate G7: the table of the design, made with 16,384 random samples (its own error is up to 1e-3, at r = 0.1 2e-3).
TEST(Brdf, DirectionalAlbedoMatchesTheTable) {
    const double rows[][4] = {{0.10, 0.1, 0.416, 0.578},   {0.25, 0.1, 0.5062, 0.3916}, {0.25, 0.5, 0.9554, 0.0326},
                              {0.25, 1.0, 0.9957, 0},      {0.50, 0.1, 0.7507, 0.1397}, {0.50, 0.5, 0.8348, 0.0223},
                              {0.50, 0.9, 0.9071, 0.0003}, {0.50, 1.0, 0.9158, 0},      {0.75, 0.1, 0.7957, 0.0526},
                              {0.75, 0.5, 0.6547, 0.0085}, {0.75, 1.0, 0.6269, 0},      {1.00, 0.1, 0.7363, 0.0239},
                              {1.00, 0.5, 0.4477, 0.0030}, {1.00, 1.0, 0.3068, 0}};
    for (const auto& [r, n_v, a, b] : rows) {
        const kiln::vec2 got = ggx_directional_albedo(float(r), float(n_v));
        EXPECT_NEAR(got.x, a, 2e-3) << "A at r " << r << ", n_v " << n_v;
        EXPECT_NEAR(got.y, b, 2e-3) << "B at r " << r << ", n_v " << n_v;
        EXPECT_NEAR(got.x + got.y, a + b, 2e-3) << "E at r " << r << ", n_v " << n_v;
        const GgxAlbedo exact = integrate_ggx_albedo(r, n_v, 96);
        EXPECT_NEAR(exact.of_f0, a, 2e-3) << "integral A at r " << r << ", n_v " << n_v;
        EXPECT_NEAR(exact.of_f90, b, 2e-3) << "integral B at r " << r << ", n_v " << n_v;
    }
    EXPECT_NEAR(integrate_ggx_albedo(1, 1, 96).of_f0 + integrate_ggx_albedo(1, 1, 96).of_f90, 1 - std::log(2.0), 1e-4);
    const double averages[][2] = {{0.25, 0.987}, {0.5, 0.882}, {0.75, 0.656}, {1.0, 0.409}};
    for (const auto& [r, e] : averages) {
        const kiln::vec2 got = ggx_average_albedo(float(r));
        EXPECT_NEAR(got.x + got.y, e, 2e-3) << "mean E at r " << r;
    }
}

TEST(Brdf, TheTableIsWhatIntegrationGives) {
    if (const char* path = std::getenv("KILN_WRITE_GGX_TABLE")) {
        std::ofstream out(path);
        for (int i = 0; i < kGgxTableWords; ++i) {
            out << "0x" << std::hex << std::setw(8) << std::setfill('0') << make_ggx_table_word(i) << ','
                << (i % 12 == 11 ? '\n' : ' ');
        }
        out << '\n';
    }
    for (int i = 0; i < kGgxTableWords; i += i < 1024 ? 37 : 5)
        EXPECT_EQ(ggx_albedo_table()[size_t(i)], make_ggx_table_word(i)) << i;
}

TEST(Brdf, PointValuesAlongTheNormal) {
    const vec3 n{0, 0, 1};
    const double rows[][3] = {{0.5, 1, 1.27324}, {1, 1, 0.0795775}, {0.25, 0.04, 0.814873}};
    for (const auto& [r, f0, expected] : rows) {
        SurfaceView s = surface_view(mirror(r, float(f0)), n, n);
        s.gain = {1, 1, 1};  // single scattering alone
        EXPECT_NEAR(brdf_times_cosine(s, n).x, expected, 1e-4 * expected) << "r " << r;
    }
    EXPECT_NEAR(ggx_distribution(1, 0, 0.25f), 5.09296, 1e-4);
    EXPECT_NEAR(ggx_distribution(1, 0, 0.0625f), 81.4873, 1e-3);
    EXPECT_NEAR(ggx_visibility(1, 1, 0.25f), 0.25, 1e-6);
}

// Direct light from every direction: a white mirror sends on all of it, however rough; so does a white dielectric.
TEST(Brdf, WhiteFurnace) {
    for (const double r : {0.2, 0.35, 0.5, 0.75, 1.0}) {
        for (const double n_v : {0.15, 0.3, 0.6, 0.9, 1.0}) {
            EXPECT_NEAR(directional_sum(mirror(r, 1), n_v), 1, 0.01) << "metal, r " << r << ", n_v " << n_v;
            EXPECT_NEAR(directional_sum(surface_optics({1, 1, 1}, 0, float(r)), n_v), 1, 0.01)
                << "dielectric, r " << r << ", n_v " << n_v;
        }
    }
}

TEST(Brdf, SkyLightOfAWhiteSurfaceIsTheSkyExactly) {
    SkyParams sky{};
    sky.c0 = {1, 1, 1, 0};
    for (float r = 0; r <= 1; r += 0.1f) {
        for (float n_v = 0.01f; n_v <= 1; n_v += 0.11f) {
            for (const float metallic : {0.0f, 0.5f, 1.0f}) {
                const SurfaceView s =
                    surface_view(surface_optics({1, 1, 1}, metallic, r), {0, 0, 1}, from_angles(n_v, 1));
                EXPECT_NEAR(shade_sky(s, sky).x, 1, 0.005) << "r " << r << ", n_v " << n_v << ", metallic " << metallic;
            }
        }
    }
}

TEST(Brdf, NeverSendsOnMoreThanItReceives) {
    for (const double r : {0.2, 0.4, 0.7, 1.0}) {
        for (const double n_v : {0.1, 0.5, 1.0}) {
            double before = 0;
            for (const float f0 : {0.0f, 0.04f, 0.3f, 0.7f, 1.0f}) {
                SurfaceOptics s = mirror(r, f0);
                const double reflected = directional_sum(s, n_v);
                EXPECT_GE(reflected, before) << "more reflectance reflects more";
                EXPECT_LE(reflected, 1.01);
                before = reflected;
                s.metallic = 0.5f;
                EXPECT_LE(directional_sum(s, n_v), 1.01) << "r " << r << ", n_v " << n_v << ", color " << f0;
            }
        }
    }
}

// The base is exactly reciprocal; the gain, which knows the eye only, is not, by less than this for dielectrics.
TEST(Brdf, IsNearlyTheSameBothWays) {
    const vec3 n{0, 0, 1};
    for (const double r : {0.2, 0.6, 1.0}) {
        const SurfaceOptics optics = surface_optics({0.8f, 0.5f, 0.2f}, 0, float(r));
        for (double a = 0.1; a < 1; a += 0.17) {
            for (double b = 0.1; b < 1; b += 0.17) {
                const vec3 v = from_angles(a, 0), l = from_angles(b, 2.1);
                const double there = brdf_times_cosine(surface_view(optics, n, v), l).x / l.z;
                const double back = brdf_times_cosine(surface_view(optics, n, l), v).x / v.z;
                EXPECT_NEAR(there, back, 2e-3 * (there + back)) << "r " << r << ", " << a << " " << b;
            }
        }
    }
}

TEST(Brdf, StaysFiniteAtTheEdges) {
    for (const float r : {-1.0f, 0.0f, 0.045f, 1.0f, 5.0f}) {
        for (const float c : {0.0f, 1e-6f, 1.0f}) {
            const SurfaceView s = surface_view(surface_optics({1, 1, 1}, 1, r), {0, 0, 1}, from_angles(c, 0));
            for (const float d : {-1.0f, 0.0f, 1e-6f, 1.0f}) {
                const vec3 out = brdf_times_cosine(s, d < 0 ? vec3{0, 0, -1} : from_angles(d, 3.14159));
                EXPECT_TRUE(std::isfinite(out.x) && out.x >= 0) << r << " " << c << " " << d << ": " << out.x;
            }
        }
    }
}
