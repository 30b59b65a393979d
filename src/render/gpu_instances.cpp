// SPDX-License-Identifier: MIT
#include "render/gpu_instances.h"

#include "base/format.h"
#include "render/graph_runner.h"
#include "render/instance_tree.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>

namespace kiln::render {

namespace {

// Bricks that sets which are not shown may keep.
constexpr uint64_t kRoomForOld = 1024;

// Around a box of voxels, for the rounding of rays: as of cells.
using field::kBoxMargin;

uint32_t slots_of(const field::BrickSet& set) { return std::max(set.field().slot_count(), 1u); }

// Metres from the object's origin.
Box3 solid_box_of(const field::BrickSet& set) {
    const field::CellBox& v = set.solid_voxels();
    const float h = set.voxel_size();
    const vec3 low{float(v.min.x), float(v.min.y), float(v.min.z)},
        high{float(v.max.x), float(v.max.y), float(v.max.z)};
    return {(low - vec3{kBoxMargin, kBoxMargin, kBoxMargin}) * h,
            (high + vec3{kBoxMargin, kBoxMargin, kBoxMargin}) * h};
}

// Rotations in double precision: places count from the eye, which may be kilometres away.
struct Rotation {
    double rows[3][3];  // object to world
};

// Beer and Lambert: what is left of light after a metre is exp(-absorbed). Black is as good as a millionth.
GlassRecord glass_record(const Material& m) {
    GlassRecord g{};
    g.ior = m.ior;
    g.opacity = m.opacity;
    g.alpha = m.roughness * m.roughness;
    if (!(m.attenuation_distance > 0)) return g;
    const auto absorbed = [&](float left) { return -std::log(std::clamp(left, 1e-6f, 1.0f)) / m.attenuation_distance; };
    g.absorbed_red = absorbed(m.attenuation_color.x);
    g.absorbed_green = absorbed(m.attenuation_color.y);
    g.absorbed_blue = absorbed(m.attenuation_color.z);
    return g;
}

Rotation rotation_of(quat q) {
    const double size = std::sqrt(double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z + double(q.w) * q.w);
    const double x = q.x / size, y = q.y / size, z = q.z / size, w = q.w / size;
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace

GpuInstances::GpuInstances(Runner& runner, GpuField& field) : runner_(&runner), field_(&field) {}

GpuInstances::~GpuInstances() {
    for (rhi::BufferHandle* b : {&cells_, &code_, &numbers_, &brick_records_, &set_table_}) drop(*b);
}

void GpuInstances::drop(rhi::BufferHandle& buffer) {
    if (!buffer) return;
    runner_->forget(buffer);
    runner_->device().destroy(buffer);
    buffer = {};
}

void GpuInstances::reserve(std::span<const Instance> instances) {
    for (auto& [key, set] : sets_) set.shown = false;
    uint64_t wanted = 0;
    bool come = false;
    for (const Instance& i : instances) {
        const auto [at, is_new] = sets_.try_emplace(i.bricks.get());
        come = come || is_new;
        Set& set = at->second;
        if (!set.shown) wanted += slots_of(*i.bricks);
        set.bricks = i.bricks;
        set.shown = true;
    }
    // What is not shown any more goes when others come, or when it takes more room than what is.
    const uint64_t held = reserve_.size() - reserve_.free_bytes();
    if (!come && held <= 2 * wanted + kRoomForOld) return;
    for (auto at = sets_.begin(); at != sets_.end();) {
        if (!at->second.shown && at->second.place) reserve_.release(*at->second.place);
        at = at->second.shown ? std::next(at) : sets_.erase(at);
    }
    order_.clear();
    for (auto& [key, set] : sets_) set.shown = false;
    bool fits = true;
    for (const Instance& i : instances) {
        Set& set = sets_.at(i.bricks.get());
        if (set.shown) continue;
        set.shown = true;
        set.number = uint32_t(order_.size());
        order_.push_back(set.bricks);
        if (!set.place) set.place = reserve_.allocate(slots_of(*set.bricks), 1);
        fits = fits && set.place;
    }
    if (!fits) {
        // All anew, in a larger reserve.
        reserve_ = rhi::RangeAllocator(reserve_.size() == 0 ? wanted : wanted + wanted / 2);
        for (const auto& bricks : order_) {
            Set& set = sets_.at(bricks.get());
            set.place = reserve_.allocate(slots_of(*bricks), 1);
            set.written = false;
        }
    }
    tables_stale_ = true;
    field_->reserve(uint32_t(reserve_.size()));
}

Result<void> GpuInstances::update(std::span<const Instance> instances) {
    bricks_new_ = 0;
    bricks_ = 0;
    if (instances.empty()) return {};
    const bool another = atlas_number_ != field_->atlas_number();
    const uint32_t end = field_->atlas_slots();
    for (const auto& bricks : order_) {
        Set& set = sets_.at(bricks.get());
        bricks_ += bricks->field().stats().bricks;
        if (!another && set.written) continue;
        if (bricks->field().options().format !=
            (field_->format() == rhi::Format::R16Float ? field::DistanceFormat::Half : field::DistanceFormat::Snorm8))
            return Error{"an instance's bricks are not stored as the field's are; make them with its format"};
        const uint32_t first = end - uint32_t(*set.place) - slots_of(*bricks);
        if (auto stored = field_->store_reserved(bricks->bricks(), first); !stored) return stored;
        set.written = true;
        bricks_new_ += bricks->field().stats().bricks;
        tables_stale_ = true;
    }
    atlas_number_ = field_->atlas_number();
    if (!tables_stale_) return {};
    if (auto written = write_tables(); !written) return written;
    tables_stale_ = false;
    return {};
}

Result<void> GpuInstances::buffer_of(rhi::BufferHandle& buffer, std::string_view name,
                                     std::span<const std::byte> bytes) {
    drop(buffer);
    const uint64_t most =
        std::min(runner_->device().limits().max_storage_binding, runner_->device().limits().max_buffer);
    if (bytes.size() > most)
        return Error{
            formatted("the instances' {} need {} bytes, a buffer of this device holds {}", name, bytes.size(), most),
            ErrorKind::OutOfMemory};
    auto made = runner_->device().create_buffer({.size = std::max<uint64_t>(bytes.size(), 16), .label = name});
    if (!made) return made.error();
    buffer = *made;
    return bytes.empty() ? Result<void>() : runner_->device().write_buffer(buffer, 0, bytes);
}

// Maps, records, code and numbers of all sets, one after another.
Result<void> GpuInstances::write_tables() {
    std::vector<uint32_t> cells;
    std::vector<field::BrickRecord> records;
    std::vector<sdf::Instruction> code;
    std::vector<float> numbers;
    table_.clear();
    const uint32_t end = field_->atlas_slots();
    use_ = {0, 0, 0, 1};
    for (const auto& bricks : order_) {
        const field::Field& f = bricks->field();
        const sdf::Program& program = bricks->program();
        InstanceSet set{};
        set.grid = f.grid();
        const field::CellBox& solid = bricks->solid_voxels();
        set.low_x = float(solid.min.x) - kBoxMargin;
        set.low_y = float(solid.min.y) - kBoxMargin;
        set.low_z = float(solid.min.z) - kBoxMargin;
        set.high_x = float(solid.max.x) + kBoxMargin;
        set.high_y = float(solid.max.y) + kBoxMargin;
        set.high_z = float(solid.max.z) + kBoxMargin;
        set.slot_first = end - uint32_t(*sets_.at(bricks.get()).place) - slots_of(*bricks);
        set.cells_first = uint32_t(cells.size());
        set.records_first = uint32_t(records.size());
        set.code_first = uint32_t(code.size());
        const auto& words = f.cells().words();
        for (size_t i = 0; i < words.size(); ++i) cells.push_back(words[i]);
        for (uint32_t slot = 0; slot < f.slot_count(); ++slot) records.push_back(f.records()[slot]);
        code.insert(code.end(), f.code().begin(), f.code().end());
        set.samples_first = uint32_t(numbers.size());
        numbers.insert(numbers.end(), program.samples.begin(), program.samples.end());
        set.params_first = uint32_t(numbers.size());
        numbers.insert(numbers.end(), program.params.begin(), program.params.end());
        table_.push_back(set);
        use_ = both(use_, tape_use(program.tape()));
    }
    if (runner_->device().info().kind != rhi::DeviceKind::Cpu) use_ = any_kind(use_);
    if (auto r = buffer_of(cells_, "instance cells", std::as_bytes(std::span(cells))); !r) return r;
    if (auto r = buffer_of(brick_records_, "instance bricks", std::as_bytes(std::span(records))); !r) return r;
    if (auto r = buffer_of(code_, "instance code", std::as_bytes(std::span(code))); !r) return r;
    if (auto r = buffer_of(numbers_, "instance numbers", std::as_bytes(std::span(numbers))); !r) return r;
    return buffer_of(set_table_, "instance sets", std::as_bytes(std::span(table_)));
}

void GpuInstances::place(std::span<const Instance> instances, const FrameParams& frame,
                         std::span<const Material> materials) {
    const auto start = std::chrono::steady_clock::now();
    records_.resize(instances.size());
    glass_.assign(instances.size(), {});
    const double h = double(frame.grid.voxel_size);
    const double eye[3] = {(double(frame.eye_x) + double(frame.eye_part_x)) * h,
                           (double(frame.eye_y) + double(frame.eye_part_y)) * h,
                           (double(frame.eye_z) + double(frame.eye_part_z)) * h};
    std::vector<Box3> boxes(instances.size()), glass_boxes(instances.size());
    for (size_t i = 0; i < instances.size(); ++i) {
        const Instance& instance = instances[i];
        const Rotation now = rotation_of(instance.pose.rotation), before = rotation_of(instance.before.rotation);
        const double at[3] = {instance.pose.position.x, instance.pose.position.y, instance.pose.position.z};
        const double was[3] = {instance.before.position.x, instance.before.position.y, instance.before.position.z};
        const double voxel = double(instance.bricks->voxel_size());
        InstanceRecord& r = records_[i];
        r = {};
        r.set = sets_.at(instance.bricks.get()).number;
        r.voxels = float(h / voxel);
        r.material = instance.material;
        vec4* const rows[] = {&r.x, &r.y, &r.z};
        vec4* const before_rows[] = {&r.before_x, &r.before_y, &r.before_z};
        int* const eye_voxel[] = {&r.eye_x, &r.eye_y, &r.eye_z};
        const Box3 box = instance.glass == 0 ? solid_box_of(*instance.bricks) : instance.bricks->box();
        const vec3 middle = box.center(), half = box.half_extents();
        float low[3], high[3];
        for (size_t k = 0; k < 3; ++k) {
            double in_object = 0;
            for (size_t j = 0; j < 3; ++j) in_object += now.rows[j][k] * (eye[j] - at[j]);
            // Farther than this no ray finds it.
            const double texel = std::clamp(in_object / voxel, -1e9, 1e9), whole = std::floor(texel);
            *eye_voxel[k] = int(whole);
            *rows[k] = {float(now.rows[0][k]), float(now.rows[1][k]), float(now.rows[2][k]), float(texel - whole)};
            // before = Rb Rn^T (p - at) + was, both from this eye.
            double turned[3], moved = was[k] - eye[k];
            for (size_t j = 0; j < 3; ++j) {
                turned[j] = 0;
                for (size_t n = 0; n < 3; ++n) turned[j] += before.rows[k][n] * now.rows[j][n];
                moved -= turned[j] * (at[j] - eye[j]);
            }
            *before_rows[k] = {float(turned[0]), float(turned[1]), float(turned[2]), float(moved / h)};
            const double center =
                at[k] - eye[k] + now.rows[k][0] * middle.x + now.rows[k][1] * middle.y + now.rows[k][2] * middle.z;
            const double reach = std::fabs(now.rows[k][0]) * half.x + std::fabs(now.rows[k][1]) * half.y +
                                 std::fabs(now.rows[k][2]) * half.z;
            const double slack = 1e-6 * (std::fabs(center) + reach) + 1e-3 * voxel;
            low[k] = float((center - reach - slack) / h);
            high[k] = float((center + reach + slack) / h);
        }
        if (instance.glass != 0 && instance.glass < materials.size())
            glass_[i] = glass_record(materials[instance.glass]);
        if (!instance.bricks->solid_voxels().empty())
            (instance.glass == 0 ? boxes : glass_boxes)[i] = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
    }
    nodes_ = instance_tree(boxes);
    glass_nodes_ = instance_tree(glass_boxes);
    place_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// As an image with rows of so many bytes.
static Image upload_rows(Graph& graph, std::string_view name, size_t row, std::span<const std::byte> bytes) {
    constexpr size_t kTexel = 16;
    const size_t rows = (bytes.size() + row - 1) / row;
    std::vector<std::byte> whole(rows * row);
    std::memcpy(whole.data(), bytes.data(), bytes.size());
    const rhi::Extent size{uint32_t(row / kTexel), uint32_t(rows)};
    Image out = graph.create(std::string(name), {.size = size, .format = rhi::Format::Rgba32Uint});
    const CopyRegion all[] = {{.size = size}};
    graph.copy(graph.upload(std::string(name), std::span<const std::byte>(whole)), out, all);
    return out;
}

InstanceHandles GpuInstances::import(Graph& graph) const {
    InstanceHandles out;
    if (nodes_.empty() && glass_nodes_.empty()) return out;
    out.instances = graph.upload("instances", std::span<const InstanceRecord>(records_));
    std::vector<InstanceWay> ways;
    ways.reserve(records_.size());
    for (const InstanceRecord& r : records_) {
        const InstanceSet& set = table_[r.set];
        ways.push_back({r.x, r.y, r.z, r.eye_x, r.eye_y, r.eye_z, r.voxels, set.grid, set.slot_first, set.cells_first,
                        set.low_x, set.low_y, set.low_z, set.high_x, set.high_y, set.high_z});
    }
    out.ways = upload_rows(graph, "instance ways", kWaysARow * sizeof(InstanceWay), std::as_bytes(std::span(ways)));
    constexpr size_t kNodeRow = kNodesARow * sizeof(InstanceNode);
    if (!nodes_.empty()) out.nodes = upload_rows(graph, "instance tree", kNodeRow, std::as_bytes(std::span(nodes_)));
    if (!glass_nodes_.empty()) {
        std::vector<std::byte> tree(glass_nodes_.size() * sizeof(InstanceNode) + glass_.size() * sizeof(GlassRecord));
        std::memcpy(tree.data(), glass_nodes_.data(), glass_nodes_.size() * sizeof(InstanceNode));
        std::memcpy(tree.data() + glass_nodes_.size() * sizeof(InstanceNode), glass_.data(),
                    glass_.size() * sizeof(GlassRecord));
        out.glass_nodes = upload_rows(graph, "glass tree", kNodeRow, tree);
        out.glass = graph.upload("glass", std::span<const GlassRecord>(glass_));
    }
    out.sets = graph.import("instance sets", set_table_);
    out.cells = graph.import("instance cells", cells_);
    out.records = graph.import("instance bricks", brick_records_);
    out.code = graph.import("instance code", code_);
    out.numbers = graph.import("instance numbers", numbers_);
    out.node_count = uint32_t(nodes_.size());
    out.glass_node_count = uint32_t(glass_nodes_.size());
    out.use = use_;
    return out;
}

}  // namespace kiln::render
