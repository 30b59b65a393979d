// SPDX-License-Identifier: MIT

#include "physics/jolt/sdf_shape_jolt.h"

#include "physics/facing.h"
#include "physics/ground_contacts.h"
#include "physics/sdf_collision.h"

#include <Jolt/Physics/Collision/CastResult.h>
#include <Jolt/Physics/Collision/CollidePointResult.h>
#include <Jolt/Physics/Collision/CollideShape.h>
#include <Jolt/Physics/Collision/CollideSoftBodyVertexIterator.h>
#include <Jolt/Physics/Collision/CollisionDispatch.h>
#include <Jolt/Physics/Collision/InternalEdgeRemovingCollector.h>
#include <Jolt/Physics/Collision/PhysicsMaterial.h>
#include <Jolt/Physics/Collision/RayCast.h>
#include <Jolt/Physics/Collision/Shape/ConvexShape.h>
#include <Jolt/Physics/Collision/ShapeCast.h>
#include <Jolt/Physics/Collision/TransformedShape.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace kiln::physics {

namespace {

using namespace JPH;

constexpr EShapeSubType kType = EShapeSubType::User1;
constexpr float kWorldSize = 1e5f;  // of what has no end: the tree of boxes wants finite ones
// Jolt keeps contacts between steps, and sorts them, by the numbers of the parts that touch. A field's parts are the directions it faces.
// Contacts of one pair that face alike within five degrees are one to Jolt (PhysicsSettings::mContactNormalCosMaxDeltaRotation), others
// must not share a number: their order, and so the outcome, would be left to the threads. Of what it makes one it keeps four points, those
// far apart from their opposites rather than those that touch, and gives them one normal: so fields that move, and ground that is meshed
// where it settled, are not for it to reduce, and the numbers of their contacts say also where they are.
const JoltSdfShape& field_of(const JPH::Shape* s) { return *static_cast<const JoltSdfShape*>(s); }

Pose pose_of(Mat44Arg m) { return {to_vec(m.GetTranslation()), to_quat(m.GetQuaternion())}; }
// Of the field's own frame in the world, given that of its centre of mass.
Pose world_of(const JoltSdfShape& field, Mat44Arg center_of_mass) {
    Pose out = pose_of(center_of_mass);
    out.position = out * -field.center();
    return out;
}

// Where contacts of one pair lie about a centre, for their numbers: in each direction one.
class Places {
public:
    explicit Places(vec3 center) : center_(center) {}
    uint32 number(uint32 normal, vec3 point) {
        const vec3 from = point - center_;
        uint32 place = dot(from, from) > 0 ? facing(from) : 0;
        while (std::find(taken_.begin(), taken_.end(), normal << kFacingBits | place) != taken_.end())
            place = (place + 1) & ((1u << kFacingBits) - 1);
        taken_.push_back(normal << kFacingBits | place);
        return place;
    }

private:
    vec3 center_;
    StaticArray<uint32, kMostContacts> taken_;
};

// Hits of shape 1 on the field that is shape 2; `world` is the field's frame, `center1` the centre of mass of shape 1 in the world.
void add(const std::vector<FieldContact>& contacts, const Pose& world, bool field1, bool separate, vec3 center1,
         const SubShapeIDCreator& id1, const SubShapeIDCreator& id2, CollideShapeCollector& collector) {
    Places places(inverse(world) * center1);
    for (const FieldContact& c : contacts) {
        if (collector.ShouldEarlyOut()) return;
        if (-c.depth >= collector.GetEarlyOutFraction()) continue;
        const vec3 normal = rotate(world.rotation, c.normal), on1 = world * c.point;
        const uint32 number = facing(c.normal);
        const SubShapeID part1 = field1 ? id1.PushID(number, kFacingBits).GetID() : id1.GetID();
        SubShapeIDCreator part2 = id2.PushID(number, kFacingBits);
        if (separate) part2 = part2.PushID(places.number(number, c.point), kFacingBits);
        collector.AddHit(CollideShapeResult(to_jolt(on1), to_jolt(on1 + normal * c.depth), to_jolt(-normal), c.depth,
                                            part1, part2.GetID(),
                                            TransformedShape::sGetBodyID(collector.GetContext())));
    }
}

// Hits on meshes of regions, of which those on aprons are let go: where they touch, in the ground's frame. Facets that a body glides over
// face now this way, now that, and each turn costs it speed: which way, and how deep, the field says (measure()).
class OwnHits final : public CollideShapeCollector {
public:
    OwnHits(const Regions& regions, const Pose& ground_from_world, std::vector<FieldContact>& out)
        : regions_(regions), local_(ground_from_world), out_(out) {}
    void AddHit(const CollideShapeResult& hit) override {
        SubShapeID rest;
        const Regions::Entry* e = regions_.numbered(hit.mSubShapeID2.PopID(kRegionBits, rest));
        const vec3 normal = rotate(local_.rotation, to_vec(-hit.mPenetrationAxis.NormalizedOr(-Vec3::sAxisY())));
        if (is_own(*e->mesh, local_ * to_vec(hit.mContactPointOn2)))
            out_.push_back({local_ * to_vec(hit.mContactPointOn1), normal, hit.mPenetrationDepth});
    }

private:
    const Regions& regions_;
    Pose local_;
    std::vector<FieldContact>& out_;
};

void collide_meshed(const JPH::Shape* shape1, const JPH::Shape* shape2, Vec3Arg scale1, Vec3Arg scale2,
                    Mat44Arg transform1, Mat44Arg transform2, const SubShapeIDCreator& id1,
                    const SubShapeIDCreator& id2, const CollideShapeSettings& settings,
                    CollideShapeCollector& collector, const ShapeFilter& filter) {
    static thread_local std::vector<FieldContact> contacts;
    const JoltSdfShape& ground = field_of(shape2);
    const Pose world = world_of(ground, transform2), local_from_world = inverse(world);
    const Pose local = local_from_world * pose_of(transform1);
    const Convex& body = convex_of(shape1);
    const bool triangles = collide_ground(ground.sdf(), body, local, settings.mMaxSeparationDistance, contacts);
    if (triangles) {
        // All of them together, so that an edge between two regions is seen to be an inner one.
        OwnHits own(*ground.sdf().regions(), local_from_world, contacts);
        InternalEdgeRemovingCollector inner(own, settings.mInternalEdgeRemovalVertexToleranceSq);
        CollideShapeSettings all = settings;
        all.mActiveEdgeMode = EActiveEdgeMode::CollideWithAll;
        all.mCollectFacesMode = ECollectFacesMode::CollectFaces;
        ground.sdf().regions()->each(
            box_of(body, local).inflated(settings.mMaxSeparationDistance), [&](const Regions::Entry& e) {
                if (e.mesh->made == nullptr) return;
                CollisionDispatch::sCollideShapeVsShape(
                    shape1, static_cast<const JPH::Shape*>(e.mesh->made.get()), scale1, scale2, transform1, transform2,
                    SubShapeIDCreator(), SubShapeIDCreator().PushID(e.number, kRegionBits), all, inner, filter);
            });
        inner.Flush();
        settle_on_triangles(ground.sdf(), body, local, settings.mMaxSeparationDistance, contacts);
    }
    add(contacts, world, false, true, to_vec(transform1.GetTranslation()), id1, id2, collector);
}

void collide_convex(const JPH::Shape* shape1, const JPH::Shape* shape2, Vec3Arg scale1, Vec3Arg scale2,
                    Mat44Arg transform1, Mat44Arg transform2, const SubShapeIDCreator& id1,
                    const SubShapeIDCreator& id2, const CollideShapeSettings& settings,
                    CollideShapeCollector& collector, const ShapeFilter& filter) {
    const CallInStep call;
    if (field_of(shape2).sdf().regions() != nullptr)
        return collide_meshed(shape1, shape2, scale1, scale2, transform1, transform2, id1, id2, settings, collector,
                              filter);
    static thread_local std::vector<FieldContact> contacts;
    const Pose world = world_of(field_of(shape2), transform2);
    collide(field_of(shape2).sdf(), convex_of(shape1), inverse(world) * pose_of(transform1),
            settings.mMaxSeparationDistance, contacts);
    add(contacts, world, false, field_of(shape2).sdf().moves(), to_vec(transform1.GetTranslation()), id1, id2,
        collector);
}

void collide_fields(const JPH::Shape* shape1, const JPH::Shape* shape2, Vec3Arg, Vec3Arg, Mat44Arg transform1,
                    Mat44Arg transform2, const SubShapeIDCreator& id1, const SubShapeIDCreator& id2,
                    const CollideShapeSettings& settings, CollideShapeCollector& collector, const ShapeFilter&) {
    const CallInStep call;
    static thread_local std::vector<FieldContact> contacts;
    const Pose world1 = world_of(field_of(shape1), transform1), world2 = world_of(field_of(shape2), transform2);
    collide(field_of(shape1).sdf(), field_of(shape2).sdf(), inverse(world2) * world1, settings.mMaxSeparationDistance,
            contacts);
    add(contacts, world2, true, true, to_vec(transform1.GetTranslation()), id1, id2, collector);
}

// A field meets a mesh as the solid that the mesh is the surface of.
void collide_mesh(const JPH::Shape* shape1, const JPH::Shape* shape2, Vec3Arg, Vec3Arg, Mat44Arg transform1,
                  Mat44Arg transform2, const SubShapeIDCreator& id1, const SubShapeIDCreator&,
                  const CollideShapeSettings& settings, CollideShapeCollector& collector, const ShapeFilter&) {
    static thread_local std::vector<FieldContact> contacts;
    const Pose world1 = world_of(field_of(shape1), transform1), world2 = pose_of(transform2);
    collide(field_of(shape1).sdf(), *triangles_of(shape2).solid, inverse(world2) * world1,
            settings.mMaxSeparationDistance, contacts);
    // The mesh's part is one and the same: contacts are told apart by the field's.
    Places places(inverse(world2) * to_vec(transform1.GetTranslation()));
    for (const FieldContact& c : contacts) {
        if (collector.ShouldEarlyOut()) return;
        if (-c.depth >= collector.GetEarlyOutFraction()) continue;
        const vec3 normal = rotate(world2.rotation, c.normal), on1 = world2 * c.point;
        const uint32 number = facing(c.normal);
        collector.AddHit(CollideShapeResult(
            to_jolt(on1), to_jolt(on1 + normal * c.depth), to_jolt(-normal), c.depth,
            id1.PushID(number, kFacingBits).PushID(places.number(number, c.point), kFacingBits).GetID(), SubShapeID(),
            TransformedShape::sGetBodyID(collector.GetContext())));
    }
}

void cast_at_mesh(const ShapeCast& moving, const ShapeCastSettings&, const JPH::Shape* shape2, Vec3Arg,
                  const ShapeFilter&, Mat44Arg transform2, const SubShapeIDCreator& id1, const SubShapeIDCreator&,
                  CastShapeCollector& collector) {
    const vec3 way = to_vec(moving.mDirection);
    const auto hit =
        sweep(triangles_of(shape2).solid->field(), Convex::sphere(field_of(moving.mShape).GetInnerRadius()),
              pose_of(moving.mCenterOfMassStart), way, std::min(collector.GetEarlyOutFraction(), 1.0f));
    if (!hit || hit->fraction >= collector.GetEarlyOutFraction()) return;
    const Vec3 point = transform2 * to_jolt(hit->point);
    collector.AddHit(ShapeCastResult(hit->fraction, point, point, transform2.Multiply3x3(to_jolt(-hit->normal)), false,
                                     id1.PushID(facing(hit->normal), kFacingBits).GetID(), SubShapeID(),
                                     TransformedShape::sGetBodyID(collector.GetContext())));
}

// Given relative to the centre of mass of shape 2. A field is cast as the largest ball in it.
void cast(const ShapeCast& moving, const ShapeCastSettings& settings, const JPH::Shape* shape2, Vec3Arg,
          const ShapeFilter&, Mat44Arg transform2, const SubShapeIDCreator& id1, const SubShapeIDCreator& id2,
          CastShapeCollector& collector) {
    const CallInStep call;
    const bool field1 = moving.mShape->GetSubType() == kType;
    const Convex body = field1 ? Convex::sphere(field_of(moving.mShape).GetInnerRadius()) : convex_of(moving.mShape);
    const JoltSdfShape& field = field_of(shape2);
    Pose start = pose_of(moving.mCenterOfMassStart);
    start.position = start.position + field.center();
    const vec3 way = to_vec(moving.mDirection);
    const auto hit = sweep(field.sdf().field(), body, start, way, std::min(collector.GetEarlyOutFraction(), 1.0f));
    if (!hit || hit->fraction >= collector.GetEarlyOutFraction()) return;
    const bool back_face = dot(hit->normal, way) > 0;
    if (back_face && settings.mBackFaceModeConvex == EBackFaceMode::IgnoreBackFaces) return;
    const Vec3 point = transform2 * to_jolt(hit->point - field.center());
    const uint32 number = facing(hit->normal);
    collector.AddHit(ShapeCastResult(hit->fraction, point, point, transform2.Multiply3x3(to_jolt(-hit->normal)),
                                     back_face, field1 ? id1.PushID(number, kFacingBits).GetID() : id1.GetID(),
                                     id2.PushID(number, kFacingBits).GetID(),
                                     TransformedShape::sGetBodyID(collector.GetContext())));
}

}  // namespace

