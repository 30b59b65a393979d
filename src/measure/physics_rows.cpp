// SPDX-License-Identifier: MIT
// `bench physics`: bodies on a field, beside the same engine on a triangle mesh of the same ground. The checksum is of where everything
// ends; it must be the same for one thread and for all, and nothing may fall through.

#include "measure/bench_run.h"

#include "field/brick_field.h"
#include "field/host_bricks.h"
#include "field/mesh.h"
#include "field/meshing.h"
#include "measure/contest.h"
#include "measure/recipes.h"
#include "measure/slow_mesh.h"
#include "physics/physics.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace kiln::measure {
namespace {

using namespace physics;

constexpr float kStep = 1.0f / 60, kSide = 64, kVoxel = 0.25f;  // of the terrain, metres; 256 voxels a side
constexpr int kBodies = 1000, kTori = 100, kSteps = 240;        // 4 s: fallen, rolling, most not yet asleep
constexpr float kTorusMajor = 0.35f, kTorusMinor = 0.12f;
constexpr int kMostRuns = 3;
constexpr float kEditCells = 64;
constexpr int kEdits = 16, kMeshedEdits = 6;

Edit placed(Shape shape, vec3 at, Op op = Op::Union, float blend = 0) {
    Edit e;
    e.node.shape = std::move(shape);
    e.node.transform.position = at;
    e.op = op;
    e.blend_radius = blend;
    return e;
}

// Hills and hollows, soft ones.
std::vector<Edit> terrain(uint32_t seed) {
    std::vector<Edit> out{placed(Plane{}, {})};
    for (uint32_t i = 0; i < 200; ++i) {
        const auto u = [&](uint32_t k) { return uniform(seed, i, k); };
        const float radius = 4 + 6 * u(0), rise = 0.3f + 1.2f * u(1), x = kSide * (u(2) - 0.5f),
                    z = kSide * (u(3) - 0.5f);
        const bool hollow = i % 3 == 0;
        out.push_back(placed(Sphere{.radius = radius}, {x, hollow ? radius - rise : rise - radius, z},
                             hollow ? Op::Subtract : Op::Union, 1));
    }
    return out;
}

std::shared_ptr<const field::ProgramField> exact_of(const std::vector<Edit>& edits) {
    auto program = sdf::compile({edits, {}, {}});
    return std::make_shared<const field::ProgramField>(std::make_shared<const sdf::Program>(std::move(*program)));
}

struct Ground {
    std::vector<Edit> edits;
    std::shared_ptr<const field::ProgramField> exact;
    std::shared_ptr<const Triangles> triangles;
    std::shared_ptr<const SdfShape> fresh() const {
        return SdfShape::fixed(exact, std::make_shared<const field::BrickField>(
                                          exact, field::BrickFieldOptions{.voxel_size = kVoxel, .near = 4 * kVoxel}));
    }
};

Result<Ground> make_ground(std::vector<Edit> edits, float side, float voxel) {
    Ground out{.edits = std::move(edits), .exact = nullptr, .triangles = nullptr};
    auto program = sdf::compile({out.edits, {}, {}});
    if (!program) return program.error();
    const auto shared = std::make_shared<const sdf::Program>(std::move(*program));
    out.exact = std::make_shared<const field::ProgramField>(shared);
    const float half = 0.5f * side;
    const auto host =
        field::HostBricks::build(shared, {.voxel_size = voxel, .bounds = {{-half, -4, -half}, {half, 4, half}}});
    if (!host) return host.error();
    field::Mesh mesh;
    field::mesh_smooth(field::MeshBricks(*host), mesh);
    Triangles t;
    t.vertices.assign(mesh.positions.data(), mesh.positions.data() + mesh.positions.size());
    t.indices.assign(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size());
    t.solid = SdfShape::fixed(out.exact);
    out.triangles = std::make_shared<const Triangles>(std::move(t));
    return out;
}

// What a run came to.
struct Ran {
    double seconds = 0;
    uint64_t hash = 0;
    int through = 0;
};

class PhysicsRows {
public:
    PhysicsRows(BenchRun& run, std::string_view engine, bool standard)
        : run_(run), engine_(engine), standard_(standard) {}

