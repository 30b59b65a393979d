// SPDX-License-Identifier: MIT

#include "physics/physics.h"

#include "physics/bullet/bullet_world.h"
#include "physics/convex_field.h"
#include "physics/ground_contacts.h"
#include "physics/jolt/jolt_world.h"
#include "physics/mesh_mass.h"
#include "physics/sdf_collision.h"

#include "base/assert.h"
#include "base/format.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace kiln::physics {

namespace {

constexpr int kLoadRounds = 8;      // over the places a body lies on
constexpr float kTouching = 5e-3f;  // metres apart that still counts as lying on something
// Kilograms, and kilograms times square metres: engines reckon in floats, with these, one over these, and products of them with speeds.
constexpr double kLeastMass = 1e-30, kMostMass = 1e30;

bool finite(vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool finite(const Pose& p) {
    const quat& q = p.rotation;
    return finite(p.position) && std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z) && std::isfinite(q.w);
}
bool is_field(const BodyShape& s) { return std::holds_alternative<std::shared_ptr<const SdfShape>>(s); }
const std::shared_ptr<const SdfShape>& field_ptr(const BodyShape& s) {
    return std::get<std::shared_ptr<const SdfShape>>(s);
}
const SdfShape& field_of(const BodyShape& s) { return *field_ptr(s); }

const Triangles* triangles_of(const BodyShape& s) {
    const auto* t = std::get_if<std::shared_ptr<const Triangles>>(&s);
    return t != nullptr ? t->get() : nullptr;
}

Error refused(std::string_view what) { return {formatted("a body with {}", what), ErrorKind::Input}; }

std::optional<Error> fault_of(const BodySettings& s) {
    if (!finite(s.pose)) return refused("a transform that is not finite; write finite numbers");
    const quat& q = s.pose.rotation;
    const float size = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!(std::abs(size - 1) < 1e-2f)) return refused("a rotation that is not of unit length; normalise it");
    if (!finite(s.linear_velocity) || !finite(s.angular_velocity))
        return refused("a velocity that is not finite; write finite numbers");
    const auto rate = [](float v) { return std::isfinite(v) && v >= 0; };
    if (!rate(s.friction) || !rate(s.restitution) || !rate(s.linear_damping) || !rate(s.angular_damping) ||
        !rate(s.rolling_friction))
        return refused("a friction, restitution or damping that is not a finite number of 0 or more");
    if (s.motion == Motion::Dynamic && !(std::isfinite(s.density) && s.density > 0))
        return refused("a density that is not a finite number above 0");
    if (!rate(s.mesh_voxel) || (s.mesh_voxel > 0 && (s.motion != Motion::Static || !is_field(s.shape))))
        return refused("a size of voxels to mesh: only static fields have one, a finite number of 0 or more");
    if (const Triangles* t = triangles_of(s.shape)) {
        if (t->indices.empty() || t->indices.size() % 3 != 0 || t->solid == nullptr) return refused("no triangles");
        for (const uint32_t i : t->indices)
            if (i >= t->vertices.size()) return refused("a triangle of a vertex that there is not");
        for (const vec3 v : t->vertices)
            if (!finite(v)) return refused("a vertex that is not finite; write finite numbers");
        if (s.motion != Motion::Static && !t->solid->moves())
            return refused("triangles whose solid cannot move: only static bodies may have it");
    } else if (is_field(s.shape)) {
        if (s.motion != Motion::Static && !field_of(s.shape).moves())
            return refused("a field that cannot move: only static bodies may have it");
    } else {
        const vec3 size3 = std::get<Convex>(s.shape).size;
        if (!finite(size3) || !(std::min({size3.x, size3.y, size3.z}) > 0))
            return refused("no volume: every size must be a finite number above 0");
    }
    return std::nullopt;
}

bool reckonable(const MassProperties& m) {
    const dvec3& i = m.moments;
    return std::min({m.mass, i.x, i.y, i.z}) >= kLeastMass && std::max({m.mass, i.x, i.y, i.z}) <= kMostMass;
}

MassProperties mass_of(const BodySettings& s) {
    MassProperties out;
    if (is_field(s.shape)) {
        out = field_of(s.shape).mass();
        out.mass *= double(s.density);
        out.moments = {out.moments.x * double(s.density), out.moments.y * double(s.density),
                       out.moments.z * double(s.density)};
        return out;
    }
    const Convex& c = std::get<Convex>(s.shape);
    out.mass = volume(c) * double(s.density);
    const dvec3 m = moments(c);
    out.moments = {m.x * out.mass, m.y * out.mass, m.z * out.mass};
    return out;
}

