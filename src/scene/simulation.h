// SPDX-License-Identifier: MIT
// Simulation: a scene's bodies, run from their start. The ground is the world's list without the edits of bodies, read from host bricks
// near what moves; commands with times change a copy of the world on the way, and what they cut loose becomes a body, which settles back
// into the ground where it has slept for a while. The order of a step: commands, ground and loose parts, physics, triggers.
#pragma once

#include "field/brick_field.h"
#include "field/loose.h"
#include "physics/character.h"
#include "physics/physics.h"
#include "physics/triggers.h"
#include "scene/world_impl.h"

#include <kiln/world.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

namespace kiln::scene {

class Simulation {
public:
    /// `start` stays as it is and must outlive the simulation.
    static Result<std::unique_ptr<Simulation>> make(const World& start, const SimulateSettings& settings) {
        return make(start, settings, nullptr);
    }
    /// From the start again, by what an old one, which is at its end then, made of it at first. The same steps to the bit.
    static Result<std::unique_ptr<Simulation>> again(Simulation& old) { return make(old.start_, old.settings_, &old); }

    /// Commands whose time has come, then one fixed step.
    Result<void> step();
    /// A command, {"add": EDIT} and the like, whose change comes before the next step; refused, it changes nothing.
    Result<void> command_now(const std::string& command, const std::string& name);
    /// Makes another world, as it was at the start, what this one has become: commands, what came loose, and where that is and bodies are.
    /// One step.
    Result<void> keep(World& world) const;
    /// The commands that have led from the start to the ground and the parts of now, in order; it grows.
    const std::vector<std::string>& made() const { return made_; }
    /// Makes what moves in a world that has taken all of them start where it is now, as fast as it is now (simulation_keep.cpp).
    Result<void> keep_motion(World& world) const;
    /// Parts too small to be bodies that have come loose; pictures show them fall.
    int crumbs() const { return crumb_count_; }
    /// The world with its bodies between where they were before the last step (0) and where they are (1).
    Result<Frame> frame(const Camera& camera, float between, const PlayLines& lines, const FrameBudget& budget = {});

    // For whoever plays (simulation_launch.cpp).
    Result<void> launch(Edit edit, vec3 velocity);
    Result<RayHit> cast(const Ray& ray);
    Result<PlayHit> pick(const Ray& ray);
    Result<void> enter(vec3 feet);
    void wish(vec3 velocity, float jump);
    void leave();
    std::optional<PlayWalker> visitor(float between) const;
    PlayCounts counts() const;

    const physics::World& world() const { return *world_; }
    int64_t steps() const { return steps_; }
    double time() const { return double(steps_) * double(seconds_); }
    double step_seconds() const { return double(seconds_); }

    /// Bodies of the scene in its order, then parts in the order they came loose.
    struct Member {
        std::string id;
        physics::BodyId body;
        physics::MassProperties mass{};
        std::string edit{};      ///< by which the live world moves it; empty: by none
        physics::Pose before{};  ///< the last step
        std::optional<physics::BodyState>
            rest{};                 ///< of a part that has settled back into the world: it is no body any more
        std::vector<Edit> edits{};  ///< its shape, in its frame
        physics::Pose began{};      ///< the pose at which the world has its edits
        bool gone = false;          ///< nothing is left of it
        int cuts = 0;               ///< objects that it was given
    };
    const std::vector<Member>& members() const { return members_; }
    physics::BodyState state(const Member& m) const { return m.rest ? *m.rest : world_->state(m.body); }

    struct Walker {
        std::string id;
        physics::Character character;
        const SceneCharacter* of;  ///< of the start's
        size_t next = 0;           ///< wish
        vec3 walk{};               ///< m/s
        vec3 before{};             ///< of its centre, the last step
        std::string shown{};       ///< edit of the live world that pictures show it as
    };
    const std::vector<Walker>& walkers() const { return walkers_; }
    /// Of a body or a character.
    std::string name_of(physics::BodyId id) const;

    /// Of the last step: contacts that began or ended, then who entered or left triggers.
    const std::vector<PlayEvent>& events() const { return events_; }

private:
    Simulation(const World& start, const SimulateSettings& settings) : start_(start), settings_(settings) {}
    static Result<std::unique_ptr<Simulation>> make(const World& start, const SimulateSettings& settings,
                                                    Simulation* old);
    /// Takes the live world of another one, as it was at the start.
    Result<void> take_live(Simulation& old);
    void fit_field();
    Result<void> add_bodies(const Simulation* old);
    Result<physics::BodySettings> settings_of(const SceneBody& body, const std::vector<Edit>& edits);
    std::vector<SceneMesh> meshes_now() const;
    std::vector<SceneBody> bodies_now() const;
    std::vector<SceneCharacter> characters_now() const;
    Result<Edit> edit_of_mesh(const SceneBody& body) const;
    Result<void> check_closed(const SceneBody& body, const Edit& edit) const;
    Result<void> add_triggers();
    Result<void> add_characters();
    Result<void> show_characters();
    void walk();
    Result<World*> live();
    void move_meshes(Frame& frame, float between);
    /// The name of a body's edit that is not what it was at the start; commands must leave those alone.
    std::optional<std::string> changed_body() const;
    Result<void> apply_commands();
    Result<void> change_ground();
    /// Where a part is cut from: the list of what is around it, and how that moves.
    struct Source {
        std::span<const Edit* const> edits;
        physics::Pose frame{};
        vec3 velocity{}, spin{}, about{};  // of the place `about`, world
        physics::BodyId body{};            // none: the ground
    };
    /// Makes it a body; nothing where it has no volume.
    Result<bool> cut_loose(const field::LoosePart& part, const Source& from);
    /// Takes its region from the ground.
    Result<void> cut_from_ground(const field::LoosePart& part, const std::string& name);

