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

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kiln {

class Play;
namespace scene {
class Simulation;
}

struct FieldSettings {
    /// Metres; 0: longest finite side / 256 when the field is made, kept while edits change that by less than 10 %.
    float voxel_size = 0;
    int cells = 64;  ///< a side per level, a power of two (clipmap levels; one level covers the edits)
    int levels = 1;
    std::optional<Box3> bounds;  ///< none: the finite edits', inflated by 10 %, and their blends with a ground
    bool distance_8bit = false;  ///< bricks store distance in 8 bits instead of 16
    friend bool operator==(const FieldSettings&, const FieldSettings&) = default;
};

/// What a frame of a world of several levels may bake; what does not fit is shown coarser until a later frame.
struct FrameBudget {
    uint32_t bricks = UINT32_MAX;
    double seconds = 1e30;
};

/// How a model file is taken into a scene.
struct ImportSettings {
    float unit = 1;        ///< metres a unit of the file
    bool z_up = false;     ///< the file's +Z becomes +Y
    int resolution = 128;  ///< cells along the longest side, [8, 512]
};

class World;

/// A step of a world's history: one change, or a group of them. Steps are numbered from 1; 0 is the beginning.
struct HistoryStep {
    uint32_t number = 0;
    uint32_t parent = 0;  ///< the step it was made after; steps with one parent are branches
    std::string title;    ///< the group's; else what its change was, "add lump"
    uint32_t changes = 0;
    bool done = false;  ///< it is in the world now
};

/// A world's changes, to be taken back and made again. Each costs what the change cost. All changes count: edits, materials, objects, and
/// what was assigned to the world's public members, which becomes a step when the next change is made or record() is called.
/// A handle: cheap, good while the world stands where it is. The owner's thread.
class History {
public:
    /// The step after whose changes the world is now.
    uint32_t now() const;
    std::vector<HistoryStep> steps() const;
    /// Takes the last step back; false when there is none. Undoing and changing something else keeps both branches.
    Result<bool> undo();
    /// Makes the step that was undone last again; false when there is none.
    Result<bool> redo();
    /// To the state after any step, also of another branch; 0: the beginning.
    Result<void> go_to(uint32_t step);

    /// Changes up to end_group() are one step (a brush stroke, a drag). Groups may be nested: the outermost counts.
    void begin_group(std::string title);
    Result<void> end_group();
    /// Takes back what was changed since the outermost begin_group(), and forgets it.
    Result<void> cancel_group();
    /// Makes a step of what was assigned to the world's public members.
    Result<void> record();
    /// Forgets all steps; the world stays as it is.
    Result<void> forget();

private:
    friend class World;
    explicit History(World& world) : world_(world) {}
    World& world_;
};

/// What became of the journal beside a scene.
struct JournalReport {
    std::string file;
    uint64_t commands = 0;       ///< that were applied to what the scene file holds
    uint64_t dropped_bytes = 0;  ///< behind the last good command
    std::string reason;          ///< why they were
    std::string kept_in;         ///< the file they were put into; empty when the scene was only read
    bool foreign = false;        ///< it belongs to another scene, or to another version of this one
    /// One line for people; empty when there is nothing to tell.
    std::string sentence() const;
};

/// A command of a `--edits` file: JSON lines {"time": seconds, "command": {"add": EDIT}}, likewise change, remove, reorder and the
/// scene's other sections (docs/scene-format.md).
struct TimedCommand {
    double time = 0;  ///< seconds
    std::string file, text;
    uint32_t line = 1;
};
/// The commands by ascending time, those of one time in the file's order. Errors read "FILE:LINE:COLUMN: what; what would be right".
Result<std::vector<TimedCommand>> read_timed_commands(const std::string& path);

/// How the bodies of a scene are run.
struct SimulateSettings {
    double seconds = 1;         ///< round(seconds / the scene's step) fixed steps
    double every = 0;           ///< seconds between frames of the answer; 0: each step
    std::string backend{};      ///< one of physics_backends(); empty: the first that works
    bool field_bodies = false;  ///< also bodies with an exact convex shape collide as fields
    bool mesh_ground =
        false;        ///< convex bodies touch triangles of the ground where it has settled, else its field everywhere
    int threads = 0;  ///< 0: all cores; the answer is the same for any number
    /// Changes of the world's own edits: each comes before the first step that begins at its time or later. By ascending time.
    std::vector<TimedCommand> edits{};
};

class World {
public:
    World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    /// A scene file with the commands of the journal beside it, or the name of a bundled scene. Errors read
    /// "FILE:LINE:COLUMN: path.to.key: what; what would be right".
    /// `workers`: threads that read the journal, 0 for every core. `past`: with the steps before the last save, where they are known
    /// (FILE.history), which open() always has.
    static Result<World> load(const std::string& path_or_name, int workers = 0, bool past = false);
    static Result<World> parse(std::string_view json, const std::string& file_name);
    /// A scene file for editing: from now on every change is in the journal beside it (FILE.journal) before the call that made it
    /// returns. It survives the end of the process at once, a power cut after a tenth of a second; save() brings it into the scene
    /// file, and its steps into FILE.history, so that undo reaches beyond it. Fails while another program edits the scene. A change that the disk has no room for is refused and the world left as it was.
    static Result<World> open(const std::string& path, int workers = 0);
    /// A world of one mesh edit that reads `model` (.glb .gltf .obj .off .ply .stl), with a camera that sees all of it. `scene` is where
    /// it will be saved: the edit names the model relative to that. Errors read "MODEL: what; what would be right".
    static Result<World> import(const std::string& model, const std::string& scene,
                                const ImportSettings& settings = {});
    /// Writes the whole scene, in another folder with its files named from there (a bundled scene's models are put beside it); the old
    /// file stays until the new one is complete. Where the world was opened from there, its journal
    /// begins anew.
    Result<void> save(const std::string& path) const;
    /// What has been changed is on the disk when this returns (a power cut, too). Nothing to do for worlds without a journal.
    Result<void> flush() const;
    /// Of the journal that load() or open() found; nothing when there was none.
    std::optional<JournalReport> journal_report() const;
    std::string to_json() const;

    /// Adds a material, or changes the one of this name; nothing where it cannot be had (no name, NaN, a full disk).
    MaterialId add_material(const std::string& name, const Material& material);
    Result<ObjectId> add_object(Object object);
    /// Appends an edit. Fails on NaN, sizes out of range, references to nothing.
    Result<EditId> add(Edit edit);
    Result<void> change(EditId id, Edit edit);
    Result<void> remove(EditId id);
    /// Puts an edit before another; before none: appends it.
    Result<EditId> insert(Edit edit, EditId before);
    /// Moves an edit to stand just before another; before none: to the end.
    Result<void> reorder(EditId id, EditId before);
    /// Puts a body (by any of its edits; the pose is that of its first) or a `dynamic` edit elsewhere, in pictures and in answers. The
    /// scene stays as it is: nothing is saved, undone or, while it is drawn as an instance, baked. Changing the edit or its body's puts
    /// it back where the scene has it. Its pose in the frame before is the one that the last frame() saw.
    Result<void> move(EditId id, const Pose& pose);
    /// Where that is now; nothing for other edits.
    std::optional<Pose> pose(EditId id) const;
    /// A change as data, {"add": EDIT} and the like (docs/journal.md lists them); `name` is what errors call the text. Sections that have no
    /// functions here come this way or with a scene's text: {"bodies": […]}, {"meshes": […]}, {"characters": […]}.
    Result<void> apply(const std::string& command, const std::string& name = "command");
    Result<void> apply(const TimedCommand& command);
    /// Changes from the first call on can be undone.
    History history();
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
    /// Bricks: rays march through the baked bricks, sixteen neighbours of the list in step, and are then moved to the edits' own surface; what
    /// only grazes it may be missed. Much faster where there are many rays: give them in an order in which neighbours see the same.
    std::vector<RayHit> cast(std::span<const Ray> rays, FieldSource source = FieldSource::Exact) const;
    /// What can be asked of the field as it is now, also from other threads while this world changes. Cheap: it holds the compiled
    /// edits, which are compiled when they are first needed. A world that cannot be compiled is seen as empty.
    WorldView view() const;
    const Material* material(MaterialId id) const;
    std::string_view material_name(MaterialId id) const;

    /// Bounds of the solid of all finite edits, world metres; empty when there are none.
    Box3 bounds() const;
    /// What a renderer needs, with an immutable snapshot of the field. Camera by name; the first (or an automatic one) when empty.
    Result<Frame> frame(std::string_view camera = {}) const;
    /// The same seen through any camera; of a world of several levels, a frame of a sequence: levels follow the camera from frame to frame.
    Result<Frame> frame(const Camera& camera, const FrameBudget& budget = {}) const;
    /// By name; the first (or an automatic one) when empty.
    Result<Camera> camera(std::string_view name = {}) const;
    /// The surface as triangles. Fails where nothing is solid, and where `cell` asks for more than memory holds.
    Result<Mesh> mesh(const MeshSettings& settings = {}) const;

    /// Runs the scene's bodies from their start and tells their ways as JSON (`kiln simulate --json`); the world stays as it is. Fails on
    /// bodies that cannot be simulated, and on a backend that there is not. `each` sees the play at every frame of the answer.
    Result<std::string> simulate_json(const SimulateSettings& settings = {},
                                      const std::function<Result<void>(Play&)>& each = {}) const;

    /// Facts about the scene for people and programs (`kiln inspect`): counts, bounds, voxel size, bricks, bytes.
    std::string inspect_json() const;
    /// The history and the journal (`kiln inspect --history`).
    std::string history_json() const;
    /// What was found in the model files that the edits read, one sentence each: "bunny.obj: closed manifold of 69666 triangles".
    std::vector<std::string> model_notes() const;
    /// The files that the scene is read from: those that it names (models, pictures, formulas), and its own. None of a bundled scene.
    std::vector<std::string> files() const;
    /// Whether this is one of files(), whatever its name. Write results elsewhere.
    bool is_read_from(const std::string& file) const;
    /// Meshes that the scene names and that cannot be read, an error each: they are left out, the rest is drawn.
    std::vector<std::string> faults() const;
    /// Sections of the scene that this version reads and keeps but does not draw ("cloths", "fluids", …).
    std::vector<std::string> not_drawn_yet() const;

    struct Impl;

private:
    friend class History;
    friend class Play;
    friend class scene::Simulation;
    friend struct SceneDifference compare_scenes(const World& a, const World& b);
    std::unique_ptr<Impl> impl_;
};

/// Lines over a picture of a play, for whoever looks for a fault.
struct PlayLines {
    bool shapes = false;    ///< outlines of bodies as the engine has them, in the colour of how they move
    bool sleeping = false;  ///< … of those that sleep
    bool contacts = false;  ///< a short line along the normal of each contact
};

/// How much goes on in a play.
struct PlayCounts {
    int bodies = 0;  ///< that can move, loose parts among them
    int awake = 0;   ///< of those
    int parts = 0;   ///< that have come loose since the start
};

/// What a ray meets of a play.
struct PlayHit {
    RayHit hit;
    std::string body{};  ///< id of the body it belongs to; empty: of none
};

/// A body of a play: one of the scene, a part that came loose, or one that was launched.
struct PlayBody {
    std::string id;
    Pose pose{};                                 ///< of its frame, after the last step: its first edit's, or its mesh's
    vec3 linear_velocity{}, angular_velocity{};  ///< m/s, of its centre of mass; rad/s
    bool asleep = false;                         ///< or come to rest for good, as ground
};

/// Something that a step of a play brought about: "begin", "end": a and b touch, or do so no more; "enter", "leave": b is in the region of
/// trigger a, or no more.
struct PlayEvent {
    std::string_view type;
    std::string a, b;  ///< ids, of a contact in either order; the world's own edits are "world"
};

/// Who walks in a play (Play::enter).
struct PlayWalker {
    vec3 feet{};  ///< as far between the last two steps as frames are
    bool on_floor = false;
};

/// A world's bodies, running, while the world itself stays as it is. It must outlive the play. Owner's thread.
///   auto play = kiln::Play::start(world);   play->advance(seconds);   renderer->render(*play->frame(camera));
class Play {
public:
    /// `seconds` and `every` of the settings say nothing here.
    static Result<Play> start(const World& world, const SimulateSettings& settings = {});
    /// Plays a world that is being edited. What commands do to the world, and what they cut loose, is done to it at once, in an open group
    /// of its history: a program that ends in play, however it ends, leaves it all in the journal as one step behind what was there before.
    /// end with stop() or keep(); nothing else may change the world until then.
    static Result<Play> begin(World& world, const SimulateSettings& settings = {});
    Play(Play&&) noexcept;
    Play& operator=(Play&&) noexcept;
    ~Play();
    /// Of begin(): the world is what it was then. What the play did stays in its history, as a branch.
    Result<void> stop();
    /// Of begin(): the world is what the play has become, with bodies and parts where they are, as one step.
    Result<void> keep();

    /// Begins anew, as if it had been told nothing, at the cost of what moves: what was made of the world at first is used again, and
    /// the next frame costs what differs from the last. Not of begin().
    Result<void> restart();

    /// One fixed step: commands whose time has come, then physics.
    Result<void> step();
    /// So much time has gone by: makes the steps that are due, four at most (what is more is dropped, and counted), and answers how many.
    Result<int> advance(double seconds);
    /// Of the last step, seconds.
    double time() const;
    double dropped_seconds() const { return dropped_; }
    /// A change of the world's own edits, {"add": EDIT} and the like, before the next step; with "target" ("bodies", "all" or a body's id)
    /// an edit acts on bodies too, or alone.
    Result<void> apply(const std::string& command, const std::string& name = "command");
    /// Makes another world, or the one that was played, which must be as it was at the start, what this one has become: commands, parts
    /// that came loose (as `dynamic` edits where they are, in flight too) and those that settled. One step of its history.
    Result<void> keep(World& world) const;
    /// The world with its bodies where they are: after step() those of the last step, after advance() as far between the last two as time
    /// has gone on. Each frame moves on from the one before (motion).
    /// `budget`: of a world of several levels, what the picture may bake.
    Result<Frame> frame(const Camera& camera, const PlayLines& lines = {}, const FrameBudget& budget = {});
    /// Where everything is that moves or could: the scene's bodies in its order, then the others as they came.
    std::vector<PlayBody> bodies() const;
    /// What came about in the last step() or advance(), in order.
    const std::vector<PlayEvent>& events() const { return events_; }
    /// A new body of one edit, which goes off at `velocity` (m/s) with the next step. It is like a part that came loose: it settles, and
    /// keep() has it. Its id is made up; it is the last of bodies() then.
    Result<void> launch(Edit edit, vec3 velocity);
    /// What a ray meets of the world as the last frame showed it, bodies among it.
    Result<RayHit> cast(const Ray& ray);
    /// The same, bodies of meshes among it, and whose it is: the target of commands that act there.
    Result<PlayHit> pick(const Ray& ray);
    /// Somebody walks in it, as characters of scenes do, and is not seen: from `feet` on, 1.7 m tall. Whoever did before is gone.
    Result<void> enter(vec3 feet);
    /// What they wish until the next time: a velocity, of which the level part counts, and once, where they stand, the speed upwards of a
    /// jump (m/s). Nothing while nobody walks.
    void walk(vec3 velocity, float jump = 0);
    void leave();
    std::optional<PlayWalker> walker() const;
    PlayCounts counts() const;

private:
    friend class World;
    explicit Play(std::unique_ptr<scene::Simulation> simulation);
    std::unique_ptr<scene::Simulation> simulation_;
    Result<void> make_step();
    std::vector<PlayEvent> events_;
    double ahead_ = 0, dropped_ = 0;  // seconds
    float between_ = 1;               // the step before … the last one
    struct Session;
    std::unique_ptr<Session> session_;  // of begin()
    Result<void> tell();                // the session's world
};

/// A physics engine that this build has; `why_not` says why it cannot run on this machine, empty when it can.
struct PhysicsBackend {
    std::string_view name, why_not;
};
/// The default first.
std::vector<PhysicsBackend> physics_backends();

/// Names and one-line descriptions of the scenes that come with Kiln.
std::vector<std::pair<std::string, std::string>> bundled_scenes();
/// Whether World::load() takes this for the name of a bundled scene: a word that no file here has for its name.
bool is_bundled_scene(const std::string& path_or_name);
/// How two scenes differ, by the ids of their edits (`kiln diff`): JSON, or lines for people.
struct SceneDifference {
    bool equal = true;
    std::string json, lines;
};
SceneDifference compare_scenes(const World& a, const World& b);
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
