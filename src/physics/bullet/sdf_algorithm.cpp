// SPDX-License-Identifier: MIT

#include "physics/bullet/sdf_algorithm.h"

#include "physics/bullet/region_edges.h"
#include "physics/cell_triangles.h"
#include "physics/ground_contacts.h"
#include "physics/sdf_collision.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

namespace kiln::physics {

namespace {

// Bullet's tree of boxes wants finite ones; a kilometre-sized number of them keeps their area finite in floats.
constexpr float kWorldSize = 1e5f;

// Bullet keeps four points of a pair between steps, with their impulses. Offered more, it drops others each time, and what rests
// trembles. So the same four are chosen while nothing moves: the ends of a long triangle, the point farthest across it, and the deepest
// where it is deeper than those by more than noise.
void keep_four(std::vector<FieldContact>& contacts) {
    constexpr float kNoise = 1e-3f;
    if (contacts.size() <= 4) return;
    const auto best = [&](auto&& score) {
        return *std::max_element(contacts.begin(), contacts.end(),
                                 [&](const FieldContact& a, const FieldContact& b) { return score(a) < score(b); });
    };
    FieldContact kept[4];
    kept[0] = best([](const FieldContact& c) { return c.point.x + 0.37f * c.point.y + 0.61f * c.point.z; });
    kept[1] = best([&](const FieldContact& c) { return length(c.point - kept[0].point); });
    const vec3 along = kept[1].point - kept[0].point;
    kept[2] = best([&](const FieldContact& c) { return length(cross(along, c.point - kept[0].point)); });
    const vec3 across = cross(along, kept[2].point - kept[0].point);
    // On the other side of the line.
    kept[3] = best([&](const FieldContact& c) { return -dot(across, cross(along, c.point - kept[0].point)); });
    const FieldContact deepest = best([](const FieldContact& c) { return c.depth; });
    FieldContact* shallow = std::min_element(
        kept, kept + 4, [](const FieldContact& a, const FieldContact& b) { return a.depth < b.depth; });
    if (deepest.depth > std::max({kept[0].depth, kept[1].depth, kept[2].depth, kept[3].depth}) + kNoise)
        *shallow = deepest;
    contacts.assign(kept, kept + 4);
}

// One pair of bodies, as long as their boxes meet. The manifold keeps up to four points between steps, with their impulses.
class SdfAlgorithm : public btCollisionAlgorithm {
public:
    SdfAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                 const btCollisionObjectWrapper* b)
        : btCollisionAlgorithm(info),
          manifold_(m_dispatcher->getNewManifold(a->getCollisionObject(), b->getCollisionObject())) {}
    ~SdfAlgorithm() override { m_dispatcher->releaseManifold(manifold_); }

    btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                   btManifoldResult*) override {
        return 1;  // continuous bodies are swept before they move (bullet_world.cpp)
    }
    void getAllContactManifolds(btManifoldArray& all) override { all.push_back(manifold_); }

protected:
    // Contacts found when the bodies lay as they still do, within half a millimetre and a sixth of a degree, are good for another step;
    // Bullet moves their points along. (Jolt does so too.)
    bool as_before(const Pose& second_from_first, uint32_t revision, btManifoldResult* result) {
        constexpr float kPlace = 5e-4f, kTurn = 3e-3f;
        const quat turn = conjugate(found_at_.rotation) * second_from_first.rotation;
        const float way = length(second_from_first.position - found_at_.position);
        if (manifold_->getNumContacts() > 0 && revision == revision_ && way < kPlace &&
            2 * std::hypot(turn.x, turn.y, turn.z) < kTurn) {
            result->setPersistentManifold(manifold_);
            result->refreshContactPoints();
            return true;
        }
        found_at_ = second_from_first;
        revision_ = revision;
        return false;
    }
    float margin() const { return manifold_->getContactBreakingThreshold(); }
    // Points of body 0's side, normals out of body 1, in the frame `world_from_field`.
    void add(btManifoldResult* result, const Pose& world_from_field, bool field_is_first) {
        keep_four(contacts_);
        for (const FieldContact& c : contacts_) {
            // The body's point lies `depth` inside the field: the field's own point is that far back out.
            const vec3 normal = rotate(world_from_field.rotation, c.normal);
            const vec3 on_body = world_from_field * c.point;
            if (field_is_first) {
                result->addContactPoint(to_bullet(-normal), to_bullet(on_body), -c.depth);
            } else {
                result->addContactPoint(to_bullet(normal), to_bullet(on_body + normal * c.depth), -c.depth);
            }
        }
        result->refreshContactPoints();
    }

