// SPDX-License-Identifier: MIT

#include "physics/jolt/sdf_shape_jolt.h"

#include "physics/jolt/jolt_world.h"
#include "physics/sdf_collision.h"

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/JobSystemThreadPool.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/CollideShape.h>
#include <Jolt/Physics/Collision/CollisionCollectorImpl.h>
#include <Jolt/Physics/Collision/ContactListener.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/CylinderShape.h>
#include <Jolt/Physics/Collision/Shape/MeshShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include "base/assert.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

namespace kiln::physics {

namespace {

using namespace JPH;

constexpr uint kMostBodies = World::kMostBodies, kMostPairs = 1 << 16, kMostManifolds = 1 << 16;
constexpr uint kScratchBytes = 16 << 20;
constexpr int kManyCome = 512;  // bodies between two steps
// Iterations over the velocities of bodies that touch, as many for all that hang together. With 10, a stack of ten boxes sways more and
// more, with 21 at times, and with 20 it sinks by 6 mm: 10 are for bodies that do not touch two others that move. A tower of eleven rings,
// which lean and slide on each other so that few contacts begin with the impulse of the step before, sinks together and buckles with half of
// kFieldSteps; a ring alone lies on eight contacts where a box has four.
constexpr uint kVelocitySteps = 24, kAloneSteps = 10, kFieldSteps = 40, kAloneFieldSteps = 20;

// Jolt's registries are of the process: made once, never taken down.
void set_up() {
    static const bool done = [] {
        RegisterDefaultAllocator();
        Factory::sInstance = new Factory();
        RegisterTypes();
        JoltSdfShape::register_pairs();
        return true;
    }();
    (void)done;
}

// Two layers, of what stands and what moves: what stands meets only what moves.
constexpr ObjectLayer kStands = 0, kMoves = 1;
class Layers final : public BroadPhaseLayerInterface,
                     public ObjectVsBroadPhaseLayerFilter,
                     public ObjectLayerPairFilter {
public:
    uint GetNumBroadPhaseLayers() const override { return 2; }
    BroadPhaseLayer GetBroadPhaseLayer(ObjectLayer layer) const override {
        return BroadPhaseLayer(BroadPhaseLayer::Type(layer));
    }
#if defined(JPH_EXTERNAL_PROFILE) || defined(JPH_PROFILE_ENABLED)
    const char* GetBroadPhaseLayerName(BroadPhaseLayer) const override { return "layer"; }
#endif
    bool ShouldCollide(ObjectLayer a, BroadPhaseLayer b) const override {
        return a == kMoves || b == BroadPhaseLayer(kMoves);
    }
    bool ShouldCollide(ObjectLayer a, ObjectLayer b) const override { return a == kMoves || b == kMoves; }
};

Ref<JPH::Shape> make_shape(const Convex& c) {
    const float round = std::min(cDefaultConvexRadius, 0.1f * inner_radius(c));  // of edges
    switch (c.kind) {
    case Convex::Kind::Sphere:
        return new SphereShape(c.size.x);
    case Convex::Kind::Box:
        return new BoxShape(to_jolt(c.size), round);
    case Convex::Kind::Capsule:
        return new CapsuleShape(c.size.y, c.size.x);
    case Convex::Kind::Cylinder:
        return new CylinderShape(c.size.y, c.size.x, round);
    }
    return nullptr;
}

Ref<JPH::Shape> make_mesh(std::span<const vec3> points, std::span<const uint32_t> indices) {
    VertexList vertices;
    IndexedTriangleList triangles;
    for (const vec3 v : points) vertices.push_back({v.x, v.y, v.z});
    for (size_t i = 0; i < indices.size(); i += 3)
        triangles.push_back(IndexedTriangle(indices[i], indices[i + 1], indices[i + 2], 0));
    MeshShapeSettings settings(std::move(vertices), std::move(triangles));
    settings.mActiveEdgeCosThresholdAngle = -1;  // inner edges are found when bodies touch them (EIER, below)
    settings.mBuildQuality = MeshShapeSettings::EBuildQuality::FavorBuildSpeed;
    const JPH::Shape::ShapeResult made = settings.Create();
    if (made.HasError()) return nullptr;  // no triangle with an area
    return made.Get();
}

std::shared_ptr<const void> make_region(const RegionMesh& mesh) {
    if (mesh.own() == 0) return nullptr;
    const Ref<JPH::Shape> shape = make_mesh(mesh.vertices, mesh.indices);
    if (shape == nullptr || shape->GetSubShapeIDBitsRecursive() > kMeshBits) return nullptr;
    return std::shared_ptr<const void>(shape.GetPtr(), [keep = shape](const void*) {});
}

class JoltWorld final : public World, private ContactListener {
public:
    explicit JoltWorld(const WorldSettings& settings) : World(settings.gravity), scratch_(kScratchBytes) {
        if (settings.threads > 1) {
            jobs_ = std::make_unique<JobSystemThreadPool>(cMaxPhysicsJobs, cMaxPhysicsBarriers, settings.threads - 1);
        } else {
            jobs_ = std::make_unique<JobSystemSingleThreaded>(cMaxPhysicsJobs);
        }
        system_.Init(kMostBodies, 0, kMostPairs, kMostManifolds, layers_, layers_, layers_);
        system_.SetGravity(to_jolt(settings.gravity));
        system_.SetContactListener(this);
        system_.SetCombineFriction([](const JPH::Body& a, const SubShapeID&, const JPH::Body& b, const SubShapeID&) {
            return std::sqrt(a.GetFriction() * b.GetFriction());
        });
        system_.SetCombineRestitution([](const JPH::Body& a, const SubShapeID&, const JPH::Body& b, const SubShapeID&) {
            return std::max(a.GetRestitution(), b.GetRestitution());
        });
        // Shapes that are fields have nothing behind their surface that pushes out whole (a ring is entered as deep as it is thick): what
        // comes fast is met before it is there. All others keep to Jolt's own margin.
        system_.SetSimCollideBodyVsBody([this](const JPH::Body& a, const JPH::Body& b, Mat44Arg transform_a,
                                               Mat44Arg transform_b, CollideShapeSettings& how,
                                               CollideShapeCollector& collector, const ShapeFilter& filter) {
            const bool fields = a.GetShape()->GetSubType() == EShapeSubType::User1 &&
                                b.GetShape()->GetSubType() == EShapeSubType::User1;
            const auto turns = [](const JPH::Body& body) {
                return body.GetAngularVelocity().Length() * body.GetShape()->GetLocalBounds().GetExtent().Length();
            };
            const auto speed = [&] {
                return (a.GetLinearVelocity() - b.GetLinearVelocity()).Length() + turns(a) + turns(b);
            };
            how.mMaxSeparationDistance = fields ? reach_of(speed() * seconds_) : kMargin;
            PhysicsSystem::sDefaultSimCollideBodyVsBody(a, b, transform_a, transform_b, how, collector, filter);
        });
        PhysicsSettings physics;
        physics.mSpeculativeContactDistance = kMargin;  // how far boxes are looked for: more where fields move
        physics.mPenetrationSlop = 0.005f;
        physics.mMinVelocityForRestitution = 0.5f;  // as Bullet has it here
        physics.mNumVelocitySteps = kVelocitySteps;
        // Jolt asks whether three points of a body stay in balls of this radius: a swaying stack does, a box that starts down a slope does not.
        physics.mTimeBeforeSleep = kStillSeconds;
        physics.mPointVelocitySleepThreshold = kStillPlace / kStillSeconds;
        system_.SetPhysicsSettings(physics);
    }
    ~JoltWorld() override {
        for (uint32_t i = 0; i < objects_.size(); ++i)
            if (objects_[i]) take_out(i);
    }