    void all() {
        if (run_.wanted("physics", "bodies.1000"))
            pile("bodies.1000", terrain(run_.options.seed), &PhysicsRows::add_bodies, true);
        if (run_.wanted("physics", "tori.100")) pile("tori.100", {placed(Plane{}, {})}, &PhysicsRows::add_tori, false);
        if (run_.wanted("physics", "collider.edit") || run_.wanted("physics", "collider.main")) {
            collider(false);
            collider(true);
        }
        if ((standard_ && run_.wanted("physics", "mesh.region")) || run_.wanted("physics", "mesh.collider"))
            region_meshes();
    }

private:
    using Add = std::vector<BodyId> (PhysicsRows::*)(World&) const;

    std::string name(std::string_view row) const {
        return standard_ ? std::string(row) : formatted("{}.{}", row, engine_);
    }

    std::vector<BodyId> add_bodies(World& world) const {
        std::vector<BodyId> out;
        const uint32_t seed = run_.options.seed + 1;
        for (uint32_t i = 0; i < kBodies; ++i) {
            const auto u = [&](uint32_t k) { return uniform(seed, i, k); };
            const Convex convex = i % 4 == 0   ? Convex::sphere(0.35f)
                                  : i % 4 == 1 ? Convex::box({0.4f, 0.3f, 0.35f})
                                  : i % 4 == 2 ? Convex::capsule(0.3f, 0.25f)
                                               : Convex::cylinder(0.3f, 0.35f);
            vec3 at{(u(0) - 0.5f) * 0.85f * kSide, 8, (u(1) - 0.5f) * 0.85f * kSide};
            if (const auto hit = world.cast_ray(at, {0, -16, 0})) at.y = hit->position.y;
            at.y += 1 + 2 * u(2);
            const auto id = world.add({.shape = convex, .pose = {at, axis_angle({0, 0, 1}, 3 * u(3))}});
            if (id) out.push_back(*id);
        }
        return out;
    }

    std::vector<BodyId> add_tori(World& world) const {
        const auto exact = exact_of({placed(Torus{.major_radius = kTorusMajor, .minor_radius = kTorusMinor}, {})});
        auto shape = SdfShape::moving(exact, field::BrickField::of_body(exact, kVoxel));
        std::vector<BodyId> out;
        for (uint32_t i = 0; shape && i < kTori; ++i) {
            const auto u = [&](uint32_t k) { return 0.1f * uniform(run_.options.seed, i, k) - 0.05f; };
            const vec3 at{float(i % 3) - 1 + u(0), 0.6f + 0.5f * float(i / 9), float(i / 3 % 3) - 1 + u(1)};
            const auto id = world.add({.shape = *shape, .pose = {at, axis_angle({1, 0, 0}, 8 * u(2))}});
            if (id) out.push_back(*id);
        }
        return out;
    }

    Ran run_once(const Ground& ground, bool mesh, int threads, Add add) {
        Ran out;
        auto made = make_world(engine_, {.threads = threads});
        if (!made) {
            run_.fail(made.error());
            return out;
        }
        World& world = **made;
        BodySettings stands{.motion = Motion::Static};
        if (mesh) {
            stands.shape = ground.triangles;
        } else {
            stands.shape = ground.fresh();
        }
        if (auto id = world.add(stands); !id) run_.fail(id.error());
        const std::vector<BodyId> ids = (this->*add)(world);
        out.seconds = seconds_of([&] {
            for (int i = 0; i < kSteps; ++i) world.step(kStep);
        });
        for (const BodyId id : ids) {
            const BodyState s = world.state(id);
            const float values[7] = {s.pose.position.x, s.pose.position.y, s.pose.position.z, s.pose.rotation.x,
                                     s.pose.rotation.y, s.pose.rotation.z, s.pose.rotation.w};
            out.hash = hash_combine(out.hash, hash64_of(std::span<const float>(values)));
            out.through += ground.exact->distance(s.pose.position) < 0 && s.pose.position.y < -4;
        }
        out.through += world.lost();
        return out;
    }