Box3 box_around(vec3 center, float radius) { return Box3{center, center}.inflated(radius); }

// Around a box that is turned. One without end stays without.
Box3 box_of_world(const Box3& box, const Pose& frame) {
    if (!box.finite()) return box;
    return box_of(Convex::box(box.half_extents()), {frame * box.center(), frame.rotation});
}

}  // namespace

const SdfShape* solid_of(const BodyShape& shape) {
    if (const Triangles* t = triangles_of(shape)) return t->solid.get();
    return is_field(shape) ? &field_of(shape) : nullptr;
}

Result<BodyId> World::add(const BodySettings& settings) {
    if (auto fault = fault_of(settings)) return std::move(*fault);
    std::shared_ptr<const SdfShape> weighed;  // of triangles that move
    if (const Triangles* t = triangles_of(settings.shape); t != nullptr && settings.motion != Motion::Static) {
        const auto mass = mass_of_mesh(*t);
        if (!mass) return mass.error();
        weighed = t->solid->with(*mass);
    }
    BodySettings given = settings;
    if (weighed != nullptr) given.shape = std::move(weighed);
    MassProperties mass;
    if (settings.motion != Motion::Static) mass = physics::mass_of(given);
    if (settings.motion == Motion::Dynamic && !reckonable(mass))
        return refused(
            formatted("a mass of {} kg: it and the moments of inertia must be {} to {}; change its size or density",
                      mass.mass, kLeastMass, kMostMass));
    if (count_ == kMostBodies)
        return Error{formatted("more than {} bodies; make do with fewer", kMostBodies), ErrorKind::Input};
    uint32_t index = uint32_t(bodies_.size());
    if (free_.empty()) {
        bodies_.emplace_back();
    } else {
        index = free_.back();
        free_.pop_back();
    }
    Body& body = bodies_[index];
    body.settings = std::move(given);
    body.mass = mass;
    body.body_from_mass = {};
    if (settings.motion != Motion::Static) body.body_from_mass = {mass.center, mass.axes};
    if (settings.motion == Motion::Kinematic) body.mass.mass = 0;
    body.last = settings.pose * body.body_from_mass;
    body.support = {};
    if (settings.mesh_voxel > 0) {
        body.mesher = std::make_unique<GroundMesher>(settings.mesh_voxel, region_builder());
        body.settings.shape = field_ptr(body.settings.shape)->with(body.mesher->regions());
    }
    body.live = true;
    ++count_;
    create(index, body);
    return BodyId{index, body.generation};
}

const World::Body* World::find(BodyId id) const {
    if (id.index >= bodies_.size()) return nullptr;
    const Body& b = bodies_[id.index];
    return b.live && b.generation == id.generation ? &b : nullptr;
}

const MassProperties& World::mass_of(BodyId id) const {
    static const MassProperties none{};
    const Body* b = find(id);
    return b != nullptr ? b->mass : none;
}

void World::remove(BodyId id) {
    if (find(id) == nullptr) return;
    destroy(id.index);
    Body& b = bodies_[id.index];
    b.live = false;
    b.mesher.reset();
    b.settings.shape = Convex{};
    // What touched it does so no longer: told with the next step's events, under the id it had.
    ++b.generation;
    free_.push_back(id.index);
    --count_;
}

BodyState World::state(BodyId id) const {
    const Body* b = find(id);
    if (b == nullptr) return {};
    BodyState out = get(id.index);
    out.pose = out.pose * inverse(b->body_from_mass);
    return out;
}

void World::set_pose(BodyId id, const Pose& pose) {
    if (find(id) == nullptr || !finite(pose)) return;
    Body& b = bodies_[id.index];
    b.settings.pose = pose;
    b.last = pose * b.body_from_mass;
    put(id.index, b.last);
}

void World::set_velocity(BodyId id, vec3 linear, vec3 angular) {
    if (find(id) != nullptr && finite(linear) && finite(angular)) push(id.index, linear, angular);
}

