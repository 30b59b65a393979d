// SPDX-License-Identifier: MIT
// Edits: the ordered, non-destructive operations a world is made of, the object trees they may place, and a program's own shapes.
// Plain data but for those; nothing here evaluates. Typed shapes and warps (`Sphere{.radius = 1}`) are in <kiln/shapes.h>,
// generated from the same files that define their distance functions.
#pragma once

#include <kiln/math.h>
#include <kiln/result.h>

#include <array>
#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace kiln {

/// Typed index with a generation: a stale id is detected, never dereferenced. Default: refers to nothing.
template <typename Tag>
struct Id {
    uint32_t index = UINT32_MAX;
    uint32_t generation = 0;
    constexpr explicit operator bool() const { return index != UINT32_MAX; }
    friend auto operator<=>(const Id&, const Id&) = default;
};
using EditId = Id<struct EditTag>;
using ObjectId = Id<struct ObjectTag>;
using MaterialId = Id<struct MaterialTag>;

/// glTF 2.0 metallic-roughness, scene-linear Rec. 709.
struct Material {
    vec3 base_color{0.5f, 0.5f, 0.5f};
    float roughness = 0.7f;    ///< perceptual, [0, 1]; alpha = roughness²
    float metallic = 0.0f;     ///< [0, 1]
    vec3 emissive{0, 0, 0};    ///< radiance, cd/m²
    float opacity = 1.0f;      ///< (0, 1]: the share of light that does not go in; below 1 the forward pass draws it
    float friction = 0.5f;     ///< >= 0
    float restitution = 0.0f;  ///< [0, 1]
    float ior = 1.5f;          ///< where opacity is below 1: how much light bends going in, [1, 4]
    /// … and what is left of white light after attenuation_distance metres inside (Beer and Lambert); 0 metres: all of it
    vec3 attenuation_color{1, 1, 1};
    float attenuation_distance = 0;
    float rolling_friction = 0;  ///< >= 0: the tangent of the slope on which a ball begins to roll
    friend bool operator==(const Material&, const Material&) = default;
};

/// How an edit acts on all before it. Smooth where blend_radius > 0.
enum class Op : uint8_t { Union, Subtract, Intersect, Paint };

inline constexpr int kMaxParams = 12;  ///< most numbers any shape or warp has

/// One primitive. `kind` indexes the generated shape table; `params` are its fields in order of declaration.
/// `data` is only for shapes with a resource: the file of `heightfield` and `mesh`, the text of `expression`.
struct Shape {
    uint16_t kind = 0;
    std::array<float, kMaxParams> params{};
    std::string data{};
    friend bool operator==(const Shape&, const Shape&) = default;
};

/// A shape of the program's own, known by name in code and in scene files: a distance in GLSL, which every device and every instruction
/// set runs, or in C++.
///   const auto egg = kiln::register_shape({.name = "egg", .half_extents = …, .glsl = "float egg(vec3 p) { … }"});
///   world.add({.node = {.shape = *egg}});
struct CustomShape {
    /// One number of the shape; a key beside `shape` in scene files.
    struct Parameter {
        std::string name;  ///< lower case letters, digits and _
        float value = 1;   ///< when left out
        float least = -1e9f, most = 1e9f;
        std::string description{};
    };
    /// Points in the shape's own frame, metres; never outside the half extents.
    struct Points {
        const double* x;
        const double* y;
        const double* z;
        int count;  ///< 1 … 64
    };

    std::string name{};  ///< lower case letters, digits and _; no other shape's
    std::string description{};
    std::vector<Parameter> parameters{};  ///< at most 9; Shape::params in this order
    /// Writes `count` numbers: metres, negative inside. The same answers for the same points, on any thread.
    std::function<void(const Points& points, const float* parameters, double* distance)> distance{};
    /// Half the size of a box around the origin that the solid lies in, metres.
    std::function<vec3(const float* parameters)> half_extents{};
    /// No two points of the box differ by more than this per metre; 1 for distances. What is given here and above is checked by
    /// sampling when an edit with the shape is compiled; the solid is cut to the box.
    float lipschitz = 1;
    /// In the place of `distance`: a function of the point, and of a float for each parameter in order; the last function in the text
    /// that takes a vec3 first and returns a float. What is read of GLSL: docs/scene-format.md.
    std::string glsl{};
};

/// Makes the shape known to this process, for good, and returns one with its parameters' own values. Register before worlds or scene
/// files name it. Worlds with one in C++ are baked on the CPU on every device. Fails on a name that is taken, a missing function, and GLSL that
/// cannot be read ("glsl LINE:COLUMN: …"). Any thread.
Result<Shape> register_shape(CustomShape shape);

/// One entry of a modelling stack (twist, bend, mirror, round, …); same layout as Shape.
struct Warp {
    uint16_t kind = 0;
    std::array<float, kMaxParams> params{};
    friend bool operator==(const Warp&, const Warp&) = default;
};

/// What an edit or a tree node draws: a shape, or an object placed by reference, or (nodes only) a fold of children.
/// local solid -> domain[0] -> domain[1] -> … -> transform -> parent's space.
struct Node {
    enum class Kind : uint8_t { Shape, Object, Fold };
    Kind kind = Kind::Shape;
    Shape shape{};
    ObjectId object{};
    Op op = Op::Union;                 ///< Fold: combines the children from left to right
    float blend_radius = 0;            ///< Fold: in the node's own units
    float material_blend_radius = -1;  ///< Fold: likewise, for materials; negative: same as blend_radius
    std::vector<uint32_t> children{};  ///< Fold: indices into Object::nodes
    Transform transform{};
    std::vector<Warp> domain{};
    MaterialId material{};  ///< none: the parent's
    friend bool operator==(const Node&, const Node&) = default;
};

/// A reusable tree; nodes[0] is the root. Children always have higher indices than their parent.
struct Object {
    std::string name{};
    std::vector<Node> nodes{};
    friend bool operator==(const Object&, const Object&) = default;
};

/// A line around something on the screen.
struct Outline {
    vec3 color{1, 0.6f, 0};  ///< scene-linear Rec. 709
    float width_px = 3;      ///< (0, 64]
    friend bool operator==(const Outline&, const Outline&) = default;
};

/// One entry of the world's ordered list. `node.kind` is Shape or Object.
struct Edit {
    std::string name{};  ///< the scene file's `id`; unique in a world, made up when empty
    Node node{};
    Op op = Op::Union;
    float blend_radius = 0;            ///< world metres; the |a − b| where blending begins
    float material_blend_radius = -1;  ///< world metres; negative: same as blend_radius
    bool dynamic = false;              ///< hint: moves often
    bool hidden = false;               ///< kept in the list, acts on nothing
    std::string group{};
    std::optional<Outline> outline{};
    friend bool operator==(const Edit&, const Edit&) = default;
};

}  // namespace kiln
