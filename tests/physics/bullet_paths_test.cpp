// SPDX-License-Identifier: MIT
// Starts threads.
// What Bullet itself does with a field: its rays, sweeps, continuous bodies and character, which know shapes as triangles only.
#include "physics/bullet/sdf_algorithm.h"
#include "physics/cell_triangles.h"
#include "physics/sdf_collision.h"
#include "physics/worlds.h"

#include "field/mesh_facts.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <btBulletDynamicsCommon.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

// A plain world of Bullet's with one field in it.
struct BulletsOwn {
    btDefaultCollisionConfiguration configuration{[] {
        btDefaultCollisionConstructionInfo out;
        out.m_customCollisionAlgorithmMaxElementSize = 256;
        return out;
    }()};
    btCollisionDispatcher dispatcher{&configuration};
    SdfAlgorithms algorithms{dispatcher};
    btDbvtBroadphase broadphase;
    btGhostPairCallback ghosts;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    BulletSdfShape shape;
    btCollisionObject object;

    explicit BulletsOwn(const std::shared_ptr<const SdfShape>& sdf, const btTransform& at = btTransform::getIdentity())
        : shape(sdf, {}) {
        broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghosts);
        object.setCollisionShape(&shape);
        object.setWorldTransform(at);
        world.addCollisionObject(&object, btBroadphaseProxy::StaticFilter,
                                 btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter);
        world.setGravity({0, -kGravity, 0});
    }
    ~BulletsOwn() { world.removeCollisionObject(&object); }

    btCollisionWorld::ClosestRayResultCallback ray(vec3 from, vec3 to) const {
        btCollisionWorld::ClosestRayResultCallback hit(to_bullet(from), to_bullet(to));
        world.rayTest(to_bullet(from), to_bullet(to), hit);
        return hit;
    }
};

TEST(BulletsOwnPaths, TrianglesInABoxAreTheClosedSurfaceThere) {
    const auto ball = field_of({edit(kiln::Sphere{.radius = 1}, {0.03f, 0.01f, -0.02f})});
    std::vector<vec3> corners;
    triangles_in(*ball, kVoxel, {{-2, -2, -2}, {2, 2, 2}}, corners);
    std::map<std::array<uint32_t, 3>, uint32_t> numbers;
    std::vector<vec3> vertices;
    std::vector<uint32_t> indices;
    for (const vec3 v : corners) {
        std::array<uint32_t, 3> bits;
        std::memcpy(bits.data(), &v, sizeof bits);
        const auto [at, fresh] = numbers.try_emplace(bits, uint32_t(vertices.size()));
        if (fresh) vertices.push_back(v);
        indices.push_back(at->second);
        EXPECT_LT(std::abs(ball->distance(v)), 0.01f * kVoxel + 1e-3f);
    }
    const field::MeshFacts facts = field::mesh_facts(vertices, indices);
    EXPECT_EQ(facts.open_edges, 0u);
    EXPECT_EQ(facts.euler(), 2);
    EXPECT_NEAR(facts.volume, 4 * double(kPi) / 3, 0.03);
    // A part of the box has those triangles of the whole that meet it.
    const Box3 part{{0.23f, 0.24f, 0.21f}, {0.92f, 1.4f, 0.77f}};
    std::vector<vec3> some;
    triangles_in(*ball, kVoxel, part, some);
    const auto meeting = [&](const std::vector<vec3>& list) {
        size_t count = 0;
        for (size_t i = 0; i < list.size(); i += 3) {
            Box3 own;
            for (size_t k = 0; k < 3; ++k) own = box_union(own, {list[i + k], list[i + k]});
            count += own.overlaps(part);
        }
        return count;
    };
    EXPECT_EQ(meeting(some), meeting(corners));
    EXPECT_LT(some.size(), corners.size());
}

TEST(BulletsOwnPaths, RaysMeetAFieldWhereItIs) {
    const auto exact = field_of({edit(kiln::Torus{.major_radius = 1, .minor_radius = 0.3f})});
    btTransform at = btTransform::getIdentity();
    at.setOrigin({3, 2, 0});
    at.setRotation({btVector3(1, 0, 0), 0.4f});
    const BulletsOwn b(moving({edit(kiln::Torus{.major_radius = 1, .minor_radius = 0.3f})}), at);
    std::mt19937 rng(4);
    const auto uniform = [&](float l, float h) { return std::uniform_real_distribution<float>(l, h)(rng); };
    int hits = 0;
    for (int i = 0; i < 200; ++i) {
        const vec3 from{3 + uniform(-1.4f, 1.4f), 6, uniform(-1.4f, 1.4f)}, to{from.x, -2, from.z};
        const auto hit = b.ray(from, to);
        const Pose local = inverse(to_pose(at));
        const auto expected = cast_ray(*exact, local * from, rotate(local.rotation, to - from));
        if (!expected || std::abs(expected->normal.y) < 0.3f) continue;  // grazing ones may pass between triangles
        ++hits;
        ASSERT_TRUE(hit.hasHit()) << i;
        EXPECT_NEAR(hit.m_closestHitFraction * 8, expected->fraction * 8, 0.02f) << i;
    }
    EXPECT_GT(hits, 50);
    EXPECT_FALSE(b.ray({3, 6, 0}, {3, -2, 0}).hasHit()) << "through the hole";
}

