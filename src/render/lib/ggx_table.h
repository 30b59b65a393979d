// SPDX-License-Identifier: MIT
// Directional albedo of GGX, by integration, and as the table that shaders read.
#pragma once

#include <cstdint>
#include <span>

namespace kiln::render::shade {

// Rows over roughness from kMinRoughness to 1, columns over sqrt(n_v) from 0 to 1. A word holds the factor of f0 in its
// low and of f90 in its high 16 bits, each in 65535ths. Behind the square, one word a row: the averages over the hemisphere.
inline constexpr int kGgxTableSide = 32;
inline constexpr int kGgxTableWords = kGgxTableSide * kGgxTableSide + kGgxTableSide;

// The committed table: kGgxTableWords words, to be uploaded as a storage buffer. Any thread.
std::span<const uint32_t> ggx_albedo_table();

struct GgxAlbedo {
    double of_f0 = 0, of_f90 = 0;
};

// The integral itself: height-correlated Smith, alpha = roughness², directions of visible normals sampled on a grid of
// `side` x `side` (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023). 64 is good to 3e-4.
GgxAlbedo integrate_ggx_albedo(double roughness, double n_v, int side);

// Word i of the table, made anew. What tests compare with, and what the committed table was made by.
uint32_t make_ggx_table_word(int i);

}  // namespace kiln::render::shade
