// SPDX-License-Identifier: MIT

#include "physics/bullet/bullet_world.h"

#include "physics/bullet/contact_solver.h"
#include "physics/bullet/islands.h"
#include "physics/bullet/region_edges.h"
#include "physics/bullet/sdf_algorithm.h"
#include "physics/sdf_collision.h"

#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>

namespace kiln::physics {

namespace {

// Bullet asks for speeds below a threshold for a while. The world here says who has kept its place, as Jolt does (what starts to slide,
// however slowly, has left it), or has been slower than this for a second: a capsule that nothing keeps from rolling. So the while is
// none, and the threshold is nothing, or more than anything that keeps its place has.
constexpr float kAtOnce = 1e-6f, kNeverSleeps = 0, kSleeps = 1e3f, kSlow = 0.02f, kSlowSeconds = 1;

// A body moves this share of its inner radius in a step before it is swept, if it is continuous.
constexpr float kSweepShare = 0.5f;

btScalar geometric_mean(const btCollisionObject* a, const btCollisionObject* b) {
    return std::sqrt(a->getFriction() * b->getFriction());
}
btScalar larger(const btCollisionObject* a, const btCollisionObject* b) {
    return std::max(a->getRestitution(), b->getRestitution());
}

bool contact_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                   const btCollisionObjectWrapper* b, int, int);

// Bullet's globals, the same for every world here.
void set_globals() {
    gCalculateCombinedFrictionCallback = geometric_mean;
    gCalculateCombinedRestitutionCallback = larger;
    gDeactivationTime = kAtOnce;
    gContactAddedCallback = contact_added;
}

class Configuration final : public btDefaultCollisionConfiguration {
public:
    Configuration() : btDefaultCollisionConfiguration(info()) {}

private:
    static btDefaultCollisionConstructionInfo info() {
        btDefaultCollisionConstructionInfo out;
        out.m_customCollisionAlgorithmMaxElementSize = 224;  // of the pool that algorithms come from
        return out;
    }
};

std::unique_ptr<btCollisionShape> make_shape(const Convex& c) {
    std::unique_ptr<btCollisionShape> out;
    switch (c.kind) {
    case Convex::Kind::Sphere:
        out = std::make_unique<btSphereShape>(c.size.x);
        break;
    case Convex::Kind::Box:
        out = std::make_unique<btBoxShape>(to_bullet(c.size));
        break;
    case Convex::Kind::Capsule:
        out = std::make_unique<btCapsuleShape>(c.size.x, 2 * c.size.y);
        break;
    case Convex::Kind::Cylinder:
        out = std::make_unique<btCylinderShape>(btVector3(c.size.x, c.size.y, c.size.x));
        break;
    }
    // Boxes and cylinders have their margin inside; small ones a small one. Spheres and capsules are their margin.
    if (c.kind == Convex::Kind::Box || c.kind == Convex::Kind::Cylinder)
        out->setMargin(std::min(0.04f, 0.1f * inner_radius(c)));
    return out;
}

// Triangles as Bullet wants them: the arrays stay ours, the tree and the angles at its edges are Bullet's.
struct BulletMesh {
    explicit BulletMesh(std::shared_ptr<const Triangles> given) : triangles(std::move(given)) {
        btIndexedMesh part;
        part.m_numTriangles = int(triangles->indices.size() / 3);
        part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(triangles->indices.data());
        part.m_triangleIndexStride = 3 * int(sizeof(uint32_t));
        part.m_numVertices = int(triangles->vertices.size());
        part.m_vertexBase = reinterpret_cast<const unsigned char*>(triangles->vertices.data());
        part.m_vertexStride = int(sizeof(vec3));
        array.addIndexedMesh(part, PHY_INTEGER);
    }
    std::unique_ptr<btCollisionShape> shape() {
        auto out = std::make_unique<btBvhTriangleMeshShape>(&array, true);
        out->setMargin(0);
        out->setUserPointer(const_cast<Triangles*>(triangles.get()));
        btGenerateInternalEdgeInfo(out.get(), &edges);
        return out;
    }
    std::shared_ptr<const Triangles> triangles;
    btTriangleIndexVertexArray array;
    btTriangleInfoMap edges;
};

class BulletWorld;

// Whether a plane across the line between their middles has all of one convex body on one side and all of the other beyond, with more than
// `margin` between them. Of the pairs whose boxes meet in a heap this is so for most.
bool apart(const btCollisionObject& a, const btCollisionObject& b, float margin) {
    const btTransform &at_a = a.getWorldTransform(), &at_b = b.getWorldTransform();
    const btVector3 between = at_b.getOrigin() - at_a.getOrigin();
    const float distance = between.length();
    if (!(distance > margin)) return false;
    const btVector3 way = between / distance;
    const auto reaches = [&](const btCollisionObject& o, const btTransform& at) {
        return reach(convex_of(o.getCollisionShape()), to_vec(way * at.getBasis()));
    };
    return distance - reaches(a, at_a) > margin + reaches(b, at_b);
}

// Bullet's world, which asks ours before it moves the bodies, with islands and a solver of our own.
class Dynamics final : public btDiscreteDynamicsWorld {
public:
    Dynamics(BulletWorld& owner, btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
             btCollisionConfiguration* configuration)
        : btDiscreteDynamicsWorld(dispatcher, broadphase, nullptr, configuration), owner_(owner) {}

protected:
    void integrateTransforms(btScalar seconds) override;
    void calculateSimulationIslands() override {}
    void solveConstraints(btContactSolverInfo& settings) override {
        if (m_nonStaticRigidBodies.size() == 0) return;
        islands_.find({&m_nonStaticRigidBodies[0], size_t(m_nonStaticRigidBodies.size())}, *getDispatcher());
        solver_.gravity = getGravity();
        for (size_t i = 0; i < islands_.count(); ++i)
            solver_.solve(islands_.bodies(i), islands_.manifolds(i), settings.m_timeStep);
    }

private:
    BulletWorld& owner_;
    Islands islands_;
    ContactSolver solver_;
};

class BulletWorld final : public World {
public:
    explicit BulletWorld(const WorldSettings& settings) : World(settings.gravity) {
        set_globals();
        dispatcher_.setDispatcherFlags(0);  // touch within kMargin, whatever their size
        dispatcher_.setNearCallback(look);
        dynamics_.setGravity(to_bullet(settings.gravity));
        dynamics_.setForceUpdateAllAabbs(false);
    }
    ~BulletWorld() override {
        for (auto& o : objects_)
            if (o) dynamics_.removeRigidBody(o->body.get());
    }

