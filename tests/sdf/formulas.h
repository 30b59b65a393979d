// SPDX-License-Identifier: MIT
// Random formulas as trees with an evaluator of their own, which shares nothing with the reader or the graph.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>

namespace kiln::sdf {

struct RandomFormula {
    std::string text;
    std::function<double(double, double, double)> value;
};

class FormulaMaker {
public:
    explicit FormulaMaker(uint32_t seed) : engine_(seed) {}
    int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
    double in(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(engine_); }

    /// `smooth`: no jumps and no poles, so that its slope is bounded.
    RandomFormula make(int depth, bool smooth) {
        using F = RandomFormula;
        if (depth == 0 || below(12) == 0) {
            switch (below(5)) {
            case 0:
                return {"x", [](double x, double, double) { return x; }};
            case 1:
                return {"p.y", [](double, double y, double) { return y; }};
            case 2:
                return {"z", [](double, double, double z) { return z; }};
            case 3:
                return {"length(p)", [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }};
            default: {
                const float number = std::round(float(in(-2, 2)) * 64) / 64;  // exact in text, float and double
                const double v = double(number);
                return {v < 0 ? "(" + std::to_string(v) + ")" : std::to_string(v),
                        [v](double, double, double) { return v; }};
            }
            }
        }
        const F a = make(depth - 1, smooth);
        const auto f = a.value;
        switch (below(smooth ? 9 : 16)) {
        case 0:
            return {"sin(" + a.text + ")", [f](double x, double y, double z) { return std::sin(f(x, y, z)); }};
        case 1:
            return {"(-" + a.text + ")", [f](double x, double y, double z) { return -f(x, y, z); }};
        case 2:
            return {"abs(" + a.text + ")", [f](double x, double y, double z) { return std::fabs(f(x, y, z)); }};
        case 9:
            return {"sqrt(" + a.text + ")",
                    [f](double x, double y, double z) { return std::sqrt(std::max(f(x, y, z), 0.0)); }};
        case 10:
            return {"floor(" + a.text + ")", [f](double x, double y, double z) { return std::floor(f(x, y, z)); }};
        case 11:
            return {"exp(clamp(" + a.text + ", -3, 3))",
                    [f](double x, double y, double z) { return std::exp(std::min(std::max(f(x, y, z), -3.0), 3.0)); }};
        case 12:
            return {"log(0.5 + " + a.text + "^2)",
                    [f](double x, double y, double z) { return std::log(0.5 + f(x, y, z) * f(x, y, z)); }};
        default:
            break;
        }
        const F b = make(depth - 1, smooth);
        const auto g = b.value;
        switch (below(smooth ? 6 : 10)) {
        case 0:
            return {"(" + a.text + " + " + b.text + ")",
                    [f, g](double x, double y, double z) { return f(x, y, z) + g(x, y, z); }};
        case 1:
            return {"(" + a.text + " - " + b.text + ")",
                    [f, g](double x, double y, double z) { return f(x, y, z) - g(x, y, z); }};
        case 2:
            return {"min(" + a.text + ", " + b.text + ")",
                    [f, g](double x, double y, double z) { return std::min(f(x, y, z), g(x, y, z)); }};
        case 3:
            return {"max(" + a.text + ", " + b.text + ")",
                    [f, g](double x, double y, double z) { return std::max(f(x, y, z), g(x, y, z)); }};
        case 4:
            return {"(" + a.text + " * cos(" + b.text + "))",
                    [f, g](double x, double y, double z) { return f(x, y, z) * std::cos(g(x, y, z)); }};
        case 5:
            return {"((" + a.text + " + 2*" + b.text + ")/3)",
                    [f, g](double x, double y, double z) { return (f(x, y, z) + 2 * g(x, y, z)) / 3; }};
        case 6:
            return {"atan2(" + a.text + ", " + b.text + ")", [f, g](double x, double y, double z) {
                        const double u = f(x, y, z), v = g(x, y, z);
                        return u == 0 && v == 0 ? 0 : std::atan2(u, v);
                    }};
        case 7:
            return {"mod(" + a.text + ", 0.75)",
                    [f](double x, double y, double z) { return f(x, y, z) - 0.75 * std::floor(f(x, y, z) / 0.75); }};
        case 8:
            return {"(" + a.text + "/(0.5 + square(" + b.text + ")))",
                    [f, g](double x, double y, double z) { return f(x, y, z) / (0.5 + g(x, y, z) * g(x, y, z)); }};
        default:
            return {"mix(" + a.text + ", " + b.text + ", 0.25)",
                    [f, g](double x, double y, double z) { return f(x, y, z) + (g(x, y, z) - f(x, y, z)) * 0.25; }};
        }
    }

private:
    std::mt19937 engine_;
};

}  // namespace kiln::sdf
