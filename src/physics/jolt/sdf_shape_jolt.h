// SPDX-License-Identifier: MIT
// Fields as shapes of Jolt: a custom shape and its entries in the table of pairs.
#pragma once

#include <Jolt/Jolt.h>

#include <Jolt/Physics/Collision/Shape/Shape.h>

#include "physics/jolt/step_order.h"
#include "physics/physics.h"

namespace kiln::physics {

inline vec3 to_vec(JPH::Vec3Arg v) { return {v.GetX(), v.GetY(), v.GetZ()}; }
inline JPH::Vec3 to_jolt(vec3 v) { return {v.x, v.y, v.z}; }
inline JPH::Quat to_jolt(quat q) { return {q.x, q.y, q.z, q.w}; }
inline quat to_quat(JPH::QuatArg q) { return {q.GetX(), q.GetY(), q.GetZ(), q.GetW()}; }

/// Jolt's frame of a shape is at its centre of mass, with the axes of the body: a field's is moved there, not turned.
class JoltSdfShape final : public JPH::Shape {
public:
    JPH_OVERRIDE_NEW_DELETE
    explicit JoltSdfShape(std::shared_ptr<const SdfShape> sdf);
    /// Puts the pairs of fields with convex shapes and fields into Jolt's table. Once, after RegisterTypes().
    static void register_pairs();

    const SdfShape& sdf() const { return *sdf_; }
    /// Between steps, and then the body must be told. The centre of mass stays: only for what stands.
    void set(std::shared_ptr<const SdfShape> sdf) { sdf_ = std::move(sdf); }
    /// From Jolt's frame to the field's.
    vec3 center() const { return sdf_->mass().center; }

    bool MustBeStatic() const override { return !sdf_->moves(); }
    JPH::Vec3 GetCenterOfMass() const override {
        const CallInStep call;
        return to_jolt(center());
    }
    JPH::AABox GetLocalBounds() const override;
    JPH::uint GetSubShapeIDBitsRecursive() const override;
    float GetInnerRadius() const override {
        const CallInStep call;
        return float(sdf_->inner_radius());
    }
    JPH::MassProperties GetMassProperties() const override { return {}; }  // given with the body
    const JPH::PhysicsMaterial* GetMaterial(const JPH::SubShapeID&) const override;
    JPH::Vec3 GetSurfaceNormal(const JPH::SubShapeID&, JPH::Vec3Arg local) const override;
    void GetSubmergedVolume(JPH::Mat44Arg, JPH::Vec3Arg, const JPH::Plane&, float& total, float& submerged,
                            JPH::Vec3& center JPH_IF_DEBUG_RENDERER(, JPH::RVec3Arg)) const override;
#ifdef JPH_DEBUG_RENDERER
    void Draw(JPH::DebugRenderer*, JPH::RMat44Arg, JPH::Vec3Arg, JPH::ColorArg, bool, bool) const override {}
#endif
    bool CastRay(const JPH::RayCast& ray, const JPH::SubShapeIDCreator& id, JPH::RayCastResult& hit) const override;
    void CastRay(const JPH::RayCast& ray, const JPH::RayCastSettings& settings, const JPH::SubShapeIDCreator& id,
                 JPH::CastRayCollector& collector, const JPH::ShapeFilter& filter) const override;
    void CollidePoint(JPH::Vec3Arg point, const JPH::SubShapeIDCreator& id, JPH::CollidePointCollector& collector,
                      const JPH::ShapeFilter& filter) const override;
    void CollideSoftBodyVertices(JPH::Mat44Arg transform, JPH::Vec3Arg scale,
                                 const JPH::CollideSoftBodyVertexIterator& vertices, JPH::uint count,
                                 int shape_index) const override;
    // Fields have no triangles.
    void GetTrianglesStart(GetTrianglesContext&, const JPH::AABox&, JPH::Vec3Arg, JPH::QuatArg,
                           JPH::Vec3Arg) const override {}
    int GetTrianglesNext(GetTrianglesContext&, int, JPH::Float3*, const JPH::PhysicsMaterial**) const override {
        return 0;
    }
    Stats GetStats() const override { return {sizeof(*this), 0}; }
    float GetVolume() const override { return float(sdf_->mass().mass); }

private:
    std::shared_ptr<const SdfShape> sdf_;
};

// While contacts with meshed ground are gathered, its parts are numbered by the region, then by its mesh's own numbers.
inline constexpr JPH::uint kRegionBits = 9, kMeshBits = 32 - kRegionBits;
static_assert(kMostRegions <= 1u << kRegionBits);

/// What a mesh is made of, likewise.
inline const Triangles& triangles_of(const JPH::Shape* s) {
    return *reinterpret_cast<const Triangles*>(s->GetUserData());
}
/// What a convex shape of ours is, kept as Jolt's user data of the shape.
inline const Convex& convex_of(const JPH::Shape* s) { return *reinterpret_cast<const Convex*>(s->GetUserData()); }

}  // namespace kiln::physics