Surface World::surface(uint32_t index, vec3 p_world) const {
    const BodySettings& s = bodies_[index].settings;
    const Surface whole{s.friction, s.restitution, s.rolling_friction};
    const SdfShape* solid = solid_of(s.shape);
    if (s.surfaces.empty() || solid == nullptr) return whole;
    const Pose pose = s.motion == Motion::Static ? s.pose : get(index).pose * inverse(bodies_[index].body_from_mass);
    const uint32_t number = solid->field().material(inverse(pose) * p_world);
    return number < s.surfaces.size() ? s.surfaces[number] : whole;
}

Surface World::of_pair(const Surface& a, const Surface& b) {
    return {std::sqrt(a.friction * b.friction), std::max(a.restitution, b.restitution),
            std::max(a.rolling_friction, b.rolling_friction)};
}

void World::set_field(BodyId id, std::shared_ptr<const SdfShape> field, const Box3& changed) {
    const Body* b = find(id);
    KILN_ASSERT(b == nullptr || (b->settings.motion == Motion::Static && is_field(b->settings.shape)), "body {}",
                id.index);
    if (b == nullptr) return;
    std::shared_ptr<const SdfShape> before = field_ptr(b->settings.shape);
    if (b->mesher != nullptr) {
        b->mesher->changed(box_of_world(changed, inverse(b->settings.pose)));
        field = field->with(b->mesher->regions());
    }
    bodies_[id.index].settings.shape = field;
    swap(id.index, std::move(field));
    wake(changed);
    if (b->mesher != nullptr) b->mesher->let_go(std::move(before));  // meshes of regions are megabytes
}

void World::set_shape(BodyId id, std::shared_ptr<const SdfShape> shape) {
    const Body* was = find(id);
    KILN_ASSERT(
        was == nullptr || (was->mesher == nullptr && (shape->moves() || was->settings.motion == Motion::Static)),
        "body {}", id.index);
    if (was == nullptr) return;
    const BodyState now = state(id);
    const vec3 center = now.pose * was->mass.center;
    destroy(id.index);
    Body& b = bodies_[id.index];
    b.settings.shape = std::move(shape);
    b.settings.pose = now.pose;
    b.mass = {};
    b.body_from_mass = {};
    if (b.settings.motion != Motion::Static) {
        b.mass = physics::mass_of(b.settings);
        b.body_from_mass = {b.mass.center, b.mass.axes};
        if (b.settings.motion == Motion::Kinematic) b.mass.mass = 0;
    }
    b.settings.linear_velocity = now.linear_velocity + cross(now.angular_velocity, now.pose * b.mass.center - center);
    b.settings.angular_velocity = now.angular_velocity;
    b.last = now.pose * b.body_from_mass;
    b.support = {};
    create(id.index, b);
}

const BodySettings* World::settings(BodyId id) const {
    const Body* b = find(id);
    return b != nullptr ? &b->settings : nullptr;
}

// Of what is convex and awake: fields meet the ground's field.
void World::mesh_ground(float seconds) {
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
        Body& ground = bodies_[i];
        if (!ground.live || ground.mesher == nullptr) continue;
        const Pose ground_from_world = inverse(ground.settings.pose);
        for (uint32_t k = 0; k < bodies_.size(); ++k) {
            const Body& b = bodies_[k];
            const Convex* convex = std::get_if<Convex>(&b.settings.shape);
            if (!b.live || convex == nullptr || b.settings.motion != Motion::Dynamic) continue;
            const BodyState s = get(k);
            if (s.asleep) continue;
            ground.mesher->visit(box_around(ground_from_world * s.pose.position, outer_radius(*convex)));
        }
        const std::shared_ptr<const SdfShape> shape = field_ptr(ground.settings.shape);
        if (!ground.mesher->advance(double(seconds), shape->shared_field())) continue;
        auto next = shape->with(ground.mesher->regions());
        ground.settings.shape = next;
        swap(i, std::move(next));
    }
}

// Before the engine moves them: what lay on something in the last step.
void World::resist_rolling(float seconds) {
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
        Body& b = bodies_[i];
        if (!b.live || b.settings.motion != Motion::Dynamic) continue;
        const BodyState s = get(i);
        b.begun = s.linear_velocity;
        if (s.asleep || !(b.support.rolling_friction > 0)) continue;
        const Velocities now = physics::resist_rolling(b.mass, s.pose, {s.linear_velocity, s.angular_velocity},
                                                       b.support, gravity_, seconds);
        b.begun = now.linear;
        guide(i, now.linear, now.angular);
    }
}

