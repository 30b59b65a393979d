// SPDX-License-Identifier: MIT
// `bench field`: building, editing, asking and storing the field of the recipes, at `resolution` voxels over [-1, 1]^3, or (but for edits)
// of a scene from a file.
// Peers: OpenVDB and NanoVDB with a band of 3 voxels on each side where their plug-in is found (peers.h), else the figures that
// they had on one core of an EPYC (Zen 5) at 4.1 GHz with kind 0, seed 5, 1000 edits and 256 voxels, marked "(anchor)".

#include "measure/bench_scene.h"
#include "measure/contest.h"
#include "measure/peers.h"
#include "measure/recipes.h"
#include "measure/roofs.h"
#include "measure/slow.h"
#include "measure/slow_mesh.h"

#include "base/parallel_for.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "field/meshing.h"
#include "sdf/program.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>

namespace kiln::measure {
namespace {

using field::Field;
using field::HostBricks;

/// Point evaluations that the slow way may take for one field; above, it looks at every n-th cell.
constexpr double kMostSlowWork = 4e10;
constexpr int kEdits = 20;
constexpr size_t kCacheWords = size_t(16) << 20;  // 128 MiB: more than caches hold
constexpr uint32_t kRandomPoints = 2000000;
constexpr int kRayWidth = 640, kRayHeight = 360;

/// A world that is edited, and its bricks.
struct State {
    sdf::Program list;
    HostBricks bricks;
    std::vector<uint32_t> rows;  // in the program, by position in the list
};

std::shared_ptr<const sdf::Program> program_of(std::span<const Edit> edits) {
    return std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
}

HostBricks made(std::shared_ptr<const sdf::Program> program, field::FieldOptions options, int threads,
                float own_voxels = 1) {
    options.workers = threads;
    options.own_voxels = own_voxels;
    return *HostBricks::build(std::move(program), options);
}

/// One step of a history: the edit at a position before and after it; none: there is none.
struct Step {
    uint32_t position;
    std::optional<Edit> before, after;

    Step back() const { return {position, after, before}; }
};

void apply(State& state, const Step& step) {
    field::RowChange change;
    state.rows.resize(std::max<size_t>(state.rows.size(), step.position + 1), field::kNoRow);
    uint32_t& row = state.rows[step.position];
    if (step.before) {
        change.removed = row;
        state.list.remove(row);
    }
    if (step.after)
        change.inserted = row =
            *sdf::insert(state.list, *step.after, {}, {}, sdf::order_at(step.position), step.position);
    (void)state.bricks.update(std::make_shared<const sdf::Program>(state.list), std::span(&change, 1));
}

class FieldRows {
public:
    FieldRows(BenchRun& run, BenchScene scene) : run_(run), scene_(std::move(scene)) {
        const vec3 size = (scene_.options.bounds.max - scene_.options.bounds.min) / scene_.options.voxel_size;
        const double points = double(size.x) * double(size.y) * double(size.z) * std::pow(8.0 / 7, 3);
        stride_ = stride_of(points);
        anchored_ = scene_.file.empty() && scene_.kind == 0 && run.options.seed == 5 && run.options.count == 1000 &&
                    run.options.resolution == 256;
    }

    void all() {
        const int cores = hardware_workers();
        const int first = run_.options.threads > 0 ? run_.options.threads : 1;
        measure(first);
        if (run_.options.threads == 0 && cores > 1) measure_parallel(cores);
    }

private:
    bool wanted(std::string_view row) const { return run_.wanted("field", row); }

    void measure(int threads) {
        if (wanted("bake")) bake(threads);
        if (scene_.file.empty()) edit_rows(threads);
        ask(threads);
        memory_rows();
    }
    void measure_parallel(int threads) {
        if (wanted("bake")) bake(threads);
        ask(threads);
    }
    void ask(int threads) {
        if (wanted("samples.random")) samples("samples.random", start(), scene_.points(kRandomPoints), 8.5, threads);
        if (wanted("samples.band")) samples("samples.band", wide_start(), band_points(), 39, threads);
        if (wanted("query.single") && threads == 1) single();
        if (wanted("rays")) rays(threads);
        if (wanted("rays.refined")) refined_rays(threads);
        if (wanted("mesh.smooth")) mesh(false, threads);
        if (wanted("mesh.sharp")) mesh(true, threads);
    }