    btPersistentManifold* manifold_;
    Pose found_at_;
    uint32_t revision_ = ~0u;
    std::vector<FieldContact> contacts_;
};

// Contacts with triangles of regions, in the ground's frame, with the normals that their edges allow. Bullet says which triangle before it
// adds them; whichever body is the first, normals are out of the triangle, and points on it (btConvexTriangleCallback). They are gathered,
// not kept: Bullet takes a new point for an old one that is nearer than its threshold, and triangles are hardly larger than that, so which
// of two neighbours' normals stayed would change from step to step, and what rests would tremble.
class OnRegions final : public btManifoldResult {
public:
    OnRegions(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const Regions& regions,
              const Pose& world_from_ground, bool ground_first, std::vector<FieldContact>& out)
        : btManifoldResult(a, b),
          regions_(regions),
          world_(world_from_ground),
          ground_first_(ground_first),
          out_(out) {}
    void addContactPoint(const btVector3& normal, const btVector3& point, btScalar distance) override {
        const Regions::Entry* e = regions_.numbered(uint32_t(ground_first_ ? m_partId0 : m_partId1));
        const uint32_t triangle = uint32_t(ground_first_ ? m_index0 : m_index1);
        const Pose local = inverse(world_);
        const auto& edges = *static_cast<const RegionEdges*>(e->mesh->made.get());
        const vec3 on_ground = local * to_vec(point), out = rotate(local.rotation, to_vec(normal));
        const auto allowed = edges.allowed(*e->mesh, triangle, on_ground, out);
        if (allowed) out_.push_back({on_ground + out * distance, *allowed, -distance});
    }

private:
    const Regions& regions_;
    Pose world_;
    bool ground_first_;
    std::vector<FieldContact>& out_;
};

// kFieldFirst: body 0 is the field.
template <bool kFieldFirst>
class ConvexAlgorithm final : public SdfAlgorithm {
public:
    using SdfAlgorithm::SdfAlgorithm;
    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& settings, btManifoldResult* result) override {
        const btCollisionObjectWrapper *field = kFieldFirst ? a : b, *convex = kFieldFirst ? b : a;
        const auto& shape = static_cast<const BulletSdfShape&>(*field->getCollisionShape());
        const Pose world_from_field = to_pose(field->getWorldTransform()) * inverse(shape.field_from_body());
        const Pose field_from_convex = inverse(world_from_field) * to_pose(convex->getWorldTransform());
        if (shape.sdf().regions() == nullptr) {
            if (as_before(field_from_convex, shape.revision(), result)) return;
            collide(shape.sdf(), convex_of(convex->getCollisionShape()), field_from_convex, margin(), contacts_);
            result->setPersistentManifold(manifold_);
            add(result, world_from_field, kFieldFirst);
            return;
        }
        if (as_before(field_from_convex, shape.revision(), result)) return;
        const Convex& body = convex_of(convex->getCollisionShape());
        const bool triangles = collide_ground(shape.sdf(), body, field_from_convex, margin(), contacts_);
        if (triangles) {
            if (on_triangles_ == nullptr) {
                btCollisionAlgorithmConstructionInfo info;
                info.m_dispatcher1 = m_dispatcher;
                on_triangles_ = std::make_unique<btConvexConcaveCollisionAlgorithm>(info, a, b, kFieldFirst);
            }
            const btCollisionObjectWrapper regions(field->m_parent, &shape.regions(), field->getCollisionObject(),
                                                   field->getWorldTransform(), -1, -1);
            OnRegions gathered(a, b, *shape.sdf().regions(), world_from_field, kFieldFirst, contacts_);
            on_triangles_->processCollision(kFieldFirst ? &regions : convex, kFieldFirst ? convex : &regions, settings,
                                            &gathered);
            settle_on_triangles(shape.sdf(), body, field_from_convex, margin(), contacts_);
        } else {
            on_triangles_.reset();
        }
        if (contacts_.empty()) {
            manifold_->clearManifold();
            return;
        }
        result->setPersistentManifold(manifold_);
        add(result, world_from_field, kFieldFirst);
    }