// Whether a body, or a material of it, resists rolling.
bool World::resists_rolling(const Body& b) {
    return b.settings.rolling_friction > 0 || std::any_of(b.settings.surfaces.begin(), b.settings.surfaces.end(),
                                                          [](const Surface& s) { return s.rolling_friction > 0; });
}

// What holds each body up where rolling is resisted, and how hard it did so in this step. Of several places each counts by what it bears,
// the loads along their normals that come nearest to what the body gained: a stone in a corner lies on the floor, whatever it touches of
// the wall.
void World::find_supports(float seconds) {
    for (Body& b : bodies_) b.support = {};
    places_.clear();
    for (const Pair& p : pairs_) {
        if (p.depth < -kTouching || (!resists_rolling(bodies_[p.a]) && !resists_rolling(bodies_[p.b]))) continue;
        const float friction = of_pair(surface(p.a, p.point), surface(p.b, p.point)).rolling_friction;
        for (const bool first : {true, false})
            if (bodies_[first ? p.a : p.b].settings.motion == Motion::Dynamic)
                places_.push_back(
                    {first ? p.a : p.b, first ? p.b : p.a, p.point, first ? p.normal : -p.normal, friction});
    }
    std::stable_sort(places_.begin(), places_.end(), [](const Place& p, const Place& q) { return p.on < q.on; });
    for (size_t first = 0, last = 0; first < places_.size(); first = last) {
        const uint32_t on = places_[first].on;
        while (last < places_.size() && places_[last].on == on) ++last;
        const std::span<Place> all(places_.data() + first, last - first);
        Body& b = bodies_[on];
        const vec3 gained =
            get(on).linear_velocity - (b.begun + gravity_ * seconds) * std::exp(-b.settings.linear_damping * seconds);
        vec3 left = gained;
        for (int round = 0; round < (all.size() > 1 ? kLoadRounds : 1); ++round)
            for (Place& p : all) {
                const float load = std::max(p.load + dot(left, p.normal), 0.0f);
                left = left - p.normal * (load - p.load);
                p.load = load;
            }
        Support& s = b.support;
        float sum = 0;
        for (const Place& p : all) {
            if (!(p.load > 0)) continue;
            sum += p.load;
            s.point = s.point + p.point * p.load;
            s.normal = s.normal + p.normal * p.load;
            s.rolling_friction = std::max(s.rolling_friction, p.friction);
            if (bodies_[p.under].settings.motion == Motion::Static) continue;
            const BodyState below = get(p.under);
            const vec3 there = cross(below.angular_velocity, p.point - below.pose.position);
            s.spin = s.spin + below.angular_velocity * p.load;
            s.velocity = s.velocity + (below.linear_velocity + there) * p.load;
        }
        const float up = length(s.normal);
        if (!(up > 0)) {
            s = {};
            continue;
        }
        const float share = 1 / sum;
        s.point = s.point * share, s.spin = s.spin * share, s.velocity = s.velocity * share;
        s.normal = s.normal / up;
        s.impulse = std::max(dot(gained, s.normal), 0.0f) * float(b.mass.mass);
    }
}