    std::string_view backend() const override { return "jolt"; }

    void wake(const Box3& box) override {
        std::vector<uint32_t> found;
        near(box.inflated(0.1f), found);
        for (const uint32_t i : found) {
            if (bodies()[i].settings.motion == Motion::Static) continue;
            interface().InvalidateContactCache(objects_[i]->id);
            interface().ActivateBody(objects_[i]->id);
        }
    }

protected:
    void create(uint32_t index, const Body& b) override {
        if (index >= objects_.size()) objects_.resize(size_t(index) + 1);
        auto object = std::make_unique<Object>();
        if (const Convex* convex = std::get_if<Convex>(&b.settings.shape)) {
            object->convex = *convex;
            object->shape = make_shape(*convex);
            object->shape->SetUserData(reinterpret_cast<uint64>(&object->convex));
        } else if (const auto* sdf = std::get_if<std::shared_ptr<const SdfShape>>(&b.settings.shape)) {
            object->shape = new JoltSdfShape(*sdf);
        } else {
            object->triangles = std::get<std::shared_ptr<const Triangles>>(b.settings.shape);
            object->shape = make_mesh(object->triangles->vertices, object->triangles->indices);
            if (object->shape == nullptr) {
                object->shape = new JoltSdfShape(object->triangles->solid);
            } else {
                object->shape->SetUserData(reinterpret_cast<uint64>(object->triangles.get()));
            }
        }
        const bool fixed = b.settings.motion == Motion::Static, dynamic = b.settings.motion == Motion::Dynamic;
        BodyCreationSettings settings(object->shape, to_jolt(b.settings.pose.position),
                                      to_jolt(b.settings.pose.rotation).Normalized(),
                                      fixed     ? EMotionType::Static
                                      : dynamic ? EMotionType::Dynamic
                                                : EMotionType::Kinematic,
                                      fixed ? kStands : kMoves);
        settings.mUserData = index;
        settings.mEnhancedInternalEdgeRemoval = object->triangles != nullptr;
        settings.mUseManifoldReduction = !(b.settings.mesh_voxel > 0) &&
                                         (fixed || object->shape->GetSubType() != EShapeSubType::User1);  // see Places
        settings.mFriction = b.settings.friction;
        settings.mRestitution = b.settings.restitution;
        settings.mLinearDamping = settings.mAngularDamping = 0;
        settings.mApplyGyroscopicForce = true;
        settings.mMotionQuality = b.settings.continuous ? EMotionQuality::LinearCast : EMotionQuality::Discrete;
        settings.mMaxLinearVelocity = 1e4f;
        settings.mMaxAngularVelocity = 1e3f;
        settings.mLinearVelocity = to_jolt(b.settings.linear_velocity);
        settings.mAngularVelocity = to_jolt(b.settings.angular_velocity);
        if (dynamic) {
            // In the body's axes: R diag Rᵀ.
            const Mat44 axes = Mat44::sRotation(to_jolt(b.mass.axes).Normalized());
            const Vec3 moments(float(b.mass.moments.x), float(b.mass.moments.y), float(b.mass.moments.z));
            settings.mOverrideMassProperties = EOverrideMassProperties::MassAndInertiaProvided;
            settings.mMassPropertiesOverride.mMass = float(b.mass.mass);
            settings.mMassPropertiesOverride.mInertia =
                axes.Multiply3x3(Mat44::sScale(moments)).Multiply3x3RightTransposed(axes);
            settings.mMassPropertiesOverride.mInertia.SetColumn4(3, Vec4(0, 0, 0, 1));
        } else if (!fixed) {
            settings.mOverrideMassProperties = EOverrideMassProperties::MassAndInertiaProvided;
            settings.mMassPropertiesOverride.mMass = 1;
            settings.mMassPropertiesOverride.mInertia = Mat44::sIdentity();
        }
        object->id = interface().CreateAndAddBody(settings, fixed ? EActivation::DontActivate : EActivation::Activate);
        KILN_ASSERT(!object->id.IsInvalid(), "body {} of {}", index, kMostBodies);
        object->moving_field = dynamic && settings.GetShape()->GetSubType() == EShapeSubType::User1;
        look_for_fields(object->moving_field ? 1 : 0);
        object->damped = dynamic && (b.settings.linear_damping > 0 || b.settings.angular_damping > 0);
        objects_[index] = std::move(object);
        damped_for_ = 0;
        ++came_;
    }

