// SPDX-License-Identifier: MIT
#include "render/gpu_field.h"

#include "base/assert.h"
#include "base/format.h"
#include "base/log.h"
#include "base/parallel_for.h"
#include "field/brick_content.h"
#include "render/graph_runner.h"
#include "render/passes/bake.gpu.h"
#include "render/passes/passes.h"

#include <kiln/shapes.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <limits>

namespace kiln::render {

namespace {

// Distances and materials together. Beyond it a field is refused, and the world coarsens.
constexpr uint64_t kMaxAtlasBytes = 512ull << 20;
// One slice of a bake: bounds the copy path's buffer (8 MiB) and the work of one submit.
constexpr uint32_t kJobsPerSlice = 8192;
constexpr uint64_t kCompareBlock = 64 << 10;

template <typename T>
std::span<const std::byte> bytes_of(const T& range) {
    return std::as_bytes(std::span(range));
}

bool any_cpu_only(std::span<const sdf::Instruction> code) {
    return std::any_of(code.begin(), code.end(), [](const sdf::Instruction& in) { return in.cpu_only(); });
}

// An edit that is a half-space, added without a blend; nothing when it is more.
std::optional<HorizonPlane> plane_of(std::span<const sdf::Instruction> code, const AppendArray<float>& params) {
    HorizonPlane out{
        .normal_x = 0, .normal_y = 1, .normal_z = 0, .scale = 0, .at_x = 0, .at_y = 0, .at_z = 0, .material = 0};
    for (const sdf::Instruction in : code) {
        const auto number = [&](size_t i) { return params[in.param + i]; };
        if (in.moves_point() && out.scale != 0) return {};
        switch (in.opcode()) {
        case sdf::Opcode::PointCell:
            break;
        case sdf::Opcode::PointTranslate:
            out.at_x = number(0), out.at_y = number(1), out.at_z = number(2);
            break;
        case sdf::Opcode::PointAffine:  // of the matrix the row that makes y
            out.at_x = number(0), out.at_y = number(1), out.at_z = number(2);
            out.normal_x = number(6), out.normal_y = number(7), out.normal_z = number(8);
            break;
        case sdf::Opcode::Shape:
            if (in.aux() != uint32_t(ShapeKind::Plane) || out.scale != 0) return {};
            out.scale = number(0);
            out.material = uint32_t(number(1));
            break;
        case sdf::Opcode::Combine:
            if (Op(in.aux() & 3u) != Op::Union || number(0) != 0 || number(1) != 0) return {};
            break;
        default:
            return {};
        }
    }
    return out;
}

uint32_t ceil_div(uint32_t a, uint32_t b) { return (a + b - 1) / b; }

}  // namespace

GpuField::GpuField(Runner& runner) : runner_(&runner), device_(&runner.device()) {}

GpuField::~GpuField() {
    drop_atlas();
    for (Storage* s : {&cells_, &records_, &code_, &program_, &numbers_}) {
        if (!s->handle) continue;
        runner_->forget(s->handle);
        device_->destroy(s->handle);
    }
    if (dropped_) {
        runner_->forget(dropped_);
        device_->destroy(dropped_);
    }
}

// Makes the buffer hold at least `bytes`; `kept` says whether it is still the one it was.
Result<void> GpuField::reserve(Storage& storage, std::string_view name, uint64_t bytes, bool& kept) {
    const uint64_t most = std::min(device_->limits().max_storage_binding, device_->limits().max_buffer);
    if (bytes > most) {
        return Error{
            formatted("the field's {} need {} bytes, a buffer of this device holds {}; a larger voxel size would fit",
                      name, bytes, most),
            ErrorKind::OutOfMemory};
    }
    kept = storage.bytes >= std::max<uint64_t>(bytes, 16);
    if (kept) return {};
    if (storage.handle) {
        runner_->forget(storage.handle);
        device_->destroy(storage.handle);
    }
    storage = {};
    // Room to grow by half, so that a growing world does not make a buffer a frame.
    const uint64_t room = std::min<uint64_t>((bytes + bytes / 2 + 256) & ~uint64_t{255}, most);
    auto buffer = device_->create_buffer({.size = room, .label = name});
    if (!buffer) return buffer.error();
    storage = {*buffer, room};
    return {};
}

// Writes `bytes`, leaving out blocks equal to `old` (what the buffer holds there).
Result<void> GpuField::write(const Storage& storage, uint64_t offset, std::span<const std::byte> bytes,
                             std::span<const std::byte> old) {
    const auto same = [&](uint64_t at, uint64_t n) {
        return at + n <= old.size() && std::memcmp(bytes.data() + at, old.data() + at, n) == 0;
    };
    for (uint64_t at = 0; at < bytes.size();) {
        const uint64_t n = std::min<uint64_t>(kCompareBlock, bytes.size() - at);
        if (same(at, n)) {
            at += n;
            continue;
        }
        uint64_t end = at + n;  // as long a run of changed blocks as there is, in one write
        while (end < bytes.size()) {
            const uint64_t m = std::min<uint64_t>(kCompareBlock, bytes.size() - end);
            if (same(end, m)) break;
            end += m;
        }
        if (auto written = device_->write_buffer(storage.handle, offset + at, bytes.subspan(at, end - at)); !written)
            return written;
        at = end;
    }
    return {};
}

Result<void> GpuField::store(Storage& storage, std::string_view name, std::span<const std::byte> bytes,
                             std::span<const std::byte> old) {
    bool kept = false;
    if (auto r = reserve(storage, name, bytes.size(), kept); !r) return r;
    return write(storage, 0, bytes, kept ? old : std::span<const std::byte>{});
}

// Pages that are not those of `old`, runs of them in one write.
template <typename T, size_t kPage>
Result<void> GpuField::store_pages(Storage& storage, std::string_view name, const PagedArray<T, kPage>& pages,
                                   const PagedArray<T, kPage>* old) {
    bool kept = false;
    if (auto r = reserve(storage, name, pages.size() * sizeof(T), kept); !r) return r;
    return write_pages(storage, 0, pages, kept ? old : nullptr);
}

template <typename T, size_t kPage>
Result<void> GpuField::write_pages(const Storage& storage, uint64_t offset, const PagedArray<T, kPage>& pages,
                                   const PagedArray<T, kPage>* old) {
    std::vector<T> run;
    for (size_t page = 0, first = 0; page <= pages.pages(); ++page) {
        const bool ends = page == pages.pages() || (old != nullptr && pages.same_page(*old, page)) ||
                          run.size() * sizeof(T) >= kCompareBlock;
        if (ends && !run.empty()) {
            if (auto r = device_->write_buffer(storage.handle, offset + first * kPage * sizeof(T), bytes_of(run)); !r)
                return r;
            run.clear();
        }
        if (page == pages.pages() || (old != nullptr && pages.same_page(*old, page))) continue;
        if (run.empty()) first = page;
        if (const auto* content = pages.find(page)) {
            run.insert(run.end(), content->begin(), content->end());
        } else {
            run.insert(run.end(), kPage, pages.fill());
        }
    }
    return {};
}

// What `array` has grown by since `old`, or all of it.
template <typename T>
Result<void> GpuField::write_grown(const Storage& storage, uint64_t offset, const AppendArray<T>& array,
                                   const AppendArray<T>* old) {
    const size_t from = old != nullptr && array.extends(*old) ? old->size() : 0;
    if (from == array.size()) return {};
    return device_->write_buffer(storage.handle, offset + from * sizeof(T),
                                 bytes_of(array.subspan(from, array.size() - from)));
}

template <typename T>
Result<void> GpuField::store_grown(Storage& storage, std::string_view name, const AppendArray<T>& array,
                                   const AppendArray<T>* old) {
    bool kept = false;
    if (auto r = reserve(storage, name, array.size() * sizeof(T), kept); !r) return r;
    return write_grown(storage, 0, array, kept ? old : nullptr);
}

void GpuField::drop_atlas() {
    for (rhi::TextureHandle* t : {&distances_, &materials_}) {
        if (!*t) continue;
        runner_->forget(*t);
        device_->destroy(*t);
        *t = {};
    }
    if (tables_) {
        runner_->forget(tables_);
        device_->destroy(tables_);
        tables_ = {};
    }
}

Result<void> GpuField::make_atlas(uint32_t slots, rhi::Format format, Baker baker) {
    drop_atlas();
    const uint32_t side = std::min(device_->limits().max_texture_3d, rhi::kMaxTexture3d) / field::kBrickTexels;
    bricks_x_ = 32;  // a multiple of the bricks of a copy group, so that most copies are whole groups
    uint32_t y_most = 32;
    while (uint64_t{bricks_x_} * y_most * side < slots && y_most < side) y_most *= 2;
    bricks_y_ = std::clamp(ceil_div(slots, bricks_x_), 1u, y_most);
    bricks_z_ = std::max(ceil_div(slots, bricks_x_ * bricks_y_), 1u);
    const uint64_t texels = uint64_t{bricks_x_} * bricks_y_ * bricks_z_ * field::kBrickTexelCount;
    const uint64_t bytes = texels * (rhi::bytes_per_texel(format) + 2);
    if (bricks_z_ > side || bytes > kMaxAtlasBytes) {
        return Error{
            formatted(
                "the atlas of {} bricks needs {} bytes, at most {} are given to it; a larger voxel size would fit",
                slots, bytes, kMaxAtlasBytes),
            ErrorKind::OutOfMemory};
    }
    using rhi::TextureUsage;
    const rhi::Extent size{bricks_x_ * 8, bricks_y_ * 8, bricks_z_ * 8};
    auto distances = device_->create_texture(
        {.dimension = rhi::Dimension::D3,
         .format = format,
         .size = size,
         .usage = TextureUsage::Sampled | TextureUsage::CopySrc |
                  (baker == Baker::Storage ? TextureUsage::Storage | TextureUsage::CopyDst : TextureUsage::CopyDst),
         .label = "atlas distances"});
    if (!distances) return distances.error();
    distances_ = *distances;
    auto materials = device_->create_texture(
        {.dimension = rhi::Dimension::D3,
         .format = rhi::Format::R32Uint,
         .size = {size.width / 2, size.height, size.depth},
         .usage = TextureUsage::Sampled | TextureUsage::CopySrc |
                  (baker == Baker::Host ? TextureUsage::CopyDst : TextureUsage::Storage | TextureUsage::CopyDst),
         .label = "atlas materials"});
    if (!materials) return materials.error();
    materials_ = *materials;
    auto tables = device_->create_buffer(
        {.size = uint64_t{bricks_x_} * bricks_y_ * bricks_z_ * field::kBrickTableWords * 4, .label = "brick tables"});
    if (!tables) return tables.error();
    tables_ = *tables;
    ++atlas_number_;
    format_ = format;
    baker_ = baker;
    return {};
}

// The unbounded edits, as one program; nothing when none of them adds. (An intersect takes away what is far from it: unbounded.)
std::vector<sdf::Instruction> GpuField::outside_code() {
    const sdf::Program& program = this->program();
    std::vector<sdf::Instruction> out{sdf::Instruction::make(sdf::Opcode::Empty, 0, 0, 0, 0, 0)};
    bool adds = false;
    bool concave = true;
    Box3 solids;
    float blends = 0;  // metres: a union bulges by less than its blend radius
    planes_.clear();
    std::vector<uint32_t> rows;
    program.index.everywhere(rows);
    std::sort(rows.begin(), rows.end(),
              [&](uint32_t a, uint32_t b) { return program.edits[a].order < program.edits[b].order; });
    for (const uint32_t row : rows) {
        const sdf::EditSpan& edit = program.edits[row];
        if (edit.op == Op::Union) {
            adds = true;
            solids = box_union(solids, edit.bounds);
            blends += edit.blend;
        }
        const auto code = program.code.subspan(edit.first, edit.count);
        for (sdf::Instruction in : code) {
            // What the GPU cannot run stands as solid: its box is cut by the instruction that follows. Where such a shape intersects, the
            // rays of the grid's outside see the box.
            if (any_cpu_only(code)) {
                if (in.opcode() == sdf::Opcode::Arithmetic) continue;
                if (in.opcode() == sdf::Opcode::Result || in.opcode() == sdf::Opcode::Custom)
                    in = sdf::Instruction::make(sdf::Opcode::Constant, 0, in.dst(), 0, 0, in.param);
            }
            out.push_back(in);
        }
        planes_.push_back(plane_of(code, program.params).value_or(HorizonPlane{}));
        if (edit.op == Op::Paint) continue;         // changes no distance
        concave = concave && edit.op == Op::Union;  // the smooth minimum of concave functions is concave
        for (const sdf::Instruction in : code) {
            if (in.opcode() == sdf::Opcode::Shape) concave = concave && in.aux() == uint32_t(ShapeKind::Plane);
            const bool keeps_straight = in.opcode() <= sdf::Opcode::PointAffineOn ||
                                        in.opcode() == sdf::Opcode::Shape || in.opcode() == sdf::Opcode::Combine;
            concave = concave && keeps_straight;
        }
    }
    if (!adds) out.clear();
    outside_is_concave_ = adds && concave;
    const float far = std::numeric_limits<float>::infinity();
    outside_box_ =
        concave ? Box3{{-far, -far, -far}, {far, far, far}} : solids.inflated(blends);  // half-spaces are solved
    const auto not_plain = [](const HorizonPlane& plane) { return plane.scale == 0; };
    if (!outside_is_concave_ || planes_.size() > size_t(kMostPlanes) || std::ranges::any_of(planes_, not_plain))
        planes_.clear();
    return out;
}

Result<void> GpuField::update(std::shared_ptr<const field::Field> next, Baker baker) {
    KILN_ASSERT(next != nullptr);
    bricks_baked_ = 0;
    bake_ms_ = 0;
    const rhi::Format format =
        next->options().format == field::DistanceFormat::Half ? rhi::Format::R16Float : rhi::Format::R8Snorm;
    if (baker == Baker::Auto) baker = device_->info().kind == rhi::DeviceKind::Cpu ? Baker::Host : Baker::Storage;
    if (baker == Baker::Storage && !device_->caps().storage_r16f) baker = Baker::Copy;
    const bool same_atlas =
        distances_ && format == format_ && baker == baker_ && uint64_t{next->slot_count()} + reserved_ <= atlas_slots();
    const bool here = field_ && same_atlas && next->revision() == field_->revision();
    if (here) return {};
    const bool grown_from_here = field_ && same_atlas && next->parent_revision() == field_->revision();

    const std::shared_ptr<const field::Field> old = std::move(field_);
    field_ = next;
    levels_.reset();
    auto fail = [this](Error error) -> Result<void> {
        field_.reset();  // what the buffers hold is not known any more
        return error;
    };
    if (auto r = store_pages(cells_, "cells", next->cells().words(), old ? &old->cells().words() : nullptr); !r)
        return fail(r.error());
    if (auto r = store_pages(records_, "records", next->records(), old ? &old->records() : nullptr); !r)
        return fail(r.error());
    if (auto r = store_grown(code_, "code", next->code(), old ? &old->code() : nullptr); !r) return fail(r.error());
    if (auto r = store_programs(old ? &old->program().samples : nullptr, old ? &old->program().params : nullptr); !r)
        return fail(r.error());
    if (!same_atlas) {
        if (auto r = fit_atlas(next->slot_count(), format, baker); !r) return fail(r.error());
    }

    std::vector<uint32_t> slots;
    if (grown_from_here) {
        slots.assign(next->jobs().begin(), next->jobs().end());
    } else {
        slots = next->slots();
    }
    std::sort(slots.begin(), slots.end());
    bricks_on_host_ = 0;
    if (!same_atlas && slots.empty()) {
        if (auto r = clear_atlas(); !r) return fail(r.error());
    }
    if (baker == Baker::Host) {
        if (auto r = bake_on_host(slots); !r) return fail(r.error());
        return {};
    }
    // Bricks whose code the GPU cannot run are the CPU's.
    const auto gpu_can = [&](uint32_t slot) { return !any_cpu_only(next->code_of(slot)); };
    const auto host = std::stable_partition(slots.begin(), slots.end(), gpu_can);
    const std::span<const uint32_t> for_gpu(slots.begin(), host), for_host(host, slots.end());
    if (auto r = bake(for_gpu); !r) return fail(r.error());
    if (!for_host.empty()) {
        const double gpu_ms = bake_ms_;
        if (auto r = bake_on_host(for_host); !r) return fail(r.error());
        bake_ms_ += gpu_ms;
        log::info(
            "{} of {} bricks were baked on the CPU: shapes of the program's own, or formulas with more values than the "
            "GPU has registers",
            for_host.size(), slots.size());
    }
    bricks_baked_ = uint32_t(slots.size());
    bricks_on_host_ = uint32_t(for_host.size());
    return {};
}

// The whole program, what leaves the grid, and the numbers of both.
Result<void> GpuField::store_programs(const AppendArray<float>* old_samples, const AppendArray<float>* old_params) {
    const std::span<const sdf::Instruction> tape = program().tape();
    std::vector<sdf::Instruction> programs(tape.begin(), tape.end());
    program_count_ = uint32_t(programs.size());
    const std::vector<sdf::Instruction> outside = outside_code();
    const bool software = device_->info().kind == rhi::DeviceKind::Cpu;
    const TapeUse inside = tape_use(programs), leaves = tape_use(outside), none{0, 0, 0, 1};
    use_ = both(software ? inside : any_kind(inside), use_known_ ? use_ : none);
    // Half-spaces are few kinds whatever the world: a kernel of its own on every device.
    outside_use_ = both(software || outside_is_concave_ ? leaves : any_kind(leaves), use_known_ ? outside_use_ : none);
    outside_use_.planes = uint32_t(planes_.size());
    use_known_ = true;
    outside_count_ = uint32_t(outside.size());
    programs.insert(programs.end(), outside.begin(), outside.end());
    if (auto r = store(program_, "program", bytes_of(programs), bytes_of(program_code_)); !r) return r;
    program_code_ = std::move(programs);
    const AppendArray<float>& new_samples = program().samples;
    const AppendArray<float>& new_params = program().params;
    bool kept = false;
    if (auto r = reserve(numbers_, "numbers", (new_samples.size() + new_params.size()) * sizeof(float), kept); !r)
        return r;
    kept = kept && old_samples != nullptr && old_samples->size() == new_samples.size();
    const uint64_t params_at = new_samples.size() * sizeof(float);
    if (auto r = write_grown(numbers_, 0, new_samples, kept ? old_samples : nullptr); !r) return r;
    if (auto r = write_grown(numbers_, params_at, new_params, kept ? old_params : nullptr); !r) return r;
    if (!dropped_) {
        auto buffer = device_->create_buffer({.size = 16, .label = "dropped materials"});
        if (!buffer) return buffer.error();
        dropped_ = *buffer;
        const std::array<uint32_t, 4> zeros{};
        if (auto r = device_->write_buffer(dropped_, 0, bytes_of(zeros)); !r) return r;
    }
    return {};
}

// A new atlas. A growing world gets half as much again, where that fits.
Result<void> GpuField::fit_atlas(uint32_t slots, rhi::Format format, Baker baker) {
    const uint32_t roomy = distances_ ? slots + slots / 2 : slots;
    auto made = make_atlas(std::max(roomy + reserved_, 1u), format, baker);
    if (!made && roomy != slots) made = make_atlas(std::max(slots + reserved_, 1u), format, baker);
    if (!made) drop_atlas();
    return made;
}

// Of a world without bricks: kernels name the atlas, and what nothing has written cannot be named.
Result<void> GpuField::clear_atlas() {
    Graph graph(*runner_);
    FieldHandles f = import(graph);
    graph.clear(f.distances);
    graph.clear(f.materials);
    graph.output(f.distances, rhi::Access::SampledReadCompute);
    graph.output(f.materials, rhi::Access::SampledReadCompute);
    if (auto submit = runner_->execute(graph); !submit) return submit.error();
    return {};
}

Result<void> GpuField::update(const field::Clipmap& next) {
    bricks_baked_ = bricks_on_host_ = 0;
    bake_ms_ = 0;
    const auto start = std::chrono::steady_clock::now();
    const rhi::Format format =
        next.options().format == field::DistanceFormat::Half ? rhi::Format::R16Float : rhi::Format::R8Snorm;
    std::optional<field::Clipmap> before = std::move(levels_);
    field_.reset();
    levels_ = next;
    const auto fail = [this](Error error) -> Result<void> {
        levels_.reset();
        return error;
    };
    const bool same_atlas = distances_ && format == format_ && baker_ == Baker::Host &&
                            uint64_t{next.slot_count()} + reserved_ <= atlas_slots();
    const field::Clipmap* const old = before && same_atlas && before->level_count() == next.level_count() &&
                                              before->options().cells == next.options().cells &&
                                              before->options().format == next.options().format
                                          ? &*before
                                          : nullptr;

    const uint64_t level_bytes = next.cells(0).words().size() * sizeof(uint32_t);
    bool kept = false;
    if (auto r = reserve(cells_, "cells", level_bytes * uint64_t(next.shown_levels()), kept); !r)
        return fail(r.error());
    for (int level = 0; level < next.shown_levels(); ++level) {
        if (auto r = write_pages(
                cells_, level_bytes * uint64_t(level), next.cells(level).words(),
                kept && old != nullptr && level < old->shown_levels() ? &old->cells(level).words() : nullptr);
            !r)
            return fail(r.error());
    }
    if (auto r = store_pages(records_, "records", next.records(), old != nullptr ? &old->records() : nullptr); !r)
        return fail(r.error());
    if (auto r = store_grown(code_, "code", next.code(), old != nullptr ? &old->code() : nullptr); !r)
        return fail(r.error());
    if (old == nullptr || old->program() != next.program()) {
        const sdf::Program* const was = old != nullptr ? old->program().get() : nullptr;
        if (auto r = store_programs(was != nullptr ? &was->samples : nullptr, was != nullptr ? &was->params : nullptr);
            !r)
            return fail(r.error());
    }
    if (!same_atlas) {
        if (auto r = fit_atlas(next.slot_count(), format, Baker::Host); !r) return fail(r.error());
    }
    std::vector<uint32_t> slots;
    for (uint32_t slot = 0; slot < next.slot_count(); ++slot) {
        const field::BrickContent& brick = next.content(slot);
        if (!brick) continue;
        if (old != nullptr && slot < old->slot_count()) {
            const field::BrickContent& was = old->content(slot);
            if (brick.half == was.half && brick.bytes == was.bytes && brick.materials == was.materials &&
                brick.material == was.material)
                continue;
        }
        slots.push_back(slot);
    }
    if (!same_atlas && slots.empty()) {
        if (auto r = clear_atlas(); !r) return fail(r.error());
    }
    if (slots.empty()) return {};
    if (auto r = store_texels(slots, next.options().workers, [&](uint32_t slot) { return next.content(slot); }); !r)
        return fail(r.error());
    bricks_baked_ = bricks_on_host_ = uint32_t(slots.size());
    bake_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return {};
}

field::LevelsBlock GpuField::levels() const {
    field::LevelsBlock out{};
    out.params = levels_->params();
    out.params.atlas_bricks_x_y = bricks_x_ | bricks_y_ << 16;
    for (int level = 0; level < levels_->shown_levels(); ++level) {
        const field::ivec3 first = levels_->first_cell(level);
        out.places[level] = {first.x, first.y, first.z, 0};
    }
    return out;
}

BrickCode GpuField::code_of_bricks() const {
    if (levels_) return {levels_->program().get(), &levels_->records(), levels_->code(), levels_->options().workers};
    return {&field_->program(), &field_->records(), field_->code(), field_->options().workers};
}

Result<void> GpuField::bake(std::span<const uint32_t> slots) {
    const bool by_copy = baker_ == Baker::Copy;
    bricks_baked_ = uint32_t(slots.size());
    if (slots.empty()) return {};
    const Kernel* const kernels[] = {&bake_kernel(format_, by_copy, use_)};
    if (auto warm = runner_->pipelines().warm_up(kernels); !warm) return warm;
    for (size_t at = 0; at < slots.size(); at += kJobsPerSlice) {
        const auto slice = slots.subspan(at, std::min<size_t>(kJobsPerSlice, slots.size() - at));
        Graph graph(*runner_);
        FieldHandles f = import(graph);
        BakePush push{};
        push.voxel_size = field_->grid().voxel_size;
        push.voxels_per_metre = 1.0f / push.voxel_size;
        push.params_first = params_first();
        push.atlas_bricks_x_y = bricks_x_ | bricks_y_ << 16;
        bake_bricks(graph, f, slice, push, format_, by_copy, use_);
        graph.output(f.distances, rhi::Access::SampledReadCompute);
        graph.output(f.materials, rhi::Access::SampledReadCompute);
        graph.output(f.tables, rhi::Access::StorageReadCompute);
        graph.output(f.dropped);
        auto submit = runner_->execute(graph);
        if (!submit) return submit.error();
        if (device_->caps().timestamp) {
            auto times = runner_->times(*submit);
            if (!times) return times.error();
            bake_ms_ += times->total_ms;
        }
    }
    return {};
}

Result<void> GpuField::bake_on_host(std::span<const uint32_t> slots) {
    bricks_baked_ = uint32_t(slots.size());
    const auto start = std::chrono::steady_clock::now();
    auto stored = store_texels(slots, field_->options().workers, [&](uint32_t slot) {
        const field::BrickRecord& record = field_->records()[slot];
        field::BrickEvaluator evaluator(field_->program(), field_->options().voxel_size);
        evaluator.evaluate(field_->code_of(slot), {record.texel_x, record.texel_y, record.texel_z});
        return evaluator.content(field_->options().format);
    });
    bake_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return stored;
}

// content(slot), from any thread, into the atlas.
template <typename Content>
Result<void> GpuField::store_texels(std::span<const uint32_t> slots, int workers, Content&& content) {
    const size_t code_bytes = rhi::bytes_per_texel(format_);
    for (size_t at = 0; at < slots.size(); at += kJobsPerSlice) {
        const auto slice = slots.subspan(at, std::min<size_t>(kJobsPerSlice, slots.size() - at));
        std::vector<std::byte> codes(packed_bytes(slice.size(), 8 * code_bytes));
        std::vector<std::byte> words(packed_bytes(slice.size(), 16));
        std::vector<uint32_t> tables(slice.size() * field::kBrickTableWords);
        parallel_for(int(slice.size()), workers, [&](int i) {
            const size_t job = size_t(i);
            const field::BrickContent brick = content(slice[job]);
            const std::byte* const from = brick.codes();
            for (size_t row = 0; row < 64; ++row) {
                std::memcpy(codes.data() + packed_at(job, row, 8 * code_bytes), from + row * 8 * code_bytes,
                            8 * code_bytes);
                if (brick.materials)
                    std::memcpy(words.data() + packed_at(job, row, 16), brick.materials->words.data() + row * 8, 16);
            }
            uint32_t* const table = tables.data() + job * field::kBrickTableWords;
            for (size_t entry = 0; entry < field::kPaletteSize; ++entry) table[entry] = brick.palette(entry);
            std::memcpy(table + field::kPaletteSize, brick.solid().data(), field::kSolidMaskWords * 4);
        });
        // Tables of slots that follow each other in one write.
        for (size_t i = 0; i < slice.size();) {
            size_t n = 1;
            while (i + n < slice.size() && slice[i + n] == slice[i] + n) ++n;
            const auto run = std::span(tables).subspan(i * field::kBrickTableWords, n * field::kBrickTableWords);
            if (auto r =
                    device_->write_buffer(tables_, uint64_t{slice[i]} * field::kBrickTableWords * 4, bytes_of(run));
                !r)
                return r;
            i += n;
        }
        Graph graph(*runner_);
        FieldHandles f = import(graph);
        store_bricks(graph, f, slice, codes, words, bricks_x_ | bricks_y_ << 16, format_);
        graph.output(f.distances, rhi::Access::SampledReadCompute);
        graph.output(f.materials, rhi::Access::SampledReadCompute);
        if (auto submit = runner_->execute(graph); !submit) return submit.error();
    }
    return {};
}

Result<void> GpuField::store_reserved(const field::HostBricks& bricks, uint32_t first) {
    std::vector<uint32_t> slots = bricks.field().slots();
    for (uint32_t& slot : slots) slot += first;
    return store_texels(slots, bricks.field().options().workers,
                        [&](uint32_t slot) { return bricks.content(slot - first); });
}

FieldHandles GpuField::import(Graph& graph) const {
    FieldHandles f;
    f.cells = graph.import("cells", cells_.handle);
    f.records = graph.import("records", records_.handle);
    f.code = graph.import("code", code_.handle);
    f.program = graph.import("program", program_.handle);
    f.numbers = graph.import("numbers", numbers_.handle);
    f.tables = graph.import("brick tables", tables_);
    f.dropped = graph.import("dropped materials", dropped_);
    f.distances = graph.import("atlas distances", distances_);
    f.materials = graph.import("atlas materials", materials_);
    return f;
}

field::GridParams GpuField::grid() const {
    field::GridParams g;
    if (levels_) {
        // A finest cell less than the last level's box, so that what leaves it is looked at before levels end.
        const field::LevelsParams p = levels_->params();
        const int reach = int(field::level_reach(p.cells)) << (p.drawn - 1);
        const auto first = [&](int focus) { return field::cell_of_texel(focus - reach) + 2; };
        const int size = 2 * reach / field::kBrickVoxels - 3;
        g = {first(p.focus_x), first(p.focus_y), first(p.focus_z), p.voxel_size, size, size, size, 0};
    } else {
        g = field_->grid();
    }
    g.atlas_bricks_x_y = bricks_x_ | bricks_y_ << 16;
    return g;
}

float GpuField::distance_scale() const { return format_ == rhi::Format::R8Snorm ? field::kBandVoxels : 1.0f; }

uint32_t GpuField::params_first() const { return uint32_t(program().samples.size()); }

uint32_t GpuField::outside_first() const { return program_count_; }

uint64_t GpuField::atlas_bytes() const {
    return uint64_t{bricks_x_} * bricks_y_ * bricks_z_ * field::kBrickTexelCount * (rhi::bytes_per_texel(format_) + 2);
}

Result<uint32_t> GpuField::dropped_materials() {
    Graph graph(*runner_);
    const Readback back = graph.readback(import(graph).dropped);
    if (auto submit = runner_->execute(graph); !submit) return submit.error();
    auto words = back.get_as<uint32_t>();
    if (!words) return words.error();
    return words->front();
}

Result<std::vector<GpuField::BrickTexels>> GpuField::read_back(std::span<const uint32_t> slots) {
    Graph graph(*runner_);
    FieldHandles f = import(graph);
    const Readback distances = graph.readback(f.distances);
    const Readback materials = graph.readback(f.materials);
    const Readback tables = graph.readback(f.tables);
    if (auto submit = runner_->execute(graph); !submit) return submit.error();
    auto codes = distances.get();
    if (!codes) return codes.error();
    auto words = materials.get_as<uint32_t>();
    if (!words) return words.error();
    auto words_of_tables = tables.get_as<uint32_t>();
    if (!words_of_tables) return words_of_tables.error();
    const uint32_t code_bytes = rhi::bytes_per_texel(format_);
    const size_t row = size_t{bricks_x_} * 8;
    const size_t plane = row * bricks_y_ * 8;
    std::vector<BrickTexels> out;
    for (const uint32_t slot : slots) {
        BrickTexels brick;
        const size_t bx = slot % bricks_x_;
        const size_t by = slot / bricks_x_ % bricks_y_;
        const size_t bz = slot / (bricks_x_ * bricks_y_);
        for (size_t z = 0; z < 8; ++z) {
            for (size_t y = 0; y < 8; ++y) {
                for (size_t x = 0; x < 8; ++x) {
                    const size_t at = (bz * 8 + z) * plane + (by * 8 + y) * row + bx * 8 + x;
                    uint32_t code = 0;
                    std::memcpy(&code, codes->data() + at * code_bytes, code_bytes);
                    brick.distance_codes.push_back(code);
                    const uint32_t two = (*words)[at / 2];
                    brick.material_words.push_back(at % 2 == 0 ? two & 0xffffu : two >> 16);
                }
            }
        }
        const auto first = words_of_tables->begin() + ptrdiff_t(slot) * field::kBrickTableWords;
        brick.palette.assign(first, first + field::kPaletteSize);
        brick.solid_mask.assign(first + field::kPaletteSize, first + field::kPaletteSize + field::kSolidMaskWords);
        out.push_back(std::move(brick));
    }
    return out;
}

}  // namespace kiln::render
