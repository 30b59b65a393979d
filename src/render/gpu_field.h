// SPDX-License-Identifier: MIT
// A field on the GPU: brick map, records, code, and the atlas of distances and materials that the bake fills.
// Kept between frames: a field whose parent is the one already here costs only what changed. Owner's thread.
#pragma once

#include "field/clipmap.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "render/graph.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/tape_use.h"
#include "rhi/device.h"

#include <memory>
#include <optional>

namespace kiln::render {

// The field's resources as one graph sees them.
struct FieldHandles {
    Buffer cells, records, code, program, tables, dropped;
    Buffer numbers;  // Program::samples, then Program::params
    Image distances, materials;
};

// Where the code of bricks is, on the host.
struct BrickCode {
    const sdf::Program* program;
    const field::Field::Records* records;
    std::span<const sdf::Instruction> code;
    int workers;
};

// Who bakes, and how the distances get into the atlas.
enum class Baker : uint8_t {
    Auto,  // Storage where the device can; Host on software devices, whose shaders run many times slower than our SIMD
    Storage,  // the GPU, to a storage texture (Copy where the device has none of the format)
    Copy,     // the GPU, to a buffer that is copied
    Host,     // the CPU; texels are copied
};

class GpuField {
public:
    explicit GpuField(Runner& runner);
    ~GpuField();
    GpuField(const GpuField&) = delete;
    GpuField& operator=(const GpuField&) = delete;

    // Makes the GPU's copy that of `field`. OutOfMemory, with the number of bytes, when the atlas does not fit.
    Result<void> update(std::shared_ptr<const field::Field> field, Baker baker = Baker::Auto);

    // Makes the GPU's copy that of `levels` as it is now, whose bricks are made already: what changed since the last call is written.
    Result<void> update(const field::Clipmap& levels);

    // Keeps the last `slots` bricks of the atlas for instances; more may make update() lay out another atlas.
    void reserve(uint32_t slots) { reserved_ = slots; }
    uint32_t atlas_slots() const { return bricks_x_ * bricks_y_ * bricks_z_; }
    // Another number: another atlas, in whose reserve nothing is.
    uint64_t atlas_number() const { return atlas_number_; }
    rhi::Format format() const { return format_; }
    // Puts bricks into the reserve, from slot `first` on.
    Result<void> store_reserved(const field::HostBricks& bricks, uint32_t first);

    FieldHandles import(Graph& graph) const;

    bool has_levels() const { return levels_.has_value(); }
    field::LevelsBlock levels() const;  // with the atlas layout filled in
    BrickCode code_of_bricks() const;
    const sdf::Program& program() const { return levels_ ? *levels_->program() : field_->program(); }
    const field::Field* field() const { return field_.get(); }
    field::GridParams grid() const;  // with the atlas layout filled in; of levels: the box they fill, in finest cells
    float distance_scale() const;    // voxels a unit of the atlas
    bool leaves_grid() const { return outside_count_ != 0; }
    // Nothing but half-spaces, in unions, leaves the grid: along any ray the field there is a concave function.
    bool outside_is_concave() const { return outside_is_concave_; }
    // They, where they are at most kMostPlanes and without blends; else none.
    std::span<const HorizonPlane> planes() const { return planes_; }
    // What kernels that run the tapes are made for. `outside`: on the tape of what leaves the grid alone.
    const TapeUse& use(bool outside) const { return outside ? outside_use_ : use_; }
    uint32_t params_first() const;   // in the numbers buffer
    uint32_t outside_first() const;  // in the program buffer
    uint32_t outside_count() const { return outside_count_; }
    // Holds all that is solid in what leaves the grid, metres.
    const Box3& outside_box() const { return outside_box_; }
    uint32_t program_count() const { return program_count_; }
    uint64_t atlas_bytes() const;
    uint32_t bricks_baked() const { return bricks_baked_; }  // by the last update()
    uint32_t bricks_on_host() const {
        return bricks_on_host_;
    }  // … of them on the CPU because their code has no twin on the GPU
    double bake_ms() const {
        return bake_ms_;
    }                                      // GPU time of the last update() (Host: wall time); 0: nothing was baked
    Result<uint32_t> dropped_materials();  // that found no place in a palette of 16, so far; waits

    // What is stored, for tests: distance codes (16 or 8 bits each) and material words of a brick, in order x, y, z.
    struct BrickTexels {
        std::vector<uint32_t> distance_codes, material_words;  // 512 each
        std::vector<uint32_t> palette;                         // 16
        std::vector<uint32_t> solid_mask;                      // kSolidMaskWords
    };
    Result<std::vector<BrickTexels>> read_back(std::span<const uint32_t> slots);

private:
    struct Storage {
        rhi::BufferHandle handle;
        uint64_t bytes = 0;
    };
    Result<void> reserve(Storage& storage, std::string_view name, uint64_t bytes, bool& kept);
    Result<void> write(const Storage& storage, uint64_t offset, std::span<const std::byte> bytes,
                       std::span<const std::byte> old);
    Result<void> store(Storage& storage, std::string_view name, std::span<const std::byte> bytes,
                       std::span<const std::byte> old);
    template <typename T, size_t kPage>
    Result<void> store_pages(Storage& storage, std::string_view name, const PagedArray<T, kPage>& pages,
                             const PagedArray<T, kPage>* old);
    template <typename T, size_t kPage>
    Result<void> write_pages(const Storage& storage, uint64_t offset, const PagedArray<T, kPage>& pages,
                             const PagedArray<T, kPage>* old);
    template <typename T>
    Result<void> write_grown(const Storage& storage, uint64_t offset, const AppendArray<T>& array,
                             const AppendArray<T>* old);
    template <typename T>
    Result<void> store_grown(Storage& storage, std::string_view name, const AppendArray<T>& array,
                             const AppendArray<T>* old);
    Result<void> make_atlas(uint32_t slots, rhi::Format format, Baker baker);
    void drop_atlas();
    Result<void> bake(std::span<const uint32_t> slots);
    Result<void> bake_on_host(std::span<const uint32_t> slots);
    template <typename Content>
    Result<void> store_texels(std::span<const uint32_t> slots, int workers, Content&& content);
    Result<void> store_programs(const AppendArray<float>* old_samples, const AppendArray<float>* old_params);
    Result<void> clear_atlas();
    Result<void> fit_atlas(uint32_t slots, rhi::Format format, Baker baker);
    std::vector<sdf::Instruction> outside_code();

    Runner* runner_;
    rhi::Device* device_;
    std::shared_ptr<const field::Field> field_;
    std::optional<field::Clipmap> levels_;  // what the buffers hold instead of a field
    Storage cells_, records_, code_, program_, numbers_;
    std::vector<sdf::Instruction> program_code_;
    rhi::BufferHandle tables_, dropped_;
    rhi::TextureHandle distances_, materials_;
    rhi::Format format_ = rhi::Format::Undefined;
    Baker baker_ = Baker::Auto;
    uint32_t bricks_x_ = 0, bricks_y_ = 0, bricks_z_ = 0;
    uint32_t reserved_ = 0;
    uint64_t atlas_number_ = 0;
    uint32_t outside_count_ = 0, program_count_ = 0;
    bool outside_is_concave_ = false;
    Box3 outside_box_;
    std::vector<HorizonPlane> planes_;
    TapeUse use_, outside_use_;
    bool use_known_ = false;  // both only ever grow from there
    uint32_t bricks_baked_ = 0, bricks_on_host_ = 0;
    double bake_ms_ = 0;
};

}  // namespace kiln::render
