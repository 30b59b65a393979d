// SPDX-License-Identifier: MIT
// Shaders that change while the program runs. A thread of its own looks at the sources, and at what they include, five times a second; what has
// other contents than when it was last looked at is compiled by glslc; between two frames the pipelines are made anew. A shader that does
// not compile, or no longer fits its pass, keeps the pipeline that it had and is one error in the log.
//
//   KILN_LIVE_SHADERS=src:build/release/generated kiln render …    folders that #include looks in, the sources in the first
#pragma once

#include "base/hash.h"
#include "render/graph_kernel.h"

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

namespace kiln::render {

// A shader of this program: its file in the first folder, and the words that were made from it.
struct ShaderSource {
    std::string_view file;
    std::span<const uint32_t> words;
};
// All of the renderer's.
std::span<const ShaderSource> shader_sources();

class LiveShaders {
public:
    // Null where the variable is not set. An error where it names no sources, or no glslc is there.
    static Result<std::unique_ptr<LiveShaders>> from_environment();
    static Result<std::unique_ptr<LiveShaders>> watch(std::vector<std::string> folders,
                                                      std::span<const ShaderSource> sources = shader_sources());
    ~LiveShaders();
    LiveShaders(const LiveShaders&) = delete;
    LiveShaders& operator=(const LiveShaders&) = delete;

    // Waits for a look that begins after this call.
    void finish();
    // Hands over what has been compiled since the last call. The errors, each a sentence, which are also logged.
    std::vector<std::string> apply(PipelineLibrary& pipelines);
    uint64_t swapped() const { return swapped_; }  // shaders, by apply()

private:
    struct Compiled {
        const ShaderSource* source = nullptr;
        std::vector<uint32_t> words;  // none: see fault
        std::string fault;
    };
    using Files = std::map<std::string, std::string, std::less<>>;  // contents by path
    LiveShaders(std::vector<std::string> folders, std::span<const ShaderSource> sources);
    void run();
    std::vector<Compiled> look();
    Hash128 contents_of(const std::string& file, Files& files) const;
    std::string find(std::string_view name) const;
    Compiled compile(const ShaderSource& source) const;

    std::vector<std::string> folders_;
    std::span<const ShaderSource> sources_;
    std::vector<Hash128> seen_;  // by source; the looking thread's, once it runs
    uint64_t swapped_ = 0;

    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<Compiled> ready_;
    uint64_t asked_ = 0, looked_ = 0;  // looks
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace kiln::render
