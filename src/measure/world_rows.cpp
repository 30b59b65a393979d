// SPDX-License-Identifier: MIT
// `bench world`: flying through a world of several levels, digging on the way, and moving a thousand things in it. Frames are those of a simulated
// 60 Hz; what a frame costs is its baking, without the picture. The scene is the recipe's edits, spread over kilometres of ground.
// A flight ends where it is judged: when all is made, the levels must hold what levels made there from nothing do.

#include "measure/bench_run.h"

#include "measure/contest.h"
#include "measure/move_work.h"
#include "measure/recipes.h"

#include "base/hash.h"
#include "field/clipmap.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace kiln::measure {
namespace {

constexpr double kFrame = 1.0 / 60;
constexpr float kFinest = 0.02f;
constexpr int kLevels = 6;
constexpr uint32_t kBudget = 1024;  // bricks a frame
constexpr double kSeconds = 0.004;  // likewise, of "rush"
constexpr float kSpacing = 4;       // metres between edits, more or less
constexpr float kSize = 3;          // of the recipe's edits, which are made for a box of two metres
constexpr int kFlown = 240, kFast = 60, kTeleports = 3, kDug = 60, kMoved = 1000;

// Ground, and edits all over a square.
std::vector<Edit> landscape(uint32_t seed, uint32_t count) {
    std::vector<Edit> out;
    Edit ground;
    ground.node.shape = Plane{};
    out.push_back(ground);
    const float side = kSpacing * std::sqrt(float(count));
    uint32_t i = 0;
    for (Edit e : recipe(0, seed, count)) {
        const float x = uniform(seed, 3 * i, 77), z = uniform(seed, 3 * i + 1, 77);
        Transform& t = e.node.transform;
        t.position = {(x - 0.5f) * side, t.position.y, (z - 0.5f) * side};
        t.scale = t.scale * kSize;
        out.push_back(std::move(e));
        ++i;
    }
    return out;
}

// What the levels hold where both have it, wherever in the pool: windows follow the focus late, so they may lie a little apart.
uint64_t hash_of(const field::Clipmap& map, const field::Clipmap& other) {
    uint64_t out = 0;
    for (int level = 0; level < map.level_count(); ++level) {
        const field::CellBox a = map.window(level), b = other.window(level);
        for (int z = std::max(a.min.z, b.min.z); z < std::min(a.max.z, b.max.z); ++z) {
            for (int y = std::max(a.min.y, b.min.y); y < std::min(a.max.y, b.max.y); ++y) {
                for (int x = std::max(a.min.x, b.min.x); x < std::min(a.max.x, b.max.x); ++x) {
                    const uint32_t word = map.cell_word(level, {x, y, z});
                    if ((word & field::kCellOccupied) == 0) continue;
                    uint64_t cell = hash_combine(uint64_t(uint32_t(x)) << 32 | uint32_t(y), uint32_t(z));
                    if (word != field::kCellMissing) {
                        const field::BrickContent& brick = map.content(word & field::kCellSlotMask);
                        cell = hash64({brick.codes(), size_t(field::kBrickTexelCount) * 2}, cell);
                    }
                    out = hash_combine(out, cell);
                }
            }
        }
    }
    return out;
}

struct Flight {
    double mean_ms = 0, worst_ms = 0, bricks = 0, mib = 0;
    uint64_t most_cells = 0;   // made by a frame beyond what entered and was still missing: none
    uint64_t most_bricks = 0;  // made by a frame
};

class WorldRows {
public:
    explicit WorldRows(BenchRun& run) : run_(run) {}

    void all() {
        const std::vector<Edit> edits = landscape(run_.options.seed, run_.options.count);
        auto compiled = sdf::compile({edits, {}, {}});
        if (!compiled) return run_.fail(compiled.error());
        program_ = std::make_shared<const sdf::Program>(std::move(*compiled));
        if (wanted("fly")) fly("fly", kFlown, 10, 0);
        if (wanted("fast")) fly("fast", kFast, 300, 0);
        if (wanted("teleport")) fly("teleport", 60 * kTeleports, 10, 60);
        if (wanted("rush")) fly("rush", 60 * kTeleports, 10, 60, kSeconds);
        if (wanted("arrive")) arrive();
        if (wanted("dig")) dig();
        if (wanted("move.1000")) move();
    }

private:
    bool wanted(std::string_view row) const { return run_.wanted("world", row); }
    int threads() const { return run_.options.threads > 0 ? run_.options.threads : 1; }
    BenchRow row(const std::string& name, double value, std::string unit) const {
        BenchRow out;
        out.name = name;
        out.value = value;
        out.unit = std::move(unit);
        out.seed = run_.options.seed;
        out.count = run_.options.count;
        out.threads = threads();
        return out;
    }
    field::ClipmapOptions options() const {
        return {.voxel_size = kFinest, .levels = kLevels, .cells = 64, .workers = threads()};
    }
    Result<field::Clipmap> made(dvec3 at) const { return field::Clipmap::make(program_, options(), at); }
    static double mib_of(const field::Clipmap& map) {
        uint64_t bytes = 0;
        for (uint32_t slot = 0; slot < map.slot_count(); ++slot) {
            const field::BrickContent& brick = map.content(slot);
            if (brick) bytes += sizeof(field::HalfCodes) + (brick.materials ? sizeof(field::BrickMaterials) : 0);
        }
        return double(bytes) / (1 << 20);
    }