private:
    std::unique_ptr<btConvexConcaveCollisionAlgorithm> on_triangles_;  // of meshed ground
};

// Two fields, or a field and a mesh, which is met as the solid that it is the surface of.
class FieldsAlgorithm final : public SdfAlgorithm {
public:
    using SdfAlgorithm::SdfAlgorithm;
    ~FieldsAlgorithm() override {
        for (btPersistentManifold* m : more_)
            if (m != nullptr) m_dispatcher->releaseManifold(m);
    }
    void getAllContactManifolds(btManifoldArray& all) override {
        SdfAlgorithm::getAllContactManifolds(all);
        for (btPersistentManifold* m : more_)
            if (m != nullptr) all.push_back(m);
    }
    struct Side {
        const SdfShape* sdf;
        Pose world;
        uint32_t revision;
    };
    static Side side_of(const btCollisionObjectWrapper* w) {
        const Pose world = to_pose(w->getWorldTransform());
        if (w->getCollisionShape()->getShapeType() != CUSTOM_CONCAVE_SHAPE_TYPE)
            return {static_cast<const Triangles*>(w->getCollisionShape()->getUserPointer())->solid.get(), world, 0};
        const auto& shape = static_cast<const BulletSdfShape&>(*w->getCollisionShape());
        return {&shape.sdf(), world * inverse(shape.field_from_body()), shape.revision()};
    }
    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& settings, btManifoldResult* result) override {
        const Side side_a = side_of(a), side_b = side_of(b);
        const Pose world_from_b = side_b.world;
        const Pose b_from_a = inverse(world_from_b) * side_a.world;
        if (as_before(b_from_a, side_a.revision + side_b.revision, result)) {
            for (btPersistentManifold* m : more_) {
                if (m == nullptr) continue;
                result->setPersistentManifold(m);
                result->refreshContactPoints();
            }
            return;
        }
        const auto velocity = [](const btCollisionObjectWrapper* w) {
            return to_vec(w->getCollisionObject()->getInterpolationLinearVelocity());
        };
        // What comes fast is met before it is there.
        const auto turns = [](const btCollisionObjectWrapper* w, const Side& side) {
            const float turn = w->getCollisionObject()->getInterpolationAngularVelocity().length();
            return turn > 0 ? turn * length(side.sdf->bounds().half_extents()) : 0;
        };
        const float speed = length(velocity(a) - velocity(b)) + turns(a, side_a) + turns(b, side_b);
        const float reach = reach_of(speed * settings.m_timeStep);
        collide(*side_a.sdf, *side_b.sdf, b_from_a, reach, contacts_);
        manifold_->setContactBreakingThreshold(reach);
        const auto moves = [](const btCollisionObjectWrapper* w) {
            return !w->getCollisionObject()->isStaticOrKinematicObject();
        };
        if (reach > kMargin || (moves(a) && moves(b))) {
            lay(result, world_from_b);
        } else {
            for (btPersistentManifold* m : more_)
                if (m != nullptr) m->clearManifold();
            result->setPersistentManifold(manifold_);
            add(result, world_from_b, false);
        }
    }

