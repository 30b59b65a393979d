// SPDX-License-Identifier: MIT
// Corners, faces and edges are brought together by sorting: the same answer on every machine.

#include "model/topology.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

namespace kiln::model {
namespace {

// Positions as words, with -0 as 0: equal words are equal places.
std::array<uint32_t, 3> key_of(vec3 p) {
    return {std::bit_cast<uint32_t>(p.x + 0.0f), std::bit_cast<uint32_t>(p.y + 0.0f),
            std::bit_cast<uint32_t>(p.z + 0.0f)};
}

Triangles weld(const Triangles& mesh, Topology& found) {
    struct Corner {
        uint64_t hash;
        uint32_t index;
    };
    std::vector<Corner> order(mesh.positions.size());
    for (uint32_t i = 0; i < order.size(); ++i) {
        const auto k = key_of(mesh.positions[i]);
        uint64_t h = k[0] * 0x9e3779b97f4a7c15u;
        h = (std::rotl(h, 29) ^ k[1]) * 0xbf58476d1ce4e5b9u;
        h = (std::rotl(h, 31) ^ k[2]) * 0x94d049bb133111ebu;
        order[i] = {h, i};
    }
    std::sort(order.begin(), order.end(),
              [](const Corner& a, const Corner& b) { return a.hash != b.hash ? a.hash < b.hash : a.index < b.index; });
    std::vector<uint32_t> same(mesh.positions.size());
    for (size_t i = 0; i < order.size();) {
        size_t end = i;
        while (end < order.size() && order[end].hash == order[i].hash) ++end;
        for (size_t a = i; a < end; ++a) {
            same[order[a].index] = order[a].index;
            for (size_t b = i; b < a; ++b) {
                if (key_of(mesh.positions[order[b].index]) != key_of(mesh.positions[order[a].index])) continue;
                same[order[a].index] = same[order[b].index];
                break;
            }
        }
        i = end;
    }
    Triangles out;
    std::vector<uint32_t> number(mesh.positions.size(), UINT32_MAX);
    for (const Face& f : mesh.faces) {
        const Face g{same[f[0]], same[f[1]], same[f[2]]};
        if (g[0] == g[1] || g[1] == g[2] || g[2] == g[0]) {
            ++found.degenerate_faces;
            continue;
        }
        Face h;
        for (size_t k = 0; k < 3; ++k) {
            uint32_t& n = number[g[k]];
            if (n == UINT32_MAX) {
                n = uint32_t(out.positions.size());
                out.positions.push_back(mesh.positions[g[k]]);
            }
            h[k] = n;
        }
        out.faces.push_back(h);
    }
    return out;
}

// Of triangles with the same three corners one remains, or none where as many face one way as the other.
void merge_duplicates(Triangles& mesh, Topology& found) {
    struct Key {
        Face sorted;
        uint32_t face;
    };
    std::vector<Key> keys(mesh.faces.size());
    for (uint32_t f = 0; f < keys.size(); ++f) {
        keys[f] = {mesh.faces[f], f};
        std::sort(keys[f].sorted.begin(), keys[f].sorted.end());
    }
    std::sort(keys.begin(), keys.end(),
              [](const Key& a, const Key& b) { return a.sorted != b.sorted ? a.sorted < b.sorted : a.face < b.face; });
    // +1 where the corners run upwards from the least one.
    const auto turn = [&](uint32_t f) {
        const Face& c = mesh.faces[f];
        const size_t least = size_t(std::min_element(c.begin(), c.end()) - c.begin());
        return c[(least + 1) % 3] < c[(least + 2) % 3] ? 1 : -1;
    };
    std::vector<bool> drop(mesh.faces.size(), false);
    for (size_t i = 0; i < keys.size();) {
        size_t end = i + 1;
        int sum = turn(keys[i].face);
        for (; end < keys.size() && keys[end].sorted == keys[i].sorted; ++end) sum += turn(keys[end].face);
        if (end > i + 1) {
            bool kept = sum == 0;
            for (size_t k = i; k < end; ++k) {
                const bool keep = !kept && turn(keys[k].face) == (sum > 0 ? 1 : -1);
                kept = kept || keep;
                drop[keys[k].face] = !keep;
                found.duplicate_faces += !keep;
            }
        }
        i = end;
    }
    size_t n = 0;
    for (size_t f = 0; f < mesh.faces.size(); ++f)
        if (!drop[f]) mesh.faces[n++] = mesh.faces[f];
    mesh.faces.resize(n);
}

struct Edge {
    uint64_t key;  // lower corner, higher corner
    uint32_t face;
    bool forwards;  // from the lower to the higher
};

std::vector<Edge> edges_of(const Triangles& mesh) {
    std::vector<Edge> out;
    out.reserve(3 * mesh.faces.size());
    for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t a = mesh.faces[f][k], b = mesh.faces[f][(k + 1) % 3];
            out.push_back({uint64_t(std::min(a, b)) << 32 | std::max(a, b), f, a < b});
        }
    }
    std::sort(out.begin(), out.end(),
              [](const Edge& a, const Edge& b) { return a.key != b.key ? a.key < b.key : a.face < b.face; });
    return out;
}

