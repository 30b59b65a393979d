// SPDX-License-Identifier: MIT
// GLB files made in memory: a buffer that grows, and JSON written by hand around it.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace kiln::model {

class Glb {
public:
    // Adds bytes with a buffer view and an accessor; answers the accessor's number. `extra`: more members, ", \"normalized\": true".
    template <typename T>
    int add(std::span<const T> values, int component_type, const std::string& type, size_t per_element,
            const std::string& extra = {}) {
        const int view = add_bytes(std::as_bytes(values));
        accessors += (accessors.empty() ? "" : ",") + std::string("{\"bufferView\":") + std::to_string(view) +
                     ",\"componentType\":" + std::to_string(component_type) +
                     ",\"count\":" + std::to_string(values.size() / per_element) + ",\"type\":\"" + type + "\"" +
                     extra + "}";
        return accessor_count++;
    }
    int floats(const std::vector<float>& v, const std::string& type, size_t per_element) {
        return add(std::span(v), 5126, type, per_element);
    }
    int indices(const std::vector<uint16_t>& v) { return add(std::span(v), 5123, "SCALAR", 1); }
    int add_bytes(std::span<const std::byte> bytes) {
        views += (views.empty() ? "" : ",") + std::string("{\"buffer\":0,\"byteOffset\":") +
                 std::to_string(bin.size()) + ",\"byteLength\":" + std::to_string(bytes.size()) + "}";
        bin.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        while (bin.size() % 4) bin += '\0';
        return view_count++;
    }
    // `members`: the rest of the JSON, "\"nodes\": [...], ..." .
    std::string file(const std::string& members) const {
        std::string json =
            "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":" + std::to_string(bin.size()) +
            "}],\"bufferViews\":[" + views + "],\"accessors\":[" + accessors + "]," + members + "}";
        while (json.size() % 4) json += ' ';
        std::string out = "glTF";
        word(out, 2);
        word(out, uint32_t(12 + 8 + json.size() + 8 + bin.size()));
        word(out, uint32_t(json.size()));
        out += "JSON" + json;
        word(out, uint32_t(bin.size()));
        out += std::string("BIN\0", 4) + bin;
        return out;
    }

    std::string bin, views, accessors;
    int view_count = 0, accessor_count = 0;

private:
    static void word(std::string& out, uint32_t v) {
        char bytes[4];
        std::memcpy(bytes, &v, 4);
        out.append(bytes, 4);
    }
};

// Four corners of a square, two triangles, with whatever a test wants besides.
struct SquareGlb : Glb {
    int positions = floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3", 3);
    int corners = indices({0, 1, 2, 0, 2, 3});
    std::string attributes = "\"POSITION\":0";
    std::string material, materials, nodes = "{\"mesh\":0}", scene = "0", rest;

    std::string whole() const {
        return file("\"meshes\":[{\"primitives\":[{\"attributes\":{" + attributes + "},\"indices\":1" + material +
                    "}]}],\"nodes\":[" + nodes + "],\"scenes\":[{\"nodes\":[" + scene + "]}],\"scene\":0" +
                    (materials.empty() ? "" : ",\"materials\":[" + materials + "]") + rest);
    }
};

}  // namespace kiln::model