JoltSdfShape::JoltSdfShape(std::shared_ptr<const SdfShape> sdf)
    : Shape(EShapeType::User1, kType), sdf_(std::move(sdf)) {}

void JoltSdfShape::register_pairs() {
    ShapeFunctions& functions = ShapeFunctions::sGet(kType);
    functions.mConstruct = nullptr;  // never read from a stream
    functions.mColor = Color::sOrange;
    for (const EShapeSubType convex : sConvexSubShapeTypes) {
        CollisionDispatch::sRegisterCollideShape(convex, kType, collide_convex);
        CollisionDispatch::sRegisterCollideShape(kType, convex, CollisionDispatch::sReversedCollideShape);
        CollisionDispatch::sRegisterCastShape(convex, kType, cast);
        CollisionDispatch::sRegisterCastShape(kType, convex, CollisionDispatch::sReversedCastShape);
    }
    CollisionDispatch::sRegisterCollideShape(kType, EShapeSubType::Mesh, collide_mesh);
    CollisionDispatch::sRegisterCollideShape(EShapeSubType::Mesh, kType, CollisionDispatch::sReversedCollideShape);
    CollisionDispatch::sRegisterCastShape(kType, EShapeSubType::Mesh, cast_at_mesh);
    CollisionDispatch::sRegisterCollideShape(kType, kType, collide_fields);
    CollisionDispatch::sRegisterCastShape(kType, kType, cast);
}