    BenchRow row(std::string name, double value, std::string unit, int threads, bool more_is_better = false) const {
        BenchRow out;
        out.name = std::move(name);
        out.value = value;
        out.unit = std::move(unit);
        out.threads = threads;
        out.more_is_better = more_is_better;
        out.kind = scene_.kind;
        out.seed = run_.options.seed;
        out.count = scene_.file.empty() ? run_.options.count : scene_.program->index.size();
        out.scene = scene_.file;
        return out;
    }
    static void compare(BenchRow& row, std::string peer, double value) {
        row.peer = std::move(peer);
        row.peer_value = value;
        row.ratio = row.more_is_better ? row.value / value : value / row.value;
    }
    static void baked(BenchRow& row, double bricks) {
        row.bricks = bricks;
        row.texels = uint64_t(bricks * field::kBrickTexelCount + 0.5);
    }
    // Every how many-th piece of such work the slow way can do for, each point by every edit.
    uint64_t stride_of(double points) const {
        return std::max<uint64_t>(1, uint64_t(points * double(scene_.program->index.size()) / kMostSlowWork + 0.5));
    }
    // A published figure, where nobody can be asked.
    void anchor(BenchRow& row, std::string peer, double value) const {
        if (anchored_ && row.threads == 1) compare(row, std::move(peer) + " (anchor)", value);
    }

    const HostBricks& start() {
        if (!start_) start_ = std::make_unique<HostBricks>(made(scene_.program, scene_.options, 0));
        return *start_;
    }
    // Owns its whole band of 3 voxels, so that every point of the band lies in a brick.
    const HostBricks& wide_start() {
        if (!wide_start_) wide_start_ = std::make_unique<HostBricks>(made(scene_.program, scene_.options, 0, 4));
        return *wide_start_;
    }
    const Stored& slow() {
        if (!slow_) slow_ = std::make_unique<Stored>(brute_force(*scene_.program, start().field(), stride_));
        return *slow_;
    }
    double voxel() const { return double(scene_.options.voxel_size); }
    void* peer_grid() {
        if (!peer_ && peers() != nullptr && scene_.file.empty()) {
            const std::vector<KilnPeerEdit> list = peer_edits(scene_.edits);
            peer_.reset(peers()->build(list.data(), uint32_t(list.size()), voxel(), hardware_workers()));
        }
        return peer_.get();
    }

    // Roots that baking some bricks cannot do without: one a texel and edit that a brick keeps.
    static double roots_of(const Field& field, std::span<const uint32_t> slots) {
        double roots = 0;
        for (const uint32_t slot : slots) {
            for (const sdf::Instruction& in : field.code_of(slot))
                roots += in.opcode() == sdf::Opcode::Shape ? field::kBrickTexelCount : 0;
        }
        return roots;
    }

    void bake(int threads) {
        run_.stage("bake");
        HostBricks last;
        std::vector<Contestant> turns{[&] {
            last = {};
            return seconds_of([&] { last = made(scene_.program, scene_.options, threads); });
        }};
        const std::vector<KilnPeerEdit> list = peer_edits(scene_.edits);
        if (peers() != nullptr && scene_.file.empty())
            turns.push_back([&] {
                PeerGrid grid;
                return seconds_of(
                    [&] { grid.reset(peers()->build(list.data(), uint32_t(list.size()), voxel(), threads)); });
            });
        const std::vector<double> least = least_seconds(run_.options.runs, turns);
        BenchRow out = row("bake", least[0] * 1e3, "ms", threads);
        if (least.size() > 1) {
            compare(out, peers()->tree_name, least[1] * 1e3);
        } else {
            anchor(out, "OpenVDB", 1224);
        }
        out.roof_ratio = roots_of(last.field(), last.field().slots()) / (roofs().roots * threads) / least[0];
        baked(out, double(last.field().slots().size()));
        run_.add_checked(out, stored(last, stride_).checksum, slow().checksum);
    }

    // ---- edits: each way to change the list, kEdits times over, from the changed list to bricks that hold it

    // Positions of the list, empty where an edit was removed; what is added stands at the end.
    using List = std::vector<std::optional<Edit>>;
    using Change = void (*)(List& list, uint32_t m);

