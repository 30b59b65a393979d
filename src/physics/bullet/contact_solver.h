// SPDX-License-Identifier: MIT
// What the contacts of an island (islands.h) do to the velocities of its bodies: in place of Bullet's own solver, which knows joints and
// motors that nothing here has, and for that takes a third of a step.
//
// Sequential impulses (Catto, "Iterative Dynamics with Temporal Coherence", 2005) on Coulomb's cone, with nonsmooth conjugate gradients
// (Silcowitz-Hansen, Niebe and Erleben, "A Nonsmooth Nonlinear Conjugate Gradient Method for Interactive Contact Force Problems", 2010):
// what an iteration finds out at one contact it tells the next ones of the same bodies. How far two iterations are apart is measured by the
// energy that lies between them, so that light and heavy bodies count alike.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <span>
#include <vector>

namespace kiln::physics {

/// Of one world; its thread. Bodies have user indices of their own.
class ContactSolver {
public:
    btVector3 gravity{0, 0, 0};

    /// An island's bodies, all awake, and the pairs of them, and of them and what stands, that touch.
    void solve(std::span<btRigidBody* const> bodies, std::span<btPersistentManifold* const> manifolds, float seconds);

private:
    using Manifolds = std::span<btPersistentManifold* const>;
    using Quad = float __attribute__((vector_size(16)));  // the fourth is 0
    struct Motion {
        Quad linear{}, angular{};
    };
    struct Body {
        const btRigidBody* body;
        float inverse_mass;  // 0 for what no contact moves
        Motion now{};        // with what gravity and other forces do in this step
        Motion start{};      // of an iteration
        Motion direction{};  // of the conjugate gradients
        Motion push{};       // moves it out of what it is in, once
    };
    // Impulses of a contact are along three axes: out of b, and two across.
    struct Contact {
        btManifoldPoint* point;
        uint32_t a, b;                             // numbers of bodies
        Quad axes[3]{}, turn_a[3]{}, turn_b[3]{};  // in the world; what each turns, by a unit of impulse along an axis
        Quad spin_out_a{}, spin_out_b{};           // m/s out by 1 rad/s about x, y, z
        Quad across[3]{}, spin_a[3]{}, spin_b[3]{};  // m/s across by 1 m/s along x, by 1 rad/s about x; y; z
        Quad moved{};      // m/s by a unit of impulse: out by out, x by x, x by y, y by y (across)
        float mass = 0;    // kg, out
        float block[3]{};  // kg, across: the inverse of xx, xy, yy
        float slide = 0;   // kg, across: the lesser one of its two extremes
        float least = 0;   // m/s out, afterwards
        float push = 0;    // m/s out, of the push
        float friction = 0;
        Quad impulse{}, start{}, direction{};  // as of a body's motion
        float pushed = 0;
    };
    struct Change {
        float energy, speed2;
    };
    static float speed_out(const Contact& c, const Motion& a, const Motion& b);
    void give_out(const Contact& c, float impulse, Motion& a, Motion& b) const;
    void give_across(const Contact& c, float x, float y, Motion& a, Motion& b) const;

    int storeys(Manifolds manifolds, int moving);
    int iterations(Manifolds manifolds, int moving);
    void begin(std::span<btRigidBody* const> bodies, Manifolds manifolds, float seconds, bool move_out);
    uint32_t number(const btRigidBody& body);
    void meet(const btPersistentManifold& manifold, btManifoldPoint& point, float seconds, bool move_out);
    Change sweep();
    void iterate(int most);
    void push_out(int most);
    void end(float seconds);

    std::vector<int> height_;       // by the body's index
    std::vector<uint32_t> number_;  // in the island, by the body's index
    std::vector<Body> bodies_;      // the first is all that stands still; then what moves
    size_t moving_ = 0;
    std::vector<Contact> contacts_;
};

}  // namespace kiln::physics
