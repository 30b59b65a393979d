// SPDX-License-Identifier: MIT
// World: compiling, building its field, and answering questions from them.

#include "scene/exact.h"
#include "scene/framing.h"
#include "scene/region.h"
#include "scene/world_impl.h"

#include "render/lib/pack.h"
#include "sdf/tables.h"

#include "base/assert.h"
#include "base/format.h"
#include "base/suggest.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace kiln {

namespace {

constexpr int kMostDoublings = 24;
// Three quarters of what the renderer's atlas holds; the rest is for what moves.
constexpr uint32_t kMostBricks = 3u << 16;
/// More changes than this since the last field, and it is built anew: what so large a share of a world reaches is most of it, and finding
/// the changes of a place takes as long as there are changes.
size_t most_changes(size_t edits) { return std::clamp<size_t>(edits / 4, 256, 8192); }

/// An edit at the rim moves the bounds that the edits ask for, and with them the voxel size. A grid stays while it holds what it must and
/// both differ by no more than this: else a stroke there would make every brick anew with each of its edits.
constexpr float kKeptGrid = 1.1f;

double cells_of(const Box3& box, float voxel) {
    const vec3 size = box.max - box.min;
    const double cell = double(voxel) * field::kBrickVoxels;
    return (double(size.x) / cell + 2) * (double(size.y) / cell + 2) * (double(size.z) / cell + 2);
}

}  // namespace

void World::Impl::row_changed(uint32_t removed, uint32_t inserted) {
    const std::lock_guard lock(mutex);
    program.reset();
    all.reset();
    if (levels) level_changes.push_back({removed, inserted});
    if (level_changes.size() > most_changes(edits.size())) {
        levels.reset();
        level_changes.clear();
    }
    asked.reset();
    if (!built.field) return;
    if (changes.size() > most_changes(edits.size())) {
        built = {};
        return forget_changes();
    }
    // A row that came since the field was made and goes again leaves no trace in it.
    if (removed != field::kNoRow) {
        if (const auto came = inserted_since.find(removed); came != inserted_since.end()) {
            field::RowChange& change = changes[came->second];
            change.inserted = inserted;
            if (inserted != field::kNoRow) inserted_since.emplace(inserted, came->second);
            inserted_since.erase(removed);
            return;
        }
    }
    if (inserted != field::kNoRow) inserted_since.emplace(inserted, uint32_t(changes.size()));
    changes.push_back({removed, inserted});
}

void World::Impl::forget_changes() {
    changes.clear();
    inserted_since.clear();
}

std::shared_ptr<const sdf::Program> World::Impl::compiled() {
    const std::lock_guard lock(mutex);
    if (!program) {
        sdf::Program out = list;
        for (const uint32_t row : apart_rows()) out.remove(row);
        program = std::make_shared<const sdf::Program>(std::move(out));
    }
    return program;
}

void World::Impl::let_old_rows_go() {
    if (list.edits.size() == edits.size()) return;
    const auto done = compile_all();
    KILN_ASSERT(bool(done), "a world that was compiled compiles no more: {}", done ? "" : done.error().message);
}