    std::vector<Step> history(Change change) const {
        std::vector<Step> out;
        List list(scene_.edits.begin(), scene_.edits.end());
        for (uint32_t m = 0; m < kEdits; ++m) {
            const List before = list;
            change(list, m);
            for (size_t i = 0; i < list.size(); ++i) {
                const std::optional<Edit> was = i < before.size() ? before[i] : std::nullopt;
                if (was != list[i]) out.push_back({uint32_t(i), was, list[i]});
            }
        }
        return out;
    }
    std::vector<Edit> after(const std::vector<Step>& steps) const {
        List list(scene_.edits.begin(), scene_.edits.end());
        for (const Step& step : steps) {
            list.resize(std::max<size_t>(list.size(), step.position + 1));
            list[step.position] = step.after;
        }
        std::vector<Edit> out;
        for (const std::optional<Edit>& edit : list)
            if (edit) out.push_back(*edit);
        return out;
    }

    struct Turns {
        std::vector<double> forwards = std::vector<double>(kEdits, 1e300);  // the least time of each edit, seconds
        std::vector<double> backwards = forwards;
        std::vector<double> peer = forwards;
        uint64_t checksum = 0;  // after all edits
        uint64_t undone = 0;    // after the undo of all of them
        double roots = 0;       // a mean edit's
        double bricks = 0;      // that it baked
    };

    // What takes the caches from an edit, before each.
    enum class Caches { Warm, Cold };

    // Of ours and the peer's in turn: each makes all edits, one after another, before the other does, and but in `edit.cold` twice, of
    // which the second time counts: what the other did in between is gone from the caches, else a row would tell which peers are
    // installed. `fresh` stands for the picture that is drawn
    // while a user edits: it holds what was before, so an edit copies the pages that it changes. What a turn's copy appends to it must copy whole,
    // once; a user's world has done so long before, and so has the copy when its first edit comes. A user's edits pay a little more than
    // these, for a picture that holds the last edit's pages too: one world throughout, copied before each edit, as `bench edits` has it.
    Turns take_turns(const std::vector<Step>& steps, bool with_peer, bool undo, int threads,
                     Caches caches = Caches::Warm) {
        Turns out;
        const bool peer = with_peer && peer_grid() != nullptr;
        State fresh{*scene_.program, made(scene_.program, scene_.options, threads), {}};
        for (uint32_t i = 0; i < scene_.edits.size(); ++i) fresh.rows.push_back(i);
        std::vector<uint64_t> other(caches == Caches::Cold ? kCacheWords : 0);
        const auto least = [](double& to, double seconds) { to = std::min(to, seconds); };
        const auto ours = [&](Turns& to, bool first) {
            State state = fresh;
            apply(state, in_the_corner());
            apply(state, in_the_corner().back());
            to.roots = to.bricks = 0;
            for (uint32_t m = 0; m < steps.size(); ++m) {
                for (uint64_t& word : other) ++word;
                least(to.forwards[m], seconds_of([&] { apply(state, steps[m]); }));
                to.roots += roots_of(state.bricks.field(), state.bricks.field().jobs()) / kEdits;
                to.bricks += double(state.bricks.field().jobs().size()) / kEdits;
            }
            if (first) to.checksum = stored(state.bricks).checksum;
            for (uint32_t m = undo ? uint32_t(steps.size()) : 0; m-- > 0;)
                least(to.backwards[m], seconds_of([&] { apply(state, steps[m].back()); }));
            if (first && undo) to.undone = stored(state.bricks).checksum;
        };
        const auto theirs = [&](Turns& to) {
            const PeerGrid grid(peers()->copy(peer_grid()));
            for (uint32_t m = 0; m < steps.size(); ++m) {
                const vec3 c = bite(m).node.transform.position;
                const float center[3] = {c.x, c.y, c.z};
                least(to.peer[m], seconds_of([&] { peers()->bite(grid.get(), center, kBiteRadius, threads); }));
            }
        };
        for (int turn = 0; turn < run_.options.runs; ++turn) {
            Turns before;
            if (caches == Caches::Warm) ours(before, false);
            ours(out, turn == 0);
            if (!peer) continue;
            theirs(before);
            theirs(out);
        }
        return out;
    }

    // An edit of air, far from all that edits of the rows change.
    Step in_the_corner() const {
        Edit out = bite(0);
        out.node.transform.position = {1, 1, 1};
        return {uint32_t(scene_.edits.size()) + kEdits, std::nullopt, out};
    }

    static double mean(const std::vector<double>& values) {
        double sum = 0;
        for (const double v : values) sum += v;
        return sum / double(values.size());
    }