void World::step(float seconds) {
    KILN_ASSERT(seconds > 0 && std::isfinite(seconds), "a step of {} s", double(seconds));
    mesh_ground(seconds);
    const bool supports = std::exchange(
        rolling_resisted_,
        std::any_of(bodies_.begin(), bodies_.end(), [](const Body& b) { return b.live && resists_rolling(b); }));
    if (rolling_resisted_) resist_rolling(seconds);
    advance(seconds);
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
        if (!bodies_[i].live || bodies_[i].settings.motion != Motion::Dynamic) continue;
        const BodyState s = get(i);
        if (finite(s.pose) && finite(s.linear_velocity) && finite(s.angular_velocity)) {
            bodies_[i].last = s.pose;
            continue;
        }
        put(i, bodies_[i].last);
        push(i, {}, {});
        ++lost_;
    }
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
        Body& b = bodies_[i];
        if (!b.live || b.settings.motion != Motion::Static || !is_field(b.settings.shape)) continue;
        if (auto next = field_of(b.settings.shape).renewed()) {
            b.settings.shape = next;
            swap(i, std::move(next));
        }
    }
    pairs_.clear();
    collect(pairs_);
    // To the last bit: engines tell them in any order, and sums and loads depend on it.
    const auto whose = [](const Pair& p) { return uint64_t(p.a) << 32 | p.b; };
    const auto key = [](const Pair& p) {
        return std::tuple(-p.depth, p.point.x, p.point.y, p.point.z, p.normal.x, p.normal.y, p.normal.z);
    };
    std::sort(pairs_.begin(), pairs_.end(), [&](const Pair& p, const Pair& q) {
        return whose(p) != whose(q) ? whose(p) < whose(q) : key(p) < key(q);
    });
    if (rolling_resisted_) find_supports(seconds);
    if (supports && !rolling_resisted_)
        for (Body& b : bodies_) b.support = {};
    events_.clear();
    std::vector<Touch>& touches = touches_before_;  // what is of no more use
    touches.clear();
    for (const Pair& p : pairs_) {
        const Touch t{id_of(p.a), id_of(p.b), p.depth};
        if (touches.empty() || touches.back().a != t.a || touches.back().b != t.b) touches.push_back(t);
    }
    // Both lists ascend: what is in one only has begun or ended.
    const auto less = [](const Touch& p, const Touch& q) { return std::pair(p.a, p.b) < std::pair(q.a, q.b); };
    auto before = touches_.begin();
    for (const Touch& t : touches) {
        for (; before != touches_.end() && less(*before, t); ++before) events_.push_back({before->a, before->b, false});
        if (before != touches_.end() && !less(t, *before)) {
            ++before;
        } else {
            events_.push_back({t.a, t.b, true});
        }
    }
    for (; before != touches_.end(); ++before) events_.push_back({before->a, before->b, false});
    touches_.swap(touches);
}

// Convex bodies have distances in closed form, so that questions are the same on every engine, and the same as those of fields.
template <typename Ask>
auto World::ask(uint32_t index, Ask&& ask_field) const {
    const BodyShape& shape = bodies_[index].settings.shape;
    const Pose pose = state(id_of(index)).pose;
    if (const SdfShape* solid = solid_of(shape)) return ask_field(solid->field(), pose);
    return ask_field(ConvexField(std::get<Convex>(shape)), pose);
}

template <typename Ask>
std::optional<BodyHit> World::first_hit(const Box3& box, BodyId but, Ask&& cast) const {
    std::vector<uint32_t> candidates;
    near(box, candidates);
    std::sort(candidates.begin(), candidates.end());  // of two at one place the lower index is hit
    std::optional<BodyHit> best;
    for (const uint32_t i : candidates) {
        if (id_of(i) == but) continue;
        ask(i, [&](const field::SdfField& field, const Pose& world) {
            const std::optional<FieldHit> hit = cast(field, inverse(world), best ? best->fraction : 1);
            if (hit && (!best || hit->fraction < best->fraction))
                best = BodyHit{id_of(i), hit->fraction, world * hit->point, rotate(world.rotation, hit->normal)};
        });
    }
    return best;
}

std::optional<BodyHit> World::cast_ray(vec3 origin, vec3 way, BodyId but) const {
    const vec3 end = origin + way;
    return first_hit({min(origin, end), max(origin, end)}, but, [&](const auto& field, const Pose& local, float most) {
        return physics::cast_ray(field, local * origin, rotate(local.rotation, way), most);
    });
}

std::optional<BodyHit> World::sweep(const Convex& shape, const Pose& pose, vec3 way, BodyId but) const {
    const float radius = outer_radius(shape);
    const Box3 box = box_union(box_around(pose.position, radius), box_around(pose.position + way, radius));
    return first_hit(box, but, [&](const auto& field, const Pose& local, float most) {
        return physics::sweep(field, shape, local * pose, rotate(local.rotation, way), most);
    });
}

std::vector<BodyContact> World::contacts(const Convex& shape, const Pose& pose, float margin, BodyId but) const {
    std::vector<uint32_t> candidates;
    near(box_around(pose.position, outer_radius(shape) + margin), candidates);
    std::sort(candidates.begin(), candidates.end());
    std::vector<BodyContact> out;
    std::vector<FieldContact> found;
    for (const uint32_t i : candidates) {
        if (id_of(i) == but) continue;
        ask(i, [&](const field::SdfField& field, const Pose& world) {
            collide(field, shape, inverse(world) * pose, margin, found);
            for (const FieldContact& c : found)
                out.push_back({id_of(i), world * c.point, rotate(world.rotation, c.normal), c.depth});
        });
    }
    return out;
}

