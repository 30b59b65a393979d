// SPDX-License-Identifier: MIT
// Starts threads.
// What the field says about a world, against asking the whole program at every texel of every cell.

#include "field/field.h"

#include "field/host_bricks.h"
#include "sdf/eval.h"
#include "worlds.h"
#include "rounds.h"

#include <cmath>
#include <cstring>
#include <functional>

namespace kiln::field {
namespace {

std::vector<float> values_of_cell(const sdf::TapeView& tape, const int (&texel)[3], float h) {
    std::vector<float> x(512), y(512), z(512), out(512);
    for (size_t i = 0; i < 512; ++i) {
        x[i] = float(texel[0] + int(i & 7)) * h;
        y[i] = float(texel[1] + int(i >> 3 & 7)) * h;
        z[i] = float(texel[2] + int(i >> 6)) * h;
    }
    sdf::evaluate(tape, {x.data(), y.data(), z.data(), 512}, out.data());
    return out;
}

void each_cell_of(const Field& field, const std::function<void(int, int, int, uint32_t)>& fn) {
    const GridParams g = field.grid();
    for (int z = g.cell_z; z < g.cell_z + g.size_z; ++z) {
        for (int y = g.cell_y; y < g.cell_y + g.size_y; ++y) {
            for (int x = g.cell_x; x < g.cell_x + g.size_x; ++x) fn(x, y, z, field.cell_word(x, y, z));
        }
    }
}

// Occupancy, sign, record and pruned code of every cell.
void expect_true_field(const Field& field, const std::string& name) {
    const float h = field.grid().voxel_size;
    uint32_t bricks = 0;
    int wrong = 0;
    each_cell_of(field, [&](int x, int y, int z, uint32_t word) {
        if (wrong > 3) return;
        const int texel[3] = {x * 7, y * 7, z * 7};
        const std::vector<float> full = values_of_cell(sdf::view(field.program()), texel, h);
        bool near = false;
        for (const float v : full) near = near || std::fabs(v) < h;
        const bool occupied = (word & kCellOccupied) != 0;
        if (occupied != near) {
            ADD_FAILURE() << name << ": cell " << x << " " << y << " " << z
                          << (near ? " lacks its brick" : " has a brick for nothing");
            ++wrong;
            return;
        }
        if (!occupied) {
            for (const float v : full) {
                if ((v < 0) != ((word & kCellInside) != 0)) {
                    ADD_FAILURE() << name << ": empty cell " << x << " " << y << " " << z
                                  << " has the wrong sign: " << v;
                    ++wrong;
                    return;
                }
            }
            return;
        }
        ++bricks;
        const BrickRecord& record = field.records()[word & kCellSlotMask];
        ASSERT_EQ(record.texel_x, texel[0]);
        ASSERT_EQ(record.texel_y, texel[1]);
        ASSERT_EQ(record.texel_z, texel[2]);
        ASSERT_GT(record.code_count, 0u);
        const auto code = field.code().subspan(record.code_first, record.code_count);
        const std::vector<float> pruned = values_of_cell(sdf::view(field.program(), code), texel, h);
        if (std::memcmp(pruned.data(), full.data(), 512 * sizeof(float)) != 0) {
            for (size_t i = 0; i < 512; ++i) {
                const float band = kBandVoxels * h;
                if (pruned[i] == full[i]) continue;
                if (std::min(std::fabs(pruned[i]), std::fabs(full[i])) >= band && (pruned[i] < 0) == (full[i] < 0))
                    continue;
                ADD_FAILURE() << name << ": cell " << x << " " << y << " " << z << " texel " << i << ": pruned "
                              << pruned[i] << ", whole " << full[i];
                ++wrong;
                return;
            }
        }
    });
    EXPECT_EQ(field.stats().bricks, bricks) << name;
}

TEST(Field, CellsAreWhatTheWholeProgramSaysAndPrunedCodeHasItsBits) {
    for (const worlds::World& world : worlds::all()) {
        const std::shared_ptr<const Field> field = world.field();
        ASSERT_TRUE(field);
        expect_true_field(*field, world.name);
        EXPECT_EQ(field->jobs().size(), field->stats().bricks);
        EXPECT_GT(field->stats().bricks, 20u) << world.name;
        std::vector<bool> used(field->slot_count(), false);
        for (const uint32_t slot : field->jobs()) {
            ASSERT_FALSE(used[slot]);
            used[slot] = true;
        }
    }
}

// Many edits that are only joined, of which a few cover most cells together: those are asked by depth, and most are not asked at all.
TEST(Field, ACrowdIsWhatTheWholeProgramSaysThoughFewOfItAreAsked) {
    const float spread = kSanitized ? 0.3f : 0.5f, most = spread + 0.3f;  // as crowded with a quarter of the edits
    for (const uint32_t seed : {1u, 2u, 3u}) {
        worlds::Random r(seed);
        worlds::World world{"crowd", {}, {.voxel_size = 0.03f, .bounds = {{-most, -most, -most}, {most, most, most}}}};
        for (int i = 0; i < rounds(1500); ++i) {
            const float size = r.in(0.05f, 0.16f);
            Edit e = worlds::edit(Sphere{.radius = size}, r.point(spread));
            if (r.below(2) == 0) e.node.shape = Box{.half_extents = {size, 0.7f * size, 0.5f * size}};
            if (seed == 2 && r.below(3) == 0) {
                e.node.shape = Torus{.major_radius = size, .minor_radius = 0.4f * size};
                e.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 0.3f}), r.in(-3, 3));
            }
            if (seed == 2 && r.below(3) != 0) e = worlds::of_material(e, uint32_t(1 + r.below(3)));
            // A few that do else than join: where they reach, all are asked in their order.
            if (seed == 3 && i % 100 == 99) e.op = r.below(2) == 0 ? Op::Subtract : Op::Paint;
            if (seed == 3 && i % 100 == 49) e.blend_radius = 0.1f;
            world.edits.push_back(e);
        }
        const std::shared_ptr<const Field> field = world.field();
        ASSERT_TRUE(field);
        expect_true_field(*field, "crowd");
        const HostBricks host = *HostBricks::build(worlds::compiled(world.edits), world.options);
        EXPECT_EQ(host.hash(), HostBricks::bake(field).hash()) << "seed " << seed;
    }
}