    // Peers can neither undo nor move: every row is held against the cut that they can do, so that it can be judged on any machine.
    static void beside_cut(BenchRow& out, const Turns& turns) {
        const double cut = mean(turns.peer);
        if (cut < 1e300) compare(out, std::string(peers()->tree_name) + "'s cut", cut * 1e6);
    }

    void edit_rows(int threads) {
        const bool undo = wanted("undo");
        if (wanted("edit.mean") || wanted("edit.worst") || undo) {
            const auto bites = history([](List& list, uint32_t m) { list.push_back(bite(m)); });
            run_.stage("edits");
            const Turns turns = take_turns(bites, true, undo, threads);
            const uint64_t slow_way = rebuilt(after(bites));
            const auto edit_row = [&](std::string name, double seconds, double peer, double published) {
                BenchRow out = row(std::move(name), seconds * 1e6, "µs", threads);
                if (peer < 1e300) {
                    compare(out, peers()->tree_name, peer * 1e6);
                } else {
                    anchor(out, "OpenVDB", published);
                }
                out.roof_ratio = turns.roots / roofs().roots / seconds;
                baked(out, turns.bricks);
                return out;
            };
            if (wanted("edit.mean"))
                run_.add_checked(edit_row("edit.mean", mean(turns.forwards), mean(turns.peer), 1450), turns.checksum,
                                 slow_way);
            if (wanted("edit.worst"))
                run_.add_checked(edit_row("edit.worst", *std::ranges::max_element(turns.forwards),
                                          *std::ranges::max_element(turns.peer), 1750),
                                 turns.checksum, slow_way);
            if (undo) {
                BenchRow out = row("undo", mean(turns.backwards) * 1e6, "µs", threads);
                beside_cut(out, turns);
                out.roof_ratio = turns.roots / roofs().roots / mean(turns.backwards);
                baked(out, turns.bricks);
                run_.add_checked(out, turns.undone, stored(start()).checksum);
            }
        }
        if (wanted("edit.cold")) {
            const auto bites = history([](List& list, uint32_t m) { list.push_back(bite(m)); });
            run_.stage("edit.cold");
            const Turns turns = take_turns(bites, false, false, threads, Caches::Cold);
            BenchRow out = row("edit.cold", mean(turns.forwards) * 1e6, "µs", threads);
            out.roof_ratio = turns.roots / roofs().roots / mean(turns.forwards);
            baked(out, turns.bricks);
            run_.add_checked(out, turns.checksum, rebuilt(after(bites)));
        }
        for (const auto& [name, count] : kAmong) {
            if (wanted(name)) among(name, count, threads);
        }
        struct Way {
            const char* name;
            Change change;
        };
        static constexpr Way kWays[] = {
            {"edit.add",
             [](List& list, uint32_t m) {
                 Edit added = bite(m);
                 added.op = Op::Union;
                 list.push_back(added);
             }},
            {"edit.smooth",
             [](List& list, uint32_t m) {
                 Edit added = bite(m);
                 added.op = Op::Union;
                 added.blend_radius = kSmoothRadius;
                 list.push_back(added);
             }},
            {"edit.move",
             [](List& list, uint32_t m) { list[lb32(m) % list.size()]->node.transform.position.x += kBiteRadius; }},
            {"edit.remove",
             [](List& list, uint32_t m) {
                 size_t at = lb32(m) % list.size();
                 for (size_t i = 0; i < list.size() && !list[at]; ++i) at = (at + 1) % list.size();
                 list[at].reset();
             }},
        };
        for (const Way& way : kWays) {
            if (!wanted(way.name)) continue;
            run_.stage(way.name);
            const std::vector<Step> steps = history(way.change);
            const Turns turns = take_turns(steps, true, false, threads);
            BenchRow out = row(way.name, mean(turns.forwards) * 1e6, "µs", threads);
            beside_cut(out, turns);
            out.roof_ratio = turns.roots / roofs().roots / mean(turns.forwards);
            baked(out, turns.bricks);
            run_.add_checked(out, turns.checksum, rebuilt(after(steps)));
        }
    }

    // What an edit costs among so many others that lie as close together as the scene's do: the scene, and round it others of its kind, each in
    // the cube beside. So what an edit of edit.mean finds where it bites is there in every row, whatever the kind; a larger recipe would not do:
    // the crowd of kind 2 is densest in its middle, and less so a scene's size away from it. The grid covers kAmongHalf to each side.
    struct Among {
        const char* name;
        uint32_t count;
    };
    static constexpr Among kAmong[] = {
        {"edit.among.10k", 10000}, {"edit.among.100k", 100000}, {"edit.among.1m", 1000000}};
    static constexpr float kAmongHalf = 2;