    void destroy(uint32_t index) override {
        const AABox box = interface().GetTransformedShape(objects_[index]->id).GetWorldSpaceBounds();
        take_out(index);
        wake({to_vec(box.mMin), to_vec(box.mMax)});
    }

    BodyState get(uint32_t index) const override {
        const BodyInterface& bodies_interface = system_.GetBodyInterfaceNoLock();
        const BodyID id = objects_[index]->id;
        BodyState out;
        RVec3 position;
        Quat rotation;
        bodies_interface.GetPositionAndRotation(id, position, rotation);
        out.pose = Pose{to_vec(position), to_quat(rotation)} * bodies()[index].body_from_mass;
        Vec3 linear, angular;
        bodies_interface.GetLinearAndAngularVelocity(id, linear, angular);
        out.linear_velocity = to_vec(linear);
        out.angular_velocity = to_vec(angular);
        out.asleep = bodies()[index].settings.motion == Motion::Dynamic && !bodies_interface.IsActive(id);
        return out;
    }

    void put(uint32_t index, const Pose& mass_pose) override {
        const bool fixed = bodies()[index].settings.motion == Motion::Static;
        const BodyID id = objects_[index]->id;
        const AABox before = interface().GetTransformedShape(id).GetWorldSpaceBounds();
        const Pose pose = mass_pose * inverse(bodies()[index].body_from_mass);
        interface().SetPositionAndRotation(id, to_jolt(pose.position), to_jolt(pose.rotation).Normalized(),
                                           fixed ? EActivation::DontActivate : EActivation::Activate);
        if (!fixed) return;
        const AABox after = interface().GetTransformedShape(id).GetWorldSpaceBounds();
        wake({to_vec(before.mMin), to_vec(before.mMax)});
        wake({to_vec(after.mMin), to_vec(after.mMax)});
    }