    // Fields meet triangles as the solid that these bound, so only convex bodies have a peer.
    void pile(std::string_view row, std::vector<Edit> edits, Add add, bool peer) {
        run_.stage(name(row));
        const auto ground = make_ground(std::move(edits), kSide, kVoxel);
        if (!ground) return run_.fail(ground.error());
        std::vector<int> threads{1};
        if (run_.options.threads > 0) {
            threads = {run_.options.threads};
        } else if (engine_ != "bullet" && hardware_workers() > 1) {
            threads.push_back(hardware_workers());
        }
        uint64_t first = 0;
        for (const int n : threads) {
            Ran field, mesh;
            const auto turn = [&](Ran& into, bool on_mesh) {
                into = run_once(*ground, on_mesh, n, add);
                return into.seconds;
            };
            std::vector<Contestant> contestants{[&] { return turn(field, false); }};
            if (peer) contestants.push_back([&] { return turn(mesh, true); });
            const std::vector<double> least = least_seconds(std::min(run_.options.runs, kMostRuns), contestants);
            if (run_.fault()) return;
            if (field.through > 0)
                return run_.fail(Error{formatted("bench physics/{}: {} bodies fell through", row, field.through),
                                       ErrorKind::Failed});
            if (first == 0) first = n == 1 ? field.hash : run_once(*ground, false, 1, add).hash;
            BenchRow out;
            out.name = name(row);
            out.value = kSteps / least[0];
            out.unit = "steps/s";
            out.more_is_better = true;
            out.threads = n;
            if (peer) {
                out.peer = formatted("{}, {} triangles", engine_, ground->triangles->indices.size() / 3);
                out.peer_value = kSteps / least[1];
                out.ratio = out.value / out.peer_value;
            }
            out.seed = run_.options.seed;
            run_.add_checked(out, field.hash, first);
        }
    }