    // Middles of `count` cubes of side 2, the nearest to the origin first.
    static std::vector<vec3> cube_middles(uint32_t count) {
        const int reach = int(std::ceil(std::cbrt(float(count)))) / 2 + 1;
        std::vector<vec3> out;
        for (int z = -reach; z <= reach; ++z) {
            for (int y = -reach; y <= reach; ++y) {
                for (int x = -reach; x <= reach; ++x) out.push_back({2 * float(x), 2 * float(y), 2 * float(z)});
            }
        }
        std::ranges::stable_sort(out, {}, [](vec3 p) { return dot(p, p); });
        out.resize(count);
        return out;
    }

    void among(const char* name, uint32_t wanted_count, int threads) {
        run_.stage(name);
        const uint32_t scenes = std::max(1u, wanted_count / std::max(1u, run_.options.count));
        std::vector<Edit> edits;
        uint32_t seed = run_.options.seed;
        for (const vec3 middle : cube_middles(scenes)) {
            for (Edit& e : recipe(scene_.kind, seed++, run_.options.count)) {
                e.node.transform.position = e.node.transform.position + middle;
                edits.push_back(e);
            }
        }
        const uint32_t count = uint32_t(edits.size());
        field::FieldOptions options;
        options.voxel_size = float(voxel());
        options.bounds = {{-kAmongHalf, -kAmongHalf, -kAmongHalf}, {kAmongHalf, kAmongHalf, kAmongHalf}};
        options.workers = threads;
        std::vector<Step> steps;
        for (uint32_t m = 0; m < kEdits; ++m) steps.push_back({count + m, std::nullopt, bite(m)});
        Turns out;
        {
            const std::shared_ptr<const sdf::Program> program = program_of(edits);
            State state{*program, *HostBricks::build(program, options), {}};
            for (uint32_t i = 0; i < count; ++i) state.rows.push_back(i);
            // One world throughout, as a program has it: a copy's first edit would pay for the copy.
            for (int turn = 0; turn < run_.options.runs; ++turn) {
                for (uint32_t m = 0; m < kEdits; ++m)
                    out.forwards[m] = std::min(out.forwards[m], seconds_of([&] { apply(state, steps[m]); }));
                if (turn == 0) out.checksum = stored(state.bricks).checksum;
                for (uint32_t m = kEdits; m-- > 0;) apply(state, steps[m].back());
            }
        }
        for (const Step& step : steps) edits.push_back(*step.after);
        BenchRow made = row(name, mean(out.forwards) * 1e6, "µs", threads);
        made.count = count;
        run_.add_checked(made, out.checksum, stored(*HostBricks::build(program_of(edits), options)).checksum);
    }

    uint64_t rebuilt(std::span<const Edit> edits) const {
        return stored(made(program_of(edits), scene_.options, 0)).checksum;
    }

    // ---- questions, of the baked bricks

    struct Cloud {
        std::vector<float> x, y, z;
        explicit Cloud(std::span<const vec3> points) {
            for (const vec3& p : points) {
                x.push_back(p.x);
                y.push_back(p.y);
                z.push_back(p.z);
            }
        }
        sdf::Points points() const { return {x.data(), y.data(), z.data(), int(x.size())}; }
    };

    // The lattice points of bricks with |d| < 3 voxels, brick by brick, moved to (0.3, 0.4, 0.6) of their voxel.
    std::vector<vec3> band_points() {
        const HostBricks& bricks = wide_start();
        const float h = bricks.field().grid().voxel_size;
        std::vector<vec3> out;
        for (const uint32_t slot : bricks.field().slots()) {
            const field::BrickRecord record = bricks.field().records()[slot];
            for (int i = 0; i < 343; ++i) {
                const int x = i % 7, y = i / 7 % 7, z = i / 49;
                if (!(std::abs(bricks.texel(slot, x, y, z)) < 3)) continue;
                out.push_back({(float(record.texel_x + x) + 0.3f) * h, (float(record.texel_y + y) + 0.4f) * h,
                               (float(record.texel_z + z) + 0.6f) * h});
            }
        }
        return out;
    }

    static uint64_t checksum_of(std::span<const float> values) { return hash64_of(values); }

