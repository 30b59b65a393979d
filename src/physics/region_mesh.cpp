// SPDX-License-Identifier: MIT

#include "physics/region_mesh.h"

#include "field/codes.gpu.h"
#include "field/meshing.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>

namespace kiln::physics {

namespace {

constexpr int kVoxels = field::kBrickVoxels, kTexels = field::kBrickTexels;
constexpr int kBlock = 3;                  // bricks a side that are looked at together first
constexpr int kAcross = kRegionCells + 2;  // with the apron
constexpr float kHalfDiagonal = 0.8661f;   // of a side
constexpr int kFarthest = 1 << 19;         // regions from the origin; floats end long before
static_assert(kAcross % kBlock == 0);

struct Brick {
    ivec3 cell;
    std::array<uint16_t, field::kBrickTexelCount> codes;
};

int floor_of(float v) { return int(std::floor(v)); }

// The bricks of a region and its apron that the surface passes.
std::vector<Brick> bricks_of(const field::SdfField& exact, float h, ivec3 region) {
    std::vector<Brick> out;
    const float side = float(kVoxels) * h;
    std::array<float, field::kBrickTexelCount> texels;
    const ivec3 first{region.x * kRegionCells - 1, region.y * kRegionCells - 1, region.z * kRegionCells - 1};
    for (int bz = 0; bz < kAcross; bz += kBlock)
        for (int by = 0; by < kAcross; by += kBlock)
            for (int bx = 0; bx < kAcross; bx += kBlock) {
                const vec3 low{float(first.x + bx) * side, float(first.y + by) * side, float(first.z + bz) * side};
                const float across = float(kBlock) * side;
                const vec3 middle = low + vec3{across, across, across} * 0.5f;
                // 1-Lipschitz both ways: no surface in the block.
                if (std::abs(exact.distance(middle)) > kHalfDiagonal * across) continue;
                for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
                    const ivec3 cell =
                        first + ivec3{bx + i % kBlock, by + i / kBlock % kBlock, bz + i / (kBlock * kBlock)};
                    // Positions as all bricks have them: whole numbers first, so that neighbours agree.
                    float x[kTexels], y[kTexels], z[kTexels];
                    for (int k = 0; k < kTexels; ++k) {
                        x[k] = float(cell.x * kVoxels + k) * h;
                        y[k] = float(cell.y * kVoxels + k) * h;
                        z[k] = float(cell.z * kVoxels + k) * h;
                    }
                    const vec3 center{0.5f * (x[0] + x[7]), 0.5f * (y[0] + y[7]), 0.5f * (z[0] + z[7])};
                    if (!exact.texels(center, side, 0, x, y, z, texels.data())) continue;
                    const auto [least, most] = std::minmax_element(texels.begin(), texels.end());
                    if (*least > 0 || *most <= 0) continue;
                    Brick& b = out.emplace_back();
                    b.cell = cell;
                    for (size_t k = 0; k < texels.size(); ++k) b.codes[k] = uint16_t(field::half_code(texels[k] / h));
                }
            }
    return out;
}

// The lattice edge that a vertex lies on, by its place in voxels: the axis it is along, its lower end as a texel of the brick.
struct LatticeEdge {
    int axis;
    size_t low;
};
// None so far out that places are no finer than the ends of an edge: a matter of the place alone.
std::optional<LatticeEdge> edge_at(const std::array<double, 3>& at, ivec3 cell) {
    constexpr double kOff =
        0.5 * double(field::kLeastFraction);  // voxels: what is farther off the lattice is on its edge's way
    const std::array<int, 3> first{cell.x * kVoxels, cell.y * kVoxels, cell.z * kVoxels};
    LatticeEdge out{-1, 0};
    for (int k = 2; k >= 0; --k) {
        const double v = at[size_t(k)];
        const bool along = std::abs(v - std::round(v)) > kOff;
        if (along && out.axis >= 0) return {};
        if (along) out.axis = k;
        const double texel = (along ? std::floor(v) : std::round(v)) - first[size_t(k)];
        if (!(texel >= 0 && texel < kTexels - along)) return {};
        out.low = out.low * kTexels + size_t(texel);
    }
    return out.axis < 0 ? std::nullopt : std::optional(out);
}

// Where the field itself is 0 on an edge, not what its ends let one think: straight between them, a ball of eight voxels' radius would be
// off by h²/8R, a 64th of a voxel, and the edge of a box by a third. One step of regula falsi; the vertex stays between the ends, so what
// is closed stays so. A matter of the place and of the field alone: regions that share an edge move its vertex alike.
void lay_on_surface(const field::SdfField& exact, float h, const field::MeshBricks& bricks, field::Mesh& mesh) {
    std::vector<float> x, y, z, d;
    for (size_t b = 0; b < bricks.bricks().size(); ++b) {
        const field::MeshBrick& brick = bricks.bricks()[b];
        vec3* const vertices = mesh.positions.data() + mesh.brick_vertices[b];
        const size_t count = mesh.brick_vertices[b + 1] - mesh.brick_vertices[b];
        x.resize(count), y.resize(count), z.resize(count), d.resize(count);
        for (size_t i = 0; i < count; ++i) x[i] = vertices[i].x, y[i] = vertices[i].y, z[i] = vertices[i].z;
        exact.distances(sdf::Points{x.data(), y.data(), z.data(), int(count)}, d.data());
        const auto value = [&](size_t texel) {
            uint16_t code;
            std::memcpy(&code, brick.codes + texel * sizeof code, sizeof code);
            return field::half_value(code);
        };
        for (size_t i = 0; i < count; ++i) {
            const std::array<double, 3> at{x[i] / double(h), y[i] / double(h), z[i] / double(h)};
            const auto edge = edge_at(at, brick.cell);
            if (!edge) continue;
            constexpr size_t kStep[3] = {1, kTexels, size_t(kTexels) * kTexels};
            const double along = at[size_t(edge->axis)];
            const float whole = float(std::floor(along)), t = float(along - std::floor(along)), here = d[i] / h;
            // From the end that is on the other side.
            const float low = value(edge->low), high = value(edge->low + kStep[edge->axis]);
            const bool from_low = (low <= 0) != (here <= 0);
            const float end = from_low ? low : high, end_at = from_low ? 0.0f : 1.0f;
            if ((end <= 0) == (here <= 0)) continue;
            const float zero = end_at + (t - end_at) * (end / (end - here));
            const float moved = (whole + std::clamp(zero, field::kLeastFraction, 1 - field::kLeastFraction)) * h;
            (edge->axis == 0 ? vertices[i].x : edge->axis == 1 ? vertices[i].y : vertices[i].z) = moved;
        }
    }
}

}  // namespace

