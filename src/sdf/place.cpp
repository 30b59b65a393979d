// SPDX-License-Identifier: MIT
// An edit leaves its value in register 1 and combines it with the world's, in register 0. An object's edits do the same one register up:
// its running result is in register 1, so that the last thing left to do is to combine it with the world's. One register more is no
// more than there are: trees ask for 22 of the 24 at most.
// A chain of points begins at the cell's point C. Seen from an object that a pose (R, o) has put into the world, C is Rᵀ (C − o), so
//   C − t       is  Rᵀ (C − (o + R t)),   and   M (C − t)   is   M Rᵀ (C − (o + R t)).

#include "sdf/place.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace kiln::sdf {

namespace {

struct Placer {
    Program& world;
    const Program& object;
    dvec3 origin;
    double rows[3][3];  // object to world
    bool turned;
    uint32_t params_at = 0;  // of the object's numbers in the world's
    std::vector<Instruction> code;

    Placer(Program& w, const Program& o, const Pose& pose) : world(w), object(o) {
        const quat r = pose.rotation;
        origin = {double(pose.position.x), double(pose.position.y), double(pose.position.z)};
        turned = r.x != 0 || r.y != 0 || r.z != 0;
        const double size = std::sqrt(double(r.x) * double(r.x) + double(r.y) * double(r.y) +
                                      double(r.z) * double(r.z) + double(r.w) * double(r.w));
        const double x = double(r.x) / size, y = double(r.y) / size, z = double(r.z) / size, q = double(r.w) / size;
        const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * q), 2 * (x * z + y * q)},
                                {2 * (x * y + z * q), 1 - 2 * (x * x + z * z), 2 * (y * z - x * q)},
                                {2 * (x * z - y * q), 2 * (y * z + x * q), 1 - 2 * (x * x + y * y)}};
        std::copy(&m[0][0], &m[0][0] + 9, &rows[0][0]);
    }

    dvec3 out(dvec3 p) const {
        return {origin.x + rows[0][0] * p.x + rows[0][1] * p.y + rows[0][2] * p.z,
                origin.y + rows[1][0] * p.x + rows[1][1] * p.y + rows[1][2] * p.z,
                origin.z + rows[2][0] * p.x + rows[2][1] * p.y + rows[2][2] * p.z};
    }

    Instruction begin_chain(Instruction in) {
        const float* const w = object.params.data() + in.param;
        dvec3 t{};
        if (in.opcode() != Opcode::PointCell) t = {double(w[0]), double(w[1]), double(w[2])};
        t = out(t);
        std::vector<float> numbers{float(t.x), float(t.y), float(t.z)};
        Opcode opcode = Opcode::PointTranslate;
        if (turned || in.opcode() == Opcode::PointAffine) {
            opcode = Opcode::PointAffine;
            for (size_t i = 0; i < 3; ++i) {
                for (size_t j = 0; j < 3; ++j) {
                    double sum = rows[j][i];  // Rᵀ
                    if (in.opcode() == Opcode::PointAffine) {
                        sum = 0;
                        for (size_t k = 0; k < 3; ++k) sum += double(w[3 + 3 * i + k]) * rows[j][k];
                    }
                    numbers.push_back(float(sum));
                }
            }
        }
        const uint32_t at = uint32_t(world.params.append(numbers));
        return Instruction::make(opcode, in.aux(), in.dst(), in.a(), in.b(), at);
    }

    void append(Instruction in, uint32_t up) {
        if (in.starts_chain()) {
            code.push_back(begin_chain(in));
            return;
        }
        code.push_back(in.moves_point() ? Instruction{in.word, in.param + params_at}
                                        : Instruction::make(in.opcode(), in.aux(), in.dst() + up, in.a() + up,
                                                            in.b() + up, in.param + params_at));
    }
};

}  // namespace

Box3 solid_box(const Program& object) {
    if (object.bounds.empty()) return object.bounds;
    float slowest = 1, blend = 0;
    bool first = true;
    for (const uint32_t row : object.rows()) {
        const EditSpan& edit = object.edits[row];
        slowest = std::min(slowest, edit.rate);
        // Nothing lies before the first, what blends materials moves no surface, and only a union adds to the solid.
        if (!first && edit.op == Op::Union) blend = std::max(blend, edit.blend);
        first = false;
    }
    // A chain of smooth minima with radii up to k goes less than k below the least of its operands.
    return object.bounds.inflated(blend / slowest);
}