TEST(Field, CullingLooksAtFewLeaves) {
    const std::shared_ptr<const Field> field = worlds::sphere_of(60).field();
    const GridParams g = field->grid();
    const uint64_t cells = uint64_t(g.size_x) * uint64_t(g.size_y) * uint64_t(g.size_z);
    EXPECT_LT(field->stats().cells_evaluated, cells / 3);
    EXPECT_LT(field->stats().cells_evaluated, 3 * field->stats().bricks);
}

TEST(Field, JumpsLeadOverEmptyCellsOfOneSign) {
    for (const worlds::World& world : {worlds::boxes(), worlds::thin_walls(), worlds::sphere_of(40)}) {
        const std::shared_ptr<const Field> field = world.field();
        each_cell_of(*field, [&](int x, int y, int z, uint32_t word) {
            if ((word & kCellOccupied) != 0) return;
            const int jump = int(word & 7u);
            ASSERT_GE(jump, 1);
            ASSERT_LE(jump, kMaxJump);
            for (int c = 1 - jump; c < jump; ++c) {
                for (int b = 1 - jump; b < jump; ++b) {
                    for (int a = 1 - jump; a < jump; ++a) {
                        const GridParams g = field->grid();
                        const int cx = x + a, cy = y + b, cz = z + c;
                        if (cx < g.cell_x || cy < g.cell_y || cz < g.cell_z || cx >= g.cell_x + g.size_x ||
                            cy >= g.cell_y + g.size_y || cz >= g.cell_z + g.size_z) {
                            continue;
                        }
                        const uint32_t other = field->cell_word(cx, cy, cz);
                        ASSERT_EQ(other & (kCellOccupied | kCellInside), word & kCellInside);
                    }
                }
            }
        });
    }
}