    std::string_view backend() const override { return "bullet"; }

    // Of a contact with a body that is not the same all over.
    void give_surface(btManifoldPoint& point, const btCollisionObject& a, const btCollisionObject& b) const {
        const Surface s = of_pair(surface(uint32_t(a.getUserIndex()), to_vec(point.getPositionWorldOnA())),
                                  surface(uint32_t(b.getUserIndex()), to_vec(point.getPositionWorldOnB())));
        point.m_combinedFriction = s.friction;
        point.m_combinedRestitution = s.restitution;
    }

    void wake(const Box3& box) override {
        std::vector<uint32_t> found;
        near(box.inflated(0.1f), found);
        std::erase_if(found, [&](uint32_t i) { return objects_[i]->body->isStaticObject(); });
        std::vector<bool> woken(objects_.size());
        for (const uint32_t i : found) {
            woken[i] = true;
            stir(*objects_[i]);
            objects_[i]->body->activate(true);
        }
        for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
            btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(m);
            if (woken[size_t(manifold->getBody0()->getUserIndex())] ||
                woken[size_t(manifold->getBody1()->getUserIndex())])
                manifold->clearManifold();
        }
    }

protected:
    void create(uint32_t index, const Body& b) override {
        if (index >= objects_.size()) objects_.resize(size_t(index) + 1);
        auto object = std::make_unique<Object>();
        if (const Convex* convex = std::get_if<Convex>(&b.settings.shape)) {
            object->convex = *convex;
            object->shape = make_shape(*convex);
            object->shape->setUserPointer(&object->convex);
            object->inner_radius = inner_radius(*convex);
        } else if (const auto* sdf = std::get_if<std::shared_ptr<const SdfShape>>(&b.settings.shape)) {
            object->shape = std::make_unique<BulletSdfShape>(*sdf, b.body_from_mass);
            object->inner_radius = float((*sdf)->inner_radius());
        } else {
            object->mesh = std::make_unique<BulletMesh>(std::get<std::shared_ptr<const Triangles>>(b.settings.shape));
            object->shape = object->mesh->shape();
        }
        const bool dynamic = b.settings.motion == Motion::Dynamic;
        const btVector3 inertia{float(b.mass.moments.x), float(b.mass.moments.y), float(b.mass.moments.z)};
        const btTransform at = to_bullet(b.settings.pose * b.body_from_mass);
        btRigidBody::btRigidBodyConstructionInfo info(dynamic ? float(b.mass.mass) : 0, nullptr, object->shape.get(),
                                                      dynamic ? inertia : btVector3(0, 0, 0));
        info.m_startWorldTransform = at;
        info.m_friction = b.settings.friction;
        info.m_restitution = b.settings.restitution;
        // Bullet multiplies the velocity by (1 - damping)^t.
        info.m_linearDamping = 1 - std::exp(-b.settings.linear_damping);
        info.m_angularDamping = 1 - std::exp(-b.settings.angular_damping);
        object->body = std::make_unique<btRigidBody>(info);
        object->body->setUserIndex(int(index));
        object->body->setUserPointer(this);
        if (!b.settings.surfaces.empty() || object->mesh != nullptr || b.settings.mesh_voxel > 0)
            object->body->setCollisionFlags(object->body->getCollisionFlags() |
                                            btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        object->continuous = dynamic && b.settings.continuous;
        if (b.settings.motion == Motion::Kinematic) {
            const int flags = object->body->getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT;
            object->body->setCollisionFlags(flags | btCollisionObject::CF_KINEMATIC_OBJECT);
            object->body->setActivationState(DISABLE_DEACTIVATION);
        }
        object->body->setLinearVelocity(to_bullet(b.settings.linear_velocity));
        object->body->setAngularVelocity(to_bullet(b.settings.angular_velocity));
        dynamics_.addRigidBody(object->body.get());
        object->anchor = to_pose(at);
        set_sleep(*object, false);
        objects_[index] = std::move(object);
    }

    void destroy(uint32_t index) override {
        Object& o = *objects_[index];
        btVector3 low, high;
        o.body->getAabb(low, high);
        dynamics_.removeRigidBody(o.body.get());
        objects_[index].reset();
        wake({to_vec(low), to_vec(high)});
    }

    BodyState get(uint32_t index) const override {
        const btRigidBody& b = *objects_[index]->body;
        return {to_pose(b.getWorldTransform()), to_vec(b.getLinearVelocity()), to_vec(b.getAngularVelocity()),
                !b.isStaticOrKinematicObject() && !b.isActive()};
    }

    void put(uint32_t index, const Pose& pose) override {
        btRigidBody& b = *objects_[index]->body;
        b.setWorldTransform(to_bullet(pose));
        b.setInterpolationWorldTransform(b.getWorldTransform());
        stir(*objects_[index]);
        if (!b.isStaticObject()) b.activate(true);
        dynamics_.updateSingleAabb(&b);
        if (!b.isStaticObject()) return;
        btVector3 low, high;
        b.getAabb(low, high);
        wake({to_vec(low), to_vec(high)});
    }

    void push(uint32_t index, vec3 linear, vec3 angular) override {
        btRigidBody& b = *objects_[index]->body;
        if (b.isStaticObject()) return;
        b.setLinearVelocity(to_bullet(linear));
        b.setAngularVelocity(to_bullet(angular));
        b.activate(true);
    }

    void guide(uint32_t index, vec3 linear, vec3 angular) override {
        objects_[index]->body->setLinearVelocity(to_bullet(linear));
        objects_[index]->body->setAngularVelocity(to_bullet(angular));
    }

    void swap(uint32_t index, std::shared_ptr<const SdfShape> field) override {
        static_cast<BulletSdfShape&>(*objects_[index]->shape).set(std::move(field));
        dynamics_.updateSingleAabb(objects_[index]->body.get());
    }

    void advance(float seconds) override {
        for (auto& o : objects_) {
            if (!o || !o->body->isKinematicObject()) continue;
            // Bullet leaves it to us to move these, and asks for their velocities when it solves.
            btTransform next;
            btTransformUtil::integrateTransform(o->body->getWorldTransform(), o->body->getLinearVelocity(),
                                                o->body->getAngularVelocity(), seconds, next);
            o->body->setWorldTransform(next);
        }
        dynamics_.stepSimulation(seconds, 0);
        for (auto& o : objects_) {
            if (!o || o->body->isStaticOrKinematicObject()) continue;
            if (o->body->isActive()) {
                watch(*o, seconds);
            } else {
                stir(*o);  // what is woken by others waits anew
            }
        }
    }

    GroundMesher::Build region_builder() const override {
        return [](const RegionMesh& mesh) -> std::shared_ptr<const void> {
            return std::make_shared<const RegionEdges>(mesh);
        };
    }

    void collect(std::vector<Pair>& pairs) const override {
        for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
            const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
            if (manifold.getNumContacts() == 0) continue;
            const uint32_t a = uint32_t(manifold.getBody0()->getUserIndex()),
                           b = uint32_t(manifold.getBody1()->getUserIndex());
            // By what each point carries; alike where none carries anything.
            float depth = -1e30f, load = 0;
            for (int i = 0; i < manifold.getNumContacts(); ++i) load += manifold.getContactPoint(i).m_appliedImpulse;
            vec3 point{}, normal{};  // from body 1 to body 0
            for (int i = 0; i < manifold.getNumContacts(); ++i) {
                const btManifoldPoint& p = manifold.getContactPoint(i);
                const float share = load > 0 ? p.m_appliedImpulse / load : 1 / float(manifold.getNumContacts());
                depth = std::max(depth, -p.getDistance());
                point = point + to_vec(p.getPositionWorldOnB()) * share;
                normal = normal + to_vec(p.m_normalWorldOnB) * share;
            }
            const float size = length(normal);
            normal = size > 0 ? normal / size : vec3{};
            pairs.push_back({std::min(a, b), std::max(a, b), depth, point, a < b ? normal : -normal});
        }
    }