private:
    static constexpr size_t kMore = 2, kPlaces = 4;  // manifolds beside the first; points of one

    // Four points do not stop a ring that another comes through, nor one that is struck from above where it lies on a third: what moves on
    // what moves, and what comes fast, has up to twelve: first the four that stay the same, then the deepest of the others.
    void lay(btManifoldResult* result, const Pose& world_from_b) {
        others_ = contacts_;
        keep_four(contacts_);
        const size_t kept = contacts_.size();
        for (const FieldContact& c : others_) {
            if (contacts_.size() == (1 + kMore) * kPlaces) break;  // they are sorted
            if (std::any_of(contacts_.begin(), contacts_.begin() + std::ptrdiff_t(kept),
                            [&](const FieldContact& k) { return k.point == c.point; }))
                continue;
            contacts_.push_back(c);
        }
        // Bullet takes a new point for an old one that is nearer than the threshold, which may be how far the bodies come in a step. So each
        // is made alone, and begins with the impulse of the nearest of the step before within the margin of what rests.
        std::array<btPersistentManifold*, 1 + kMore> all{manifold_, more_[0], more_[1]};
        std::array<btManifoldPoint, (1 + kMore) * kPlaces> before;
        size_t had = 0;
        for (btPersistentManifold* m : all) {
            for (int i = 0; m != nullptr && i < m->getNumContacts(); ++i) before[had++] = m->getContactPoint(i);
        }
        const auto take_over = [&](btManifoldPoint& made) {
            const auto far = [&](const btManifoldPoint& p) { return (p.m_localPointA - made.m_localPointA).length2(); };
            const auto end = before.begin() + std::ptrdiff_t(had);
            const auto old =
                std::min_element(before.begin(), end,
                                 [&](const btManifoldPoint& p, const btManifoldPoint& q) { return far(p) < far(q); });
            if (old == end || far(*old) > kMargin * kMargin) return;
            made.m_appliedImpulse = old->m_appliedImpulse;
            made.m_appliedImpulseLateral1 = old->m_appliedImpulseLateral1;
            made.m_appliedImpulseLateral2 = old->m_appliedImpulseLateral2;
            made.m_lifeTime = old->m_lifeTime;
            *old = before[--had];
        };
        const float reach = manifold_->getContactBreakingThreshold();
        for (size_t m = 0; m < all.size(); ++m) {
            const size_t first = std::min(m * kPlaces, contacts_.size()),
                         last = std::min(first + kPlaces, contacts_.size());
            if (all[m] == nullptr) {
                if (first == last) continue;
                all[m] = more_[m - 1] = m_dispatcher->getNewManifold(manifold_->getBody0(), manifold_->getBody1());
            }
            btPersistentManifold& manifold = *all[m];
            manifold.setContactBreakingThreshold(reach);
            result->setPersistentManifold(&manifold);
            std::array<btManifoldPoint, kPlaces> points;
            int count = 0;
            for (size_t i = first; i < last; ++i) {
                const FieldContact& c = contacts_[i];
                const vec3 normal = rotate(world_from_b.rotation, c.normal);
                manifold.setNumContacts(0);
                result->addContactPoint(to_bullet(normal), to_bullet(world_from_b * c.point + normal * c.depth),
                                        -c.depth);
                if (manifold.getNumContacts() == 0) continue;  // beyond the reach by rounding
                points[size_t(count)] = manifold.getContactPoint(0);
                take_over(points[size_t(count++)]);
            }
            manifold.setNumContacts(count);
            for (int i = 0; i < count; ++i) manifold.getContactPoint(i) = points[size_t(i)];
            result->refreshContactPoints();
        }
    }

    std::array<btPersistentManifold*, kMore> more_{};
    std::vector<FieldContact> others_;
};

template <typename Algorithm>
struct Create final : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override {
        return new (info.m_dispatcher1->allocateCollisionAlgorithm(int(sizeof(Algorithm)))) Algorithm(info, a, b);
    }
};

}  // namespace

BulletSdfShape::BulletSdfShape(std::shared_ptr<const SdfShape> shape, const Pose& field_from_body)
    : sdf_(std::move(shape)), regions_(sdf_), field_from_body_(field_from_body) {
    m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE;
    m_collisionMargin = 0;
}

namespace {

// Of the voxels that bricks have; where there are no bricks, of the surface points, or of what a person would not feel.
float voxel_of(const SdfShape& shape) {
    if (const float error = shape.bricks().error(); error > 0) return 2 * error;
    return shape.spacing() > 0 ? shape.spacing() : 0.1f;
}

}  // namespace

