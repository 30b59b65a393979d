// SPDX-License-Identifier: MIT
// World: its surface as a mesh, with materials.

#include "scene/world_impl.h"

#include "sdf/place.h"

#include "field/mesh_facts.h"
#include "field/mesh_simplify.h"
#include "field/meshing.h"

#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace kiln {

namespace {

constexpr float kMargin = 3;  // voxels of grid around what is meshed, so that nothing is cut by the grid
constexpr const char* kDefaultName = "default";

// The edits that make one more: everything outside the box is cut away, and what was there keeps its material.
Edit cut_to(const Box3& box) {
    Edit e;
    e.node.shape = Box{.half_extents = box.half_extents()};
    e.node.transform.position = box.center();
    e.op = Op::Intersect;
    return e;
}

bool positive(const Box3& box) {
    return box.finite() && box.min.x < box.max.x && box.min.y < box.max.y && box.min.z < box.max.z;
}

Error too_fine(float cell, const std::string& why) {
    return {formatted("a mesh of cells of {} m: {}; choose larger cells or smaller bounds", cell, why),
            ErrorKind::OutOfMemory};
}

// A triangle's part: the material most of its vertices have, and whether one of them has two.
struct PartKey {
    uint16_t material;
    bool blended;
    friend auto operator<=>(const PartKey&, const PartKey&) = default;
};
PartKey part_of(const sdf::MaterialMix& a, const sdf::MaterialMix& b, const sdf::MaterialMix& c) {
    const uint16_t most = b.id0 == c.id0                     ? b.id0
                          : a.id0 == b.id0 || a.id0 == c.id0 ? a.id0
                                                             : std::min({a.id0, b.id0, c.id0});
    return {most, a.weight > 0 || b.weight > 0 || c.weight > 0};
}

// Drops vertices that no triangle uses.
void compact(Mesh& mesh) {
    std::vector<uint32_t> number(mesh.positions.size(), UINT32_MAX);
    for (const uint32_t v : mesh.triangles) number[v] = 0;
    uint32_t kept = 0;
    for (uint32_t v = 0; v < number.size(); ++v) {
        if (number[v] != 0) continue;
        number[v] = kept;
        const auto move = [&](auto& values) {
            if (!values.empty()) values[kept] = values[v];
        };
        move(mesh.positions), move(mesh.normals), move(mesh.colors), move(mesh.roughness), move(mesh.metallic);
        ++kept;
    }
    const auto cut = [&](auto& values) { values.resize(std::min<size_t>(values.size(), kept)); };
    cut(mesh.positions), cut(mesh.normals), cut(mesh.colors), cut(mesh.roughness), cut(mesh.metallic);
    for (uint32_t& v : mesh.triangles) v = number[v];
}

}  // namespace