AABox JoltSdfShape::GetLocalBounds() const {
    const CallInStep call;
    const Box3& box = sdf_->bounds();
    if (!box.finite()) return {Vec3::sReplicate(-kWorldSize), Vec3::sReplicate(kWorldSize)};
    return {to_jolt(box.min - center()), to_jolt(box.max - center())};
}

uint JoltSdfShape::GetSubShapeIDBitsRecursive() const { return 2 * kFacingBits; }

const PhysicsMaterial* JoltSdfShape::GetMaterial(const SubShapeID&) const { return PhysicsMaterial::sDefault; }

Vec3 JoltSdfShape::GetSurfaceNormal(const SubShapeID&, Vec3Arg local) const {
    const CallInStep call;
    vec3 n;
    (void)sdf_->field().distance(to_vec(local) + center(), n);
    return to_jolt(n).NormalizedOr(Vec3::sAxisY());
}

// Buoyancy is the fluid's own matter.
void JoltSdfShape::GetSubmergedVolume(Mat44Arg, Vec3Arg, const JPH::Plane&, float& total, float& submerged,
                                      Vec3& middle JPH_IF_DEBUG_RENDERER(, RVec3Arg)) const {
    total = GetVolume();
    submerged = 0;
    middle = Vec3::sZero();
}

