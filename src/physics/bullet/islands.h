// SPDX-License-Identifier: MIT
// What hangs together by contacts: it sleeps and wakes together, and is solved by itself. In place of Bullet's own islands, which hold together
// all whose boxes meet, and sort all pairs there are.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::physics {

/// No contact moves it.
inline bool stands(const btCollisionObject* o) { return o->isStaticOrKinematicObject(); }

/// Of one world; its thread. Bodies have user indices of their own.
class Islands {
public:
    /// Sends to sleep what wants to in all of its island, wakes what touches something awake, and groups what is awake. `bodies`: all that do
    /// not stand still. What they touch is in the dispatcher's manifolds.
    void find(std::span<btRigidBody* const> bodies, btDispatcher& dispatcher);

    size_t count() const { return islands_.size(); }
    std::span<btRigidBody* const> bodies(size_t island) const;
    /// Those with contacts; the same order every step.
    std::span<btPersistentManifold* const> manifolds(size_t island) const;

private:
    struct Island {
        size_t first_body = 0, bodies = 0, first_manifold = 0, manifolds = 0;
    };
    uint32_t root(uint32_t index);
    std::vector<uint32_t> parent_;  // by the body's index; itself for the first of an island
    std::vector<uint8_t> awake_;    // by the first of an island
    std::vector<uint32_t> number_;  // of the island, by its first
    std::vector<Island> islands_;
    std::vector<btRigidBody*> bodies_;
    std::vector<btPersistentManifold*> touching_, manifolds_;
};

}  // namespace kiln::physics