void BulletSdfShape::processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                                         const btVector3& high) const {
    const vec3 from{low.x(), low.y(), low.z()}, to{high.x(), high.y(), high.z()};
    const Box3 box =
        box_of(Convex::box((to - from) * 0.5f), {field_from_body_ * ((from + to) * 0.5f), field_from_body_.rotation});
    std::vector<vec3> corners;
    triangles_in(sdf_->bricks(), voxel_of(*sdf_), box, corners);
    const Pose body_from_field = inverse(field_from_body_);
    for (size_t i = 0; i < corners.size(); i += 3) {
        btVector3 triangle[3];
        for (size_t k = 0; k < 3; ++k) triangle[k] = to_bullet(body_from_field * corners[i + k]);
        callback->processTriangle(triangle, 0, int(i / 3));
    }
}

BulletRegionsShape::BulletRegionsShape(std::shared_ptr<const SdfShape> shape) : sdf_(std::move(shape)) {
    // Bullet takes the custom type for its own class of fields where it looks for triangles.
    m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE;
    m_collisionMargin = 0;
}

void BulletRegionsShape::getAabb(const btTransform&, btVector3& low, btVector3& high) const {
    low.setValue(-kWorldSize, -kWorldSize, -kWorldSize);
    high.setValue(kWorldSize, kWorldSize, kWorldSize);
}

// The frame of what stands is the field's.
void BulletRegionsShape::processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                                             const btVector3& high) const {
    const Box3 box{{low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}};
    sdf_->regions()->each(box, [&](const Regions::Entry& e) {
        e.mesh->each(box, [&](uint32_t t) {
            btVector3 triangle[3];
            for (uint32_t k = 0; k < 3; ++k) triangle[k] = to_bullet(e.mesh->vertices[e.mesh->indices[3 * t + k]]);
            callback->processTriangle(triangle, int(e.number), int(t));
        });
    });
}

void BulletSdfShape::getAabb(const btTransform& t, btVector3& low, btVector3& high) const {
    const Box3& box = sdf_->bounds();
    if (!box.finite()) {
        low.setValue(-kWorldSize, -kWorldSize, -kWorldSize);
        high.setValue(kWorldSize, kWorldSize, kWorldSize);
        return;
    }
    const Pose world = to_pose(t) * inverse(field_from_body_);
    const vec3 half = box.half_extents(), center = world * box.center();
    const vec3 x = rotate(world.rotation, {half.x, 0, 0}), y = rotate(world.rotation, {0, half.y, 0}),
               z = rotate(world.rotation, {0, 0, half.z});
    const vec3 reach{std::abs(x.x) + std::abs(y.x) + std::abs(z.x), std::abs(x.y) + std::abs(y.y) + std::abs(z.y),
                     std::abs(x.z) + std::abs(y.z) + std::abs(z.z)};
    low = to_bullet(center - reach);
    high = to_bullet(center + reach);
}

void BulletSdfShape::calculateLocalInertia(btScalar mass, btVector3& inertia) const {
    const MassProperties& m = sdf_->mass();
    const double k = m.mass > 0 ? double(mass) / m.mass : 0;
    inertia.setValue(float(m.moments.x * k), float(m.moments.y * k), float(m.moments.z * k));
}

SdfAlgorithms::SdfAlgorithms(btCollisionDispatcher& dispatcher)
    : convex_(new Create<ConvexAlgorithm<false>>),
      swapped_(new Create<ConvexAlgorithm<true>>),
      fields_(new Create<FieldsAlgorithm>) {
    for (const int type :
         {SPHERE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, CAPSULE_SHAPE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE}) {
        dispatcher.registerCollisionCreateFunc(type, CUSTOM_CONCAVE_SHAPE_TYPE, convex_.get());
        dispatcher.registerCollisionCreateFunc(CUSTOM_CONCAVE_SHAPE_TYPE, type, swapped_.get());
    }
    dispatcher.registerCollisionCreateFunc(CUSTOM_CONCAVE_SHAPE_TYPE, CUSTOM_CONCAVE_SHAPE_TYPE, fields_.get());
    dispatcher.registerCollisionCreateFunc(CUSTOM_CONCAVE_SHAPE_TYPE, TRIANGLE_MESH_SHAPE_PROXYTYPE, fields_.get());
    dispatcher.registerCollisionCreateFunc(TRIANGLE_MESH_SHAPE_PROXYTYPE, CUSTOM_CONCAVE_SHAPE_TYPE, fields_.get());
}
SdfAlgorithms::~SdfAlgorithms() = default;

}  // namespace kiln::physics