Result<void> World::Impl::compile_all() {
    sdf::Fault fault;
    std::vector<uint32_t> slots;
    const auto placed = [&](Error error) -> Error {
        // From the compiler's numbers back to the file.
        const scene::JsonDocument& doc = data.source;
        scene::JsonIndex at = scene::SceneData::kNowhere;
        if (fault.object < data.object_places.size() && fault.node < data.object_places[fault.object].size()) {
            at = data.object_places[fault.object][fault.node];
        } else if (fault.object == UINT32_MAX && fault.edit < slots.size()) {
            at = edits[slots[fault.edit]].place;
        }
        error.kind = ErrorKind::Input;
        if (at == scene::SceneData::kNowhere) {
            if (fault.edit < slots.size()) error.message = edits[slots[fault.edit]].edit->name + ": " + error.message;
            return error;
        }
        if (fault.warp >= 0) {
            if (const auto domain = doc.find(at, "domain")) {
                at = doc.first(*domain);
                for (int i = 0; i < fault.warp; ++i) at = doc.next(at);
            }
        } else if (const auto file = doc.find(at, "file")) {
            at = *file;
        } else if (const auto formula = doc.find(at, "expression")) {
            at = *formula;
        }
        return doc.error(at, error.message);
    };
    // The compiler wants them side by side: their nodes are lent to it.
    std::vector<Edit> flat;
    flat.reserve(edits.size());
    slots.reserve(edits.size());
    edits.each([&](uint32_t slot) {
        Edit& e = *edits[slot].edit;
        Edit& lent = flat.emplace_back();
        lent.node = std::move(e.node);
        lent.op = e.op;
        lent.blend_radius = e.blend_radius;
        lent.material_blend_radius = e.material_blend_radius;
        lent.hidden = e.hidden;
        slots.push_back(slot);
    });
    auto source = scene::with_grids(flat, data.objects, data.folder, grids, &fault);
    sdf::Source compiled_source;
    if (source) {
        compiled_source = source->source();
        compiled_source.owners = slots;
    }
    auto made = source ? sdf::compile(compiled_source, &fault) : Result<sdf::Program>(source.error());
    for (size_t i = 0; i < slots.size(); ++i) edits[slots[i]].edit->node = std::move(flat[i].node);
    if (!made) return placed(made.error());
    list = std::move(*made);
    for (uint32_t i = 0; i < slots.size(); ++i) edits.set_row(slots[i], i);
    {
        const std::lock_guard lock(mutex);
        program.reset();
        all.reset();
        built = {};
        forget_changes();
        levels.reset();
        level_changes.clear();
    }
    find_movers();
    all_is_new = true;
    return {};
}

World::Impl::Resolution World::Impl::resolution(const sdf::Program& p, const FieldSettings& settings) const {
    Resolution out;
    Box3 finite = p.bounds;
    if (finite.empty())
        finite = p.unbounded ? Box3{{-5, -5, -5}, {5, 5, 5}} : Box3{{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}};
    out.voxel_size = settings.voxel_size > 0 ? settings.voxel_size : std::max(longest_side(finite) / 256, 1e-6f);
    if (settings.bounds) {
        out.bounds = out.least = *settings.bounds;
    } else {
        // Inflated by 10 %, and by two voxels where the scene is flat.
        const vec3 center = finite.center(), half = finite.half_extents() * 1.1f;
        const float least = 2 * out.voxel_size;
        const vec3 grown = max(half, finite.half_extents() + vec3{least, least, least});
        out.bounds = {center - grown, center + grown};
        out.least = finite.inflated(least);
        // A ground rises towards what blends with it as far as the blend reaches; beyond the bounds it would be bare again, with a step.
        if (p.unbounded) {
            out.bounds = box_union(out.bounds, p.index.touched());
            out.least = box_union(out.least, p.index.touched());
        }
    }
    return out;
}

bool World::Impl::still_serves(const field::FieldOptions& has, const Resolution& asked, const FieldSettings& settings) {
    if (has.voxel_size < asked.voxel_size / kKeptGrid || has.voxel_size > asked.voxel_size * kKeptGrid) return false;
    if (settings.bounds) return has.bounds == asked.bounds;
    return has.bounds.contains(asked.least.min) && has.bounds.contains(asked.least.max) &&
           longest_side(has.bounds) <= longest_side(asked.bounds) * kKeptGrid;
}

