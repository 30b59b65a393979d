// SPDX-License-Identifier: MIT
// Mesh: an indexed triangle mesh, and the bricks that meshers read. Positions are world metres; triangles are anticlockwise as seen
// from the empty side.
#pragma once

#include "field/host_bricks.h"

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

namespace kiln::field {

/// Numbers that are written once: keeps its memory between uses and does not clear it first.
template <typename T>
requires std::is_trivially_copyable_v<T>
class Buffer {
public:
    /// Contents are undefined afterwards.
    void resize(size_t count) {
        if (count > capacity_) {
            data_.reset();
            data_.reset(static_cast<T*>(::operator new(count * sizeof(T))));
            capacity_ = count;
        }
        size_ = count;
    }
    /// Keeps the contents so far.
    void grow(size_t count) {
        if (count > capacity_) {
            std::unique_ptr<T, Free> kept = std::move(data_);
            const size_t size = size_;
            capacity_ = 0;
            resize(count + count / 16);
            if (size != 0) std::memcpy(data_.get(), kept.get(), size * sizeof(T));
        }
        size_ = count;
    }
    size_t size() const { return size_; }
    T* data() { return data_.get(); }
    const T* data() const { return data_.get(); }
    T& operator[](size_t i) { return data_.get()[i]; }
    const T& operator[](size_t i) const { return data_.get()[i]; }
    std::span<const T> span() const { return {data_.get(), size_}; }

private:
    struct Free {
        void operator()(T* p) const { ::operator delete(p); }
    };
    std::unique_ptr<T, Free> data_;
    size_t size_ = 0, capacity_ = 0;
};

struct Mesh {
    Buffer<vec3> positions;
    Buffer<uint32_t> triangles;       ///< three vertices each
    Buffer<uint32_t> brick_vertices;  ///< brick i of the MeshBricks made vertices [i] … [i + 1] - 1, which lie in it
    Buffer<uint32_t>
        late_bricks;  ///< of those after [bricks]: a brick that each lies in; one brick's are never far apart

    size_t vertex_count() const { return positions.size(); }
    size_t triangle_count() const { return triangles.size() / 3; }
};

/// World cells min … max - 1.
struct MeshRegion {
    ivec3 min, max;
};

/// A brick as meshers see it.
struct MeshBrick {
    ivec3 cell;
    uint32_t slot = 0;
    const std::byte* codes = nullptr;  ///< 512 distance codes, x fastest
};

/// Bricks in ascending order of z, y, x of their cells, with an index of rows. Valid while the host bricks are.
class MeshBricks {
public:
    explicit MeshBricks(const HostBricks& bricks);
    /// Only the bricks of the region's cells.
    MeshBricks(const HostBricks& bricks, const MeshRegion& region);
    /// Any codes; cells must differ.
    MeshBricks(std::vector<MeshBrick> bricks, DistanceFormat format, float voxel_size);

    struct Row {
        int y = 0, z = 0;
        uint32_t first = 0, end = 0;
    };
    std::span<const MeshBrick> bricks() const { return bricks_; }
    std::span<const Row> rows() const { return rows_; }
    /// null when there is none.
    const Row* row(int y, int z) const;
    DistanceFormat format() const { return format_; }
    float voxel_size() const { return voxel_size_; }

private:
    void index();
    std::vector<MeshBrick> bricks_;
    std::vector<Row> rows_;
    std::vector<int32_t> row_at_;  // by (z, y) in the bricks' bounds; -1: none
    ivec3 low_, size_;
    DistanceFormat format_;
    float voxel_size_;
};

}  // namespace kiln::field
