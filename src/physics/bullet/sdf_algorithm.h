// SPDX-License-Identifier: MIT
// Fields as shapes of Bullet: a custom concave shape, and the collision algorithms for its pairs. Rays, sweeps and continuous motion of ours
// are answered by the field itself (physics.h, bullet_world.cpp); Bullet's own, which know triangles only, are given those of the voxels they
// pass.
#pragma once

#include "physics/physics.h"

#include <btBulletCollisionCommon.h>

namespace kiln::physics {

inline Pose to_pose(const btTransform& t) {
    const btVector3& p = t.getOrigin();
    const btQuaternion q = t.getRotation();
    return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}
inline vec3 to_vec(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btVector3 to_bullet(vec3 v) { return {v.x, v.y, v.z}; }
inline btTransform to_bullet(const Pose& p) {
    return btTransform(btQuaternion(p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w), to_bullet(p.position));
}

/// The triangles of meshed regions alone.
class BulletRegionsShape final : public btConcaveShape {
public:
    explicit BulletRegionsShape(std::shared_ptr<const SdfShape> shape);
    void set(std::shared_ptr<const SdfShape> shape) { sdf_ = std::move(shape); }
    void getAabb(const btTransform&, btVector3& low, btVector3& high) const override;
    void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return one_; }
    const char* getName() const override { return "regions"; }
    /// `part` is the region's number, `index` its triangle's.
    void processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override;

private:
    std::shared_ptr<const SdfShape> sdf_;
    btVector3 one_{1, 1, 1};
};

/// `field_from_body`: from Bullet's frame, that of the mass, to the field's.
class BulletSdfShape final : public btConcaveShape {
public:
    BulletSdfShape(std::shared_ptr<const SdfShape> shape, const Pose& field_from_body);
    const SdfShape& sdf() const { return *sdf_; }
    void set(std::shared_ptr<const SdfShape> shape) {
        sdf_ = std::move(shape);
        regions_.set(sdf_);
        ++revision_;
    }
    const btConcaveShape& regions() const { return regions_; }
    uint32_t revision() const { return revision_; }  ///< how often it was another field
    const Pose& field_from_body() const { return field_from_body_; }

    void getAabb(const btTransform& t, btVector3& low, btVector3& high) const override;
    void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
    void setLocalScaling(const btVector3&) override {}
    const btVector3& getLocalScaling() const override { return one_; }
    const char* getName() const override { return "field"; }
    /// Of the voxels that the box meets: see triangles_in().
    void processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override;

private:
    std::shared_ptr<const SdfShape> sdf_;
    BulletRegionsShape regions_;
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
