// SPDX-License-Identifier: MIT
// Rigid bodies: one narrow interface, two engines behind it (bullet/, jolt/). What differs between them stays inside: centres of mass,
// contact threads, margins, sleeping rules. Metres, kilograms, seconds; +Y up.
//
// A body's frame is the caller's: its position and rotation are of that frame, velocities are of its centre of mass. Friction of a
// pair is the geometric mean, restitution and rolling friction (rolling.h) the larger of the two. Damping is a rate: velocity falls as
// exp(-damping · t). A body sleeps, on every engine, with all that it hangs together with, when each has kept its place for kStillSeconds.
#pragma once

#include "physics/convex.h"
#include "physics/ground_mesher.h"
#include "physics/pose.h"
#include "physics/rolling.h"
#include "physics/sdf_shape.h"

#include <kiln/edit.h>
#include <kiln/result.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace kiln::physics {

using BodyId = Id<struct BodyTag>;

enum class Motion : uint8_t { Static, Kinematic, Dynamic };

/// Triangles wound so that their normals point out; `solid` is what they are the surface of: fields meet it, and questions are answered from
/// it. Those of what moves must be closed: they say its mass (mesh_mass.h), and it collides as its solid, which is then SdfShape::moving().
struct Triangles {
    std::vector<vec3> vertices;
    std::vector<uint32_t> indices;  ///< three a triangle
    std::shared_ptr<const SdfShape> solid;
};

/// Exact convex shapes, a field, or triangles.
using BodyShape = std::variant<Convex, std::shared_ptr<const SdfShape>, std::shared_ptr<const Triangles>>;
/// The field, or what the triangles are the surface of; null for convex shapes.
const SdfShape* solid_of(const BodyShape& shape);

struct Surface {
    float friction = 0.5f, restitution = 0, rolling_friction = 0;
};

struct BodySettings {
    BodyShape shape = Convex{};
    Motion motion = Motion::Dynamic;
    Pose pose{};
    float density = 1000;  ///< kg/m³
    float friction = 0.5f, restitution = 0;
    std::vector<Surface> surfaces{};  ///< of a field, by the number of its material; empty: the two above everywhere
    float linear_damping = 0, angular_damping = 0;  ///< 1/s
    bool continuous = false;  ///< swept, so that it does not pass through what is thinner than its way in a step
    vec3 linear_velocity{}, angular_velocity{};
    /// Of static fields, metres: what is convex touches triangles of voxels of this size where the ground has settled (ground_mesher.h);
    /// 0: the field everywhere.
    float mesh_voxel = 0;
    /// Tangent of the slope on which a ball begins to roll; elsewhere it takes 5/7 of that times the load from a rolling ball.
    float rolling_friction = 0;
};

struct BodyState {
    Pose pose{};
    vec3 linear_velocity{}, angular_velocity{};
    bool asleep = false;
};

struct BodyHit {
    BodyId body;
    float fraction = 0;  ///< of the way
    vec3 position;       ///< where they touch
    vec3 normal;         ///< unit, out of the body that was hit
};

struct BodyContact {
    BodyId body;
    vec3 position;    ///< on the shape that was asked for
    vec3 normal;      ///< unit, out of the body
    float depth = 0;  ///< metres; negative where they are apart
};

/// Two bodies began to touch, or ceased to; a has the lower index.
struct ContactEvent {
    BodyId a, b;
    bool began = false;
    friend bool operator==(const ContactEvent&, const ContactEvent&) = default;
};

struct WorldSettings {
    vec3 gravity{0, -9.81f, 0};
    int threads = 1;  ///< engines that have no threads of their own use one
};

/// How long a body keeps its place, within kStillPlace and kStillTurn, before it sleeps.
inline constexpr float kStillSeconds = 1.5f, kStillPlace = 0.02f, kStillTurn = 0.03f;

/// A set of bodies. Everything is the owner's thread, except that the questions may be asked from any thread between steps.
/// Same input, same bytes, for any number of threads within one engine.
class World {
public:
    static constexpr uint32_t kMostBodies = 1u << 16;

    explicit World(vec3 gravity) : gravity_(gravity) {}
    virtual ~World() = default;
    World(const World&) = delete;
    World& operator=(const World&) = delete;
    virtual std::string_view backend() const = 0;

    /// Refused, with the reason: one more than kMostBodies, no volume, numbers that are not finite, a field without end that is to move, a mass
    /// that no engine can reckon with.
    Result<BodyId> add(const BodySettings& settings);
    void remove(BodyId id);
    bool contains(BodyId id) const { return find(id) != nullptr; }
    size_t body_count() const { return count_; }
    BodyState state(BodyId id) const;
    /// Mass and centre of mass in the body's frame; a mass of 0 for what has none.
    double mass(BodyId id) const { return mass_of(id).mass; }
    vec3 center_of_mass(BodyId id) const { return mass_of(id).center; }
    void set_pose(BodyId id, const Pose& pose);
    void set_velocity(BodyId id, vec3 linear, vec3 angular);
    /// Another field for a static body that has one, as edits make it. `changed` holds where in the world the two differ: what lies there
    /// wakes, and falls, or is pushed out, with the next step.
    void set_field(BodyId id, std::shared_ptr<const SdfShape> field, const Box3& changed);

    /// Another shape for a body, as cutting and building make it: mass, centre and moments are the new one's, and each of its points keeps
    /// its velocity. What touched it wakes.
    void set_shape(BodyId id, std::shared_ptr<const SdfShape> shape);
    /// As it was added, or changed since; null for none.
    const BodySettings* settings(BodyId id) const;