    void near(const Box3& box, std::vector<uint32_t>& out) const override {
        struct Gather final : btBroadphaseAabbCallback {
            std::vector<uint32_t>* out = nullptr;
            bool process(const btBroadphaseProxy* proxy) override {
                out->push_back(uint32_t(static_cast<btCollisionObject*>(proxy->m_clientObject)->getUserIndex()));
                return true;
            }
        } gather;
        gather.out = &out;
        broadphase_.aabbTest(to_bullet(box.min), to_bullet(box.max), gather);
    }

private:
    struct Object {
        Convex convex;
        std::unique_ptr<BulletMesh> mesh;
        std::unique_ptr<btCollisionShape> shape;
        std::unique_ptr<btRigidBody> body;
        float inner_radius = 0;
        bool continuous = false;
        Pose anchor;  // where it has been for `still` seconds
        float still = 0, slow = 0;
        bool rests = false;
    };

    static void set_sleep(Object& o, bool rests) {
        const float speed = rests ? kSleeps : kNeverSleeps;
        o.body->setSleepingThresholds(speed, speed);
        o.rests = rests;
    }
    static void stir(Object& o) {
        o.anchor = to_pose(o.body->getWorldTransform());
        o.still = o.slow = 0;
        if (o.rests) set_sleep(o, false);
    }
    static void watch(Object& o, float seconds) {
        const Pose now = to_pose(o.body->getWorldTransform());
        const quat turn = conjugate(o.anchor.rotation) * now.rotation;
        const bool here = length(now.position - o.anchor.position) < kStillPlace &&
                          2 * std::hypot(turn.x, turn.y, turn.z) < kStillTurn;
        o.still = here ? o.still + seconds : 0;
        if (!here) o.anchor = now;
        const bool slow = o.body->getLinearVelocity().length() < kSlow &&
                          o.body->getAngularVelocity().length() * std::max(o.inner_radius, 0.05f) < kSlow;
        o.slow = slow ? o.slow + seconds : 0;
        const bool rests = o.still >= kStillSeconds || o.slow >= kSlowSeconds;
        if (rests != o.rests) set_sleep(o, rests);
    }

