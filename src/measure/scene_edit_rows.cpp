// SPDX-License-Identifier: MIT
// `bench edits`: what an edit costs in bundled scenes, which nobody tuned it on. Balls as large to the scene's voxels as the bites of
// `bench field` are to theirs are cut out, added, blended in, moved and removed, each in the middle of a brick, so at a surface. Before each a
// picture takes its copy of world and bricks, as it does in a player, so the edit writes to copies of the pages that it changes.

#include "measure/bench_run.h"
#include "measure/contest.h"
#include "measure/recipes.h"
#include "measure/scene_field.h"
#include "measure/slow.h"

#include "sdf/program.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace kiln::measure {
namespace {

using field::HostBricks;

constexpr const char* kScenes[] = {"archipelago", "quarry", "workbench"};
constexpr uint32_t kPlaces = 20;
constexpr float kVoxelsOfTheRecipes = 2.0f / 256;

class SceneEditRows {
public:
    SceneEditRows(BenchRun& run, std::string scene, std::shared_ptr<const field::Field> field)
        : run_(run), scene_(std::move(scene)), program_(field->shared_program()), options_(field->options()) {
        options_.workers = 1;
        const std::vector<uint32_t> slots = field->slots();
        for (uint32_t i = 0; i < kPlaces; ++i) {
            const field::BrickRecord& brick = field->records()[slots[lb32(i) % slots.size()]];
            const auto middle = [&](int texel) { return (float(texel) + 3.5f) * options_.voxel_size; };
            places_.push_back({middle(brick.texel_x), middle(brick.texel_y), middle(brick.texel_z)});
        }
    }

    void all() {
        const auto row = [&](const char* what, auto&& change) {
            if (run_.wanted("edits", scene_ + "." + what)) measure(what, change);
        };
        row("cut", [&](uint32_t m) { return Step{{}, ball(m, Op::Subtract, 0)}; });
        row("add", [&](uint32_t m) { return Step{{}, ball(m, Op::Union, 0)}; });
        row("smooth", [&](uint32_t m) { return Step{{}, ball(m, Op::Union, kSmoothRadius)}; });
        row("move", [&](uint32_t m) {
            Step out{ball(m, Op::Union, 0), ball(m, Op::Union, 0)};
            out.after->node.transform.position.x += scaled(kBiteRadius);
            return out;
        });
        row("remove", [&](uint32_t m) { return Step{ball(m, Op::Union, 0), {}}; });
    }

private:
    struct Step {
        std::optional<Edit> before, after;
        Step back() const { return {after, before}; }
    };
    struct State {
        sdf::Program list;
        HostBricks bricks;
        std::array<uint32_t, kPlaces> rows;
    };

    float scaled(float metres) const { return metres * options_.voxel_size / kVoxelsOfTheRecipes; }
    Edit ball(uint32_t m, Op op, float blend) const {
        Edit out;
        out.node.shape = Sphere{.radius = scaled(kBiteRadius)};
        out.node.transform.position = places_[m];
        out.op = op;
        out.blend_radius = scaled(blend);
        return out;
    }

    static void list(State& state, const Step& step, uint32_t m, field::RowChange& change) {
        if (step.before) {
            change.removed = state.rows[m];
            state.list.remove(change.removed);
        }
        if (step.after) {
            const uint64_t position = uint64_t(1) << 24 | m;  // after all of the scene's
            change.inserted = state.rows[m] =
                *sdf::insert(state.list, *step.after, {}, {}, sdf::order_at(position), uint32_t(position));
        }
    }
    static void apply(State& state, const Step& step, uint32_t m) {
        field::RowChange change;
        list(state, step, m, change);
        (void)state.bricks.update(std::make_shared<const sdf::Program>(state.list), std::span(&change, 1));
    }

    template <typename Change>
    void measure(const char* what, const Change& change) {
        const std::string name = scene_ + "." + what;
        run_.stage(name);
        State state{*program_, {}, {}};
        for (uint32_t m = 0; m < kPlaces; ++m) {
            field::RowChange unused;
            if (const Step step = change(m); step.before) list(state, {{}, step.before}, m, unused);
        }
        auto bricks = HostBricks::build(std::make_shared<const sdf::Program>(state.list), options_);
        if (!bricks) return run_.fail(bricks.error());
        state.bricks = std::move(*bricks);
        std::array<double, kPlaces> least;
        least.fill(1e300);
        uint64_t found = 0, slow_way = 0, baked = 0;
        for (int turn = 0; turn < run_.options.runs; ++turn) {
            std::optional<State> picture;
            for (uint32_t m = 0; m < kPlaces; ++m) {
                picture = state;
                least[m] = std::min(least[m], seconds_of([&] { apply(state, change(m), m); }));
                if (turn == 0) baked += state.bricks.field().jobs().size();
            }
            if (turn == 0) {
                found = stored(state.bricks).checksum;
                slow_way = stored(*HostBricks::build(state.bricks.field().shared_program(), options_)).checksum;
            }
            picture.reset();
            for (uint32_t m = kPlaces; m-- > 0;) apply(state, change(m).back(), m);
        }
        double sum = 0;
        for (const double seconds : least) sum += seconds;
        BenchRow out;
        out.name = name;
        out.value = sum / kPlaces * 1e6;
        out.unit = "µs";
        out.threads = 1;
        out.count = program_->index.size();
        out.scene = scene_;
        out.bricks = double(baked) / kPlaces;
        out.texels = baked * field::kBrickTexelCount / kPlaces;
        run_.add_checked(out, found, slow_way);
    }

    BenchRun& run_;
    const std::string scene_;
    const std::shared_ptr<const sdf::Program> program_;
    field::FieldOptions options_;
    std::vector<vec3> places_;
};

const std::vector<std::string>& row_names() {
    static const std::vector<std::string> all = [] {
        std::vector<std::string> out;
        for (const std::string scene : kScenes) {
            for (const char* what : {"cut", "add", "smooth", "move", "remove"}) out.push_back(scene + "." + what);
        }
        return out;
    }();
    return all;
}

}  // namespace

BenchFamily edits_family() {
    return {{"edits",
             "an edit at the surface of bundled scenes, while a picture holds what was before",
             {row_names().begin(), row_names().end()}},
            [](BenchRun& run) {
                for (const std::string scene : kScenes) {
                    if (run.fault() || std::ranges::none_of(row_names(), [&](const std::string& name) {
                            return name.starts_with(scene) && run.wanted("edits", name);
                        }))
                        continue;
                    auto field = field_of_scene(scene);
                    if (!field) return run.fail(field.error());
                    SceneEditRows(run, scene, std::move(*field)).all();
                }
            }};
}

}  // namespace kiln::measure