void expect_same_bytes(const Field& a, const Field& b) {
    each_cell_of(a, [&](int x, int y, int z, uint32_t word) { ASSERT_EQ(word, b.cell_word(x, y, z)); });
    EXPECT_TRUE(std::ranges::equal(a.code(), b.code()));
    ASSERT_EQ(a.slots(), b.slots());
    for (const uint32_t slot : a.slots())
        ASSERT_EQ(std::memcmp(&a.records()[slot], &b.records()[slot], sizeof(BrickRecord)), 0);
    EXPECT_TRUE(std::ranges::equal(a.jobs(), b.jobs()));
}

TEST(Field, SameBytesForAnyNumberOfWorkers) {
    worlds::World world = worlds::jumble();
    world.options.workers = 1;
    const std::shared_ptr<const Field> one = world.field();
    for (const int workers : {2, 3, 8}) {
        world.options.workers = workers;
        expect_same_bytes(*one, *world.field());
    }
}

TEST(Field, EmptyAndSolidWorldsHaveNoBricks) {
    worlds::World world{"nothing", {}, {.voxel_size = 0.05f, .bounds = {{-2, -2, -2}, {2, 2, 2}}}};
    std::shared_ptr<const Field> field = world.field();
    EXPECT_EQ(field->stats().bricks, 0u);
    each_cell_of(*field, [](int, int, int, uint32_t word) { ASSERT_EQ(word, uint32_t(kMaxJump)); });
    world.edits = {worlds::edit(Box{.half_extents = {50, 50, 50}})};
    field = world.field();
    EXPECT_EQ(field->stats().bricks, 0u);
    each_cell_of(*field, [](int, int, int, uint32_t word) { ASSERT_EQ(word, kCellInside | uint32_t(kMaxJump)); });
    world.edits = {worlds::edit(Box{.half_extents = {50, 50, 50}}, {}, Op::Subtract)};
    field = world.field();
    EXPECT_EQ(field->stats().bricks, 0u);
    EXPECT_EQ(field->cell_word(0, 0, 0), uint32_t(kMaxJump));
    EXPECT_EQ(field->cell_word(1000, 0, 0), 0u) << "outside the grid";
}

TEST(Field, AnUnboundedPlaneFillsItsLayerOfTheGrid) {
    worlds::World world{
        "plane", {worlds::edit(Plane{}, {0, 0.02f, 0})}, {.voxel_size = 0.05f, .bounds = {{-2, -1, -1}, {2, 1, 1}}}};
    const std::shared_ptr<const Field> field = world.field();
    const GridParams g = field->grid();
    EXPECT_EQ(field->stats().bricks, uint32_t(2 * g.size_x * g.size_z))
        << "the layer above and, within a voxel, the one below";
    expect_true_field(*field, world.name);
}

TEST(Field, IsTheSameFarFromTheOrigin) {
    for (const float away : {100.0f, 1000.0f}) {
        worlds::World world = worlds::boxes();
        for (Edit& e : world.edits)
            e.node.transform.position = e.node.transform.position + vec3{away, -away, 0.5f * away};
        world.options.bounds = {world.options.bounds.min + vec3{away, -away, 0.5f * away},
                                world.options.bounds.max + vec3{away, -away, 0.5f * away}};
        const std::shared_ptr<const Field> field = world.field();
        ASSERT_TRUE(field);
        expect_true_field(*field, world.name);
    }
}