uint64_t region_key(ivec3 r) {
    const auto part = [](int v) { return uint64_t(uint32_t(v + kFarthest)) & 0xfffff; };
    return uint64_t(1) << 63 | part(r.x) | part(r.y) << 20 | part(r.z) << 40;
}

Box3 RegionMesh::box() const {
    const float side = float(kRegionCells) * cell;
    const vec3 low{float(region.x) * side, float(region.y) * side, float(region.z) * side};
    return {low, low + vec3{side, side, side}};
}

std::shared_ptr<RegionMesh> mesh_region(const field::SdfField& exact, float voxel_size, ivec3 region) {
    auto out = std::make_shared<RegionMesh>();
    out->region = region;
    out->cell = float(kVoxels) * voxel_size;
    const std::vector<Brick> bricks = bricks_of(exact, voxel_size, region);
    if (bricks.empty()) return out;
    std::vector<field::MeshBrick> views;
    views.reserve(bricks.size());
    for (const Brick& b : bricks) views.push_back({b.cell, 0, reinterpret_cast<const std::byte*>(b.codes.data())});
    field::Mesh mesh;
    const field::MeshBricks sorted(std::move(views), field::DistanceFormat::Half, voxel_size);
    field::mesh_smooth(sorted, mesh, 1);
    lay_on_surface(exact, voxel_size, sorted, mesh);
    out->vertices.assign(mesh.positions.data(), mesh.positions.data() + mesh.positions.size());

    // By bricks, counted and then placed. Whose a triangle is, its middle says: of the same three vertices it is the same for all.
    constexpr size_t kBricks = size_t(kRegionCells) * kRegionCells * kRegionCells;
    const size_t count = mesh.triangle_count();
    std::vector<uint32_t> brick(count);
    std::vector<uint32_t> next(kBricks + 2);
    const float scale = 1 / out->cell;
    const ivec3 first{region.x * kRegionCells, region.y * kRegionCells, region.z * kRegionCells};
    for (size_t t = 0; t < count; ++t) {
        const uint32_t* i = mesh.triangles.data() + 3 * t;
        const vec3 middle = (out->vertices[i[0]] + out->vertices[i[1]] + out->vertices[i[2]]) * (scale / 3);
        const ivec3 at{floor_of(middle.x) - first.x, floor_of(middle.y) - first.y, floor_of(middle.z) - first.z};
        const bool own = std::min({at.x, at.y, at.z}) >= 0 && std::max({at.x, at.y, at.z}) < kRegionCells;
        brick[t] = own ? uint32_t((at.z * kRegionCells + at.y) * kRegionCells + at.x) : uint32_t(kBricks);
        ++next[brick[t] + 1];
    }
    std::partial_sum(next.begin(), next.end(), next.begin());
    out->first_of.assign(next.begin(), next.begin() + kBricks + 1);
    out->indices.resize(3 * count);
    for (size_t t = 0; t < count; ++t)
        std::memcpy(out->indices.data() + 3 * size_t(next[brick[t]]++), mesh.triangles.data() + 3 * t,
                    3 * sizeof(uint32_t));
    return out;
}

ivec3 Regions::region_of(vec3 p) const {
    const auto part = [&](float v) {
        return floor_of(std::clamp(v / side_, -float(kFarthest) + 1, float(kFarthest) - 1));
    };
    return {part(p.x), part(p.y), part(p.z)};
}

const Regions::Entry* Regions::find(ivec3 region) const {
    const auto found = meshes_.find(region_key(region));
    return found != meshes_.end() ? &found->second : nullptr;
}

const Regions::Entry* Regions::numbered(uint32_t number) const {
    if (number >= by_number_.size() || by_number_[number] == 0) return nullptr;
    return &meshes_.at(by_number_[number]);
}

std::shared_ptr<const Regions> Regions::with(std::shared_ptr<const RegionMesh> mesh) const {
    auto out = std::make_shared<Regions>(*this);
    const uint64_t key = region_key(mesh->region);
    auto [at, fresh] = out->meshes_.try_emplace(key);
    if (fresh) {
        const auto free = std::find(out->by_number_.begin(), out->by_number_.end(), 0u);
        at->second.number = uint32_t(free - out->by_number_.begin());
        if (free == out->by_number_.end()) {
            out->by_number_.push_back(key);
        } else {
            *free = key;
        }
    }
    at->second.mesh = std::move(mesh);
    return out;
}

std::shared_ptr<const Regions> Regions::without(const std::vector<ivec3>& regions) const {
    auto out = std::make_shared<Regions>(*this);
    for (const ivec3 r : regions) {
        const auto found = out->meshes_.find(region_key(r));
        if (found == out->meshes_.end()) continue;
        out->by_number_[found->second.number] = 0;
        out->meshes_.erase(found);
    }
    return out;
}

}  // namespace kiln::physics