    // Bites of 64 cells a side out of the terrain: until the changed ground is what bodies touch, and its bricks there are made. Ground that
    // is meshed where it has settled (`meshed`) is a field again there at once. The peer makes triangles of the same box anew, and the
    // engine's own collider of them.
    void collider(bool meshed) {
        run_.stage(name(meshed ? "collider.meshed" : "collider"));
        std::vector<Edit> edits = terrain(run_.options.seed);
        auto exact = exact_of(edits);
        auto bricks = std::make_shared<const field::BrickField>(
            exact, field::BrickFieldOptions{.voxel_size = kVoxel, .near = 4 * kVoxel});
        auto made = make_world(engine_, {});
        if (!made) return run_.fail(made.error());
        World& world = **made;
        const auto ground = world.add(
            {.shape = SdfShape::fixed(exact, bricks), .motion = Motion::Static, .mesh_voxel = meshed ? kVoxel : 0});
        if (!ground) return run_.fail(ground.error());
        // Somebody in each region, who keeps it meshed.
        constexpr float kApart = 12;
        for (float z = -24; meshed && z <= 24; z += kApart)
            for (float x = -24; x <= 24; x += kApart)
                if (auto id = world.add({.shape = Convex::box({0.3f, 0.3f, 0.3f}), .pose = {{x, 3, z}, {}}}); !id)
                    return run_.fail(id.error());
        const auto settle = [&] {
            for (int i = 0; meshed && i < 50; ++i) world.step(kStep);
        };
        const auto touch = [](const field::BrickField& b, const Box3& box) {
            double sum = 0;
            const float step = kVoxel * field::kBrickVoxels;
            for (float z = box.min.z; z < box.max.z; z += step)
                for (float y = box.min.y; y < box.max.y; y += step)
                    for (float x = box.min.x; x < box.max.x; x += step) sum += double(b.distance({x, y, z}));
            return sum;
        };
        (void)touch(*bricks, {{-kSide / 2, -2, -kSide / 2}, {kSide / 2, 2, kSide / 2}});
        double whole = 1e300, share = 1e300, peer = 1e300;
        uint64_t hash = 0, slow = 0;
        for (int i = 0; i < (meshed ? kMeshedEdits : kEdits); ++i) {
            settle();
            const float half = 0.5f * kEditCells * kVoxel;
            const vec3 at{kSide * 0.6f * (uniform(7, uint32_t(i), 0) - 0.5f), 0,
                          kSide * 0.6f * (uniform(7, uint32_t(i), 1) - 0.5f)};
            edits.push_back(placed(Sphere{.radius = half}, at, Op::Subtract));
            exact = exact_of(edits);
            const Box3 box{at - vec3{half, half, half}, at + vec3{half, half, half}};
            double main = 0;
            const double all = seconds_of([&] {
                const std::shared_ptr<const field::BrickField> before = bricks;
                main = seconds_of([&] {
                    bricks = before->after(exact, box);
                    world.set_field(*ground, SdfShape::fixed(exact, bricks), box);
                });
                (void)touch(*bricks, box);
            });
            whole = std::min(whole, all);
            share = std::min(share, main);
            peer = std::min(peer, seconds_of([&] { mesh_into(world, exact, box); }));
            const double sum = touch(*bricks, box);
            const double anew = touch(field::BrickField(exact, {.voxel_size = kVoxel, .near = 4 * kVoxel}), box);
            hash = hash_combine(hash, hash64_of(std::span<const double>(&sum, 1)));
            slow = hash_combine(slow, hash64_of(std::span<const double>(&anew, 1)));
        }
        const auto add = [&](std::string row, double seconds, bool beside) {
            if (!run_.wanted("physics", row)) return;
            BenchRow out;
            out.name = name(meshed ? row + ".meshed" : row);
            out.value = seconds * 1e3;
            out.unit = "ms";
            if (beside) {
                out.peer = formatted("{}, triangles made anew", engine_);
                out.peer_value = peer * 1e3;
                out.ratio = out.peer_value / out.value;
            }
            out.seed = run_.options.seed;
            run_.add_checked(out, hash, slow);
        };
        add("collider.edit", whole, true);
        add("collider.main", share, false);
    }

    // Far below, where it touches nothing.
    void mesh_into(World& world, const std::shared_ptr<const field::ProgramField>& exact, const Box3& box) {
        const auto shared = std::make_shared<const sdf::Program>(exact->program());
        const auto host = field::HostBricks::build(shared, {.voxel_size = kVoxel, .bounds = box});
        if (!host) return run_.fail(host.error());
        field::Mesh mesh;
        field::mesh_smooth(field::MeshBricks(*host), mesh);
        Triangles t;
        t.vertices.assign(mesh.positions.data(), mesh.positions.data() + mesh.positions.size());
        t.indices.assign(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size());
        t.solid = SdfShape::fixed(exact);
        const auto id = world.add({.shape = std::make_shared<const Triangles>(std::move(t)),
                                   .motion = Motion::Static,
                                   .pose = {{0, -1000, 0}, {}}});
        if (!id) return run_.fail(id.error());
        world.remove(*id);
    }

