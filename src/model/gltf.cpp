// SPDX-License-Identifier: MIT
// glTF 2.0, text and binary, through tinygltf: the triangles of the default scene's nodes, each in its node's place. Images are not
// looked at; skins and morphs stay in their rest pose. What tinygltf throws ends here.

#include "model/triangles.h"

#include "base/format.h"

#include <cmath>
#include <cstring>

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

namespace kiln::model {
namespace {

using Matrix = std::array<double, 16>;  // columns, as glTF writes them

constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Matrix times(const Matrix& a, const Matrix& b) {
    Matrix out{};
    for (size_t c = 0; c < 4; ++c)
        for (size_t r = 0; r < 4; ++r)
            for (size_t k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    return out;
}

Matrix matrix_of(const tinygltf::Node& node) {
    Matrix out = kIdentity;
    if (node.matrix.size() == 16) {
        std::copy(node.matrix.begin(), node.matrix.end(), out.begin());
        return out;
    }
    if (node.rotation.size() == 4) {
        const double x = node.rotation[0], y = node.rotation[1], z = node.rotation[2], w = node.rotation[3];
        out = {1 - 2 * (y * y + z * z),
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
               0,
               0,
               0,
               1};
    }
    if (node.scale.size() == 3)
        for (size_t c = 0; c < 3; ++c)
            for (size_t r = 0; r < 3; ++r) out[4 * c + r] *= node.scale[c];
    if (node.translation.size() == 3)
        for (size_t r = 0; r < 3; ++r) out[12 + r] = node.translation[r];
    return out;
}

// The turn that a mirroring transform gives every triangle.
bool mirrors(const Matrix& m) {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) +
               m[8] * (m[1] * m[6] - m[2] * m[5]) <
           0;
}

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
            const Matrix place = times(v.place, matrix_of(node));
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
    Error fault(const std::string& what) const {
        return Error{name_ + ": refers to " + what + "; the file is damaged, export it again", ErrorKind::Input};
    }

    // An accessor's elements lie inside its buffer; `stride` apart.
    struct Bytes {
        const unsigned char* at = nullptr;
        size_t stride = 0;
        size_t count = 0;
    };
    Result<Bytes> bytes_of(const tinygltf::Accessor& a, size_t element) const {
        Bytes out;
        out.count = a.count;
        if (a.sparse.isSparse)
            return Error{name_ + ": has sparse accessors, which are not read; export it without them",
                         ErrorKind::Input};
        if (a.bufferView < 0 || size_t(a.bufferView) >= model_.bufferViews.size())
            return fault("a buffer view that does not exist");
        const tinygltf::BufferView& view = model_.bufferViews[size_t(a.bufferView)];
        if (view.buffer < 0 || size_t(view.buffer) >= model_.buffers.size())
            return fault("a buffer that does not exist");
        const std::vector<unsigned char>& data = model_.buffers[size_t(view.buffer)].data;
        out.stride = view.byteStride != 0 ? view.byteStride : element;
        const size_t limit = data.size();
        if (view.byteOffset > limit || a.byteOffset > limit || a.count > limit || out.stride > limit)
            return fault("bytes outside its buffer");
        const size_t from = view.byteOffset + a.byteOffset;
        if (a.count > 0 && (from > limit || (a.count - 1) > (limit - from) / out.stride ||
                            (a.count - 1) * out.stride + element > limit - from))
            return fault("bytes outside its buffer");
        out.at = data.data() + from;
        return out;
    }

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
        const auto floats = bytes_of(corners, 12);
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
            const auto indices = bytes_of(a, size);
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

bool no_image(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
    return true;
}

}  // namespace

Result<Triangles> parse_gltf(std::string_view bytes, const std::string& name, const std::string& folder) {
    try {
        tinygltf::Model model;
        tinygltf::TinyGLTF loader;
        loader.SetImageLoader(no_image, nullptr);
        std::string why, warning;
        const bool binary = bytes.starts_with("glTF");
        if (bytes.size() > (size_t(1) << 31))
            return Error{name + ": larger than 2 GiB; split the model", ErrorKind::Input};
        const auto size = unsigned(bytes.size());
        const bool read =
            binary ? loader.LoadBinaryFromMemory(&model, &why, &warning,
                                                 reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
                   : loader.LoadASCIIFromString(&model, &why, &warning, bytes.data(), size, folder);
        if (!read) {
            for (char& c : why) c = c == '\n' ? ' ' : c;
            while (why.ends_with(' ')) why.pop_back();
            return Error{formatted("{}: not a glTF file that can be read: {}; export it again", name, why),
                         ErrorKind::Input};
        }
        for (const std::string& need : model.extensionsRequired) {
            if (need == "KHR_draco_mesh_compression" || need == "EXT_meshopt_compression" ||
                need == "KHR_mesh_quantization")
                return Error{formatted("{}: needs {}, which is not read; export it without compression", name, need),
                             ErrorKind::Input};
        }
        return Reader(model, name).run();
    } catch (const std::bad_alloc&) {
        return Error{name + ": not enough memory for it; simplify the model", ErrorKind::OutOfMemory};
    } catch (const std::exception& e) {
        return Error{formatted("{}: not a glTF file that can be read: {}; export it again", name, e.what()),
                     ErrorKind::Input};
    }
}

}  // namespace kiln::model