    /// Gravity acts, then contacts, then the bodies move, by `seconds` > 0. A body whose state is not finite afterwards goes back to where
    /// it was and rests; lost() counts them.
    void step(float seconds);
    int lost() const { return lost_; }

    /// Sleepers whose boxes meet this one wake, and what they touched is forgotten.
    virtual void wake(const Box3& box) = 0;
    /// Of the last step, by a, then b.
    std::span<const ContactEvent> events() const { return events_; }
    /// Pairs that touch, by a, then b: deepest point in metres (negative: apart within the margin).
    struct Touch {
        BodyId a, b;
        float depth = 0;
    };
    std::span<const Touch> touches() const { return touches_; }
    /// Where the two of a pair touch, as contacts are found: on one of them, with normals out of the other (`body`). For pictures.
    std::vector<BodyContact> touch_points(const Touch& touch) const;
    /// Null for a body that is no more. Of triangles that move: their solid, with the mass that they bound.
    const BodyShape* shape(BodyId id) const;

    /// First body on the way from `origin` to origin + way.
    std::optional<BodyHit> cast_ray(vec3 origin, vec3 way, BodyId but = {}) const;
    /// First body that `shape` meets on its way, not turning.
    std::optional<BodyHit> sweep(const Convex& shape, const Pose& pose, vec3 way, BodyId but = {}) const;
    /// Bodies that share a point with the shape, ascending.
    std::vector<BodyId> overlap(const Convex& shape, const Pose& pose) const;
    std::vector<BodyId> overlap(const SdfShape& shape, const Pose& pose) const;
    /// Where a shape would touch bodies, no farther apart than `margin`; by body, the deepest of each place first.
    std::vector<BodyContact> contacts(const Convex& shape, const Pose& pose, float margin, BodyId but = {}) const;
    /// Of the point of a body that is at p_world now.
    vec3 velocity_at(BodyId id, vec3 p_world) const;
    Motion motion(BodyId id) const;
    /// What this engine makes of meshed ground, on any thread.
    virtual GroundMesher::Build region_builder() const = 0;

protected:
    struct Body {
        BodySettings settings;
        MassProperties mass;  // zero for what does not move by itself
        Pose body_from_mass;  // centre of mass and principal axes
        Pose last;            // where it was last known to be, of its mass
        Support support;      // of the last step
        vec3 begun{};         // linear velocity with which it began the step
        std::unique_ptr<GroundMesher> mesher;
        uint32_t generation = 0;
        bool live = false;
    };
    const Body* find(BodyId id) const;
    /// At a point of the world. May be called while the engine steps.
    Surface surface(uint32_t index, vec3 p_world) const;
    static Surface of_pair(const Surface& a, const Surface& b);
    const std::vector<Body>& bodies() const { return bodies_; }

    // What an engine does. Frames are those of the mass (body_from_mass).
    virtual void create(uint32_t index, const Body& body) = 0;
    virtual void destroy(uint32_t index) = 0;
    virtual BodyState get(uint32_t index) const = 0;
    virtual void put(uint32_t index, const Pose& pose) = 0;
    virtual void push(uint32_t index, vec3 linear, vec3 angular) = 0;
    /// The same without waking it, or keeping it awake.
    virtual void guide(uint32_t index, vec3 linear, vec3 angular) = 0;
    virtual void swap(uint32_t index, std::shared_ptr<const SdfShape> field) = 0;
    virtual void advance(float seconds) = 0;
    /// Pairs of bodies that touch now, in any order, with the lower index first.
    struct Pair {
        uint32_t a, b;
        float depth;
        vec3 point{}, normal{};  // mean of where they touch, by load where the engine tells it; unit, from b to a
    };
    virtual void collect(std::vector<Pair>& pairs) const = 0;
    /// Bodies whose box meets this one, in any order.
    virtual void near(const Box3& box, std::vector<uint32_t>& out) const = 0;

private:
    const MassProperties& mass_of(BodyId id) const;
    void mesh_ground(float seconds);
    static bool resists_rolling(const Body& body);
    void resist_rolling(float seconds);
    void find_supports(float seconds);
    vec3 gravity_{};
    template <typename Ask>
    auto ask(uint32_t index, Ask&& ask_field) const;
    template <typename Ask>
    std::optional<BodyHit> first_hit(const Box3& box, BodyId but, Ask&& cast) const;
    BodyId id_of(uint32_t index) const { return {index, bodies_[index].generation}; }
    std::vector<Body> bodies_;
    std::vector<uint32_t> free_;
    std::vector<Touch> touches_, touches_before_;
    std::vector<ContactEvent> events_;
    std::vector<Pair> pairs_;
    struct Place {  // where a body lies on another
        uint32_t on, under;
        vec3 point, normal;  // normal: towards the body
        float friction, load = 0;
    };
    std::vector<Place> places_;
    size_t count_ = 0;
    int lost_ = 0;
    bool rolling_resisted_ = false;  // by something that was there in the last step
};

/// An engine that this build has; `why_not` says why this machine cannot run it, empty when it can.
struct Backend {
    std::string_view name;
    std::string_view why_not;
    std::unique_ptr<World> (*make)(const WorldSettings&);
};
/// The default first.
std::span<const Backend> backends();
/// By name, the default when empty. Errors name those that there are.
Result<std::unique_ptr<World>> make_world(std::string_view backend, const WorldSettings& settings);

}  // namespace kiln::physics
