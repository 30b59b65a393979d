// SPDX-License-Identifier: MIT
// What tinygltf throws ends here.

#define TINYGLTF_IMPLEMENTATION
#include "model/gltf_file.h"

#include "base/format.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <utility>

namespace kiln::model {
namespace {

// Keeps an image as the file has it: `image.image` holds the PNG's or JPEG's bytes. `model` is what has been read so far; that a view of
// its buffers lies inside of them has not been looked at.
bool keep_bytes(tinygltf::Image* image, const int number, std::string* error, std::string*, int, int,
                const unsigned char* bytes, int size, void* model) {
    if (image->bufferView >= 0) {
        const auto& read = *static_cast<const tinygltf::Model*>(model);
        const tinygltf::BufferView& view = read.bufferViews[size_t(image->bufferView)];
        const size_t limit = read.buffers[size_t(view.buffer)].data.size();
        if (view.byteOffset > limit || view.byteLength > limit - view.byteOffset) {
            *error += formatted("images[{}] reaches beyond its buffer", number);
            return false;
        }
    }
    image->image.assign(bytes, bytes + std::max(size, 0));
    return true;
}

// A buffer is a file: reading a folder as one asks for all memory, and a pipe may never answer.
bool is_file(const std::string& path, void*) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

// tinygltf goes into what is nested by calling itself, as deep as a file says: 200,000 brackets end the program.
constexpr size_t kMostNested = 512;

// The text of a file, of a binary one too.
std::string_view json_of(std::string_view bytes) {
    constexpr size_t kBefore = 20;  // header of the file, length and type of the chunk
    if (!bytes.starts_with("glTF")) return bytes;
    if (bytes.size() < kBefore) return {};
    uint32_t length = 0;
    for (size_t i = 0; i < 4; ++i) length |= uint32_t(uint8_t(bytes[12 + i])) << (8 * i);
    return bytes.substr(kBefore, length);
}

bool nested_too_deep(std::string_view json) {
    size_t depth = 0;
    bool quoted = false;
    for (size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (quoted) {
            if (c == '\\') ++i;
            quoted = c != '"';
        } else if (c == '"') {
            quoted = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kMostNested) return true;
        } else if ((c == '}' || c == ']') && depth > 0) {
            --depth;
        }
    }
    return false;
}

// What tinygltf says, which may quote all of a file.
std::string said(std::string_view why) {
    constexpr size_t kMost = 160;
    std::string out = one_line(why.substr(0, kMost));
    while (!out.empty() && (out.back() == ' ' || out.back() == '.')) out.pop_back();
    return why.size() > kMost ? out + " ..." : out;
}

}  // namespace

Error gltf_fault(const std::string& name, const std::string& what) {
    return {name + ": refers to " + what + "; the file is damaged, export it again", ErrorKind::Input};
}