Result<World::Impl::Built> World::Impl::field(const FieldSettings& settings) {
    const std::shared_ptr<const sdf::Program> now = compiled();
    const std::lock_guard lock(mutex);
    const bool comparable = built.field && settings == built_with;
    std::vector<uint32_t> apart = apart_rows();
    if (comparable && changes.empty() && apart == built_apart) return built;
    if (!std::isfinite(settings.voxel_size) || settings.voxel_size < 0)
        return Error{"field_settings.voxel_size must be a finite number, 0 for automatic", ErrorKind::Usage};
    if (settings.bounds && (settings.bounds->empty() || !settings.bounds->finite()))
        return Error{"field_settings.bounds must be finite, with min below max", ErrorKind::Usage};
    const Resolution r = resolution(list, settings);
    Built next;
    if (comparable && built.coarsened == 0 && still_serves(built.field->options(), r, settings) &&
        changes.size() <= most_changes(edits.size())) {
        const std::vector<field::RowChange> changed = changes_beside(changes, built_apart, apart);
        if (changed.empty()) {
            built_apart = std::move(apart);
            forget_changes();
            return built;
        }
        // Only what the changes reach is made again.
        if (auto updated = field::Field::update(*built.field, now, changed)) {
            built.field = std::move(*updated);
            built_apart = std::move(apart);
            forget_changes();
            return built;
        }
    }
    field::FieldOptions options;
    options.voxel_size = r.voxel_size;
    options.bounds = r.bounds;
    options.format = settings.distance_8bit ? field::DistanceFormat::Snorm8 : field::DistanceFormat::Half;
    options.max_bricks = kMostBricks;
    for (;; ++next.coarsened, options.voxel_size *= 2) {
        if (cells_of(options.bounds, options.voxel_size) > kMaxCells && next.coarsened < kMostDoublings) continue;
        auto made = field::Field::build(now, options);
        if (made) {
            next.field = std::move(*made);
            break;
        }
        if (made.error().kind != ErrorKind::OutOfMemory || next.coarsened >= kMostDoublings) return made.error();
    }
    built = next;
    built_with = settings;
    built_apart = std::move(apart);
    forget_changes();
    return next;
}

// Called under the mutex, or before anyone else has the world.
Result<void> World::Impl::read_sky(const std::string& file) {
    if (sky_image.file == file) return {};
    auto pixels = scene::load_sky_image(file.starts_with('/') ? file : data.folder + file);
    if (!pixels) {
        const scene::JsonDocument& doc = data.source;
        if (const auto section = doc.empty() ? std::nullopt : doc.find(0, "environment"))
            if (const auto at = doc.find(*section, "file"); at && doc.text(*at) == file)
                return doc.error(*at, pixels.error().message);
        return Error{"environment.file: " + pixels.error().message, ErrorKind::Input};
    }
    sky_image = {file, std::make_shared<const image::FloatPixels>(std::move(*pixels)), nullptr};
    return {};
}

std::shared_ptr<const WorldView::Impl> World::Impl::view() {
    const std::shared_ptr<const sdf::Program> ready = whole();
    const std::lock_guard lock(mutex);
    if (!asked || asked->program != ready) asked = std::make_shared<const WorldView::Impl>(ready, generations);
    return asked;
}

Box3 World::bounds() const { return impl_->whole()->bounds; }

Result<std::shared_ptr<const field::Clipmap>> World::Impl::levels_around(const Camera& camera,
                                                                         const FieldSettings& settings,
                                                                         const FrameBudget& budget) {
    const std::shared_ptr<const sdf::Program> now = compiled();
    const std::lock_guard lock(mutex);
    const vec3 eye = camera.position;
    const dvec3 at{double(eye.x), double(eye.y), double(eye.z)};
    if (levels && settings == levels_with) {
        const auto changed = changes_beside(level_changes, levels_apart, apart_rows());
        if (!changed.empty()) levels->edit(now, changed);
        levels->move(at);
    } else {
        if (!std::isfinite(settings.voxel_size) || settings.voxel_size < 0)
            return Error{"field_settings.voxel_size must be a finite number, 0 for automatic", ErrorKind::Usage};
        auto made = field::Clipmap::make(
            now,
            {.voxel_size = resolution(list, settings).voxel_size,
             .levels = settings.levels,
             .cells = settings.cells,
             .format = settings.distance_8bit ? field::DistanceFormat::Snorm8 : field::DistanceFormat::Half},
            at);
        if (!made) return made.error();
        levels = std::move(*made);
        levels_with = settings;
    }
    level_changes.clear();
    levels_apart = apart_rows();
    // How wide the picture will be is not known yet.
    const render::shade::CameraParams seen = render::shade::camera_params(camera, 16, 9);
    levels->work({.bricks = budget.bricks,
                  .seconds = budget.seconds < 1e9 ? budget.seconds : std::numeric_limits<double>::infinity()},
                 field::BakeView{at,
                                 {seen.forward.x, seen.forward.y, seen.forward.z},
                                 {seen.right.x, seen.right.y, seen.right.z},
                                 {seen.up.x, seen.up.y, seen.up.z}});
    return std::make_shared<const field::Clipmap>(*levels);
}