Result<Mesh> World::mesh(const MeshSettings& settings) const {
    if (!std::isfinite(settings.cell) || settings.cell < 0)
        return Error{
            formatted("a mesh of cells of {} m: write a finite length above 0, or 0 for the world's voxel size",
                      settings.cell),
            ErrorKind::Usage};
    if (!(settings.simplify_share > 0 && settings.simplify_share <= 1) || !(settings.simplify_error >= 0))
        return Error{"simplifying a mesh: keep a share in (0, 1], and an error of 0 or more metres", ErrorKind::Usage};
    std::shared_ptr<const sdf::Program> program = impl_->whole();
    const Impl::Resolution r = impl_->resolution(impl_->list, field_settings);
    const Box3 bounds = settings.bounds.value_or(r.bounds);
    if (!positive(bounds)) return Error{"a mesh's bounds must be finite, with min below max", ErrorKind::Usage};
    const float cell = settings.cell > 0 ? settings.cell : r.voxel_size;

    // Smooth unions bulge beyond the solids' own bounds by at most a quarter of the blend radius.
    float reach = 0;
    const std::vector<uint32_t> rows = program->rows();
    for (const uint32_t row : rows) reach = std::max(reach, program->edits[row].reach);
    const Box3 solid = program->bounds.inflated(reach);
    const bool within = !program->unbounded && bounds.contains(solid.min) && bounds.contains(solid.max);
    if (!within && !rows.empty()) {
        sdf::Program cut = sdf::detached(*program);
        const uint64_t order = sdf::order_between(program->edits[rows.back()].order, UINT64_MAX);
        if (auto row = sdf::insert(cut, cut_to(bounds), {}, {}, order, UINT32_MAX); !row) return row.error();
        program = std::make_shared<const sdf::Program>(std::move(cut));
    }

    field::FieldOptions options;
    options.voxel_size = cell;
    const Box3 meshed = within ? box_intersection(bounds, solid) : bounds;
    options.bounds = meshed.inflated(kMargin * cell);
    options.workers = settings.workers;
    if (rows.empty() || !positive(options.bounds))
        return Error{"there is nothing to mesh: the world has no edits", ErrorKind::Failed};
    if (cell > longest_side(meshed))
        return Error{formatted("a mesh of cells of {} m: what is meshed is {} m long; choose smaller cells", cell,
                               longest_side(meshed)),
                     ErrorKind::Usage};
    const vec3 size = (options.bounds.max - options.bounds.min) / (cell * float(field::kBrickVoxels));
    if ((double(size.x) + 2) * (double(size.y) + 2) * (double(size.z) + 2) > kMaxCells)
        return too_fine(cell, "the grid does not fit");
    const auto built = field::HostBricks::build(program, options);
    if (!built) {
        if (built.error().kind == ErrorKind::OutOfMemory) return too_fine(cell, built.error().message);
        return built.error();
    }
    const field::HostBricks& host = *built;
    const field::MeshBricks bricks(host);
    field::Mesh raw;
    if (settings.sharp)
        field::mesh_sharp(bricks, field::exact_of(host, bricks), raw, settings.workers);
    else
        field::mesh_smooth(bricks, raw, settings.workers);
    if (raw.triangle_count() == 0)
        return Error{"there is nothing to mesh: nothing within the bounds is solid, or it is thinner than a cell",
                     ErrorKind::Failed};
    field::MeshSurface surface = field::surface_of(host, bricks, raw, !settings.sharp, settings.workers);

    Mesh out;
    out.positions.assign(raw.positions.span().begin(), raw.positions.span().end());
    out.normals = std::move(surface.normals);
    for (sdf::MaterialMix& mix : surface.mixes) {
        if (mix.id0 == uint16_t(sdf::kNoMaterial)) mix.id0 = uint16_t(sdf::kDefaultMaterial);
        if (mix.id1 == uint16_t(sdf::kNoMaterial)) mix.id1 = mix.id0;
        if (mix.id1 == mix.id0) mix.weight = 0;
    }
    const auto& named = impl_->data.materials;
    const Material grey;
    const auto material = [&](uint16_t number) -> const Material& {
        return number == sdf::kDefaultMaterial || number > named.size() ? grey : named[number - 1u].second;
    };
    for (const sdf::MaterialMix& mix : surface.mixes) {
        const Material &a = material(mix.id0), &b = material(mix.id1);
        const float t = mix.weight;
        out.colors.push_back(a.base_color * (1 - t) + b.base_color * t);
        out.roughness.push_back(a.roughness * (1 - t) + b.roughness * t);
        out.metallic.push_back(a.metallic * (1 - t) + b.metallic * t);
    }

    std::map<PartKey, uint32_t> numbers;
    std::vector<uint32_t> part_of_triangle;
    std::vector<uint32_t> triangles(raw.triangles.span().begin(), raw.triangles.span().end());
    for (size_t t = 0; t < triangles.size(); t += 3) {
        const PartKey key =
            part_of(surface.mixes[triangles[t]], surface.mixes[triangles[t + 1]], surface.mixes[triangles[t + 2]]);
        part_of_triangle.push_back(numbers.try_emplace(key, uint32_t(numbers.size())).first->second);
    }
    if (settings.simplify_share < 1 || settings.simplify_error > 0) {
        field::simplify(out.positions, triangles, part_of_triangle, settings.simplify_share,
                        settings.simplify_error > 0 ? settings.simplify_error : std::numeric_limits<float>::infinity());
    }
    out.triangles.reserve(triangles.size());
    for (const auto& [key, number] : numbers) {
        MeshPart part;
        part.first = uint32_t(out.triangles.size() / 3);
        for (size_t t = 0; t < part_of_triangle.size(); ++t) {
            if (part_of_triangle[t] != number) continue;
            const auto at = triangles.begin() + ptrdiff_t(3 * t);
            out.triangles.insert(out.triangles.end(), at, at + 3);
        }
        part.count = uint32_t(out.triangles.size() / 3) - part.first;
        if (part.count == 0) continue;
        part.name = key.material == sdf::kDefaultMaterial || key.material > named.size()
                        ? kDefaultName
                        : named[key.material - 1u].first;
        part.material = material(key.material);
        part.blended = key.blended;
        out.parts.push_back(std::move(part));
    }
    compact(out);
    return out;
}

MeshReport measure(const Mesh& mesh) {
    const field::MeshFacts f = field::mesh_facts(mesh.positions, mesh.triangles);
    return {f.vertices, f.triangles, f.open_edges, f.non_manifold_edges, f.volume, f.area, f.bounds};
}

}  // namespace kiln
