// SPDX-License-Identifier: MIT
// The pipeline cache on disk: written, read again, and never trusted.
#include "rhi/vulkan/pipeline_cache.h"
#include "rhi_test.h"

#include "shaders/rhi_add.spv.h"
#include "temp_folder.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace kiln::rhi {
namespace {

namespace fs = std::filesystem;

class PipelineCacheFolder : public VulkanTest {
protected:
    void SetUp() override {
        if (const char* old = std::getenv("XDG_CACHE_HOME")) old_ = old;
        setenv("XDG_CACHE_HOME", folder_.string().c_str(), 1);
        pipeline_cache_ = true;
    }
    void TearDown() override {
        VulkanTest::TearDown();
        if (old_) {
            setenv("XDG_CACHE_HOME", old_->c_str(), 1);
        } else {
            unsetenv("XDG_CACHE_HOME");
        }
        fs::permissions(folder_.path(), fs::perms::owner_all);
    }
    void make_a_pipeline_and_quit() {
        VulkanTest::SetUp();
        if (!device_) return;
        const ShaderModule shader = must(device_->create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
        device_->destroy(must(device_->create_compute_pipeline({.shader = shader, .label = "add"})));
        device_->destroy(shader);
        EXPECT_EQ(device_->live_handle_count(), 0u);
        device_.reset();
        for (const std::string& c : complaints_) ADD_FAILURE() << c;
    }
    // Ours; drivers keep caches of their own beside them.
    std::vector<fs::path> files() const {
        std::vector<fs::path> out;
        for (const auto& f : fs::recursive_directory_iterator(folder_.path()))
            if (f.is_regular_file() && f.path().string().find("/kiln/") != std::string::npos) out.push_back(f.path());
        return out;
    }
    const TempFolder folder_;
    std::optional<std::string> old_;
};

using PipelineCacheGpu = PipelineCacheFolder;

TEST_F(PipelineCacheGpu, IsWrittenAndReadAgain) {
    make_a_pipeline_and_quit();
    if (IsSkipped()) return;
    ASSERT_EQ(files().size(), 1u);
    EXPECT_EQ(files()[0].parent_path(), folder_ / "kiln");
    EXPECT_FALSE(vulkan::load_cache(files()[0].string()).empty());
    make_a_pipeline_and_quit();
    EXPECT_EQ(files().size(), 1u);
}

// Cut off, a flipped bit, an empty file, another program's file: each is ignored and replaced by a good one.
TEST_F(PipelineCacheGpu, DamagedFilesAreIgnoredAndReplaced) {
    make_a_pipeline_and_quit();
    if (IsSkipped()) return;
    const fs::path path = files().at(0);
    std::ifstream in(path, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(in), {}};
    std::string flipped = good;
    flipped[flipped.size() - 3] = char(flipped[flipped.size() - 3] ^ 4);
    std::string grown = good;
    grown[8] = char(0xff);  // size
    for (const std::string& bad :
         {good.substr(0, good.size() / 2), flipped, grown, std::string(), std::string(5000, 'x'), good + "x"}) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << bad;
        EXPECT_TRUE(vulkan::load_cache(path.string()).empty());
        make_a_pipeline_and_quit();
        EXPECT_FALSE(vulkan::load_cache(path.string()).empty());
    }
}

TEST_F(PipelineCacheGpu, IsOffWhereNothingCanBeWritten) {
    std::ofstream(folder_ / "kiln") << "a file where the folder should be";
    make_a_pipeline_and_quit();
    if (IsSkipped()) return;
    EXPECT_TRUE(files().empty());
    EXPECT_TRUE(fs::is_regular_file(folder_ / "kiln"));
}

}  // namespace
}  // namespace kiln::rhi
