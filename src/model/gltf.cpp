// SPDX-License-Identifier: MIT
// glTF 2.0 as bare triangles: those of the default scene's nodes, each in its node's place. Images are not looked at; skins and morphs stay
// in their rest pose.

#include "model/gltf_file.h"
#include "model/triangles.h"

#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace kiln::model {
namespace {

bool mirrors(const Matrix& m) { return determinant(m) < 0; }

class Reader {
public:
    Reader(const tinygltf::Model& model, const std::string& name) : model_(model), name_(name) {}

    Result<Triangles> run() {
        struct Visit {
            int node;
            Matrix place;
        };
        std::vector<Visit> stack;
        const int scene = model_.defaultScene >= 0 ? model_.defaultScene : 0;
        if (size_t(scene) < model_.scenes.size()) {
            for (const int n : model_.scenes[size_t(scene)].nodes) stack.push_back({n, kIdentity});
        } else {
            // No scene: every node that is nobody's child.
            std::vector<bool> child(model_.nodes.size(), false);
            for (const auto& node : model_.nodes)
                for (const int c : node.children)
                    if (c >= 0 && size_t(c) < child.size()) child[size_t(c)] = true;
            for (size_t n = 0; n < child.size(); ++n)
                if (!child[n]) stack.push_back({int(n), kIdentity});
        }
        size_t visits = 0;
        while (!stack.empty()) {
            const Visit v = stack.back();
            stack.pop_back();
            if (v.node < 0 || size_t(v.node) >= model_.nodes.size()) return fault("a node that does not exist");
            // Nodes are a forest: more visits than nodes means that one has two parents, or contains itself.
            if (++visits > model_.nodes.size()) return fault("a node that contains itself");
            const tinygltf::Node& node = model_.nodes[size_t(v.node)];
            const Matrix place = times(v.place, node_matrix(node));
            if (node.mesh >= 0) {
                if (size_t(node.mesh) >= model_.meshes.size()) return fault("a mesh that does not exist");
                for (const tinygltf::Primitive& p : model_.meshes[size_t(node.mesh)].primitives)
                    if (auto ok = primitive(p, place); !ok) return ok.error();
            }
            for (const int c : node.children) stack.push_back({c, place});
        }
        return checked(std::move(out_), name_);
    }

private:
    Error fault(const std::string& what) const { return gltf_fault(name_, what); }

    Result<void> primitive(const tinygltf::Primitive& p, const Matrix& place) {
        constexpr int kTriangles = 4, kStrip = 5, kFan = 6;
        const int mode = p.mode < 0 ? kTriangles : p.mode;
        if (mode != kTriangles && mode != kStrip && mode != kFan) return {};  // points and lines have no inside
        const auto position = p.attributes.find("POSITION");
        if (position == p.attributes.end()) return {};
        if (position->second < 0 || size_t(position->second) >= model_.accessors.size())
            return fault("an accessor that does not exist");
        const tinygltf::Accessor& corners = model_.accessors[size_t(position->second)];
        if (corners.type != TINYGLTF_TYPE_VEC3 || corners.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
            return Error{name_ + ": has compressed positions, which are not read; export it without compression",
                         ErrorKind::Input};
        const auto floats = accessor_bytes(model_, corners, 12, name_);
        if (!floats) return floats.error();
        const auto first = uint32_t(out_.positions.size());
        if (out_.positions.size() + floats->count > 3 * kMostTriangles)
            return Error{name_ + ": too many corners; simplify the model", ErrorKind::Input};
        for (size_t i = 0; i < floats->count; ++i) {
            float c[3];
            std::memcpy(c, floats->at + i * floats->stride, 12);
            double q[3];
            for (size_t r = 0; r < 3; ++r)
                q[r] =
                    place[r] * double(c[0]) + place[4 + r] * double(c[1]) + place[8 + r] * double(c[2]) + place[12 + r];
            const auto narrow = [](double v) { return std::fabs(v) > 3e38 ? INFINITY : float(v); };
            out_.positions.push_back({narrow(q[0]), narrow(q[1]), narrow(q[2])});
        }

        std::vector<uint32_t> order;
        if (p.indices >= 0) {
            if (size_t(p.indices) >= model_.accessors.size()) return fault("an accessor that does not exist");
            const tinygltf::Accessor& a = model_.accessors[size_t(p.indices)];
            size_t size = 0;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) size = 1;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) size = 2;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) size = 4;
            if (size == 0 || a.type != TINYGLTF_TYPE_SCALAR) return fault("indices of a wrong type");
            const auto indices = accessor_bytes(model_, a, size, name_);
            if (!indices) return indices.error();
            order.resize(indices->count);
            for (size_t i = 0; i < order.size(); ++i) {
                const unsigned char* at = indices->at + i * indices->stride;
                for (size_t b = size; b-- > 0;) order[i] = order[i] << 8 | at[b];
            }
        } else {
            order.resize(floats->count);
            for (size_t i = 0; i < order.size(); ++i) order[i] = uint32_t(i);
        }
        for (const uint32_t corner : order)
            if (corner >= floats->count) return fault(formatted("corner {} of {}", corner, floats->count));
        const bool turn = mirrors(place);
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            if (turn) std::swap(b, c);
            out_.faces.push_back({first + a, first + b, first + c});
        };
        if (mode == kTriangles)
            for (size_t i = 2; i < order.size(); i += 3) add(order[i - 2], order[i - 1], order[i]);
        if (mode == kStrip)
            for (size_t i = 2; i < order.size(); ++i)
                i % 2 == 0 ? add(order[i - 2], order[i - 1], order[i]) : add(order[i - 1], order[i - 2], order[i]);
        if (mode == kFan)
            for (size_t i = 2; i < order.size(); ++i) add(order[0], order[i - 1], order[i]);
        if (out_.faces.size() > kMostTriangles)
            return Error{name_ + ": too many triangles; simplify the model", ErrorKind::Input};
        return {};
    }

    const tinygltf::Model& model_;
    const std::string& name_;
    Triangles out_;
};

}  // namespace

Result<Triangles> parse_gltf(std::string_view bytes, const std::string& name, const std::string& folder) {
    auto model = load_gltf(bytes, name, folder);
    if (!model) return model.error();
    for (const std::string& need : model->extensionsRequired) {
        if (need.ends_with("_compression") || need == "KHR_mesh_quantization")
            return Error{formatted("{}: needs {}, which is not read; export it without compression", name, need),
                         ErrorKind::Input};
        // Those are of looks, which a solid has none of.
        constexpr std::string_view kOfLooks[] = {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"};
        if (std::ranges::none_of(kOfLooks, [&](std::string_view begin) { return need.starts_with(begin); }))
            return Error{formatted("{}: needs {}, which is not read; export it without", name, need), ErrorKind::Input};
    }
    try {
        return Reader(*model, name).run();
    } catch (const std::bad_alloc&) {
        return Error{name + ": not enough memory for it; simplify the model", ErrorKind::OutOfMemory};
    }
}

}  // namespace kiln::model
