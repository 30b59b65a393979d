// SPDX-License-Identifier: MIT

#include "physics/bullet/islands.h"

#include <algorithm>
#include <utility>

namespace kiln::physics {

namespace {

uint32_t index_of(const btCollisionObject* o) { return uint32_t(o->getUserIndex()); }

}  // namespace

uint32_t Islands::root(uint32_t index) {
    while (parent_[index] != index) index = parent_[index] = parent_[parent_[index]];
    return index;
}

void Islands::find(std::span<btRigidBody* const> bodies, btDispatcher& dispatcher) {
    uint32_t most = 0;
    for (const btRigidBody* b : bodies) most = std::max(most, index_of(b) + 1);
    parent_.resize(most);
    for (uint32_t i = 0; i < most; ++i) parent_[i] = i;
    touching_.clear();
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
        btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(m);
        if (manifold->getNumContacts() == 0) continue;
        const btCollisionObject *a = manifold->getBody0(), *b = manifold->getBody1();
        if (stands(a) && stands(b)) continue;
        touching_.push_back(manifold);
        if (stands(a) || stands(b)) {
            // What moves as it likes wakes what it touches.
            const btCollisionObject *still = stands(a) ? a : b, *moving = stands(a) ? b : a;
            if (still->isKinematicObject()) moving->activate();
            continue;
        }
        const uint32_t of_a = root(index_of(a)), of_b = root(index_of(b));
        parent_[std::max(of_a, of_b)] = std::min(of_a, of_b);
    }
    awake_.assign(most, 0);
    for (const btRigidBody* b : bodies) {
        const int state = b->getActivationState();
        if (!stands(b) && (state == ACTIVE_TAG || state == DISABLE_DEACTIVATION)) awake_[root(index_of(b))] = 1;
    }
    islands_.clear();
    number_.resize(most);
    for (btRigidBody* b : bodies) {
        if (stands(b)) continue;
        const uint32_t first = root(index_of(b));
        if (awake_[first] == 0) {
            b->setActivationState(ISLAND_SLEEPING);
            continue;
        }
        if (b->getActivationState() == ISLAND_SLEEPING) {
            b->setActivationState(WANTS_DEACTIVATION);
            b->setDeactivationTime(0);
        }
        if (awake_[first] == 1) {
            awake_[first] = 2;
            number_[first] = uint32_t(islands_.size());
            islands_.emplace_back();
        }
        ++islands_[number_[first]].bodies;
    }
    const auto island_of = [&](const btCollisionObject* o) -> Island* {
        const uint32_t first = root(index_of(o));
        return awake_[first] != 0 ? &islands_[number_[first]] : nullptr;
    };
    const auto island_of_pair = [&](const btPersistentManifold* m) {
        return island_of(stands(m->getBody0()) ? m->getBody1() : m->getBody0());
    };
    for (const btPersistentManifold* m : touching_)
        if (Island* island = island_of_pair(m)) ++island->manifolds;
    size_t body = 0, manifold = 0;
    for (Island& i : islands_) {
        i.first_body = body, i.first_manifold = manifold;
        body += std::exchange(i.bodies, 0), manifold += std::exchange(i.manifolds, 0);
    }
    bodies_.resize(body);
    manifolds_.resize(manifold);
    for (btRigidBody* b : bodies) {
        Island* island = stands(b) ? nullptr : island_of(b);
        if (island != nullptr) bodies_[island->first_body + island->bodies++] = b;
    }
    for (btPersistentManifold* m : touching_)
        if (Island* island = island_of_pair(m)) manifolds_[island->first_manifold + island->manifolds++] = m;
}

std::span<btRigidBody* const> Islands::bodies(size_t island) const {
    return {bodies_.data() + islands_[island].first_body, islands_[island].bodies};
}

std::span<btPersistentManifold* const> Islands::manifolds(size_t island) const {
    return {manifolds_.data() + islands_[island].first_manifold, islands_[island].manifolds};
}

}  // namespace kiln::physics
