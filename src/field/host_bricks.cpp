// SPDX-License-Identifier: MIT
#include "field/host_bricks.h"

#include "base/hash.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "field/brick_walk.gpu.h"
#include "field/ray_refiner.h"
#include "sdf/eval.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace kiln::field {
namespace {

constexpr size_t kBakeGrain = 16;  // bricks a piece of work: one takes a microsecond

size_t texel_at(int x, int y, int z) { return (size_t(z) * 8 + size_t(y)) * 8 + size_t(x); }

// The texts of march.gpu.h and surface.gpu.h, reading host bricks.
struct Reader {
    const HostBricks& bricks;
    const CellMap& cells;

    explicit Reader(const HostBricks& host) : bricks(host), cells(host.field().cells()) {}

    uint field_cell(ivec3 cell) const { return cells.at(cell.x, cell.y, cell.z); }
    static void field_enter(uint, ivec3) {}
    int field_slot(ivec3 cell) const {
        const uint32_t word = bricks.field().cell_word(cell.x, cell.y, cell.z);
        return (word & kCellOccupied) != 0 ? int(word & kCellSlotMask) : -1;
    }
    float field_texel(int slot, ivec3 texel) const { return bricks.texel(uint32_t(slot), texel.x, texel.y, texel.z); }
    Corners field_corners(int slot, ivec3 voxel) const { return bricks.corners(uint32_t(slot), voxel); }
    static bool field_voxel_solid(int, ivec3) { return true; }
    uint field_material(int slot, ivec3 texel) const {
        return bricks.content(uint32_t(slot)).word(texel_at(texel.x, texel.y, texel.z));
    }

#include "field/march.gpu.h"

#include "field/surface.gpu.h"
};

vec3 unit(vec3 v) {
    const float size = length(v);
    return size > 0 ? v / size : vec3{};
}

int floor_div(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

}  // namespace

Result<HostBricks> HostBricks::build(std::shared_ptr<const sdf::Program> program, const FieldOptions& options) {
    MadeBricks made;
    auto field = Field::build(std::move(program), options, &made);
    if (!field) return field.error();
    HostBricks out;
    out.field_ = std::move(*field);
    out.take(made);
    return out;
}

HostBricks HostBricks::bake(std::shared_ptr<const Field> field, int workers) {
    HostBricks out;
    out.field_ = std::move(field);
    out.bake_slots(out.field_->slots(), workers);
    return out;
}

void HostBricks::update(std::shared_ptr<const Field> next, int workers, MadeBricks* made) {
    if (!field_ || next->parent_revision() != field_->revision()) {
        *this = bake(std::move(next), workers);
        return;
    }
    field_ = std::move(next);
    if (made != nullptr) {
        take(*made);
    } else {
        bake_slots(field_->jobs(), workers);
    }
}

Result<void> HostBricks::update(std::shared_ptr<const sdf::Program> program, std::span<const RowChange> changes) {
    MadeBricks made;
    auto next = Field::update(*field_, std::move(program), changes, &made, &contents_);
    if (!next) return next.error();
    update(std::move(*next), 0, &made);
    return {};
}

void HostBricks::take(MadeBricks& made) {
    tables_ = WideTables::after(tables_, made);
    contents_.resize_pages(field_->slot_count() / BrickContents::kPageSize + 1);
    // Holders of what shares a page are counted when it is copied; all counters are asked for before the first is.
    for (const auto& [slot, content] : made) {
        if (const BrickContents::Page* const page = contents_.find(slot / BrickContents::kPageSize))
            std::ranges::for_each(*page, &BrickContent::prefetch);
    }
    for (auto& [slot, content] : made) contents_.write(slot) = std::move(content);
}

void HostBricks::bake_slots(std::span<const uint32_t> slots, int workers) {
    KILN_PROFILE("host bake");
    MadeBricks made(slots.size());
    parallel_for((slots.size() + kBakeGrain - 1) / kBakeGrain, workers, [&](int piece) {
        BrickEvaluator evaluator(field_->program(), field_->options().voxel_size);
        const size_t first = size_t(piece) * kBakeGrain;
        for (size_t i = first; i < std::min(first + kBakeGrain, slots.size()); ++i) {
            const BrickRecord& record = field_->records()[slots[i]];
            evaluator.evaluate(field_->code_of(slots[i]), {record.texel_x, record.texel_y, record.texel_z});
            made[i] = {slots[i], evaluator.content(field_->options().format)};
        }
    });
    take(made);
}

uint64_t HostBricks::dropped_materials() const {
    uint64_t sum = 0;
    for (const uint32_t slot : field_->slots()) sum += content(slot).dropped();
    return sum;
}

uint64_t HostBricks::bytes() const {
    uint64_t sum = 0;
    for (const uint32_t slot : field_->slots()) {
        const BrickContent& brick = content(slot);
        sum += (brick.half ? sizeof(HalfCodes) : sizeof(ByteCodes)) + (brick.materials ? sizeof(BrickMaterials) : 0);
    }
    return sum;
}

float HostBricks::texel(uint32_t slot, int x, int y, int z) const { return content(slot).distance(texel_at(x, y, z)); }

Corners HostBricks::corners(uint32_t slot, ivec3 v) const {
    const BrickContent& brick = content(slot);
    const size_t at = texel_at(v.x, v.y, v.z);
    return {brick.distance(at),      brick.distance(at + 1),  brick.distance(at + 8),  brick.distance(at + 9),
            brick.distance(at + 64), brick.distance(at + 65), brick.distance(at + 72), brick.distance(at + 73)};
}

vec3 HostBricks::gradient(uint32_t slot, ivec3 cell, vec3 p, NormalKind kind) const {
    Reader reader(*this);
    switch (kind) {
    case NormalKind::Dual:
        return reader.dual_gradient(int(slot), cell, p);
    case NormalKind::Central:
        return reader.central_gradient(int(slot), cell, p);
    case NormalKind::Tetrahedral:
        return reader.tetrahedral_gradient(int(slot), cell, p);
    }
    return {};
}

void HostBricks::surface_at(uint32_t slot, ivec3 cell, ivec3 voxel, vec3 p, NormalKind kind, Sample& out) const {
    const vec3 in_brick{float(voxel.x) + p.x, float(voxel.y) + p.y, float(voxel.z) + p.z};
    out.normal = unit(gradient(slot, cell, in_brick, kind));
    Reader reader(*this);
    const Reader::SurfaceMaterial material = reader.surface_material(int(slot), voxel, p);
    out.material0 = uint16_t(content(slot).palette(material.slot0));
    out.material1 = uint16_t(content(slot).palette(material.slot1));
    out.share = material.share;
    out.from_brick = true;
}

HostBricks::Sample HostBricks::sample(dvec3 p_world, NormalKind kind) const {
    const double h = double(field_->grid().voxel_size);
    const double t[3] = {p_world.x / h, p_world.y / h, p_world.z / h};
    Sample out;
    if (std::max({std::fabs(t[0]), std::fabs(t[1]), std::fabs(t[2])}) < double(1 << 24)) {
        const ivec3 global{int(std::floor(t[0])), int(std::floor(t[1])), int(std::floor(t[2]))};
        const ivec3 cell{floor_div(global.x, kBrickVoxels), floor_div(global.y, kBrickVoxels),
                         floor_div(global.z, kBrickVoxels)};
        const uint32_t word = field_->cell_word(cell.x, cell.y, cell.z);
        if ((word & kCellOccupied) != 0) {
            const uint32_t slot = word & kCellSlotMask;
            const ivec3 voxel{global.x - cell.x * kBrickVoxels, global.y - cell.y * kBrickVoxels,
                              global.z - cell.z * kBrickVoxels};
            const vec3 p{float(t[0] - global.x), float(t[1] - global.y), float(t[2] - global.z)};
            const Corners c = corners(slot, voxel);
            bool whole = true;
            for (const float v : {c.v000, c.v100, c.v010, c.v110, c.v001, c.v101, c.v011, c.v111}) {
                whole = whole && std::fabs(v) < kBandVoxels - 0.05f;
            }
            if (whole) {
                out.distance = double(trilinear_value(c, p)) * h;
                surface_at(slot, cell, voxel, p, kind, out);
                return out;
            }
        }
    }
    const sdf::TapeView tape = sdf::view(field_->program());
    out.distance = sdf::evaluate(tape, p_world);
    const double step = 0.01 * h;
    const auto slope = [&](dvec3 a, dvec3 b) {
        return float((sdf::evaluate(tape, a) - sdf::evaluate(tape, b)) / (2 * step));
    };
    out.normal = unit({slope({p_world.x + step, p_world.y, p_world.z}, {p_world.x - step, p_world.y, p_world.z}),
                       slope({p_world.x, p_world.y + step, p_world.z}, {p_world.x, p_world.y - step, p_world.z}),
                       slope({p_world.x, p_world.y, p_world.z + step}, {p_world.x, p_world.y, p_world.z - step})});
    const float x = float(p_world.x), y = float(p_world.y), z = float(p_world.z);
    float value;
    sdf::MaterialMix mix;
    sdf::evaluate_materials(tape, {&x, &y, &z, 1}, &value, &mix);
    out.material0 = mix.id0;
    out.material1 = mix.weight > 0 ? mix.id1 : mix.id0;
    out.share = mix.weight;
    return out;
}

MarchHit HostBricks::march(const TexelRay& ray, float t_min, float t_max, bool accelerate) const {
    Reader reader(*this);
    return reader.field_march(field_->grid(), ray, t_min, t_max, accelerate);
}

HostBricks::Hit HostBricks::cast(dvec3 origin_world, vec3 direction, double t_max, NormalKind kind,
                                 bool accelerate) const {
    const float h = field_->grid().voxel_size;
    Hit out;
    out.march = march(texel_ray_of(origin_world, direction, h), 0.0f,
                      float(std::min(t_max / double(h), double(kFarVoxels))), accelerate);
    out.state = out.march.state;
    out.t = double(out.march.t) * double(h);
    if (out.state == kMarchHit)
        surface_at(uint32_t(out.march.slot), out.march.cell, out.march.voxel, out.march.p, kind, out.surface);
    return out;
}

void HostBricks::distances(const sdf::Points& points, float* out, sdf::Isa isa) const {
    wide_distances(wide_view(), points, out, isa);
}

float HostBricks::distance(const vec3& p, sdf::Isa isa) const { return wide_distance(wide_view(), p, isa); }

void HostBricks::march(std::span<const Ray> rays, MarchHit* hits, sdf::Isa isa) const { march(rays, hits, false, isa); }

void HostBricks::march_refined(std::span<const Ray> rays, MarchHit* hits, sdf::Isa isa) const {
    march(rays, hits, true, isa);
}

void HostBricks::march(std::span<const Ray> rays, MarchHit* hits, bool refine, sdf::Isa isa) const {
    constexpr size_t kBlock = RayRefiner::kMostRays;
    const WideView& view = wide_view();
    const GridParams& grid = view.grid;
    const double h = double(grid.voxel_size);
    TexelRay from{};  // but its direction: the last ray's, as `far`
    float far = 0;
    WideRay wide[kBlock];
    RayNote notes[kBlock];
    std::optional<RayRefiner> refiner;
    if (refine) refiner.emplace(*field_, isa);
    for (size_t first = 0; first < rays.size(); first += kBlock) {
        const size_t count = std::min(kBlock, rays.size() - first);
        for (size_t i = 0; i < count; ++i) {
            const Ray& ray = rays[first + i];
            WideRay& to = wide[i];
            if (i == 0 || ray.origin != rays[first + i - 1].origin)
                from = texel_ray_of({double(ray.origin.x), double(ray.origin.y), double(ray.origin.z)}, ray.direction,
                                    grid.voxel_size);
            to.part[0] = from.part.x, to.part[1] = from.part.y, to.part[2] = from.part.z;
            to.whole[0] = from.whole.x - grid.cell_x * kBrickVoxels;
            to.whole[1] = from.whole.y - grid.cell_y * kBrickVoxels;
            to.whole[2] = from.whole.z - grid.cell_z * kBrickVoxels;
            to.direction[0] = ray.direction.x, to.direction[1] = ray.direction.y, to.direction[2] = ray.direction.z;
            if (i == 0 || ray.t_max != rays[first + i - 1].t_max)
                far = float(std::min(double(ray.t_max) / h, double(kFarVoxels)));
            to.t_max = far;
        }
        const std::span found(hits + first, count);
        wide_march(view, wide, int(count), found.data(), refine ? notes : nullptr, isa);
        if (refine) {
            refiner->run(std::span(wide).first(count), found, std::span(notes).first(count));
            continue;
        }
        const MarchHit* before = nullptr;  // neighbours in the list often are so in space
        for (MarchHit& hit : found) {
            if (hit.state != kMarchHit) continue;
            hit.slot = before != nullptr && before->cell == hit.cell
                           ? before->slot
                           : int(field_->cell_word(hit.cell.x, hit.cell.y, hit.cell.z) & kCellSlotMask);
            before = &hit;
        }
    }
}

uint64_t HostBricks::hash() const {
    uint64_t sum = 0;
    const ivec3 size = field_->cells().size();
    for (int z = 0; z < size.z; ++z) {
        for (int y = 0; y < size.y; ++y) {
            for (int x = 0; x < size.x; ++x) {
                const uint32_t word = field_->cells().at(x, y, z);
                if ((word & kCellOccupied) == 0) {
                    sum = hash_combine(sum, word);
                    continue;
                }
                const BrickContent& brick = content(word & kCellSlotMask);
                sum = hash_combine(sum, brick.half ? hash64_of(std::span<const uint16_t>(brick.half->codes))
                                                   : hash64_of(std::span<const uint8_t>(brick.bytes->codes)));
                sum = hash_combine(sum, brick.material);
                if (!brick.materials) continue;
                sum = hash_combine(sum, hash64_of(std::span<const uint16_t>(brick.materials->words)));
                sum = hash_combine(sum, hash64_of(std::span<const uint32_t>(brick.materials->palette)));
            }
        }
    }
    return sum;
}

TexelRay texel_ray_of(dvec3 origin_world, vec3 direction, float voxel_size) {
    const double h = double(voxel_size);
    const double t[3] = {origin_world.x / h, origin_world.y / h, origin_world.z / h};
    const ivec3 whole{int(std::floor(t[0])), int(std::floor(t[1])), int(std::floor(t[2]))};
    return texel_ray(whole, {float(t[0] - whole.x), float(t[1] - whole.y), float(t[2] - whole.z)}, direction);
}

}  // namespace kiln::field
