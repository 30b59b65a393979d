// SPDX-License-Identifier: MIT

#include "image/metrics.h"

#include "base/assert.h"
#include "base/format.h"
#include "image/exr_file.h"
#include "image/file.h"
#include "image/png_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace kiln::image {
namespace {

void require_same_size(const Rgb& a, const Rgb& b) {
    KILN_ASSERT(a.width == b.width && a.height == b.height && !a.values.empty(), "{} x {} and {} x {}", a.width,
                a.height, b.width, b.height);
}

// One number a pixel, filtered with windows that end at the border: weights are renormalised there.
struct Plane {
    int width, height;
    std::vector<double> values;
};

Plane blurred(const Plane& in, const std::vector<double>& weights) {
    const int radius = int(weights.size() / 2);
    Plane out = in;
    Plane middle = in;
    for (int pass = 0; pass < 2; ++pass) {
        const Plane& from = pass == 0 ? in : middle;
        Plane& to = pass == 0 ? middle : out;
        const int length = pass == 0 ? in.width : in.height;
        const size_t stride = pass == 0 ? 1 : size_t(in.width);
        for (int y = 0; y < in.height; ++y) {
            for (int x = 0; x < in.width; ++x) {
                const int at = pass == 0 ? x : y;
                const size_t index = size_t(y) * size_t(in.width) + size_t(x);
                double sum = 0, total = 0;
                for (int k = std::max(-radius, -at); k <= std::min(radius, length - 1 - at); ++k) {
                    const double w = weights[size_t(k + radius)];
                    sum += w * from.values[index + size_t(k) * stride];
                    total += w;
                }
                to.values[index] = sum / total;
            }
        }
    }
    return out;
}

Plane luma(const Rgb& rgb) {
    Plane out{rgb.width, rgb.height, std::vector<double>(rgb.values.size() / 3)};
    for (size_t i = 0; i < out.values.size(); ++i) {
        out.values[i] = 0.299 * rgb.values[3 * i] + 0.587 * rgb.values[3 * i + 1] + 0.114 * rgb.values[3 * i + 2];
    }
    return out;
}

float srgb_encoded(float x) {
    const float c = x > 0 ? std::min(x, 1.0f) : 0.0f;
    return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
}

}  // namespace

Rgb rgb_of(const Pixels& pixels) {
    Rgb out{pixels.width, pixels.height, std::vector<float>(size_t(pixels.width) * size_t(pixels.height) * 3)};
    const float scale = pixels.bits == 16 ? 1 / 65535.0f : 1 / 255.0f;
    const size_t channels = size_t(pixels.channels);
    for (size_t i = 0; i < out.values.size(); ++i) {
        out.values[i] = scale * float(pixels.values[i / 3 * channels + (channels < 3 ? 0 : i % 3)]);
    }
    return out;
}

Rgb rgb_of(const FloatPixels& linear) {
    Rgb out{linear.width, linear.height, std::vector<float>(size_t(linear.width) * size_t(linear.height) * 3)};
    const size_t channels = size_t(linear.channels);
    for (size_t i = 0; i < out.values.size(); ++i) {
        out.values[i] = srgb_encoded(linear.values[i / 3 * channels + (channels < 3 ? 0 : i % 3)]);
    }
    return out;
}

double psnr(const Rgb& a, const Rgb& b) {
    require_same_size(a, b);
    double sum = 0;
    for (size_t i = 0; i < a.values.size(); ++i)
        sum += (double(a.values[i]) - b.values[i]) * (double(a.values[i]) - b.values[i]);
    return sum == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(sum / double(a.values.size()));
}

double largest_difference(const Rgb& a, const Rgb& b) {
    require_same_size(a, b);
    double largest = 0;
    for (size_t i = 0; i < a.values.size(); ++i)
        largest = std::max(largest, std::fabs(double(a.values[i]) - b.values[i]));
    return largest;
}

double ssim(const Rgb& a, const Rgb& b) {
    require_same_size(a, b);
    std::vector<double> window(11);
    for (int i = 0; i < 11; ++i) window[size_t(i)] = std::exp(-0.5 * (i - 5) * (i - 5) / (1.5 * 1.5));
    const Plane x = luma(a), y = luma(b);
    Plane xx = x, yy = x, xy = x;
    for (size_t i = 0; i < x.values.size(); ++i) {
        xx.values[i] = x.values[i] * x.values[i];
        yy.values[i] = y.values[i] * y.values[i];
        xy.values[i] = x.values[i] * y.values[i];
    }
    const Plane mx = blurred(x, window), my = blurred(y, window);
    const Plane mxx = blurred(xx, window), myy = blurred(yy, window), mxy = blurred(xy, window);
    constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    double sum = 0;
    for (size_t i = 0; i < x.values.size(); ++i) {
        const double p = mx.values[i], q = my.values[i];
        const double vx = mxx.values[i] - p * p, vy = myy.values[i] - q * q, v = mxy.values[i] - p * q;
        sum += (2 * p * q + c1) * (2 * v + c2) / ((p * p + q * q + c1) * (vx + vy + c2));
    }
    return sum / double(x.values.size());
}

Result<Rgb> read_rgb(const std::string& path) {
    Result<std::vector<std::byte>> bytes = read_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->size() >= 1 && (*bytes)[0] == std::byte(0x76)) {
        Result<FloatPixels> exr = decode_exr(*bytes, path);
        if (!exr) return exr.error();
        return rgb_of(*exr);
    }
    Result<Pixels> png = decode_png(*bytes, path);
    if (!png) return png.error();
    return rgb_of(*png);
}

Result<Difference> compare_files(const std::string& a, const std::string& b) {
    Result<Rgb> first = read_rgb(a);
    if (!first) return first.error();
    Result<Rgb> second = read_rgb(b);
    if (!second) return second.error();
    if (first->width != second->width || first->height != second->height) {
        return Error{formatted("{} is {} x {} and {} is {} x {}; they must be of one size", a, first->width,
                               first->height, b, second->width, second->height),
                     ErrorKind::Input};
    }
    return Difference{.flip = flip(*first, *second),
                      .psnr = psnr(*first, *second),
                      .ssim = ssim(*first, *second),
                      .max_abs = largest_difference(*first, *second)};
}

}  // namespace kiln::image