    // Answers one point at a time, with other code than the wide loops.
    static std::vector<float> one_by_one(const HostBricks& bricks, std::span<const vec3> points) {
        std::vector<float> out(points.size());
        parallel_for(
            points.size(), 0, [&](int i) { out[size_t(i)] = bricks.distance(points[size_t(i)]); }, 4096);
        return out;
    }

    void samples(const char* name, const HostBricks& bricks, const std::vector<vec3>& points, double published,
                 int threads) {
        run_.stage(name);
        const Cloud cloud(points);
        std::vector<float> out(points.size()), peer(points.size());
        constexpr int kPiece = 1 << 14;
        const int pieces = (int(points.size()) + kPiece - 1) / kPiece;
        std::vector<Contestant> turns{[&] {
            return seconds_of([&] {
                parallel_for(pieces, threads, [&](int piece) {
                    const int first = piece * kPiece, count = std::min(kPiece, int(points.size()) - first);
                    const sdf::Points all = cloud.points();
                    bricks.distances({all.x + first, all.y + first, all.z + first, count}, out.data() + first);
                });
            });
        }};
        if (threads == 1 && peer_grid() != nullptr)
            turns.push_back([&] {
                return seconds_of([&] { peers()->sample_flat(peer_grid(), &points[0].x, points.size(), peer.data()); });
            });
        const std::vector<double> least = least_seconds(run_.options.runs, turns);
        BenchRow row_out = row(name, double(points.size()) / least[0] / 1e6, "M/s", threads, true);
        if (least.size() > 1) {
            compare(row_out, peers()->flat_name, double(points.size()) / least[1] / 1e6);
        } else {
            anchor(row_out, "NanoVDB", published);
        }
        // A cell word and four pairs of texels a point must be gathered.
        row_out.roof_ratio = 5 * double(points.size()) / (roofs().gathers * threads) / least[0];
        run_.add_checked(row_out, checksum_of(out), checksum_of(one_by_one(bricks, points)));
    }

    // One point a call, each by itself; the slow way is the narrowest of the wide loops, which shares no code with it.
    void single() {
        run_.stage("query.single");
        const HostBricks& bricks = start();
        const std::vector<vec3> points = scene_.points(kRandomPoints);
        std::vector<float> out(points.size()), peer(points.size()), slow_way(points.size());
        std::vector<Contestant> turns{[&] {
            return seconds_of([&] {
                for (size_t i = 0; i < points.size(); ++i) out[i] = bricks.distance(points[i]);
            });
        }};
        if (peer_grid() != nullptr)
            turns.push_back([&] {
                return seconds_of([&] {
                    for (size_t i = 0; i < points.size(); ++i)
                        peers()->sample_flat(peer_grid(), &points[i].x, 1, &peer[i]);
                });
            });
        const std::vector<double> least = least_seconds(run_.options.runs, turns);
        BenchRow row_out = row("query.single", double(points.size()) / least[0] / 1e6, "M/s", 1, true);
        if (least.size() > 1) {
            compare(row_out, peers()->flat_name, double(points.size()) / least[1] / 1e6);
        } else {
            anchor(row_out, "NanoVDB", 8.5);
        }
        row_out.roof_ratio = 5 * double(points.size()) / roofs().gathers / least[0];
        const Cloud cloud(points);
        bricks.distances(cloud.points(), slow_way.data(), sdf::Isa::Scalar);
        run_.add_checked(row_out, checksum_of(out), checksum_of(slow_way));
    }

    static uint64_t checksum_of(std::span<const field::MarchHit> hits) {
        uint64_t sum = 0;
        for (const field::MarchHit& hit : hits)
            sum = hash_combine(sum, uint64_t(hit.state) << 32 | std::bit_cast<uint32_t>(hit.t));
        return sum;
    }

