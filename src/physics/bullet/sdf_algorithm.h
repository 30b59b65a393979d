// SPDX-License-Identifier: MIT
// Fields as shapes of Bullet: a custom concave shape, and the collision algorithms for its pairs. Bullet's own paths over triangles never
// see it: rays, sweeps and continuous motion are answered by the field itself (physics.h, bullet_world.cpp).
#pragma once

#include "physics/physics.h"

#include <btBulletCollisionCommon.h>

namespace kiln::physics {

inline Pose to_pose(const btTransform& t) {
    const btVector3& p = t.getOrigin();
    const btQuaternion q = t.getRotation();
    return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}
inline btVector3 to_bullet(vec3 v) { return {v.x, v.y, v.z}; }
inline btTransform to_bullet(const Pose& p) {
    return btTransform(btQuaternion(p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w), to_bullet(p.position));
}

/// `field_from_body`: from Bullet's frame, that of the mass, to the field's.
class BulletSdfShape final : public btConcaveShape {
public:
    BulletSdfShape(std::shared_ptr<const SdfShape> shape, const Pose& field_from_body);
    const SdfShape& sdf() const { return *sdf_; }
    void set(std::shared_ptr<const SdfShape> shape) {
        sdf_ = std::move(shape);
        ++revision_;
    }
    uint32_t revision() const { return revision_; }  ///< how often it was another field
    const Pose& field_from_body() const { return field_from_body_; }

    void getAabb(const btTransform& t, btVector3& low, btVector3& high) const override;
    void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return one_; }
    const char* getName() const override { return "field"; }
    void processAllTriangles(btTriangleCallback*, const btVector3&, const btVector3&) const override {}

private:
    std::shared_ptr<const SdfShape> sdf_;
    Pose field_from_body_;
    uint32_t revision_ = 0;
    btVector3 one_{1, 1, 1};
};

/// What a convex shape of ours is, kept as Bullet's user pointer of the shape.
inline const Convex& convex_of(const btCollisionShape* s) { return *static_cast<const Convex*>(s->getUserPointer()); }

/// Registers the algorithms for fields against all convex shapes and against fields. The dispatcher keeps them by pointer: `this` must
/// outlive it.
class SdfAlgorithms {
public:
    explicit SdfAlgorithms(btCollisionDispatcher& dispatcher);
    ~SdfAlgorithms();

private:
    std::unique_ptr<btCollisionAlgorithmCreateFunc> convex_, swapped_, fields_;
};

}  // namespace kiln::physics