    // One frame of baking; counts bricks, and that no cell is made that was not missing.
    void frame(field::Clipmap& map, dvec3 at, Flight& flight, double& total, bool moves = true,
               double time = std::numeric_limits<double>::infinity()) {
        uint64_t missing = 0, cells = 0, bricks = 0;
        const double seconds = seconds_of([&] {
            if (moves) map.move(at);
            for (int level = 0; level < map.all_levels(); ++level) missing += map.counts(level).missing_cells;
            map.work({.bricks = kBudget, .seconds = time});
        });
        for (int level = 0; level < map.all_levels(); ++level) {
            bricks += map.counts(level).baked;
            cells += map.counts(level).cells_made;
        }
        if (moves && cells > missing) flight.most_cells = std::max(flight.most_cells, cells - missing);
        flight.bricks += double(bricks);
        flight.most_bricks = std::max(flight.most_bricks, bricks);
        flight.worst_ms = std::max(flight.worst_ms, seconds * 1e3);
        total += seconds * 1e3;
    }

    void report(const std::string& name, const Flight& flight, field::Clipmap& map) {
        map.work();
        auto fresh = field::Clipmap::make(map.program(), options(), map.focus());
        if (!fresh) return run_.fail(fresh.error());
        fresh->work();
        if (flight.most_cells > 0)
            return run_.fail(
                Error{formatted("bench world/{}: {} cells were made that had not entered", name, flight.most_cells)});
        if (flight.most_bricks > kBudget)
            return run_.fail(Error{formatted("bench world/{}: a frame made {} bricks, its budget is {}", name,
                                             flight.most_bricks, kBudget)});
        const uint64_t was = hash_of(map, *fresh), is = hash_of(*fresh, map);
        run_.add_checked(row(name + ".mean", flight.mean_ms, "ms"), was, is);
        run_.add_checked(row(name + ".worst", flight.worst_ms, "ms"), was, is);
        run_.add_checked(row(name + ".bricks", flight.bricks, "bricks/frame"), was, is);
        run_.add_checked(row(name + ".most", double(flight.most_bricks), "bricks"), was, is);
        run_.add_checked(row(name + ".memory", flight.mib, "MiB"), was, is);
    }

    // `leap`: frames between teleports to the other side, 0 for none. `time`: the budget in seconds beside that in bricks.
    void fly(const std::string& name, int frames, double speed, int leap,
             double time = std::numeric_limits<double>::infinity()) {
        run_.stage(name);
        const double side = double(kSpacing) * std::sqrt(double(run_.options.count));
        dvec3 at{-0.4 * side, 2, 0.1};
        auto map = made(at);
        if (!map) return run_.fail(map.error());
        map->work();
        Flight flight;
        double total = 0;
        for (int i = 0; i < frames; ++i) {
            at.x += speed * kFrame;
            if (leap > 0 && i % leap == leap / 2) at = {-at.x, at.y, -at.z + 3};
            frame(*map, at, flight, total, true, time);
        }
        flight.mean_ms = total / frames;
        flight.bricks /= frames;
        flight.mib = mib_of(*map);
        report(name, flight, *map);
    }