std::vector<BodyContact> World::touch_points(const Touch& touch) const {
    std::vector<BodyContact> out;
    if (find(touch.a) == nullptr || find(touch.b) == nullptr) return out;
    // `on` is the convex one, or the one that moves.
    BodyId on = touch.b, of = touch.a;
    if (solid_of(*shape(on)) != nullptr && solid_of(*shape(of)) == nullptr) std::swap(on, of);
    if (solid_of(*shape(on)) != nullptr && !solid_of(*shape(on))->moves()) std::swap(on, of);
    std::vector<FieldContact> found;
    ask(of.index, [&](const field::SdfField& field, const Pose& world) {
        const Pose local = inverse(world) * state(on).pose;
        const SdfShape *solid = solid_of(*shape(on)), *other = solid_of(*shape(of));
        if (const Convex* convex = std::get_if<Convex>(shape(on))) {
            other != nullptr ? collide(*other, *convex, local, kMargin, found)
                             : collide(field, *convex, local, kMargin, found);
        } else if (solid != nullptr && other != nullptr) {
            collide(*solid, *other, local, kMargin, found);
        }
        for (const FieldContact& c : found)
            out.push_back({of, world * c.point, rotate(world.rotation, c.normal), c.depth});
    });
    return out;
}

const BodyShape* World::shape(BodyId id) const {
    const Body* b = find(id);
    return b != nullptr ? &b->settings.shape : nullptr;
}

std::vector<BodyId> World::overlap(const Convex& shape, const Pose& pose) const {
    std::vector<BodyId> out;
    for (const BodyContact& c : contacts(shape, pose, 0))
        if (out.empty() || out.back() != c.body) out.push_back(c.body);
    return out;
}

std::vector<BodyId> World::overlap(const SdfShape& shape, const Pose& pose) const {
    const Box3& box = shape.bounds();
    const float radius = box.finite() ? length(box.half_extents()) : 0;
    std::vector<uint32_t> candidates;
    near(box.finite() ? box_around(pose * box.center(), radius) : box, candidates);
    std::sort(candidates.begin(), candidates.end());
    std::vector<BodyId> out;
    std::vector<FieldContact> found;
    for (const uint32_t i : candidates) {
        const BodyShape& other = bodies_[i].settings.shape;
        const Pose shape_from_body = inverse(pose) * state(id_of(i)).pose;
        if (const SdfShape* solid = solid_of(other)) {
            collide(*solid, shape, shape_from_body, 0, found);
        } else {
            collide(shape.field(), std::get<Convex>(other), shape_from_body, 0, found);
        }
        if (!found.empty()) out.push_back(id_of(i));
    }
    return out;
}

vec3 World::velocity_at(BodyId id, vec3 p_world) const {
    const Body* b = find(id);
    if (b == nullptr || b->settings.motion == Motion::Static) return {};
    const BodyState s = get(id.index);
    return s.linear_velocity + cross(s.angular_velocity, p_world - s.pose.position);
}

Motion World::motion(BodyId id) const {
    const Body* b = find(id);
    return b != nullptr ? b->settings.motion : Motion::Static;
}

std::span<const Backend> backends() {
    static const std::vector<Backend> all = [] {
        std::vector<Backend> out;
#ifdef KILN_JOLT
        const Backend jolt{"jolt", jolt_fault(), make_jolt_world};
        if (jolt.why_not.empty()) out.push_back(jolt);
#endif
        out.push_back({"bullet", "", make_bullet_world});
#ifdef KILN_JOLT
        if (!jolt.why_not.empty()) out.push_back(jolt);
#endif
        return out;
    }();
    return all;
}

Result<std::unique_ptr<World>> make_world(std::string_view name, const WorldSettings& settings) {
    std::string known;
    for (const Backend& b : backends()) {
        if (!b.why_not.empty()) {
            if (b.name == name) return Error{formatted("physics engine {}: {}", name, b.why_not), ErrorKind::Usage};
            continue;
        }
        if (name.empty() || b.name == name) return b.make(settings);
        known += (known.empty() ? "" : ", ") + std::string(b.name);
    }
    return Error{formatted("there is no physics engine \"{}\"; there is {}", name, known), ErrorKind::Usage};
}

}  // namespace kiln::physics