Result<tinygltf::Model> load_gltf(std::string_view bytes, const std::string& name, const std::string& folder) {
    const auto unreadable = [&](std::string_view why) {
        return Error{formatted("{}: not a glTF file that can be read: {}; export it again", name, said(why)),
                     ErrorKind::Input};
    };
    try {
        tinygltf::Model model;
        tinygltf::TinyGLTF loader;
        loader.SetImageLoader(keep_bytes, &model);
        tinygltf::FsCallbacks files{};
        files.FileExists = is_file;
        files.ExpandFilePath = tinygltf::ExpandFilePath;
        files.ReadWholeFile = tinygltf::ReadWholeFile;
        files.WriteWholeFile = tinygltf::WriteWholeFile;
        loader.SetFsCallbacks(files);
        std::string why, warning;
        if (bytes.size() > (size_t(1) << 31))
            return Error{name + ": larger than 2 GiB; split the model", ErrorKind::Input};
        if (nested_too_deep(json_of(bytes)))
            return unreadable(formatted("something in it is nested more than {} deep", kMostNested));
        const auto size = unsigned(bytes.size());
        const bool read =
            bytes.starts_with("glTF")
                ? loader.LoadBinaryFromMemory(&model, &why, &warning,
                                              reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
                : loader.LoadASCIIFromString(&model, &why, &warning, bytes.data(), size, folder);
        if (!read) return unreadable(why);
        return model;
    } catch (const std::bad_alloc&) {
        return Error{name + ": not enough memory for it; simplify the model", ErrorKind::OutOfMemory};
    } catch (const std::exception& e) {
        return unreadable(e.what());
    }
}

// `count` elements of a view, from `offset` on.
static Result<AccessorBytes> view_bytes(const tinygltf::Model& model, int number, size_t offset, size_t count,
                                        size_t element, const std::string& name) {
    if (number < 0 || size_t(number) >= model.bufferViews.size())
        return gltf_fault(name, "a buffer view that does not exist");
    const tinygltf::BufferView& view = model.bufferViews[size_t(number)];
    if (view.buffer < 0 || size_t(view.buffer) >= model.buffers.size())
        return gltf_fault(name, "a buffer that does not exist");
    const std::vector<unsigned char>& data = model.buffers[size_t(view.buffer)].data;
    AccessorBytes out{
        .at = nullptr, .stride = view.byteStride != 0 ? view.byteStride : element, .count = count, .made = {}};
    const size_t limit = data.size();
    if (view.byteOffset > limit || offset > limit || count > limit || out.stride > limit)
        return gltf_fault(name, "bytes outside its buffer");
    const size_t from = view.byteOffset + offset;
    if (count > 0 && (from > limit || (count - 1) > (limit - from) / out.stride ||
                      (count - 1) * out.stride + element > limit - from))
        return gltf_fault(name, "bytes outside its buffer");
    out.at = data.data() + from;
    return out;
}

// glTF 2.0, 3.6.2.3: what the view has, or zeros, but for the elements that are listed.
static Result<AccessorBytes> sparse_bytes(const tinygltf::Model& model, const tinygltf::Accessor& a, size_t element,
                                          const std::string& name) {
    constexpr size_t kMostBytes = size_t(1) << 28;
    const auto& sparse = a.sparse;
    if (a.count > kMostBytes / element)
        return Error{name + ": a sparse accessor of more than 256 MiB; split the model", ErrorKind::Input};
    if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0)
        return gltf_fault(name, "a place before its buffer");
    size_t size = 0;
    if (sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) size = 1;
    if (sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) size = 2;
    if (sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) size = 4;
    if (size == 0) return gltf_fault(name, "elements by numbers of a wrong type");
    const auto listed = size_t(sparse.count);
    const auto numbers =
        view_bytes(model, sparse.indices.bufferView, size_t(sparse.indices.byteOffset), listed, size, name);
    if (!numbers) return numbers.error();
    const auto values =
        view_bytes(model, sparse.values.bufferView, size_t(sparse.values.byteOffset), listed, element, name);
    if (!values) return values.error();
    std::vector<unsigned char> all(a.count * element);
    if (a.bufferView >= 0) {
        const auto dense = view_bytes(model, a.bufferView, a.byteOffset, a.count, element, name);
        if (!dense) return dense.error();
        for (size_t i = 0; i < a.count; ++i)
            std::memcpy(all.data() + i * element, dense->at + i * dense->stride, element);
    }
    for (size_t i = 0; i < listed; ++i) {
        size_t number = 0;
        for (size_t b = size; b-- > 0;) number = number << 8 | numbers->at[i * numbers->stride + b];
        if (number >= a.count)
            return gltf_fault(name, formatted("element {} of a sparse accessor of {}", number, a.count));
        std::memcpy(all.data() + number * element, values->at + i * values->stride, element);
    }
    auto made = std::make_shared<const std::vector<unsigned char>>(std::move(all));
    return AccessorBytes{.at = made->data(), .stride = element, .count = a.count, .made = made};
}

Result<AccessorBytes> accessor_bytes(const tinygltf::Model& model, const tinygltf::Accessor& a, size_t element,
                                     const std::string& name) {
    if (a.sparse.isSparse) return sparse_bytes(model, a, element, name);
    return view_bytes(model, a.bufferView, a.byteOffset, a.count, element, name);
}

Matrix node_matrix(const tinygltf::Node& node) {
    if (node.matrix.size() == 16) {
        Matrix out;
        std::copy(node.matrix.begin(), node.matrix.end(), out.begin());
        return out;
    }
    double t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (node.translation.size() == 3) std::copy(node.translation.begin(), node.translation.end(), t);
    if (node.rotation.size() == 4) std::copy(node.rotation.begin(), node.rotation.end(), q);
    if (node.scale.size() == 3) std::copy(node.scale.begin(), node.scale.end(), s);
    return matrix_of(t, q, s);
}

}  // namespace kiln::model