// Deep in a solid a cut with a material has code of its own alone; when the solid goes (or comes), that is another.
TEST(Field, AChangeThatACutHidReachesTheCutsBricks) {
    const std::vector<Edit> without{worlds::edit(Box{.half_extents = {0.9f, 0.5f, 0.9f}}, {0, -0.5f, 0}),
                                    worlds::of_material(worlds::edit(Sphere{.radius = 0.4f}, {}, Op::Subtract), 2)};
    std::vector<Edit> with = without;
    with.insert(with.begin() + 1, worlds::edit(Box{.half_extents = {1.1f, 1.1f, 1.1f}}));
    const FieldOptions options{.voxel_size = 0.02f, .bounds = {{-1.3f, -1.3f, -1.3f}, {1.3f, 1.3f, 1.3f}}};
    for (const bool goes : {true, false}) {
        worlds::Live live(goes ? with : without);
        auto bricks = HostBricks::build(live.program(), options);
        ASSERT_TRUE(bricks);
        const std::vector<RowChange> changes = live.become(goes ? without : with);
        ASSERT_TRUE(bricks->update(live.program(), changes));
        auto fresh = HostBricks::build(live.program(), options);
        ASSERT_TRUE(fresh);
        EXPECT_EQ(bricks->hash(), fresh->hash()) << (goes ? "goes" : "comes");
    }
}

TEST(Field, AFullPoolNamesTheNumberNeeded) {
    worlds::World world = worlds::blends();
    const uint32_t needed = world.field()->stats().bricks;
    world.options.max_bricks = needed;
    EXPECT_TRUE(Field::build(worlds::compiled(world.edits), world.options));
    world.options.max_bricks = needed - 1;
    const auto refused = Field::build(worlds::compiled(world.edits), world.options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::OutOfMemory);
    EXPECT_NE(refused.error().message.find(" " + std::to_string(needed) + " bricks needed"), std::string::npos)
        << refused.error().message;
}

TEST(Field, BadOptionsAreRefused) {
    const auto program = worlds::compiled({worlds::edit(Sphere{})});
    const Box3 box{{-1, -1, -1}, {1, 1, 1}};
    for (const float h :
         {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        EXPECT_FALSE(Field::build(program, {.voxel_size = h, .bounds = box})) << h;
    }
    EXPECT_FALSE(Field::build(program, {.voxel_size = 0.1f, .bounds = Box3{}}));
    EXPECT_FALSE(Field::build(
        program, {.voxel_size = 0.1f, .bounds = {{-1, -1, -1}, {1, 1, std::numeric_limits<float>::infinity()}}}));
    EXPECT_FALSE(Field::build(program, {.voxel_size = 1e-7f, .bounds = box}));
    const auto huge =
        Field::build(program, {.voxel_size = 0.1f, .bounds = {{-1e4f, -1e4f, -1e4f}, {1e4f, 1e4f, 1e4f}}});
    ASSERT_FALSE(huge);
    EXPECT_EQ(huge.error().kind, ErrorKind::OutOfMemory);
}

// The world, changed as people change worlds.
void change(worlds::Random& r, std::vector<Edit>& edits) {
    const int n = int(edits.size());
    switch (n < 3 ? 0 : r.below(8)) {
    case 0:
        edits.push_back(r.edit(1));
        break;
    case 1:
        edits.insert(edits.begin() + r.below(n), r.edit(1));
        break;
    case 2:
        edits.erase(edits.begin() + r.below(n));
        break;
    case 3:
        edits[size_t(r.below(n))].node.transform.position = r.point(1);
        break;
    case 4:
        edits[size_t(r.below(n))].hidden = r.below(2) == 0;
        break;
    case 5:
        edits[size_t(r.below(n))].node.material = MaterialId{uint32_t(r.below(6)), 0};
        break;
    case 6:
        std::swap(edits[size_t(r.below(n))], edits[size_t(r.below(n))]);
        break;
    default:
        edits[size_t(r.below(n))].blend_radius = r.in(0, 0.3f);
        break;
    }
}

// Same cells but for slots. (What bricks hold is compared by hash.)
void expect_equal_fields(const Field& got, const Field& expected, const std::string& name) {
    ASSERT_EQ(got.cells().size(), expected.cells().size());
    uint32_t live = 0;
    each_cell_of(got, [&](int x, int y, int z, uint32_t a) {
        const uint32_t b = expected.cell_word(x, y, z);
        ASSERT_EQ((a & kCellOccupied) != 0 ? kCellOccupied : a, (b & kCellOccupied) != 0 ? kCellOccupied : b)
            << name << " cell " << x << " " << y << " " << z;
        if ((a & kCellOccupied) == 0) return;
        ++live;
        const BrickRecord &ra = got.records()[a & kCellSlotMask], &rb = expected.records()[b & kCellSlotMask];
        ASSERT_TRUE(ra.texel_x == rb.texel_x && ra.texel_y == rb.texel_y && ra.texel_z == rb.texel_z) << name;
    });
    EXPECT_EQ(got.slots().size(), live) << name << ": slots in use";
    EXPECT_EQ(got.stats().bricks, expected.stats().bricks) << name;
}

TEST(Field, IncrementalIsFullAfterRandomEdits) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        worlds::World world = worlds::jumble(seed, 25);
        if (seed == 3) {
            for (const Edit& e : worlds::formulas().edits) world.edits.push_back(e);
        }
        world.options.format = seed == 2 ? DistanceFormat::Snorm8 : DistanceFormat::Half;
        worlds::Random r(seed + 100);
        worlds::Live live(world.edits);
        HostBricks host = *HostBricks::build(live.program(), world.options);
        for (int step = 0; step < rounds(30); ++step) {
            const std::string name = "seed " + std::to_string(seed) + " step " + std::to_string(step);
            change(r, world.edits);
            const std::vector<RowChange> changes = live.become(world.edits);
            const std::shared_ptr<const Field> field = host.shared_field();
            const auto done = host.update(live.program(), changes);
            ASSERT_TRUE(done) << done.error().message;
            const Field& next = host.field();
            EXPECT_EQ(next.parent_revision(), field->revision());
            // Bricks that are no jobs keep their slots.
            std::vector<bool> job(next.slot_count(), false);
            for (const uint32_t slot : next.jobs()) job[slot] = true;
            each_cell_of(next, [&](int x, int y, int z, uint32_t word) {
                if ((word & kCellOccupied) == 0 || job[word & kCellSlotMask]) return;
                ASSERT_EQ(word, field->cell_word(x, y, z)) << name;
            });
            const std::shared_ptr<const Field> full = world.field();
            expect_equal_fields(next, *full, name);
            ASSERT_EQ(host.hash(), HostBricks::bake(full).hash()) << name;
            if (HasFatalFailure()) return;
        }
    }
}

