// SPDX-License-Identifier: MIT
// Affine maps of nodes, in double precision, as glTF writes them.
#pragma once

#include <kiln/math.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace kiln::model {

using Matrix = std::array<double, 16>;  // columns

inline constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// First b, then a.
inline Matrix times(const Matrix& a, const Matrix& b) {
    Matrix out{};
    for (size_t c = 0; c < 4; ++c)
        for (size_t r = 0; r < 4; ++r)
            for (size_t k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    return out;
}

/// Translation, rotation (x, y, z, w), scale: scale first.
inline Matrix matrix_of(const double* t, const double* q, const double* s) {
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    Matrix out{1 - 2 * (y * y + z * z),
               2 * (x * y + z * w),
               2 * (x * z - y * w),
               0,
               2 * (x * y - z * w),
               1 - 2 * (x * x + z * z),
               2 * (y * z + x * w),
               0,
               2 * (x * z + y * w),
               2 * (y * z - x * w),
               1 - 2 * (x * x + y * y),
               0,
               t[0],
               t[1],
               t[2],
               1};
    for (size_t c = 0; c < 3; ++c)
        for (size_t r = 0; r < 3; ++r) out[4 * c + r] *= s[c];
    return out;
}

inline Matrix matrix_of(const Transform& t) {
    const double position[] = {t.position.x, t.position.y, t.position.z};
    const double rotation[] = {t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w};
    const double scale[] = {t.scale.x, t.scale.y, t.scale.z};
    return matrix_of(position, rotation, scale);
}

inline dvec3 transform_point(const Matrix& m, dvec3 p) {
    return {m[0] * p.x + m[4] * p.y + m[8] * p.z + m[12], m[1] * p.x + m[5] * p.y + m[9] * p.z + m[13],
            m[2] * p.x + m[6] * p.y + m[10] * p.z + m[14]};
}
inline dvec3 transform_vector(const Matrix& m, dvec3 v) {
    return {m[0] * v.x + m[4] * v.y + m[8] * v.z, m[1] * v.x + m[5] * v.y + m[9] * v.z,
            m[2] * v.x + m[6] * v.y + m[10] * v.z};
}

/// Of the linear part; negative where it mirrors.
inline double determinant(const Matrix& m) {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) +
           m[8] * (m[1] * m[6] - m[2] * m[5]);
}

/// Of an affine map; all zero where it has none.
inline Matrix inverse(const Matrix& m) {
    const double d = determinant(m);
    Matrix out{};
    if (!(std::fabs(d) > 0) || !std::isfinite(1 / d)) return out;
    const double k = 1 / d;
    out[0] = k * (m[5] * m[10] - m[6] * m[9]);
    out[1] = k * (m[2] * m[9] - m[1] * m[10]);
    out[2] = k * (m[1] * m[6] - m[2] * m[5]);
    out[4] = k * (m[6] * m[8] - m[4] * m[10]);
    out[5] = k * (m[0] * m[10] - m[2] * m[8]);
    out[6] = k * (m[2] * m[4] - m[0] * m[6]);
    out[8] = k * (m[4] * m[9] - m[5] * m[8]);
    out[9] = k * (m[1] * m[8] - m[0] * m[9]);
    out[10] = k * (m[0] * m[5] - m[1] * m[4]);
    const dvec3 t = transform_vector(out, {m[12], m[13], m[14]});
    out[12] = -t.x, out[13] = -t.y, out[14] = -t.z, out[15] = 1;
    return out;
}

}  // namespace kiln::model