bool JoltSdfShape::CastRay(const RayCast& ray, const SubShapeIDCreator& id, RayCastResult& hit) const {
    const CallInStep call;
    const auto found =
        cast_ray(sdf_->field(), to_vec(ray.mOrigin) + center(), to_vec(ray.mDirection), std::min(hit.mFraction, 1.0f));
    if (!found || found->fraction >= hit.mFraction) return false;
    hit.mFraction = found->fraction;
    hit.mSubShapeID2 = id.PushID(facing(found->normal), kFacingBits).GetID();
    return true;
}

void JoltSdfShape::CastRay(const RayCast& ray, const RayCastSettings&, const SubShapeIDCreator& id,
                           CastRayCollector& collector, const ShapeFilter& filter) const {
    if (!filter.ShouldCollide(this, id.GetID())) return;
    RayCastResult hit;
    hit.mFraction = collector.GetEarlyOutFraction();
    if (!CastRay(ray, id, hit)) return;
    hit.mBodyID = TransformedShape::sGetBodyID(collector.GetContext());
    collector.AddHit(hit);
}

void JoltSdfShape::CollidePoint(Vec3Arg point, const SubShapeIDCreator& id, CollidePointCollector& collector,
                                const ShapeFilter& filter) const {
    const CallInStep call;
    if (filter.ShouldCollide(this, id.GetID()) && sdf_->field().distance(to_vec(point) + center()) <= 0)
        collector.AddHit({TransformedShape::sGetBodyID(collector.GetContext()), id.GetID()});
}

void JoltSdfShape::CollideSoftBodyVertices(Mat44Arg transform, Vec3Arg, const CollideSoftBodyVertexIterator& vertices,
                                           uint count, int shape_index) const {
    const CallInStep call;
    const Mat44 local = transform.InversedRotationTranslation();
    for (CollideSoftBodyVertexIterator v = vertices, end = vertices + count; v != end; ++v) {
        if (v.GetInvMass() <= 0) continue;
        vec3 n;
        const float d = sdf_->field().distance(to_vec(local * v.GetPosition()) + center(), n);
        if (!v.UpdatePenetration(-d)) continue;
        const Vec3 normal = transform.Multiply3x3(to_jolt(n)).NormalizedOr(Vec3::sAxisY());
        v.SetCollision(JPH::Plane::sFromPointAndNormal(v.GetPosition() - normal * d, normal), shape_index);
    }
}

}  // namespace kiln::physics
