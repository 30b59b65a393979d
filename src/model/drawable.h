// SPDX-License-Identifier: MIT
// A model as it is drawn: vertices with normals and tangents, materials, images, and the nodes that place them and move. Triangles of a
// primitive stand in the order of its tree of boxes, so neighbours in the list are neighbours in space.
#pragma once

#include "model/bvh.h"
#include "model/matrix.h"

#include <kiln/math.h>
#include <kiln/result.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::model {

struct Triangles;

struct Vertex {
    vec3 position;
    vec3 normal{0, 1, 0};      ///< unit
    vec4 tangent{1, 0, 0, 1};  ///< unit; w: +1 or -1, bitangent = cross(normal, tangent) w
    std::array<vec2, 2> uv{};  ///< two sets
    vec4 color{1, 1, 1, 1};    ///< linear, multiplies the base colour
};

/// 8 bits a channel, top row first.
struct Image {
    std::string name;
    int width = 0, height = 0;  ///< 0: could not be read; drawn as white
    std::vector<uint8_t> rgba;
};

enum class Wrap : uint8_t { Repeat, Mirror, Clamp };

/// How a material looks at an image.
struct TextureUse {
    int32_t image = -1;  ///< none
    uint8_t uv_set = 0;
    Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
    bool nearest = false;  ///< magnified texels stay squares
    std::array<float, 6> map{1, 0, 0,
                             1, 0, 0};  ///< u' = m0 u + m2 v + m4, v' = m1 u + m3 v + m5 (KHR_texture_transform)
};

/// glTF 2.0 metallic-roughness.
struct Surface {
    std::string name;
    vec4 base_color{1, 1, 1, 1};  ///< linear
    float metallic = 1, roughness = 1;
    vec3 emissive{};  ///< with its strength
    float normal_scale = 1, occlusion_strength = 1;
    float alpha_cutoff = 0.5f;
    bool mask = false;   ///< less alpha than the cutoff is a hole
    bool blend = false;  ///< alpha is the share that it covers
    bool double_sided = false;
    TextureUse base_texture, rough_metal_texture, normal_texture, occlusion_texture, emissive_texture;
};

struct SkinWeights {
    std::array<uint16_t, 4> joints{};
    std::array<float, 4> weights{};  ///< sum 1
};

/// Triangles of one surface.
struct Primitive {
    uint32_t first_index = 0, index_count = 0;  ///< of Drawable::indices, which count from the drawable's first vertex
    uint32_t first_vertex = 0, vertex_count = 0;
    uint32_t surface = 0;
    uint32_t first_node = 0, node_count = 0;  ///< of Drawable::bvh; leaves count triangles of this primitive
    Box3 bounds;
    uint32_t first_weights = UINT32_MAX;  ///< of Drawable::weights, one a vertex; UINT32_MAX: rigid
    bool closed = false;                  ///< is_closed() of closed.h, at rest; finish() finds out
};

struct DrawNode {
    std::string name;
    int32_t parent = -1;  ///< a lower number
    bool has_matrix = false;
    Matrix matrix = kIdentity;  ///< with has_matrix
    std::array<double, 3> translation{};
    std::array<double, 4> rotation{0, 0, 0, 1};
    std::array<double, 3> scale{1, 1, 1};
    uint32_t first_primitive = 0, primitive_count = 0;
    int32_t skin = -1;
};

struct Skin {
    std::vector<uint32_t> joints;    ///< nodes
    std::vector<Matrix> from_model;  ///< inverse bind matrices
};

/// One property of one node over time.
struct Channel {
    enum class Path : uint8_t { Translation, Rotation, Scale };
    enum class Kind : uint8_t { Linear, Step, Cubic };
    uint32_t node = 0;
    Path path = Path::Translation;
    Kind kind = Kind::Linear;
    std::vector<float> times;   ///< seconds, ascending
    std::vector<float> values;  ///< 3 or 4 a time; Cubic: in-tangent, value, out-tangent
};

struct Drawable {
    std::string name;  ///< of the file
    std::vector<Vertex> vertices;
    std::vector<uint32_t> indices;
    std::vector<Primitive> primitives;
    std::vector<BvhNode> bvh;
    std::vector<Surface> surfaces;
    std::vector<Image> images;
    std::vector<SkinWeights> weights;
    std::vector<DrawNode> nodes;
    std::vector<Skin> skins;
    std::vector<Channel> channels;  ///< of every animation in the file; they play together and over again
    double duration = 0;            ///< seconds; 0: nothing moves
    /// What the file has and is not drawn, one sentence each.
    std::vector<std::string> notes;

    uint32_t triangle_count() const { return uint32_t(indices.size() / 3); }
};

/// By the ending of the name, as read(). Any thread.
Result<Drawable> read_drawable(const std::string& path);
/// `folder`, with its slash, is where files beside this one are.
Result<Drawable> parse_gltf_drawable(std::string_view bytes, const std::string& name, const std::string& folder);
/// Of formats that hold only triangles: one grey surface, with edges where faces meet at more than 40 degrees.
Drawable drawable_of(const Triangles& triangles, const std::string& name);

/// What a reader ends with: trees of boxes, triangles in their order.
void finish(Drawable& drawable);

/// Each node's place in the model at a time.
std::vector<Matrix> pose(const Drawable& drawable, double time);
/// The model's box at rest.
Box3 bounds_of(const Drawable& drawable);

// Normals and tangents of `count` corners of vertices, three a triangle. May add vertices, and renumber `corners`.
void make_flat_normals(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners);
void make_creased_normals(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners, float most_degrees);
void make_tangents(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners, const TextureUse& texture);

}  // namespace kiln::model