Result<Camera> World::camera(std::string_view name) const {
    if (name.empty())
        return cameras.empty()
                   ? scene::framing_camera(box_union(impl_->whole()->bounds, impl_->meshes.bounds(impl_->data)))
                   : cameras.front().second;
    std::vector<std::string_view> names;
    for (const auto& [known, value] : cameras) {
        if (known == name) return value;
        names.push_back(known);
    }
    return Error{formatted("there is no camera \"{}\"; {}", name, suggestion(name, names)), ErrorKind::Usage};
}

Result<Frame> World::frame(std::string_view name) const {
    auto seen_from = camera(name);
    if (!seen_from) return seen_from.error();
    return frame(*seen_from);
}

Result<Frame> World::frame(const Camera& camera, const FrameBudget& budget) const {
    Frame out;
    out.camera = camera;
    if (field_settings.levels > 1) {
        auto levels = impl_->levels_around(camera, field_settings, budget);
        if (!levels) return levels.error();
        out.levels = std::move(*levels);
        const field::ClipmapOptions& options = out.levels->options();
        if (auto done = impl_->instances_of(options.voxel_size, options.format, out.instances); !done)
            return done.error();
    } else {
        auto built = impl_->field(field_settings);
        if (!built) return built.error();
        out.field = built->field;
        out.coarsened = built->coarsened;
        const field::FieldOptions& options = out.field->options();
        if (auto done = impl_->instances_of(options.voxel_size, options.format, out.instances); !done)
            return done.error();
    }
    out.materials.reserve(impl_->data.materials.size() + 1);
    out.materials.emplace_back();  // sdf::kDefaultMaterial
    for (const auto& [name, material] : impl_->data.materials) out.materials.push_back(material);
    impl_->outlines_of(out);
    impl_->motions_of(out);
    out.meshes = impl_->meshes.instances(impl_->data);
    out.lights = lights;
    out.environment = environment;
    const bool image = environment && !environment->file.empty();
    if (image) {
        const std::lock_guard lock(impl_->mutex);
        if (auto read = impl_->read_sky(environment->file); !read) return read.error();
        Impl::SkyImage& sky = impl_->sky_image;
        if (!sky.map) {
            sky.map =
                std::make_shared<const render::shade::EnvironmentMap>(render::shade::make_environment_map(*sky.pixels));
            sky.pixels = nullptr;
        }
        out.environment_map = sky.map;
    }
    // An image of a sky has its own sun.
    if (out.lights.empty() && !image) out.lights.push_back(render::shade::default_sun());
    return out;
}

