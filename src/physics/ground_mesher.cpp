// SPDX-License-Identifier: MIT

#include "physics/ground_mesher.h"

#include <algorithm>

namespace kiln::physics {

namespace {
constexpr double kSoon = 1e-9;  // seconds: sums of steps are not exact
}

GroundMesher::GroundMesher(float voxel_size, Build build)
    : voxel_size_(voxel_size),
      build_(build),
      regions_(std::make_shared<Regions>(float(kRegionCells * field::kBrickVoxels) * voxel_size)),
      thread_([this] { run(); }) {}

GroundMesher::~GroundMesher() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void GroundMesher::work(Job& job) const {
    auto mesh = mesh_region(*job.exact, voxel_size_, job.region);
    mesh->made = build_(*mesh);
    if (mesh->made != nullptr || mesh->own() == 0) job.mesh = std::move(mesh);
}

void GroundMesher::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stop_ || !queue_.empty() || !of_no_use_.empty(); });
        if (stop_) return;
        if (!of_no_use_.empty()) {
            std::vector<std::shared_ptr<const void>> gone;
            gone.swap(of_no_use_);
            lock.unlock();
            gone.clear();
            lock.lock();
            continue;
        }
        const std::shared_ptr<Job> job = queue_.front();
        queue_.pop_front();
        if (job->taken) continue;
        job->taken = true;
        lock.unlock();
        work(*job);
        lock.lock();
        job->done = true;
        changed_.notify_all();
    }
}

const RegionMesh* GroundMesher::finish(Job& job) {
    std::unique_lock lock(mutex_);
    if (!job.taken) {
        job.taken = true;
        lock.unlock();
        work(job);
        return job.mesh.get();
    }
    changed_.wait(lock, [&] { return job.done; });
    return job.mesh.get();
}

void GroundMesher::let_go(std::shared_ptr<const void> what) {
    {
        const std::lock_guard lock(mutex_);
        of_no_use_.push_back(std::move(what));
    }
    changed_.notify_all();
}

void GroundMesher::visit(const Box3& box) {
    const vec3 size = box.max - box.min;
    if (!box.finite() || std::max({size.x, size.y, size.z}) > 4 * regions_->side()) return;
    const ivec3 low = regions_->region_of(box.min), high = regions_->region_of(box.max);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                if (visited_.size() >= kMostRegions) return;
                const uint64_t key = region_key({x, y, z});
                const auto [at, fresh] = visited_.try_emplace(key);
                if (!fresh) continue;
                at->second.at = {x, y, z};
                at->second.settles = now_ + kSettledSeconds;
                open_.push_back(key);
            }
}

void GroundMesher::changed(const Box3& box) {
    // As far as an apron reaches.
    const Box3 reach = box.inflated(float(2 * field::kBrickVoxels) * voxel_size_);
    std::vector<ivec3> gone;
    for (auto& [key, region] : visited_) {
        const float side = regions_->side();
        const vec3 low{float(region.at.x) * side, float(region.at.y) * side, float(region.at.z) * side};
        if (!reach.overlaps({low, low + vec3{side, side, side}})) continue;
        if (region.meshed) gone.push_back(region.at);
        if (std::find(open_.begin(), open_.end(), key) == open_.end()) open_.push_back(key);
        region.meshed = false;
        region.job = nullptr;
        region.settles = now_ + kSettledSeconds;
    }
    if (!gone.empty()) regions_ = regions_->without(gone);
}

bool GroundMesher::advance(double seconds, const std::shared_ptr<const field::SdfField>& exact) {
    now_ += seconds;
    bool other = false;
    std::erase_if(open_, [&](uint64_t key) {
        Region& r = visited_.at(key);
        if (r.job == nullptr) {
            if (now_ < r.settles - kSoon) return false;
            r.job = std::make_shared<Job>();
            r.job->exact = exact;
            r.job->region = r.at;
            r.lands = now_ + kMeshingSeconds;
            {
                const std::lock_guard lock(mutex_);
                queue_.push_back(r.job);
            }
            changed_.notify_all();
        }
        if (now_ < r.lands - kSoon) return false;
        if (finish(*r.job) != nullptr) {
            regions_ = regions_->with(r.job->mesh);
            r.meshed = true;
            other = true;
        }
        r.job = nullptr;
        return true;
    });
    return other;
}

}  // namespace kiln::physics
