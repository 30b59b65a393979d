// SPDX-License-Identifier: MIT

#include "physics/mesh_mass.h"

#include "field/mesh_facts.h"

#include "base/format.h"

namespace kiln::physics {

namespace {

dvec3 operator+(dvec3 a, dvec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
dvec3 operator-(dvec3 a, dvec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
dvec3 cross(dvec3 a, dvec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double dot(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
dvec3 to_double(vec3 v) { return {double(v.x), double(v.y), double(v.z)}; }

}  // namespace

// The sum over tetrahedra from a point to each triangle (Tonon, "Explicit Exact Formulas for the 3-D Tetrahedron Inertia Tensor", 2004):
// those that stick out of the solid cancel.
Result<MassProperties> mass_of_mesh(const Triangles& mesh) {
    const field::MeshFacts facts = field::mesh_facts(mesh.vertices, mesh.indices);
    const auto refused = [](const std::string& what) { return Error{"a body of a mesh " + what, ErrorKind::Input}; };
    if (facts.open_edges > 0)
        return refused(formatted("that is open at {} edges: close it, or make it static", facts.open_edges));
    if (facts.non_manifold_edges > 0)
        return refused(formatted("with {} edges where its sides do not agree: mend it, or make it static",
                                 facts.non_manifold_edges));
    const dvec3 from = to_double(facts.bounds.center());
    double volume = 0, x = 0, y = 0, z = 0, xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        dvec3 p[4] = {};
        for (size_t k = 0; k < 3; ++k) p[k] = to_double(mesh.vertices[mesh.indices[i + k]]) - from;
        const dvec3 across = cross(p[1] - p[0], p[2] - p[0]);
        if (!(dot(across, across) > 0)) return refused(formatted("with triangle {} of no area: take it out", i / 3));
        const double six = dot(p[0], cross(p[1], p[2]));  // times the volume
        volume += six / 6;
        dvec3 sum{};
        for (const dvec3& c : p) sum = sum + c;
        x += six * sum.x, y += six * sum.y, z += six * sum.z;
        const auto moment = [&](auto&& a, auto&& b) {  // 20 times the mean product of two coordinates
            double out = a(sum) * b(sum);
            for (const dvec3& c : p) out += a(c) * b(c);
            return six * out;
        };
        const auto px = [](const dvec3& c) { return c.x; };
        const auto py = [](const dvec3& c) { return c.y; };
        const auto pz = [](const dvec3& c) { return c.z; };
        xx += moment(px, px), yy += moment(py, py), zz += moment(pz, pz);
        xy += moment(px, py), xz += moment(px, pz), yz += moment(py, pz);
    }
    if (!(volume > 0)) return refused("whose triangles face inwards, or that bounds nothing: turn them round");
    const dvec3 c{x / (24 * volume), y / (24 * volume), z / (24 * volume)};
    const auto about = [&](double sum, double a, double b) { return sum / 120 - volume * a * b; };
    const double sxx = about(xx, c.x, c.x), syy = about(yy, c.y, c.y), szz = about(zz, c.z, c.z);
    const double inertia[6] = {syy + szz,           sxx + szz, sxx + syy, -about(xy, c.x, c.y), -about(xz, c.x, c.z),
                               -about(yz, c.y, c.z)};
    const dvec3 center = from + c;
    return principal(volume, {float(center.x), float(center.y), float(center.z)}, inertia);
}

}  // namespace kiln::physics