template <typename Visit>
void each_edge(const std::vector<Edge>& edges, Visit visit) {
    for (size_t i = 0; i < edges.size();) {
        size_t end = i + 1;
        while (end < edges.size() && edges[end].key == edges[i].key) ++end;
        visit(std::span(edges).subspan(i, end - i));
        i = end;
    }
}

double area_of(const Triangles& mesh, const Face& f) {
    const vec3 a = mesh.positions[f[0]];
    return 0.5 * double(length(cross(mesh.positions[f[1]] - a, mesh.positions[f[2]] - a)));
}

// Within each piece that hangs together by edges of two triangles, the smaller part of those that disagree is turned.
void orient(Triangles& mesh, const std::vector<Edge>& edges, Topology& found) {
    std::vector<std::array<std::pair<uint32_t, bool>, 3>> neighbours(mesh.faces.size());  // face, same direction
    std::vector<uint8_t> count(mesh.faces.size(), 0);
    bool disagree = false;
    each_edge(edges, [&](std::span<const Edge> e) {
        if (e.size() != 2) return;
        const bool same = e[0].forwards == e[1].forwards;
        disagree = disagree || same;
        neighbours[e[0].face][count[e[0].face]++] = {e[1].face, same};
        neighbours[e[1].face][count[e[1].face]++] = {e[0].face, same};
    });
    if (!disagree) return;
    enum Side : uint8_t { Unseen, Kept, Turned };
    std::vector<uint8_t> side(mesh.faces.size(), Unseen);
    std::vector<uint32_t> piece;
    for (uint32_t root = 0; root < mesh.faces.size(); ++root) {
        if (side[root] != Unseen) continue;
        piece.assign(1, root);
        side[root] = Kept;
        double kept = 0, turned = 0;
        for (size_t i = 0; i < piece.size(); ++i) {
            const uint32_t f = piece[i];
            (side[f] == Kept ? kept : turned) += area_of(mesh, mesh.faces[f]);
            for (size_t k = 0; k < count[f]; ++k) {
                const auto [other, same] = neighbours[f][k];
                if (side[other] != Unseen) continue;
                side[other] = (side[f] == Kept) != same ? Kept : Turned;
                piece.push_back(other);
            }
        }
        if (turned == 0) continue;
        const uint8_t turn = turned <= kept ? Turned : Kept;
        for (const uint32_t f : piece) {
            if (side[f] != turn) continue;
            std::swap(mesh.faces[f][1], mesh.faces[f][2]);
            ++found.flipped_faces;
        }
    }
}

// Six times the volume between the triangles and the middle of the mesh; for a closed mesh the middle does not matter.
double volume(const Triangles& mesh) {
    double middle[3] = {};
    for (const vec3& p : mesh.positions) {
        middle[0] += double(p.x);
        middle[1] += double(p.y);
        middle[2] += double(p.z);
    }
    for (double& c : middle) c /= double(mesh.positions.size());
    double sum = 0;
    for (const Face& f : mesh.faces) {
        double p[3][3];
        for (size_t k = 0; k < 3; ++k) {
            const vec3& q = mesh.positions[f[k]];
            p[k][0] = double(q.x) - middle[0];
            p[k][1] = double(q.y) - middle[1];
            p[k][2] = double(q.z) - middle[2];
        }
        sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    }
    return sum;
}

}  // namespace

Triangles heal(const Triangles& mesh, Topology& found) {
    Triangles out = weld(mesh, found);
    merge_duplicates(out, found);
    found.triangles = out.faces.size();
    if (out.faces.empty()) return out;
    std::vector<Edge> edges = edges_of(out);
    orient(out, edges, found);
    if (volume(out) < 0) {
        found.turned_inside_out = true;
        for (Face& f : out.faces) std::swap(f[1], f[2]);
    }
    if (found.flipped_faces > 0 || found.turned_inside_out) edges = edges_of(out);
    found.balanced = true;
    each_edge(edges, [&](std::span<const Edge> e) {
        int sum = 0;
        for (const Edge& one : e) sum += one.forwards ? 1 : -1;
        found.open_edges += e.size() == 1;
        found.non_manifold_edges += e.size() > 2;
        found.balanced = found.balanced && sum == 0;
    });
    return out;
}

}  // namespace kiln::model
