// SPDX-License-Identifier: MIT

#include "physics/bullet/contact_solver.h"

#include "physics/bullet/islands.h"

#include <algorithm>
#include <cmath>

namespace kiln::physics {

namespace {

constexpr int kAlone = 12, kStorey = 6, kFew = 20, kMany = 40;  // iterations
constexpr float kFast = 1;                                      // m/s
constexpr float kBounces = 0.5f;                                // m/s: what comes slower stays
// An island ends its iterations when the last one changed the velocities of its bodies by less than 1 mm/s (root of the mean square).
constexpr float kEnough = 1e-6f;
// Metres: so deep nothing is done, so that what rests keeps touching, and from so deep on what rests is moved out too.
constexpr float kSlop = 1e-3f, kDeep = 0.04f;
constexpr float kPushedOut = 0.2f, kMovedOut = 0.4f;  // of the depth, a step

using Quad = float __attribute__((vector_size(16)));
Quad to_quad(const btVector3& v) { return Quad{v.x(), v.y(), v.z(), 0}; }
btVector3 from_quad(Quad q) { return {q[0], q[1], q[2]}; }

}  // namespace

// The most bodies between one and the ground, itself counted, by the shortest way down that carries it, as far as it matters. A wall
// carries nobody; what nothing carries falls, and bears nothing.
int ContactSolver::storeys(Manifolds manifolds, int moving) {
    constexpr int kTop = kMany / kStorey;
    constexpr float kCarries = 0.3f;  // sine of the least slope of a push that holds somebody up
    const float pull = gravity.length();
    if (!(pull > 0)) return kTop;
    const auto height = [&](const btCollisionObject* o) -> int& {
        const size_t i = size_t(o->getUserIndex());
        if (i >= height_.size()) height_.resize(i + 1, kTop);
        return height_[i];
    };
    constexpr int kFalls = 1 << 20;
    for (const btPersistentManifold* m : manifolds)
        for (const btCollisionObject* o : {m->getBody0(), m->getBody1()}) height(o) = stands(o) ? 0 : kFalls;
    bool lower = true;
    while (lower) {
        lower = false;
        for (const btPersistentManifold* m : manifolds) {
            int &a = height(m->getBody0()), &b = height(m->getBody1());
            for (int i = 0; i < m->getNumContacts(); ++i) {
                const float up = -m->getContactPoint(i).m_normalWorldOnB.dot(gravity) / pull;  // of body 0
                if (up > kCarries && a > b + 1) a = b + 1, lower = true;
                if (up < -kCarries && b > a + 1) b = a + 1, lower = true;
            }
        }
    }
    int out = 1;
    for (const btPersistentManifold* m : manifolds)
        for (const btCollisionObject* o : {m->getBody0(), m->getBody1()})
            if (height(o) < kFalls) out = std::max(out, height(o));
    return std::min({out, moving, kTop});
}

// How many are needed is a matter of how many bodies lie between one and the ground: a stack of ten sways more and more with fewer than four
// a storey, a heap as wide as you like that is two high needs no more than two bodies. With fewer than these, what slides into a heap slides
// too far, and heaps are lower by a hundredth. One alone has no such neighbours: whether a ball slips comes out to half a per cent.
int ContactSolver::iterations(Manifolds manifolds, int moving) {
    if (moving == 1) return kAlone;
    return std::clamp(kStorey * (moving == 2 ? 2 : storeys(manifolds, moving)), kFew, kMany);
}

void ContactSolver::solve(std::span<btRigidBody* const> bodies, Manifolds manifolds, float seconds) {
    const bool alone = bodies.size() == 1;
    // What glides or rolls in a bowl, or turns over an edge, is a little too deep after each step: it is moved out, since a velocity given
    // for that would stay. What rests is pushed out: moved, it would lose touch again and again.
    begin(bodies, manifolds, seconds, alone && bodies[0]->getLinearVelocity().length2() > kFast * kFast);
    if (!contacts_.empty()) {
        const int most = iterations(manifolds, int(bodies.size()));
        push_out(most);
        iterate(most);
    }
    end(seconds);
}

void ContactSolver::begin(std::span<btRigidBody* const> bodies, Manifolds manifolds, float seconds, bool move_out) {
    bodies_.assign(1, {nullptr, 0});  // what stands still
    contacts_.clear();
    for (const btRigidBody* body : bodies) {
        Body& b = bodies_[number(*body)];
        b.inverse_mass = body->getInvMass();
        b.now.linear = to_quad(body->getLinearVelocity() + body->getTotalForce() * (b.inverse_mass * seconds));
        btVector3 turned = body->getTotalTorque() * body->getInvInertiaTensorWorld() * seconds;
        // Gyroscopic torque as Euler's equations have it, integrated implicitly so that thin bodies stay stable.
        const btVector3& moments = body->getLocalInertia();
        if (moments.x() != moments.y() || moments.y() != moments.z())
            turned += body->computeGyroscopicImpulseImplicit_Body(seconds);
        b.now.angular = to_quad(body->getAngularVelocity() + turned);
    }
    moving_ = bodies_.size() - 1;
    // One place of each pair after the other, not all of a pair at once: neighbours in the list then have few bodies in common, which is
    // faster, and what one tells the next goes farther in an iteration.
    int most = 0;
    for (const btPersistentManifold* m : manifolds) most = std::max(most, m->getNumContacts());
    for (int i = 0; i < most; ++i)
        for (btPersistentManifold* m : manifolds)
            if (i < m->getNumContacts()) meet(*m, m->getContactPoint(i), seconds, move_out);
}

// What stands still is the first; what moves as it likes is one of its own, of no inverse mass.
uint32_t ContactSolver::number(const btRigidBody& body) {
    if (body.isStaticObject()) return 0;
    const size_t index = size_t(body.getUserIndex());
    if (index >= number_.size()) number_.resize(index + 1);
    uint32_t& out = number_[index];
    if (out < bodies_.size() && bodies_[out].body == &body) return out;
    out = uint32_t(bodies_.size());
    bodies_.push_back({&body, 0, {to_quad(body.getLinearVelocity()), to_quad(body.getAngularVelocity())}});
    return out;
}

void ContactSolver::meet(const btPersistentManifold& manifold, btManifoldPoint& point, float seconds, bool move_out) {
    const auto* first = btRigidBody::upcast(manifold.getBody0());
    const auto* second = btRigidBody::upcast(manifold.getBody1());
    const bool swapped = stands(first);
    if (swapped) std::swap(first, second);
    const uint32_t a = number(*first), b = number(*second);
    const float inverse_mass = bodies_[a].inverse_mass + bodies_[b].inverse_mass;
    const btVector3 &on_a = swapped ? point.getPositionWorldOnB() : point.getPositionWorldOnA(),
                    &on_b = swapped ? point.getPositionWorldOnA() : point.getPositionWorldOnB();
    const btVector3 arm_a = on_a - first->getWorldTransform().getOrigin(),
                    arm_b = on_b - second->getWorldTransform().getOrigin();
    btVector3 axes[3] = {swapped ? -point.m_normalWorldOnB : point.m_normalWorldOnB};
    btPlaneSpace1(axes[0], axes[1], axes[2]);  // of the normal alone: impulses of the step before mean the same
    Contact& c = contacts_.emplace_back(Contact{.point = &point, .a = a, .b = b});
    Quad arms_a[3], arms_b[3];
    for (size_t k = 0; k < 3; ++k) {
        const btVector3 spin_a = arm_a.cross(axes[k]), spin_b = arm_b.cross(axes[k]);
        c.axes[k] = to_quad(axes[k]), arms_a[k] = to_quad(spin_a), arms_b[k] = to_quad(spin_b);
        c.turn_a[k] = to_quad(first->getInvInertiaTensorWorld() * spin_a);
        if (bodies_[b].inverse_mass > 0) c.turn_b[k] = to_quad(second->getInvInertiaTensorWorld() * spin_b);
    }
    c.spin_out_a = arms_a[0], c.spin_out_b = arms_b[0];
    for (int n = 0; n < 3; ++n) {
        c.across[n] = Quad{c.axes[1][n], c.axes[2][n], 0, 0};
        c.spin_a[n] = Quad{arms_a[1][n], arms_a[2][n], 0, 0};
        c.spin_b[n] = Quad{arms_b[1][n], arms_b[2][n], 0, 0};
    }
    // m/s along an axis by a unit of impulse along another.
    const auto moved = [&](size_t by, size_t on) {
        const Quad all = c.axes[by] * c.axes[on] * inverse_mass + c.turn_a[by] * arms_a[on] + c.turn_b[by] * arms_b[on];
        return all[0] + all[1] + all[2];
    };
    const float xx = moved(1, 1), xy = moved(1, 2), yy = moved(2, 2), whole = 1 / (xx * yy - xy * xy);
    c.moved = Quad{moved(0, 0), xx, xy, yy};
    c.mass = 1 / c.moved[0];
    c.block[0] = yy * whole, c.block[1] = -xy * whole, c.block[2] = xx * whole;
    c.slide = 1 / (0.5f * (xx + yy) + std::sqrt(0.25f * (xx - yy) * (xx - yy) + xy * xy));
    c.friction = point.m_combinedFriction;
    const float now = axes[0].dot(first->getVelocityInLocalPoint(arm_a) - second->getVelocityInLocalPoint(arm_b));
    if (-now > kBounces) c.least = -now * point.m_combinedRestitution;
    const float depth = -point.getDistance();
    const float correction = std::max(depth - kSlop, 0.0f) * (move_out ? kMovedOut : kPushedOut) / seconds;
    if (!(depth > 0)) {
        c.least += depth / seconds;  // as far as it is apart it may come
    } else if (move_out || depth > kDeep) {
        c.push = correction;
    } else {
        c.least += correction;
    }
    c.impulse = Quad{point.m_appliedImpulse, point.m_appliedImpulseLateral1, point.m_appliedImpulseLateral2, 0};
}

void ContactSolver::give_out(const Contact& c, float impulse, Motion& a, Motion& b) const {
    const Quad along = c.axes[0] * impulse;
    a.linear += along * bodies_[c.a].inverse_mass;
    a.angular += c.turn_a[0] * impulse;
    if (c.b == 0) return;
    b.linear -= along * bodies_[c.b].inverse_mass;
    b.angular -= c.turn_b[0] * impulse;
}

void ContactSolver::give_across(const Contact& c, float x, float y, Motion& a, Motion& b) const {
    const Quad along = c.axes[1] * x + c.axes[2] * y;
    a.linear += along * bodies_[c.a].inverse_mass;
    a.angular += c.turn_a[1] * x + c.turn_a[2] * y;
    if (c.b == 0) return;
    b.linear -= along * bodies_[c.b].inverse_mass;
    b.angular -= c.turn_b[1] * x + c.turn_b[2] * y;
}

float ContactSolver::speed_out(const Contact& c, const Motion& a, const Motion& b) {
    Quad out = c.axes[0] * (a.linear - b.linear) + c.spin_out_a * a.angular;
    if (c.b != 0) out -= c.spin_out_b * b.angular;
    return out[0] + out[1] + out[2];
}

// Friction of all, then what keeps all apart: turn about at each contact, a tall stack needs twice as many iterations.
ContactSolver::Change ContactSolver::sweep() {
    Change out{0, 0};
    for (Contact& c : contacts_) {
        const float hold = c.friction * std::max(c.impulse[0], 0.0f), hold2 = hold * hold;
        if (hold == 0 && c.impulse[1] == 0 && c.impulse[2] == 0) continue;
        Motion &a = bodies_[c.a].now, &b = bodies_[c.b].now;
        const Quad between = a.linear - b.linear;
        Quad now = c.across[0] * between[0] + c.across[1] * between[1] + c.across[2] * between[2];
        now += c.spin_a[0] * a.angular[0] + c.spin_a[1] * a.angular[1] + c.spin_a[2] * a.angular[2];
        if (c.b != 0) now -= c.spin_b[0] * b.angular[0] + c.spin_b[1] * b.angular[1] + c.spin_b[2] * b.angular[2];
        // Where the cone has room for it what touches does not move; elsewhere friction is on the cone against the way it slides, for which
        // both axes must count alike.
        float x = c.impulse[1] - c.block[0] * now[0] - c.block[1] * now[1],
              y = c.impulse[2] - c.block[1] * now[0] - c.block[2] * now[1];
        if (x * x + y * y > hold2) {
            x = c.impulse[1] - c.slide * now[0], y = c.impulse[2] - c.slide * now[1];
            const float size2 = x * x + y * y, share = size2 > hold2 ? hold / std::sqrt(size2) : 1;
            x *= share, y *= share;
        }
        const float dx = x - c.impulse[1], dy = y - c.impulse[2];
        const float moved_x = c.moved[1] * dx + c.moved[2] * dy, moved_y = c.moved[2] * dx + c.moved[3] * dy;
        c.impulse[1] = x, c.impulse[2] = y;
        give_across(c, dx, dy, a, b);
        out.energy += dx * moved_x + dy * moved_y;
        out.speed2 += moved_x * moved_x + moved_y * moved_y;
    }
    for (Contact& c : contacts_) {
        Motion &a = bodies_[c.a].now, &b = bodies_[c.b].now;
        const float next = std::max(c.impulse[0] + (c.least - speed_out(c, a, b)) * c.mass, 0.0f);
        const float more = next - c.impulse[0], moved = more * c.moved[0];
        c.impulse[0] = next;
        give_out(c, more, a, b);
        out.energy += more * moved;
        out.speed2 += moved * moved;
    }
    return out;
}

void ContactSolver::iterate(int most) {
    for (const Contact& c : contacts_) {
        Motion &a = bodies_[c.a].now, &b = bodies_[c.b].now;
        give_out(c, c.impulse[0], a, b);
        give_across(c, c.impulse[1], c.impulse[2], a, b);
    }
    // What the directions of the conjugate gradients do to impulses they do, in one, to velocities.
    const float enough = kEnough * float(moving_);
    float before = 0;
    for (int i = 0;; ++i) {
        for (Body& b : bodies_) b.start = b.now;
        for (Contact& c : contacts_) c.start = c.impulse;
        const Change change = sweep();
        if (i + 1 >= most || change.speed2 <= enough) return;
        const float turn = i > 0 && change.energy < before ? change.energy / before : 0;  // 0: begins anew
        before = change.energy;
        const auto go_on = [&](Quad& now, const Quad& start, Quad& direction) {
            const Quad went = now - start;
            now += direction * turn;
            direction = direction * turn + went;
        };
        for (Body& b : bodies_) {
            go_on(b.now.linear, b.start.linear, b.direction.linear);
            go_on(b.now.angular, b.start.angular, b.direction.angular);
        }
        for (Contact& c : contacts_) go_on(c.impulse, c.start, c.direction);
    }
}

void ContactSolver::push_out(int most) {
    if (std::none_of(contacts_.begin(), contacts_.end(), [](const Contact& c) { return c.push > 0; })) return;
    for (int i = 0; i < most; ++i)
        for (Contact& c : contacts_) {
            if (!(c.push > 0)) continue;
            Motion &a = bodies_[c.a].push, &b = bodies_[c.b].push;
            const float next = std::max(c.pushed + (c.push - speed_out(c, a, b)) * c.mass, 0.0f);
            give_out(c, next - c.pushed, a, b);
            c.pushed = next;
        }
}

void ContactSolver::end(float seconds) {
    for (const Contact& c : contacts_) {
        c.point->m_appliedImpulse = c.impulse[0];
        c.point->m_appliedImpulseLateral1 = c.impulse[1], c.point->m_appliedImpulseLateral2 = c.impulse[2];
    }
    const bool pushed = std::any_of(contacts_.begin(), contacts_.end(), [](const Contact& c) { return c.pushed > 0; });
    for (const Body& b : std::span(bodies_).subspan(1, moving_)) {
        btRigidBody& body = const_cast<btRigidBody&>(*b.body);
        body.setLinearVelocity(from_quad(b.now.linear));
        body.setAngularVelocity(from_quad(b.now.angular));
        if (!pushed) continue;
        btTransform next;
        btTransformUtil::integrateTransform(body.getWorldTransform(), from_quad(b.push.linear),
                                            from_quad(b.push.angular), seconds, next);
        body.setWorldTransform(next);
    }
}

}  // namespace kiln::physics