    void rays(int threads) {
        run_.stage("rays");
        const HostBricks& bricks = start();
        const std::vector<Ray> list = scene_.rays(kRayWidth, kRayHeight);
        std::vector<field::MarchHit> hits(list.size()), slow_way(list.size());
        constexpr int kPiece = 1024;
        const int pieces = (int(list.size()) + kPiece - 1) / kPiece;
        bricks.march(std::span(list).first(1), hits.data());  // makes what rays keep beside the bricks
        std::vector<Contestant> turns{[&] {
            return seconds_of([&] {
                parallel_for(pieces, threads, [&](int piece) {
                    const size_t first = size_t(piece) * kPiece, count = std::min<size_t>(kPiece, list.size() - first);
                    bricks.march(std::span(list).subspan(first, count), hits.data() + first);
                });
            });
        }};
        std::vector<float> flat, t(list.size());
        for (const Ray& ray : list) {
            for (const float v :
                 {ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z})
                flat.push_back(v);
        }
        if (threads == 1 && peer_grid() != nullptr)
            turns.push_back([&] {
                return seconds_of([&] { (void)peers()->cast_flat(peer_grid(), flat.data(), list.size(), t.data()); });
            });
        const std::vector<double> least = least_seconds(run_.options.runs, turns);
        BenchRow out = row("rays", double(list.size()) / least[0] / 1e6, "M/s", threads, true);
        if (least.size() > 1) {
            compare(out, peers()->flat_name, double(list.size()) / least[1] / 1e6);
        } else {
            anchor(out, "NanoVDB", 2.4);
        }
        double voxels = 0, cells = 0;
        for (size_t i = 0; i < list.size(); ++i) {
            const Ray& r = list[i];
            const field::TexelRay texels =
                field::texel_ray_of({double(r.origin.x), double(r.origin.y), double(r.origin.z)}, r.direction,
                                    bricks.field().grid().voxel_size);
            slow_way[i] = bricks.march(texels, 0, field::kFarVoxels, false);  // every cell, no jumps
            voxels += slow_way[i].voxels;
            cells += slow_way[i].cells;
        }
        // Operations of finding out where a ray leaves a voxel or a cell; solving the few cubics comes on top.
        constexpr double kStepFlops = 20;
        out.roof_ratio = kStepFlops * (voxels + cells) / (roofs().flops * threads) / least[0];
        run_.add_checked(out, checksum_of(hits), checksum_of(slow_way));
    }

    // Moved to where the edits' own code has the surface; the slow way is a ray a call, on the narrowest instruction set.
    void refined_rays(int threads) {
        run_.stage("rays.refined");
        const HostBricks& bricks = start();
        const std::vector<Ray> list = scene_.rays(kRayWidth, kRayHeight);
        std::vector<field::MarchHit> hits(list.size()), slow_way(list.size());
        constexpr int kPiece = 1024;
        const int pieces = (int(list.size()) + kPiece - 1) / kPiece;
        bricks.march(std::span(list).first(1), hits.data());  // makes what rays keep beside the bricks
        const double least =
            least_seconds(run_.options.runs, {{[&] {
                              return seconds_of([&] {
                                  parallel_for(pieces, threads, [&](int piece) {
                                      const size_t first = size_t(piece) * kPiece,
                                                   count = std::min<size_t>(kPiece, list.size() - first);
                                      bricks.march_refined(std::span(list).subspan(first, count), hits.data() + first);
                                  });
                              });
                          }}})[0];
        BenchRow out = row("rays.refined", double(list.size()) / least / 1e6, "M/s", threads, true);
        anchor(out, "NanoVDB", 2.4);
        parallel_for(
            list.size(), 0,
            [&](int i) {
                bricks.march_refined(std::span(list).subspan(size_t(i), 1), &slow_way[size_t(i)], sdf::Isa::Scalar);
            },
            kPiece);
        run_.add_checked(out, checksum_of(hits), checksum_of(slow_way));
    }

    void mesh(bool sharp, int threads) {
        run_.stage("meshes");
        const HostBricks& bricks = start();
        const field::MeshBricks mesh_bricks(bricks);
        field::Mesh made;
        std::vector<Contestant> turns{[&] {
            return seconds_of([&] {
                if (sharp) {
                    field::mesh_sharp(mesh_bricks, field::exact_of(bricks, mesh_bricks), made, threads);
                } else {
                    field::mesh_smooth(mesh_bricks, made, threads);
                }
            });
        }};
        uint64_t peer_triangles = 0;
        if (threads == 1 && peer_grid() != nullptr)
            turns.push_back([&] { return seconds_of([&] { peer_triangles = peers()->mesh(peer_grid(), threads); }); });
        const std::vector<double> least = least_seconds(run_.options.runs, turns);
        BenchRow out = row(sharp ? "mesh.sharp" : "mesh.smooth", double(made.triangle_count()) / least[0] / 1e6,
                           "Mtri/s", threads, true);
        if (least.size() > 1) {
            compare(out, peers()->tree_name, double(peer_triangles) / least[1] / 1e6);
        } else {
            anchor(out, sharp ? "libfive" : "OpenVDB", sharp ? 0.35 : 6.6);
        }
        constexpr double kVertexFlops = 20;  // operations that place a vertex on its edge
        out.roof_ratio = kVertexFlops * double(made.vertex_count()) / (roofs().flops * threads) / least[0];
        if (!sharp) return run_.add_checked(out, checksum_of_triangles(made), smooth_mesh_by_voxel(bricks));
        constexpr double kLooks =
            80;  // ten times what a vertex asks of the exact field: every edit at a tenth of them is seconds
        field::Mesh slow_way;
        field::mesh_sharp(mesh_bricks, every_edit(bricks, mesh_bricks, stride_of(kLooks * double(made.vertex_count()))),
                          slow_way);
        run_.add_checked(out, checksum_of_bytes(made), checksum_of_bytes(slow_way));
    }