    // Frames after a leap until every ray of a picture ends where it does when all is made: with what the picture sees made first, beside
    // the order without it.
    void arrive() {
        run_.stage("arrive");
        const double side = double(kSpacing) * std::sqrt(double(run_.options.count));
        const dvec3 from{-0.4 * side, 2, 0.1}, to{0.4 * side, 2, 3.1};
        const float half_height = 0.5f;
        const field::BakeView view{to, {1, 0, 0}, {0, 0, half_height * 16 / 9}, {0, half_height, 0}};
        constexpr int kColumns = 96, kRows = 54;
        const auto seen = [&](const field::Clipmap& map) {
            uint64_t out = 0;
            for (int i = 0; i < kColumns * kRows; ++i) {
                const float x = 2 * (float(i % kColumns) + 0.5f) / kColumns - 1;
                const float y = 2 * (float(i / kColumns) + 0.5f) / kRows - 1;
                const auto hit = map.cast(to, normalize(view.forward + view.right * x + view.up * y), 1e6);
                out = hash_combine(out, hash_combine(uint64_t(hit.state), std::bit_cast<uint64_t>(hit.t)));
            }
            return out;
        };
        auto whole = made(to);
        if (!whole) return run_.fail(whole.error());
        whole->work();
        const uint64_t expected = seen(*whole);
        std::array<double, 2> frames{};
        for (const bool first : {true, false}) {
            auto map = made(from);
            if (!map) return run_.fail(map.error());
            map->work();
            map->move(to);
            uint64_t sees = 0;
            for (bool done = false; sees != expected && !done; ++frames[first]) {
                done = map->work({.bricks = kBudget}, first ? std::optional(view) : std::nullopt);
                sees = seen(*map);
            }
            if (!first) continue;
            map->work();
            if (hash_of(*map, *whole) != hash_of(*whole, *map) || sees != expected)
                return run_.fail(Error{"bench world/arrive: what was made is not what a build from nothing makes"});
        }
        BenchRow out = row("arrive", frames[1], "frames");
        out.peer = "without a view";
        out.peer_value = frames[0];
        out.ratio = frames[0] / frames[1];
        out.checksum = hex(expected);
        run_.add(std::move(out));
    }

    void dig() {
        run_.stage("dig");
        dvec3 at{0.1, 1.5, 0.1};
        auto map = made(at);
        if (!map) return run_.fail(map.error());
        map->work();
        sdf::Program program = *program_;
        Flight flight;
        double total = 0;
        for (int i = 0; i < kDug; ++i) {
            at.x += 2 * kFrame;
            Edit hole;
            hole.op = Op::Subtract;
            hole.node.shape = Sphere{.radius = 0.25f};
            hole.node.transform.position = {float(at.x) + 1.2f, 0.05f * float(i % 5) - 0.1f, 0.3f * float(i % 3)};
            const double seconds = seconds_of([&] {
                const uint64_t order = sdf::order_at(run_.options.count + 1 + uint64_t(i));
                auto added = sdf::insert(program, hole, {}, {}, order, 0);
                if (!added) return run_.fail(added.error());
                const field::RowChange change{field::kNoRow, *added};
                map->edit(std::make_shared<const sdf::Program>(program), std::span(&change, 1));
                map->move(at);
            });
            double baked = 0;
            const double worst = flight.worst_ms;
            frame(*map, at, flight, baked, false);
            total += baked + seconds * 1e3;
            flight.worst_ms = std::max(worst, baked + seconds * 1e3);
        }
        flight.mean_ms = total / kDug;
        flight.bricks /= kDug;
        flight.mib = mib_of(*map);
        report("dig", flight, *map);
    }

    // A thousand dynamic edits, each somewhere else in every frame.
    void move() {
        run_.stage("move.1000");
        MoveWork work(kMoved);
        if (auto ready = work.prepare(); !ready) return run_.fail(ready.error());
        const uint64_t expected = hash_combine(work.bricks(), kMoved);
        uint64_t did = expected;
        double least = 1e300;
        for (int turn = 0; turn < run_.options.runs && !run_.fault(); ++turn) {
            least = std::min(least, seconds_of([&] {
                                 if (auto done = work.frame(turn); !done) run_.fail(done.error());
                             }));
            did = did == expected ? hash_combine(work.bricks(), work.instances()) : did;
        }
        run_.add_checked(row("move.1000", least * 1e6, "us"), did, expected);
    }

    BenchRun& run_;
    std::shared_ptr<const sdf::Program> program_;
};

}  // namespace

BenchFamily world_family() {
    return {
        {"world",
         "a world of six levels flown through at 60 Hz: milliseconds and bricks a frame, the worst frame, memory; the "
         "same teleports with a budget of 4 ms; frames until what is seen after one is final; digging; a "
         "thousand things moving",
         {"fly", "fast", "teleport", "rush", "arrive", "dig", "move.1000"}},
        [](BenchRun& run) { WorldRows(run).all(); }};
}

}  // namespace kiln::measure