Program detached(const Program& program) {
    const auto own = [](const auto& from) {
        std::remove_cvref_t<decltype(from)> out;
        out.append(from.subspan(0, from.size()));
        return out;
    };
    Program out = program;
    out.code = own(program.code);
    out.params = own(program.params);
    out.edits = own(program.edits);
    return out;
}

Result<uint32_t> place(Program& world, const Program& object, const Pose& pose, uint32_t material, uint64_t order) {
    if (!object.samples.empty() && !world.samples.extends(object.samples))
        return Error{"an object's sampled shapes are not among those of the world it joins"};
    if (world.params.empty()) world.params.push_back(0);
    const std::vector<uint32_t> rows = object.rows();
    const uint32_t first_row = uint32_t(world.edits.size());
    EditSpan span;
    span.first = uint32_t(world.code.size());
    span.order = order;
    // An object of several edits: rows that are never visible say whose its parts are.
    std::vector<EditSpan> parts;
    std::vector<float> numbers(object.params.begin(), object.params.end());
    for (const uint32_t row : rows) {
        const EditSpan& edit = object.edits[row];
        uint32_t number = first_row;
        if (rows.size() > 1) {
            EditSpan& part = parts.emplace_back();
            part.op = Op::Subtract;  // not asked whether it is as near as another
            part.owner = edit.owner;
            part.order = order + parts.size();
            number += uint32_t(parts.size());
        }
        for (const Instruction in : object.code.subspan(edit.first, edit.count)) {
            if (!in.has_material()) continue;
            float* const w = numbers.data() + in.param;
            if (w[1] == float(kDefaultMaterial)) w[1] = float(material);
            w[2] = float(number);
            const uint16_t has = uint16_t(w[1]);
            if (has != kNoMaterial)
                span.material = span.material == kNoMaterial || span.material == has ? has : kSeveralMaterials;
        }
        span.rate = std::min(span.rate, edit.rate);
    }
    Placer placer(world, object, pose);
    placer.params_at = uint32_t(world.params.append(numbers));
    uint32_t flag = 0;
    for (const uint32_t row : rows) {
        const auto part = object.code.subspan(object.edits[row].first, object.edits[row].count);
        const bool first = row == rows.front();
        for (const Instruction in : part.first(part.size() - (first ? 1 : 0))) placer.append(in, first ? 0 : 1);
        if (first) flag = part.back().aux() & kMayLackMaterial;
    }
    if (rows.empty()) placer.code.push_back(Instruction::make(Opcode::Empty, 0, 1, 0, 0, 0));
    const uint32_t none = uint32_t(world.params.append({0.0f, 0.0f}));
    placer.code.push_back(Instruction::make(Opcode::Combine, uint32_t(Op::Union) | flag, 0, 0, 1, none));
    const Box3 solid = solid_box(object);
    if (!solid.empty()) {
        for (int corner = 0; corner < 8; ++corner) {
            const dvec3 p = placer.out({double(corner & 1 ? solid.max.x : solid.min.x),
                                        double(corner & 2 ? solid.max.y : solid.min.y),
                                        double(corner & 4 ? solid.max.z : solid.min.z)});
            const vec3 at{float(p.x), float(p.y), float(p.z)};
            span.bounds = box_union(span.bounds, {at, at});
        }
        const vec3 size = max(max(span.bounds.max, -span.bounds.min), vec3{});
        span.bounds = span.bounds.inflated(4e-7f * std::max({size.x, size.y, size.z}));
    }
    span.count = uint32_t(placer.code.size());
    span.owner = rows.empty() ? 0 : object.edits[rows.front()].owner;
    world.code.append(placer.code);
    world.edits.push_back(span);
    world.edits.append(parts);
    world.memory_slots = std::max(world.memory_slots, object.memory_slots);
    if (!solid.empty()) world.index.insert(span.indexed(first_row));
    world.settle();
    return first_row;
}

}  // namespace kiln::sdf