// Many small ones, which blend or do not, before, between and after each other: what a change leads on to later ones.
TEST(Field, IncrementalIsFullInACrowdThatBlends) {
    worlds::Random r(41);
    worlds::World world{"crowd", {}, {.voxel_size = 0.03f, .bounds = {{-0.9f, -0.9f, -0.9f}, {0.9f, 0.9f, 0.9f}}}};
    const auto one = [&] {
        const Op ops[] = {Op::Union, Op::Union, Op::Union, Op::Subtract, Op::Paint};
        Edit e = worlds::edit(Sphere{.radius = r.in(0.03f, 0.12f)}, r.point(0.8f), ops[r.below(5)],
                              r.below(2) == 0 ? r.in(0, 0.15f) : 0.0f);
        if (r.below(2) == 0) e.node.shape = Box{.half_extents = {0.1f, r.in(0.01f, 0.1f), 0.05f}};
        if (r.below(3) == 0) e.material_blend_radius = r.in(0, 0.1f);
        if (e.op != Op::Subtract || r.below(4) == 0) e.node.material = MaterialId{uint32_t(r.below(5)), 0};
        return e;
    };
    for (int i = 0; i < 120; ++i) world.edits.push_back(one());
    worlds::Live live(world.edits);
    HostBricks host = *HostBricks::build(live.program(), world.options);
    uint64_t baked = 0;
    for (int step = 0; step < rounds(60); ++step) {
        std::vector<Edit>& edits = world.edits;
        const size_t at = size_t(r.below(int(edits.size())));
        switch (r.below(4)) {
        case 0:
            edits.insert(edits.begin() + ptrdiff_t(at), one());
            break;
        case 1:
            edits.erase(edits.begin() + ptrdiff_t(at));
            break;
        case 2:
            edits[at].node.transform.position = edits[at].node.transform.position + r.point(0.1f);
            break;
        default:
            edits.push_back(one());
            break;
        }
        const std::vector<RowChange> changes = live.become(edits);
        ASSERT_TRUE(host.update(live.program(), changes));
        baked += host.field().stats().bricks_baked;
        const std::shared_ptr<const Field> full = world.field();
        expect_equal_fields(host.field(), *full, "step " + std::to_string(step));
        ASSERT_EQ(host.hash(), HostBricks::bake(full).hash()) << "step " << step;
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(baked, uint64_t(rounds(1000)));
}

TEST(Field, AnUpdateThatChangesNothingBakesNothing) {
    worlds::World world = worlds::jumble();
    worlds::Live live(world.edits);
    const std::shared_ptr<const Field> field = world.field();
    const auto same = Field::update(*field, live.program(), {});
    ASSERT_TRUE(same);
    EXPECT_TRUE((*same)->jobs().empty());
    EXPECT_EQ((*same)->stats().cells_tested, 0u);
    // An edit at the front that reaches nothing.
    world.edits.insert(world.edits.begin(), worlds::edit(Sphere{.radius = 0.1f}, {30, 0, 0}));
    const std::vector<RowChange> changes = live.become(world.edits);
    const auto moved = Field::update(**same, live.program(), changes);
    ASSERT_TRUE(moved);
    EXPECT_TRUE((*moved)->jobs().empty());
    EXPECT_EQ((*moved)->stats().cells_tested, 0u);
    expect_equal_fields(**moved, *world.field(), "moved");
}

TEST(Field, ASmallEditBakesFewBricks) {
    worlds::World world = worlds::sphere_of(40);
    worlds::Live live(world.edits);
    const std::shared_ptr<const Field> field = world.field();
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.1f}, {2.0f, 0, 0}, Op::Subtract));
    std::vector<RowChange> changes = live.become(world.edits);
    const auto cut = Field::update(*field, live.program(), changes);
    ASSERT_TRUE(cut);
    EXPECT_GT((*cut)->jobs().size(), 0u);
    EXPECT_LE((*cut)->jobs().size(), 27u);
    EXPECT_LT((*cut)->stats().cells_evaluated, 300u);
    EXPECT_GT(field->stats().bricks, 300u);
    // And back again: what was freed is free, what came is gone.
    world.edits.pop_back();
    changes = live.become(world.edits);
    const auto back = Field::update(**cut, live.program(), changes);
    ASSERT_TRUE(back);
    expect_equal_fields(**back, *field, "undone");
}