    // Bytes a voxel of the band: of distances in either format, and of what stands beside them.
    void memory_rows() {
        if (wanted("memory.per_voxel")) memory("memory.per_voxel", start());
        if (!wanted("memory.8_bit") && !wanted("memory.beside")) return;
        field::FieldOptions options = scene_.options;
        options.format = field::DistanceFormat::Snorm8;
        if (wanted("memory.8_bit")) memory("memory.8_bit", made(scene_.program, options, 0));
        if (!wanted("memory.beside")) return;
        run_.stage("memory");
        const HostBricks& bricks = start();
        const double distances = double(bricks.field().slots().size()) * field::kBrickTexelCount * bricks.texel_bytes();
        const Stored mine = stored(bricks, stride_);
        BenchRow out = row("memory.beside",
                           (double(bricks.bytes()) - distances) / double(std::max<uint64_t>(slow().band_voxels, 1)) *
                               double(mine.bricks) / double(std::max<size_t>(bricks.field().slots().size(), 1)),
                           "B", 1);
        run_.add_checked(out, mine.checksum, slow().checksum);
    }
    void memory(const char* name, const HostBricks& bricks) {
        run_.stage("memory");
        const Stored mine = stored(bricks, stride_);
        const Stored slow_way =
            &bricks == start_.get() ? slow() : brute_force(*scene_.program, bricks.field(), stride_);
        const double bytes = double(mine.bricks) * field::kBrickTexelCount * bricks.texel_bytes();
        BenchRow out = row(name, bytes / double(std::max<uint64_t>(slow_way.band_voxels, 1)), "B", 1);
        if (peer_grid() != nullptr) {
            uint64_t voxels = 0, size = 0;
            peers()->measure(peer_grid(), &voxels, &size);
            compare(out, peers()->tree_name, double(size) / double(std::max<uint64_t>(voxels, 1)));
        } else {
            anchor(out, "OpenVDB", 11.6);
        }
        out.roof_ratio = double(bricks.texel_bytes()) / out.value;
        run_.add_checked(out, hash_combine(mine.checksum, mine.bricks),
                         hash_combine(slow_way.checksum, slow_way.bricks));
    }

    BenchRun& run_;
    const BenchScene scene_;
    uint64_t stride_ = 1;
    bool anchored_ = false;
    std::unique_ptr<HostBricks> start_, wide_start_;
    std::unique_ptr<Stored> slow_;
    PeerGrid peer_;
};

}  // namespace

BenchFamily field_family() {
    return {
        {"field",
         "the field of 1000 spheres and boxes: building, editing, sampling, rays, meshes, memory",
         {"bake",           "edit.mean",        "edit.worst",   "undo",           "edit.cold",       "edit.add",
          "edit.smooth",    "edit.move",        "edit.remove",  "edit.among.10k", "edit.among.100k", "edit.among.1m",
          "samples.random", "samples.band",     "query.single", "rays",           "rays.refined",    "mesh.smooth",
          "mesh.sharp",     "memory.per_voxel", "memory.8_bit", "memory.beside"}},
        [](BenchRun& run) {
            if (!run.options.scene.empty()) {
                if (auto scene = file_scene(run.options))
                    FieldRows(run, std::move(*scene)).all();
                else
                    run.fail(scene.error());
                return;
            }
            for (const int kind : run.options.kinds)
                if (!run.fault()) FieldRows(run, recipe_scene(kind, run.options)).all();
        }};
}

}  // namespace kiln::measure