    // The terrain's settled ground: triangles of eight regions, with their aprons, and what an engine makes of them to collide with. Beside
    // it the engine's own body of the same triangles. What the slow way holds the triangles against is one mesh of the whole, by the
    // lattice edges that corners lie on: regions lay corners on the surface, which no other mesh does.
    void region_meshes() {
        run_.stage(name("mesh"));
        const auto exact = exact_of(terrain(run_.options.seed));
        auto made = make_world(engine_, {});
        if (!made) return run_.fail(made.error());
        World& world = **made;
        std::vector<std::shared_ptr<RegionMesh>> meshes(8);
        const auto region = [](size_t i) { return ivec3{int(i & 1) - 1, int(i >> 1 & 1) - 1, int(i >> 2) - 1}; };
        const auto mesh_all = [&] {
            for (size_t i = 0; i < meshes.size(); ++i) meshes[i] = mesh_region(*exact, kVoxel, region(i));
        };
        mesh_all();
        double all = 0, own = 0;
        std::vector<std::shared_ptr<const Triangles>> bodies;
        for (const auto& mesh : meshes) {
            all += double(mesh->indices.size() / 3);
            own += double(mesh->own());
            if (mesh->own() == 0) continue;
            Triangles t;
            t.vertices = mesh->vertices, t.indices = mesh->indices;
            t.solid = SdfShape::fixed(exact);
            bodies.push_back(std::make_shared<const Triangles>(std::move(t)));
        }
        bool usable = true;
        const std::vector<double> least = least_seconds(
            run_.options.runs, {[&] { return seconds_of(mesh_all); },
                                [&] {
                                    return seconds_of([&] {
                                        for (const auto& mesh : meshes) {
                                            mesh->made = world.region_builder()(*mesh);
                                            usable &= mesh->made != nullptr || mesh->own() == 0;
                                        }
                                    });
                                },
                                [&] {
                                    return seconds_of([&] {
                                        for (const auto& body : bodies) {
                                            const auto id = world.add({.shape = body, .motion = Motion::Static});
                                            if (!id) return run_.fail(id.error());
                                            world.remove(*id);
                                        }
                                    });
                                }});
        if (!usable)
            return run_.fail(
                Error{formatted("bench physics/mesh.collider: {} refused a region", engine_), ErrorKind::Failed});
        uint64_t hash = 0;
        for (const auto& mesh : meshes)
            hash += checksum_of_edges(mesh->vertices, std::span(mesh->indices).first(3 * size_t(mesh->own())), kVoxel);
        const Box3 whole{meshes.front()->box().min, meshes.back()->box().max};
        const auto host = field::HostBricks::build(std::make_shared<const sdf::Program>(exact->program()),
                                                   {.voxel_size = kVoxel, .bounds = whole});
        if (!host) return run_.fail(host.error());
        const uint64_t slow = edges_by_voxel(*host, whole);
        const auto add = [&](std::string_view row, std::string called, double triangles, double seconds) {
            BenchRow out;
            out.name = std::move(called);
            out.value = triangles / seconds / 1e6;
            out.unit = "Mtri/s";
            out.more_is_better = true;
            if (row == "mesh.collider") {
                out.peer = formatted("{}, its own mesh", engine_);
                out.peer_value = triangles / least[2] / 1e6;
                out.ratio = out.value / out.peer_value;
            }
            out.seed = run_.options.seed;
            if (run_.wanted("physics", row)) run_.add_checked(out, hash, slow);
        };
        if (standard_) add("mesh.region", "mesh.region", own, least[0]);
        add("mesh.collider", name("mesh.collider"), all, least[1]);
    }

    BenchRun& run_;
    std::string engine_;
    bool standard_;  // the default engine, whose rows have no suffix
};

}  // namespace

BenchFamily physics_family() {
    return {{"physics",
             "1000 bodies on a terrain, a pile of 100 tori (fields), a bite of 64 cells a side out of the ground, "
             "triangles of settled ground and what engines make of them; the first beside triangles of the same ground",
             {"bodies.1000", "tori.100", "collider.edit", "collider.main", "mesh.region", "mesh.collider"}},
            [](BenchRun& run) {
                bool standard = true;
                for (const Backend& engine : backends()) {
                    if (!engine.why_not.empty() || run.fault()) continue;
                    PhysicsRows(run, engine.name, standard).all();
                    standard = false;
                }
            }};
}

}  // namespace kiln::measure