    // Pairs of convex bodies that are apart need no look at how they touch.
    static void look(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& settings) {
        const auto &a = *static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject),
                   &b = *static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
        const bool convex = a.getCollisionShape()->isConvex() && b.getCollisionShape()->isConvex();
        if (convex && apart(a, b, gContactBreakingThreshold)) {
            if (pair.m_algorithm == nullptr) return;
            btManifoldArray manifolds;
            pair.m_algorithm->getAllContactManifolds(manifolds);
            for (int i = 0; i < manifolds.size(); ++i) manifolds[i]->clearManifold();
            return;
        }
        btCollisionDispatcher::defaultNearCallback(pair, dispatcher, settings);
    }

    friend class Dynamics;
    // A continuous body that would go far in this step goes only as far as it meets something; its velocity stays, so the contact
    // that it then has stops it in the next step.
    struct Held {
        btRigidBody* body;
        btVector3 velocity;
    };
    std::vector<Held> hold_back(float seconds) {
        std::vector<Held> held;
        for (uint32_t i = 0; i < objects_.size(); ++i) {
            if (!objects_[i] || !objects_[i]->continuous) continue;
            Object& o = *objects_[i];
            const vec3 way = to_vec(o.body->getLinearVelocity()) * seconds;
            if (!o.body->isActive() || !(length(way) > kSweepShare * o.inner_radius)) continue;
            const Convex* convex = std::get_if<Convex>(&bodies()[i].settings.shape);
            const Convex swept = convex != nullptr ? *convex : Convex::sphere(o.inner_radius);
            const auto hit = sweep(swept, to_pose(o.body->getWorldTransform()), way, BodyId{i, bodies()[i].generation});
            if (!hit) continue;
            held.push_back({o.body.get(), o.body->getLinearVelocity()});
            o.body->setLinearVelocity(o.body->getLinearVelocity() * hit->fraction);
        }
        return held;
    }

    Configuration configuration_;
    mutable btCollisionDispatcher dispatcher_{&configuration_};
    SdfAlgorithms algorithms_{dispatcher_};
    mutable btDbvtBroadphase broadphase_;
    Dynamics dynamics_{*this, &dispatcher_, &broadphase_, &configuration_};
    std::vector<std::unique_ptr<Object>> objects_;
};

