// SPDX-License-Identifier: MIT
// How far two pictures are apart, as a signal (PSNR), in structure (SSIM), and to the eye (FLIP).
// Pictures are sRGB values as PNG files hold them, of equal size; alpha is not looked at, grey counts as RGB. Any thread.
#pragma once

#include "image/image.h"

#include <kiln/result.h>

#include <string>
#include <vector>

namespace kiln::image {

// Display values in [0, 1], three a pixel.
struct Rgb {
    int width = 0, height = 0;
    std::vector<float> values;
};
Rgb rgb_of(const Pixels& pixels);
// Linear light, clamped to [0, 1] and sRGB-encoded. NaN becomes 0. One channel counts as grey.
Rgb rgb_of(const FloatPixels& linear);

// 10 log10(1 / mean squared error) over all channels, dB; infinity for equal pictures.
double psnr(const Rgb& a, const Rgb& b);
double largest_difference(const Rgb& a, const Rgb& b);
// Mean structural similarity of luma: Wang et al., "Image Quality Assessment: From Error Visibility to Structural
// Similarity", 2004; 11x11 Gaussian window of sigma 1.5, weights renormalised at the picture's border.
double ssim(const Rgb& a, const Rgb& b);

// LDR-FLIP: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020. One error in [0, 1] a pixel.
// 67 pixels a degree is a 0.7 m wide 4K screen from 0.7 m.
std::vector<float> flip_map(const Rgb& reference, const Rgb& test, double pixels_per_degree = 67);
double flip(const Rgb& reference, const Rgb& test, double pixels_per_degree = 67);

struct Difference {
    double flip = 0, psnr = 0, ssim = 0, max_abs = 0;
};
// Two files, .png or .exr (by content). Fails if one cannot be read or the sizes differ.
Result<Difference> compare_files(const std::string& a, const std::string& b);
Result<Rgb> read_rgb(const std::string& path);

}  // namespace kiln::image