TEST(BulletsOwnPaths, SweptBallsStopAtAField) {
    const BulletsOwn b(fixed({edit(Plane{}, {0, 0.03f, 0}), edit(kiln::Box{.half_extents = {1, 1, 1}}, {4, 0, 0})}));
    btSphereShape ball(0.3f);
    const auto down = [&](float x) {
        btTransform from = btTransform::getIdentity(), to = from;
        from.setOrigin({x, 5, 0.1f});
        to.setOrigin({x, -1, 0.1f});
        btCollisionWorld::ClosestConvexResultCallback hit(from.getOrigin(), to.getOrigin());
        b.world.convexSweepTest(&ball, from, to, hit);
        return 5 - 6 * hit.m_closestHitFraction;
    };
    EXPECT_NEAR(down(0), 0.33f, 0.02f);
    EXPECT_NEAR(down(4), 1.3f, 0.02f);
}

TEST(BulletsOwnPaths, ItsContinuousBodiesStopAtAThinWall) {
    for (const float speed : {50.0f, 1000.0f}) {
        BulletsOwn b(fixed({edit(kiln::Box{.half_extents = {0.05f, 5, 5}})}, 0.04f));
        b.world.setGravity({0, 0, 0});
        Convex convex = Convex::sphere(0.05f);
        btSphereShape ball(0.05f);
        ball.setUserPointer(&convex);
        btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &ball, {0.001f, 0.001f, 0.001f}));
        btTransform at = btTransform::getIdentity();
        at.setOrigin({-7.3f, 0.21f, 0.11f});
        body.setWorldTransform(at);
        body.setInterpolationWorldTransform(at);
        body.setLinearVelocity({speed, 0, 0});
        body.setCcdMotionThreshold(0.025f);
        body.setCcdSweptSphereRadius(0.04f);
        b.world.addRigidBody(&body);
        for (int i = 0; i < 30; ++i) b.world.stepSimulation(kStep, 0);
        // In front of it, by up to the margin of a contact.
        const float x = body.getWorldTransform().getOrigin().x();
        EXPECT_GT(x, -0.16f) << speed;
        EXPECT_LT(x, -0.09f) << speed;
        b.world.removeRigidBody(&body);
    }
}

TEST(BulletsOwnPaths, ItsCharacterWalksOnAFieldAndUpAStep) {
    BulletsOwn b(fixed({edit(Plane{}, {0, 0.03f, 0}), edit(kiln::Box{.half_extents = {2, 0.2f, 2}}, {4, 0.03f, 0})}));
    Convex convex = Convex::capsule(0.5f, 0.3f);
    btCapsuleShape capsule(0.3f, 1);
    capsule.setUserPointer(&convex);
    btPairCachingGhostObject ghost;
    ghost.setCollisionShape(&capsule);
    ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
    btTransform at = btTransform::getIdentity();
    at.setOrigin({0, 1, 0.1f});
    ghost.setWorldTransform(at);
    btKinematicCharacterController character(&ghost, &capsule, 0.35f, {0, 1, 0});
    ghost.setWorldTransform(at);  // which it turned
    character.setMaxPenetrationDepth(0.01f);
    b.world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                               btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
    b.world.addAction(&character);
    const auto run = [&](int steps, float speed) {
        character.setWalkDirection({speed * kStep, 0, 0});
        for (int i = 0; i < steps; ++i) b.world.stepSimulation(kStep, 0);
        return ghost.getWorldTransform().getOrigin();
    };
    EXPECT_NEAR(run(60, 0).y(), 0.83f, 0.05f);
    EXPECT_TRUE(character.onGround());
    const btVector3 flat = run(60, 1);
    EXPECT_NEAR(flat.x(), 1, 0.05f);
    EXPECT_NEAR(flat.y(), 0.83f, 0.05f);
    const btVector3 up = run(120, 1);
    EXPECT_GT(up.x(), 2.2f);
    EXPECT_NEAR(up.y(), 1.03f, 0.05f);
    b.world.removeAction(&character);
    b.world.removeCollisionObject(&ghost);
}

}  // namespace