    void push(uint32_t index, vec3 linear, vec3 angular) override {
        if (bodies()[index].settings.motion == Motion::Static) return;
        interface().SetLinearAndAngularVelocity(objects_[index]->id, to_jolt(linear), to_jolt(angular));
        interface().ActivateBody(objects_[index]->id);
    }

    void guide(uint32_t index, vec3 linear, vec3 angular) override {
        interface().SetLinearAndAngularVelocity(objects_[index]->id, to_jolt(linear), to_jolt(angular));
    }

    void swap(uint32_t index, std::shared_ptr<const SdfShape> field) override {
        auto& shape = static_cast<JoltSdfShape&>(*objects_[index]->shape);
        const bool same = shape.sdf().bounds() == field->bounds();
        shape.set(std::move(field));
        if (same) return;
        interface().NotifyShapeChanged(objects_[index]->id, shape.GetCenterOfMass(), false, EActivation::DontActivate);
    }

    void advance(float seconds) override {
        if (seconds != damped_for_) {
            // Jolt multiplies by 1 - damping · t, for which exp(-damping · t) is meant here.
            for (uint32_t i = 0; i < objects_.size(); ++i) {
                if (!objects_[i] || !objects_[i]->damped) continue;
                const BodyLockWrite lock(system_.GetBodyLockInterfaceNoLock(), objects_[i]->id);
                MotionProperties& motion = *lock.GetBody().GetMotionProperties();
                const BodySettings& s = bodies()[i].settings;
                motion.SetLinearDamping((1 - std::exp(-s.linear_damping * seconds)) / seconds);
                motion.SetAngularDamping((1 - std::exp(-s.angular_damping * seconds)) / seconds);
            }
            damped_for_ = seconds;
        }
        std::vector<Pair> before;
        {
            const std::lock_guard lock(mutex_);
            before.swap(touching_);
        }
        find_the_alone(before);
        // Bodies that come one by one make a broad phase that looks at all pairs of them, once; a tree of all is made before.
        if (std::exchange(came_, 0) >= kManyCome) system_.OptimizeBroadPhase();
        seconds_ = seconds;
        step_begins();
        (void)system_.Update(seconds, 1, &scratch_, jobs_.get());  // an overflow of pairs loses contacts, not bodies
        step_ended();
        // Sleepers say nothing; they still touch what they touched.
        const BodyInterface& bodies_interface = system_.GetBodyInterfaceNoLock();
        const auto rests = [&](uint32_t i) { return objects_[i] && !bodies_interface.IsActive(objects_[i]->id); };
        const std::lock_guard lock(mutex_);
        for (const Pair& p : before)
            if (rests(p.a) && rests(p.b)) touching_.push_back(p);
    }

    GroundMesher::Build region_builder() const override { return make_region; }

    void collect(std::vector<Pair>& pairs) const override {
        const std::lock_guard lock(mutex_);
        pairs = touching_;
    }

    void near(const Box3& box, std::vector<uint32_t>& out) const override {
        AllHitCollisionCollector<CollideShapeBodyCollector> hits;
        system_.GetBroadPhaseQuery().CollideAABox({to_jolt(box.min), to_jolt(box.max)}, hits);
        for (const BodyID id : hits.mHits) out.push_back(uint32_t(system_.GetBodyInterfaceNoLock().GetUserData(id)));
    }

private:
    struct Object {
        Convex convex;
        std::shared_ptr<const Triangles> triangles;
        Ref<JPH::Shape> shape;
        BodyID id;
        bool damped = false, stepped = false, moving_field = false;
        uint velocity_steps = 0;  // none of its own
    };

    // Between steps nobody else has the bodies.
    BodyInterface& interface() { return system_.GetBodyInterfaceNoLock(); }
    void look_for_fields(int more) {
        moving_fields_ += more;
        PhysicsSettings physics = system_.GetPhysicsSettings();
        const float wanted = moving_fields_ > 0 ? kMostReach : kMargin;
        if (physics.mSpeculativeContactDistance == wanted) return;
        physics.mSpeculativeContactDistance = wanted;
        system_.SetPhysicsSettings(physics);
    }
    void take_out(uint32_t index) {
        look_for_fields(objects_[index]->moving_field ? -1 : 0);
        interface().RemoveBody(objects_[index]->id);
        interface().DestroyBody(objects_[index]->id);
        objects_[index].reset();
        const std::lock_guard lock(mutex_);
        std::erase_if(touching_, [&](const Pair& p) { return p.a == index || p.b == index; });
    }