    // Edits that act on bodies (simulation_bodies.cpp).
    struct Aimed {
        std::string text, target;  // the command without its target; empty: the world
    };
    static Result<Aimed> aim(const std::string& text, const std::string& name);
    struct Recut {
        size_t member = 0;
        std::vector<Edit> edits{};
        std::shared_ptr<const field::ProgramField> before{}, after{};
        Box3 changed{};  // in its frame
    };
    Result<std::vector<Recut>> recut(const Edit& edit, const std::string& target, const std::string& name);
    Result<Recut> recut(size_t member, const Edit& edit);
    Result<void> reshape(Recut cut);
    std::vector<std::string> edits_of(const Member& m) const;
    bool is_body(std::string_view id) const;
    Result<void> change_own(const std::string& name, const Edit& edit);
    Result<void> hide(const Member& m);
    Result<void> show(Member& m);
    Result<void> hide_mesh(const Member& m);
    Result<void> show_instead_of_mesh(Member& m, const std::string& object_name);
    /// A command for the world, for bodies or for both; `apply` gives the world its part.
    Result<void> obey(const std::string& text, const std::string& name,
                      const std::function<Result<void>(World&, const std::string&)>& apply);

    struct Crumb {
        vec3 position, before, velocity;
        float radius;
        vec3 color;
        int64_t since;
    };
    static constexpr size_t kCrumbPoints = 8;  // parts of fewer lattice points are crumbs
    static constexpr float kCrumbSeconds = 3;  // … and are seen for so long at most
    void scatter(const field::LoosePart& part, const physics::Pose& frame, uint32_t material);
    void drop_crumbs();
    Result<void> settle_parts();
    /// A change of the live world, which keep() tells.
    Result<void> change(const CommandView& command);
    /// The ground is what the live world has now; it differs from what was there in `changed`.
    Result<void> set_ground(const Box3& changed);
    std::shared_ptr<const physics::SdfShape> ground_shape(const Box3& changed);
    Result<void> add(const physics::BodySettings& body, std::string_view name);
    std::optional<physics::MassProperties> exact_mass(const Edit& mesh) const;
    Error fault(JsonIndex place, const std::string& id, const std::string& message) const;

    const World& start_;
    const SimulateSettings settings_;
    // What the start was made into, for whoever begins there again.
    struct Beginning {
        std::shared_ptr<const field::ProgramField> ground{};
        std::shared_ptr<const field::BrickField> bricks{};
        std::vector<physics::BodySettings> bodies{};
        uint64_t live_names = 0;
    } beginning_;
    std::unique_ptr<physics::World> world_;
    physics::Triggers triggers_;
    std::vector<std::string> trigger_names_;  // by index
    std::unordered_set<std::string> owned_;   // edits of bodies, of parts that are loose and of characters
    std::vector<Member> members_;
    std::vector<Walker> walkers_;
    std::map<physics::BodyId, std::string> names_;  // also of those that are no more
    std::vector<PlayEvent> events_;
    float seconds_ = 0;
    int64_t steps_ = 0;

    // The ground.
    std::vector<Edit> edits_;
    std::shared_ptr<const field::ProgramField> ground_;
    std::shared_ptr<const field::BrickField> bricks_;
    std::optional<physics::BodyId> ground_body_;
    float voxel_size_ = 0, near_ = 0;  // metres
    float mesh_voxel_ = 0;             // metres; 0: bodies touch the field
    struct Part {
        size_t member;
        Edit placed;     // of the live world
        Box3 own;        // in its frame
        int asleep = 0;  // steps
    };
    std::vector<Part> loose_;  // those that have not settled
    int parts_ = 0, launched_ = 0;

    // Who plays, while they walk in it.
    struct Visitor {
        physics::Character character;
        vec3 walk{};     // m/s
        float jump = 0;  // with the next step
        vec3 before{};   // of its centre, the last step
    };
    std::optional<Visitor> visitor_;

    // Commands.
    std::vector<TimedCommand> commands_;
    size_t done_ = 0;
    bool changed_ = false;           // live_, since the ground was made from it
    std::vector<std::string> made_;  // of live_, in order
    std::optional<World> live_;  // the world as they change it, and as pictures see it; made when it is first needed
    std::vector<Transform> meshes_shown_;  // by SceneData::meshes, in the last frame
    double time_shown_ = 0;
    std::map<std::string, Edit> own_;  // edits of bodies as cuts have left them
    std::vector<Crumb> crumbs_;
    int crumb_count_ = 0;
};

}  // namespace kiln::scene