std::string World::inspect_json() const {
    using Json = nlohmann::ordered_json;
    const auto box_json = [](const Box3& b) -> Json {
        if (b.empty() || !b.finite()) return nullptr;
        return {{"min", {b.min.x, b.min.y, b.min.z}}, {"max", {b.max.x, b.max.y, b.max.z}}};
    };
    const scene::SceneData& data = impl_->data;
    Json out;
    out["description"] = data.description;
    out["edits"] = impl_->edits.size();
    size_t hidden = 0;
    std::map<std::string, int> shapes, ops;
    constexpr const char* kOps[] = {"union", "subtract", "intersect", "paint"};
    impl_->edits.each([&](uint32_t slot) {
        const Edit& e = *impl_->edits[slot].edit;
        hidden += e.hidden;
        ++shapes[e.node.kind == Node::Kind::Shape ? std::string(sdf::shape_rows()[e.node.shape.kind].name) : "object"];
        ++ops[kOps[size_t(e.op)]];
    });
    out["hidden"] = hidden;
    out["shapes"] = shapes;
    out["ops"] = ops;
    out["objects"] = data.objects.size();
    Json materials = Json::array(), camera_names = Json::array();
    for (const auto& [name, material] : data.materials) materials.push_back(name);
    for (const auto& [name, camera] : cameras) camera_names.push_back(name);
    out["materials"] = materials;
    out["lights"] = lights.size();
    out["cameras"] = camera_names;
    out["not_drawn_yet"] = data.undrawn;
    const std::shared_ptr<const sdf::Program> program = impl_->whole();
    out["instances"] =
        std::count_if(impl_->movers.begin(), impl_->movers.end(), [](const auto& m) { return m.second.apart; });
    if (impl_->report) {
        const JournalReport& r = *impl_->report;
        out["journal"] = {{"file", r.file}, {"commands", r.commands}, {"dropped_bytes", r.dropped_bytes}};
    }
    out["bounds"] = box_json(program->bounds);
    out["unbounded"] = program->unbounded;
    out["instructions"] = program->tape().size();
    Json drawn = Json::array();
    for (size_t i = 0; i < data.meshes.size(); ++i) {
        const scene::SceneMesh& mesh = data.meshes[i];
        Json one = {{"id", mesh.id}, {"file", mesh.file}, {"hidden", mesh.hidden}};
        if (const auto& d = impl_->meshes.models[i]) {
            one["triangles"] = d->triangle_count();
            one["vertices"] = d->vertices.size();
            one["materials"] = d->surfaces.size();
            one["images"] = d->images.size();
            one["nodes"] = d->nodes.size();
            one["skins"] = d->skins.size();
            one["seconds"] = d->duration;
            one["bounds"] = box_json(model::bounds_of(*d));
        }
        drawn.push_back(one);
    }
    if (!drawn.empty()) out["triangle_meshes"] = drawn;
    if (!impl_->meshes.faults.empty()) out["faults"] = impl_->meshes.faults;
    Json meshes = Json::array();
    for (const scene::Grids::MeshNote& note : impl_->grids.mesh_notes) {
        if (scene::is_region(note.file)) continue;
        const model::BakeReport& r = note.report;
        meshes.push_back({{"file", note.file},
                          {"resolution", note.resolution},
                          {"found", r.sentence()},
                          {"triangles", r.topology.triangles},
                          {"sign", r.topology.closed_manifold() ? "closed manifold" : "winding number"},
                          {"open_edges", r.topology.open_edges},
                          {"non_manifold_edges", r.topology.non_manifold_edges},
                          {"ambiguous_share", r.ambiguous_share},
                          {"cell", r.cell},
                          {"bricks", r.bricks},
                          {"bytes", r.bytes},
                          {"divisor", r.divisor}});
    }
    if (!meshes.empty()) out["meshes"] = meshes;
    if (field_settings.levels > 1) {
        const float voxel = impl_->resolution(impl_->list, field_settings).voxel_size;
        out["voxel_size"] = voxel;
        out["levels"] = field_settings.levels;
        out["cells"] = field_settings.cells;
        out["reach"] =
            double(voxel) * std::ldexp(double(field::level_reach(field_settings.cells)), field_settings.levels - 1);
    } else if (auto built = impl_->field(field_settings)) {
        const field::Field& f = *built->field;
        const field::GridParams grid = f.grid();
        const uint32_t bricks = f.stats().bricks;
        const int bytes_a_texel = f.options().format == field::DistanceFormat::Half ? 2 : 1;
        out["voxel_size"] = f.options().voxel_size;
        out["grid_cells"] = {grid.size_x, grid.size_y, grid.size_z};
        out["bricks"] = bricks;
        out["brick_bytes"] = uint64_t(bricks) * uint64_t(field::kBrickTexelCount) * uint64_t(bytes_a_texel + 2);
        out["coarsened"] = built->coarsened;
    } else {
        out["field_error"] = built.error().message;
    }
    return out.dump(2) + "\n";
}

std::vector<std::string> World::model_notes() const {
    std::vector<std::string> out;
    for (const scene::Grids::MeshNote& note : impl_->grids.mesh_notes)
        if (!scene::is_region(note.file)) out.push_back(formatted("{}: {}", note.file, note.report.sentence()));
    out.insert(out.end(), impl_->meshes.notes.begin(), impl_->meshes.notes.end());
    return out;
}

std::vector<std::string> World::faults() const { return impl_->meshes.faults; }

std::vector<std::string> World::not_drawn_yet() const { return impl_->data.undrawn; }

}  // namespace kiln