TEST(Field, AFullPoolRefusesAnUpdateAndLeavesTheOldField) {
    worlds::World world = worlds::sphere_of(10);
    world.options.max_bricks = world.field()->stats().bricks + 5;
    worlds::Live live(world.edits);
    const std::shared_ptr<const Field> field = world.field();
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.3f}, {-0.5f, -0.5f, -0.5f}));
    world.edits.push_back(worlds::edit(Box{.half_extents = {0.8f, 0.02f, 0.8f}}));
    const std::vector<RowChange> changes = live.become(world.edits);
    const auto refused = Field::update(*field, live.program(), changes);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::OutOfMemory);
    expect_true_field(*field, "old");
}

TEST(Field, CodeThatNobodyUsesIsDropped) {
    worlds::World world = worlds::jumble(4, 30);
    worlds::Live live(world.edits);
    std::shared_ptr<const Field> field = world.field();
    worlds::Random r(1);
    for (int i = 0; i < 60; ++i) {
        world.edits[0].node.transform.position = r.point(0.5f);
        world.edits[0].node.shape = Sphere{.radius = 0.8f};
        const std::vector<RowChange> changes = live.become(world.edits);
        auto next = Field::update(*field, live.program(), changes);
        ASSERT_TRUE(next);
        field = *next;
        uint64_t used = 0;
        for (const uint32_t slot : field->slots()) used += field->records()[slot].code_count;
        ASSERT_LE(field->code().size(), 2 * used + 1024);
    }
    expect_true_field(*field, "after 60 moves");
}

}  // namespace
}  // namespace kiln::field
