// SPDX-License-Identifier: MIT
// World: an ordered list of edits, the objects, materials, lights and cameras beside it, and the field they make.
//   kiln::World world;  world.add({.node = {.shape = kiln::Sphere{.radius = 1}}});  float d = world.distance({0, 2, 0});
// A World is changed from its owner's thread; the const functions may be called from any thread between changes.
#pragma once

#include <kiln/edit.h>
#include <kiln/mesh.h>
#include <kiln/query.h>
#include <kiln/renderer.h>
#include <kiln/result.h>
#include <kiln/shapes.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kiln {

struct FieldSettings {
    float voxel_size = 0;  ///< metres; 0: longest finite side / 256
    int cells = 64;        ///< a side per level, a power of two (clipmap levels; one level covers the edits)
    int levels = 1;
    std::optional<Box3> bounds;  ///< none: the finite edits', inflated by 10 %
    bool distance_8bit = false;  ///< bricks store distance in 8 bits instead of 16
};

/// How a model file is taken into a scene.
struct ImportSettings {
    float unit = 1;        ///< metres a unit of the file
    bool z_up = false;     ///< the file's +Z becomes +Y
    int resolution = 128;  ///< cells along the longest side, [8, 512]
};

/// How the bodies of a scene are run.
struct SimulateSettings {
    double seconds = 1;         ///< round(seconds / the scene's step) fixed steps
    double every = 0;           ///< seconds between frames of the answer; 0: each step
    std::string backend{};      ///< one of physics_backends(); empty: the first that works
    bool field_bodies = false;  ///< also bodies with an exact convex shape collide as fields
    int threads = 0;            ///< 0: all cores; the answer is the same for any number
};

class World {
public:
    World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    /// A scene file, or the name of a bundled scene. Errors read "FILE:LINE:COLUMN: path.to.key: what; what would be right".
    static Result<World> load(const std::string& path_or_name);
    static Result<World> parse(std::string_view json, const std::string& file_name);
    /// A world of one mesh edit that reads `model` (.glb .gltf .obj .off .ply .stl), with a camera that sees all of it. `scene` is where
    /// it will be saved: the edit names the model relative to that. Errors read "MODEL: what; what would be right".
    static Result<World> import(const std::string& model, const std::string& scene,
                                const ImportSettings& settings = {});
    /// Writes the whole scene; the old file stays until the new one is complete.
    Result<void> save(const std::string& path) const;
    std::string to_json() const;

    MaterialId add_material(const std::string& name, const Material& material);
    Result<ObjectId> add_object(Object object);
    /// Appends an edit. Fails on NaN, sizes out of range, references to nothing.
    Result<EditId> add(Edit edit);
    Result<void> change(EditId id, Edit edit);
    Result<void> remove(EditId id);
    /// Moves an edit to stand just before another; before none: to the end.
    Result<void> reorder(EditId id, EditId before);
    const Edit* find(EditId id) const;  ///< null when stale; valid until the next change
    std::optional<EditId> find_edit(std::string_view name) const;
    std::vector<EditId> edits() const;  ///< in order

    FieldSettings field_settings;
    std::vector<Light> lights;                            ///< none: a default sun, unless an image lights the scene
    std::optional<Environment> environment;               ///< none: a default sky
    std::vector<std::pair<std::string, Camera>> cameras;  ///< none: framed automatically

    /// Exact distance of the ordered program, metres; +infinity in an empty world.
    float distance(vec3 p_world) const;
    FieldSample sample(vec3 p_world, FieldSource source = FieldSource::Exact) const;
    std::vector<FieldSample> sample(std::span<const vec3> p_world, FieldSource source = FieldSource::Exact) const;
    RayHit cast(const Ray& ray) const;
    /// What can be asked of the field as it is now, also from other threads while this world changes. Cheap: it holds the compiled
    /// edits, which are compiled when they are first needed. A world that cannot be compiled is seen as empty.
    WorldView view() const;
    const Material* material(MaterialId id) const;
    std::string_view material_name(MaterialId id) const;

    /// Bounds of the solid of all finite edits, world metres; empty when there are none.
    Box3 bounds() const;
    /// What a renderer needs, with an immutable snapshot of the field. Camera by name; the first (or an automatic one) when empty.
    Result<Frame> frame(std::string_view camera = {}) const;
    /// The surface as triangles. Fails where nothing is solid, and where `cell` asks for more than memory holds.
    Result<Mesh> mesh(const MeshSettings& settings = {}) const;

    /// Runs the scene's bodies from their start and tells their ways as JSON (`kiln simulate --json`); the world stays as it is. Fails on
    /// bodies that cannot be simulated, and on a backend that there is not.
    Result<std::string> simulate_json(const SimulateSettings& settings = {}) const;

    /// Facts about the scene for people and programs (`kiln inspect`): counts, bounds, voxel size, bricks, bytes.
    std::string inspect_json() const;
    /// What was found in the model files that the edits read, one sentence each: "bunny.obj: closed manifold of 69666 triangles".
    std::vector<std::string> model_notes() const;
    /// Sections of the scene that this version reads and keeps but does not draw ("meshes", "fluids", …).
    std::vector<std::string> not_drawn_yet() const;

    struct Impl;

private:
    std::unique_ptr<Impl> impl_;
};

/// A physics engine that this build has; `why_not` says why it cannot run on this machine, empty when it can.
struct PhysicsBackend {
    std::string_view name, why_not;
};
/// The default first.
std::vector<PhysicsBackend> physics_backends();

/// Names and one-line descriptions of the scenes that come with Kiln.
std::vector<std::pair<std::string, std::string>> bundled_scenes();
/// JSON Schema (2020-12) of the scene format, made from the same tables as the reader.
std::string scene_schema_json();
/// The engine's version, "0.1.0".
std::string_view version();

/// The known word that someone who typed `word` most likely meant; empty when none is near.
std::string_view nearest_word(std::string_view word, std::span<const std::string_view> known);
/// Removes the temporaries of files that are being written. Only for signal handlers that end the program.
void discard_unfinished_files() noexcept;

/// How far two images are apart. Mean over pixels.
struct ImageDifference {
    double flip = 0;     ///< LDR-FLIP at 67 pixels per degree, 0 (same) to 1
    double psnr = 0;     ///< dB, infinity when equal
    double ssim = 0;     ///< 1 when equal
    double max_abs = 0;  ///< largest channel difference, 0 to 1
};
Result<ImageDifference> compare_images(const std::string& a, const std::string& b);

}  // namespace kiln
