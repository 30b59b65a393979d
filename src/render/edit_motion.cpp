// SPDX-License-Identifier: MIT
#include "render/edit_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln::render {

namespace {

using Turn = std::array<std::array<double, 3>, 3>;

Turn rotation(quat q) {
    const double size = std::sqrt(double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z + double(q.w) * q.w);
    const double x = q.x / size, y = q.y / size, z = q.z / size, w = q.w / size;
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

// before · now⁻¹, both counted from the eye: in double precision, since the eye may be kilometres from the origin.
MovedRecord record_of(const EditMotion& m, const double (&eye)[3]) {
    const Turn then = rotation(m.before.rotation), now = rotation(m.now.rotation);
    const double ratio[3] = {double(m.before.scale.x) / double(m.now.scale.x),
                             double(m.before.scale.y) / double(m.now.scale.y),
                             double(m.before.scale.z) / double(m.now.scale.z)};
    const double is[3] = {m.now.position.x, m.now.position.y, m.now.position.z};
    const double was[3] = {m.before.position.x, m.before.position.y, m.before.position.z};
    MovedRecord out{};
    vec4* const rows[] = {&out.before_x, &out.before_y, &out.before_z};
    for (size_t k = 0; k < 3; ++k) {
        double row[3], at = was[k] - eye[k];
        for (size_t j = 0; j < 3; ++j) {
            row[j] = 0;
            for (size_t n = 0; n < 3; ++n) row[j] += then[k][n] * ratio[n] * now[j][n];
            at += row[j] * (eye[j] - is[j]);
        }
        *rows[k] = {float(row[0]), float(row[1]), float(row[2]), float(at)};
    }
    return out;
}

}  // namespace

MovedEdits moved_edits(const Frame& frame, const sdf::Program& program, const FrameParams& params) {
    const double h = double(params.grid.voxel_size);
    const double eye[3] = {(params.eye_x + double(params.eye_part_x)) * h,
                           (params.eye_y + double(params.eye_part_y)) * h,
                           (params.eye_z + double(params.eye_part_z)) * h};
    MovedEdits out;
    std::vector<EditOutline> rows;
    for (const EditMotion& m : frame.moved) rows.push_back({m.row, {}});
    out.code = outline_code(rows, program, {});
    for (const uint32_t i : out.code.of) out.records.push_back(record_of(frame.moved[i], eye));
    const auto from_eye = [&](float at, size_t axis) { return float(std::clamp(double(at) - eye[axis], -1e30, 1e30)); };
    for (const Box3& b : frame.changed) {
        out.boxes.push_back({from_eye(b.min.x, 0), from_eye(b.min.y, 1), from_eye(b.min.z, 2), 0, from_eye(b.max.x, 0),
                             from_eye(b.max.y, 1), from_eye(b.max.z, 2), 0});
    }
    return out;
}

}  // namespace kiln::render
