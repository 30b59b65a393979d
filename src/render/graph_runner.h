// SPDX-License-Identifier: MIT
// Executes graphs on a device, frame after frame. Owns what outlives a frame: memory and objects of transients, histories,
// bind groups, samplers, uniform memory, pipelines, timestamps, and what access every imported resource is in.
// A frame like the one before makes no object. Owner's thread.
#pragma once

#include "render/graph_plan.h"

namespace kiln::render {

struct RunnerOptions {
    bool aliasing = true;
    bool poison = false;
    uint32_t frames_in_flight = 2;  // execute() waits for the frame this many before
};

struct PassTime {
    std::string name;
    double ms = 0;       // passes of one level overlap: their sum may exceed the frame
    uint64_t bytes = 0;  // Plan::frame_bytes()
};

struct FrameTimes {
    rhi::SubmitId submit = 0;
    std::vector<PassTime> passes = {};  // in order of execution
    double total_ms = 0;                // first start to last end
    double side_by_side_ms = 0;         // critical_path()
};

struct RunnerStats {
    uint64_t frames = 0;
    uint64_t objects_made =
        0;  // textures, buffers, heaps, views, samplers, bind groups, query sets; constant when steady
    uint64_t transient_bytes = 0;                               // shared memory now
    uint64_t peak_bytes = 0, unaliased_bytes = 0;               // of the last frame
    uint32_t passes = 0, culled = 0, barriers = 0, levels = 0;  // of the last frame
};

class Runner {
public:
    explicit Runner(rhi::Device& device, const RunnerOptions& options = {});
    ~Runner();
    Runner(const Runner&) = delete;
    Runner& operator=(const Runner&) = delete;

    PipelineLibrary& pipelines();
    rhi::Device& device();
    RunnerOptions& options();

    // Compiles, records and submits. The graph is used up. One graph at a time: it must have been begun after the last
    // execute(), because it took over the state that one left.
    Result<rhi::SubmitId> execute(Graph& graph);

    // After execute(): an output of that graph, until the next execute().
    rhi::TextureHandle texture(const Image& image) const;
    rhi::BufferHandle buffer(const Buffer& buffer) const;
    const Plan& plan() const;  // of the last execute()

    // GPU time of every pass. times(submit) waits for that frame (one of the last frames_in_flight); last_times() is the
    // newest finished frame.
    Result<FrameTimes> times(rhi::SubmitId submit);
    const FrameTimes& last_times();
    const RunnerStats& stats() const;

    // The access an imported texture is in, e.g. for TextureWrite::before; and telling the runner about the `after` of one.
    rhi::Access access(rhi::TextureHandle texture) const;
    void set_access(rhi::TextureHandle texture, rhi::Access access);
    // Drops what is kept about an imported resource. Call before destroying it.
    void forget(rhi::TextureHandle texture);
    void forget(rhi::BufferHandle buffer);

private:
    friend class Graph;
    // What a graph takes over when it is recorded.
    Reflections& reflections();
    // The accesses an imported resource was left in; empty if no graph had it yet.
    std::vector<rhi::Access> left_in(rhi::TextureHandle texture) const;
    std::vector<rhi::Access> left_in(rhi::BufferHandle buffer) const;
    // Of the two images or buffers of a history, if there are such; false if the previous one holds no frame.
    bool history_left_in(const std::string& name, const GraphResource& like, std::vector<rhi::Access>& previous,
                         std::vector<rhi::Access>& current) const;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace kiln::render
