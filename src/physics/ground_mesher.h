// SPDX-License-Identifier: MIT
// Meshes settled regions of the ground in the background: those that something moves in, where no edit was for half a second. Which step a
// mesh lands in is a matter of simulated time alone: a fixed while after the region settled, and the step waits where the work is not done
// by then (or does it itself, where nobody began). So steps do not depend on the machine, its threads or its load.
#pragma once

#include "physics/region_mesh.h"

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

namespace kiln::physics {

inline constexpr double kSettledSeconds = 0.5;  ///< without an edit
inline constexpr double kMeshingSeconds = 0.2;  ///< from then until the mesh lands
inline constexpr size_t kMostRegions = 512;     ///< what is beyond stays a field

class GroundMesher {
public:
    /// What an engine makes of a mesh, on any thread; null where it cannot use it: the region then stays a field.
    using Build = std::shared_ptr<const void> (*)(const RegionMesh& mesh);
    GroundMesher(float voxel_size, Build build);
    ~GroundMesher();

    const std::shared_ptr<const Regions>& regions() const { return regions_; }
    /// Something that moves is there.
    void visit(const Box3& box);
    /// The field is another one in the box: what was meshed there is no more, at once.
    void changed(const Box3& box);
    /// What is of no more use, so that the thread that frees its memory is not the one that steps.
    void let_go(std::shared_ptr<const void> what);
    /// After `seconds` more: starts on what has settled, takes in what is due; whether regions() are others now.
    bool advance(double seconds, const std::shared_ptr<const field::SdfField>& exact);

private:
    struct Job {
        std::shared_ptr<const field::SdfField> exact;
        ivec3 region;
        bool taken = false, done = false;  // under the mesher's mutex
        std::shared_ptr<const RegionMesh> mesh;
    };
    struct Region {
        ivec3 at;
        double settles = 0, lands = 0;
        std::shared_ptr<Job> job;
        bool meshed = false;
    };
    void work(Job& job) const;
    void run();
    const RegionMesh* finish(Job& job);

    float voxel_size_;
    Build build_;
    double now_ = 0;
    std::shared_ptr<const Regions> regions_;
    std::map<uint64_t, Region> visited_;
    std::vector<uint64_t> open_;  // of visited_: not meshed yet, or not to be
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::shared_ptr<Job>> queue_;
    std::vector<std::shared_ptr<const void>> of_no_use_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace kiln::physics