    // By whom each touched in the last step.
    void find_the_alone(const std::vector<Pair>& touching) {
        moving_neighbours_.assign(objects_.size(), 0);
        const auto moves = [&](uint32_t i) { return bodies()[i].settings.motion == Motion::Dynamic; };
        for (const Pair& p : touching) {
            if (!moves(p.a) || !moves(p.b)) continue;
            ++moving_neighbours_[p.a];
            ++moving_neighbours_[p.b];
        }
        for (uint32_t i = 0; i < objects_.size(); ++i) {
            if (!objects_[i] || !moves(i)) continue;
            // Not in its first step: then nobody knows yet.
            Object& o = *objects_[i];
            const bool alone = moving_neighbours_[i] < 2 && o.stepped;
            const uint steps = o.moving_field ? (alone ? kAloneFieldSteps : kFieldSteps) : alone ? kAloneSteps : 0;
            o.stepped = true;
            if (o.velocity_steps == steps) continue;
            o.velocity_steps = steps;
            const BodyLockWrite lock(system_.GetBodyLockInterfaceNoLock(), o.id);
            lock.GetBody().GetMotionProperties()->SetNumVelocityStepsOverride(steps);
        }
    }

    // Called from Jolt's threads while it steps; what they say is sorted by World::step.
    void note(const JPH::Body& body1, const JPH::Body& body2, const ContactManifold& manifold) {
        const uint32_t a = uint32_t(body1.GetUserData()), b = uint32_t(body2.GetUserData());
        const auto& points = manifold.mRelativeContactPointsOn1;
        Vec3 middle = Vec3::sZero();
        for (const Vec3 p : points) middle += p;
        middle = Vec3(manifold.mBaseOffset) + middle / float(std::max<uint>(points.size(), 1));
        const vec3 normal = to_vec(manifold.mWorldSpaceNormal);  // from 1 to 2
        const std::lock_guard lock(mutex_);
        touching_.push_back(
            {std::min(a, b), std::max(a, b), manifold.mPenetrationDepth, to_vec(middle), a < b ? -normal : normal});
    }
    // Of a contact with a body that is not the same all over. Called while Jolt steps, when no body moves.
    void give_surface(const JPH::Body& body1, const JPH::Body& body2, const ContactManifold& m,
                      ContactSettings& settings) const {
        const uint32_t a = uint32_t(body1.GetUserData()), b = uint32_t(body2.GetUserData());
        if (bodies()[a].settings.surfaces.empty() && bodies()[b].settings.surfaces.empty()) return;
        const Surface s = of_pair(surface(a, to_vec(m.GetWorldSpaceContactPointOn1(0))),
                                  surface(b, to_vec(m.GetWorldSpaceContactPointOn2(0))));
        settings.mCombinedFriction = s.friction;
        settings.mCombinedRestitution = s.restitution;
    }
    void OnContactAdded(const JPH::Body& a, const JPH::Body& b, const ContactManifold& m, ContactSettings& s) override {
        const CallInStep call;
        give_surface(a, b, m, s);
        note(a, b, m);
    }
    void OnContactPersisted(const JPH::Body& a, const JPH::Body& b, const ContactManifold& m,
                            ContactSettings& s) override {
        const CallInStep call;
        give_surface(a, b, m, s);
        note(a, b, m);
    }

    Layers layers_;
    TempAllocatorImplWithMallocFallback scratch_;
    PhysicsSystem system_;
    std::unique_ptr<JobSystem> jobs_;  // its threads end before what they worked on
    std::vector<std::unique_ptr<Object>> objects_;
    mutable std::mutex mutex_;  // of touching_
    std::vector<Pair> touching_;
    std::vector<int> moving_neighbours_;  // by index; a pair that touches at several places counts as often
    int moving_fields_ = 0;
    int came_ = 0;          // since the last step
    float damped_for_ = 0;  // the step that dampings are set for
    float seconds_ = 0;     // of the step that is under way
};

}  // namespace

std::unique_ptr<World> make_jolt_world(const WorldSettings& settings) {
    set_up();
    return std::make_unique<JoltWorld>(settings);
}

}  // namespace kiln::physics