bool contact_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int index_a,
                   const btCollisionObjectWrapper* b, int part_b, int index_b) {
    // A body slides over the edge between two triangles as over one.
    const auto is_triangle = [](const btCollisionObjectWrapper* w) {
        return w->getCollisionShape()->getShapeType() == TRIANGLE_SHAPE_PROXYTYPE;
    };
    if (is_triangle(b)) btAdjustInternalEdgeContacts(point, b, a, part_b, index_b);
    if (is_triangle(a)) btAdjustInternalEdgeContacts(point, a, b, part_a, index_a);
    const btCollisionObject &object_a = *a->getCollisionObject(), &object_b = *b->getCollisionObject();
    static_cast<const BulletWorld*>(object_a.getUserPointer())->give_surface(point, object_a, object_b);
    return true;
}

void Dynamics::integrateTransforms(btScalar seconds) {
    const std::vector<BulletWorld::Held> held = owner_.hold_back(seconds);
    btDiscreteDynamicsWorld::integrateTransforms(seconds);
    for (const BulletWorld::Held& h : held) h.body->setLinearVelocity(h.velocity);
}

}  // namespace

std::unique_ptr<World> make_bullet_world(const WorldSettings& settings) {
    return std::make_unique<BulletWorld>(settings);
}

}  // namespace kiln::physics
