// SPDX-License-Identifier: MIT
// Frames through the null device and through Vulkan, both under validation: one complaint fails the test.
#include "render/graph_hazards.h"
#include "render/graph_samples.h"
#include "rhi/rhi_test.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>

namespace kiln::render::samples {
namespace {

using rhi::must;
using testing::HasSubstr;

float from_half(uint16_t h) {
    const uint32_t exponent = h >> 10 & 31, mantissa = h & 1023;
    float v = std::ldexp(float(mantissa + (exponent ? 1024 : 0)), int(exponent ? exponent : 1) - 25);
    if (exponent == 31) v = mantissa ? std::nanf("") : INFINITY;
    return h >> 15 ? -v : v;
}

void make_world(rhi::Device& device, World& world) {
    for (size_t i = 0; i < world.textures.size(); ++i) {
        const ImageDesc& d = World::kImages[i];
        world.textures[i] = must(device.create_texture(
            {.dimension = d.dimension, .format = d.format, .size = d.size, .mips = d.mips, .label = "imported"}));
    }
    for (rhi::BufferHandle& b : world.buffers) {
        b = must(device.create_buffer({.size = kWords * 4, .label = "imported buffer"}));
        must(device.write_buffer(b, 0, rhi::bytes_of(std::vector<uint32_t>(kWords, 7))));
    }
}

void drop_world(rhi::Device& device, World& world) {
    for (const rhi::TextureHandle t : world.textures) device.destroy(t);
    for (const rhi::BufferHandle b : world.buffers) device.destroy(b);
}

// Frames of random graphs, every one on what the last one left. All bytes that were read back.
std::vector<std::vector<std::byte>> run_random(rhi::Device& device, uint32_t seed, const RunnerOptions& runner_options,
                                               const FuzzOptions& options, int frames) {
    std::vector<std::vector<std::byte>> out;
    World world;
    make_world(device, world);
    {
        Runner runner(device, runner_options);
        must(runner.pipelines().warm_up(kKernels, kRaster));
        std::mt19937 random(seed);
        std::vector<Plan> plans;
        std::vector<Readback> waiting;
        for (int f = 0; f < frames; ++f) {
            Graph g(runner);
            for (Readback& r : record_random(g, random, world, options)) waiting.push_back(std::move(r));
            const auto submit = runner.execute(g);
            EXPECT_TRUE(bool(submit)) << (submit ? "" : submit.error().message);
            if (!submit) break;
            plans.push_back(runner.plan());
        }
        EXPECT_EQ(joined(find_hazards(plans)), "") << "seed " << seed;
        for (const Readback& r : waiting) {
            auto bytes = r.get();
            EXPECT_TRUE(bool(bytes)) << (bytes ? "" : bytes.error().message);
            if (bytes) out.push_back(std::move(*bytes));
        }
        EXPECT_EQ(runner.pipelines().made_late(), 0u);
    }
    drop_world(device, world);
    return out;
}

class RunnerTest : public rhi::NullTest {};
class RunnerGpuTest : public rhi::VulkanTest {};

TEST_F(RunnerTest, RandomFramesPassValidation) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        run_random(*device_, seed,
                   {.aliasing = seed % 3 != 0, .poison = seed % 4 == 0, .frames_in_flight = 1 + seed % 3},
                   {.passes = 30}, 4);
        ASSERT_TRUE(complaints_.empty()) << "seed " << seed << ": " << complaints_[0];
    }
}

// A frame as games have them.
struct DeferredFrames {
    explicit DeferredFrames(rhi::Device& d, const RunnerOptions& options = {}) : device(d), runner(d, options) {
        atlas = must(device.create_texture({.format = rhi::Format::Rgba16Float, .size = {64, 64}, .label = "atlas"}));
        exposure = must(device.create_buffer({.size = kWords * 4, .label = "exposure"}));
        must(device.write_buffer(exposure, 0, rhi::bytes_of(std::vector<uint32_t>(kWords, 1))));
        const std::vector<uint16_t> texels(64 * 64 * 4, 0x3800);  // one half
        must(device.write_texture({.place = {.texture = atlas}, .size = {64, 64}}, std::as_bytes(std::span(texels))));
        must(runner.pipelines().warm_up(kKernels, kRaster));
    }
    ~DeferredFrames() {
        device.destroy(atlas);
        device.destroy(exposure);
    }
    rhi::SubmitId frame() {
        Graph g(runner);
        picture = record_deferred_frame(g, atlas, exposure, {96, 64});
        return must(runner.execute(g));
    }
    rhi::Device& device;
    Runner runner;
    rhi::TextureHandle atlas;
    rhi::BufferHandle exposure;
    Readback picture;
};

TEST_F(RunnerTest, ASteadyFrameMakesNoObject) {
    DeferredFrames frames(*device_);
    for (int i = 0; i < 6; ++i) frames.frame();
    const uint64_t made = frames.runner.stats().objects_made;
    const uint64_t pipelines = device_->pipelines_created();
    const uint32_t live = device_->live_handle_count();
    const std::string plan = frames.runner.plan().text();
    for (int i = 0; i < 40; ++i) frames.frame();
    EXPECT_EQ(frames.runner.stats().objects_made, made);
    EXPECT_EQ(device_->live_handle_count(), live) << device_->live_handles();
    EXPECT_EQ(device_->pipelines_created(), pipelines);
    EXPECT_EQ(frames.runner.pipelines().made_late(), 0u);
    EXPECT_EQ(frames.runner.plan().text(), plan);
}

TEST_F(RunnerTest, PipelinesMadeInsideAFrameAreCounted) {
    Runner runner(*device_);
    must(runner.pipelines().warm_up({}));
    Graph g(runner);
    Image a = g.create("a", kSmall);
    g.dispatch(kFill, a.size, {g.write(a)}, FillPush{});
    g.output(a);
    must(runner.execute(g));
    EXPECT_EQ(runner.pipelines().made_late(), 1u);
}

TEST_F(RunnerTest, RefusesAGraphThatWasOvertaken) {
    Runner runner(*device_);
    Graph early(runner);
    Graph g(runner);
    Image a = g.create("a", kSmall);
    g.clear(a);
    g.output(a);
    must(runner.execute(g));
    EXPECT_TRUE(runner.texture(a));
    const auto late = runner.execute(early);
    ASSERT_FALSE(bool(late));
    EXPECT_THAT(late.error().message, HasSubstr("out of date"));
}

TEST_F(RunnerTest, ReportsRecordingErrorsAndAnswersTheirReadbacks) {
    Runner runner(*device_);
    Graph g(runner);
    Image a = g.create("a", kSmall);
    const Readback r = g.readback(a);
    EXPECT_FALSE(bool(runner.execute(g)));
    const auto bytes = r.get();
    ASSERT_FALSE(bool(bytes));
    EXPECT_THAT(bytes.error().message, HasSubstr("never executed"));
    EXPECT_FALSE(bool(Readback{}.get()));
}

TEST_F(RunnerTest, ReadbacksOutliveTheRunner) {
    Readback r;
    {
        Runner runner(*device_);
        Graph g(runner);
        Buffer words = g.create_buffer("words", 16);
        g.clear(words, 42);
        r = g.readback(words);
        must(runner.execute(g));
    }
    EXPECT_EQ(must(r.get_as<uint32_t>()), (std::vector<uint32_t>{42, 42, 42, 42}));
}

TEST_F(RunnerTest, HistoriesSwapAndStartWithZeros) {
    Runner runner(*device_);
    for (uint32_t frame = 1; frame <= 5; ++frame) {
        Graph g(runner);
        BufferHistory h = g.history_buffer("h", 16);
        EXPECT_EQ(h.valid, frame > 1);
        const Readback before = g.readback(h.previous);
        g.clear(h.current, frame);
        must(runner.execute(g));
        EXPECT_EQ(must(before.get_as<uint32_t>())[0], frame - 1);
    }
    Graph larger(runner);
    EXPECT_FALSE(larger.history_buffer("h", 32).valid);
}

TEST_F(RunnerTest, AHistoryThatMissedAFrameStartsAnew) {
    Runner runner(*device_);
    for (const uint32_t value : {5u, 0u, 6u}) {
        Graph g(runner);
        BufferHistory h = g.history_buffer("h", 16);
        g.readback(h.previous);
        if (value) g.clear(h.current, value);
        must(runner.execute(g));
    }
    Graph g(runner);
    EXPECT_TRUE(g.history_buffer("h", 16).valid);
    Runner other(*device_);
    for (int frame = 0; frame < 2; ++frame) {
        Graph unwritten(other);
        const BufferHistory h = unwritten.history_buffer("h", 16);
        EXPECT_FALSE(h.valid);
        const Readback zeros = unwritten.readback(h.previous);
        must(other.execute(unwritten));
        EXPECT_EQ(must(zeros.get_as<uint32_t>())[0], 0u);
    }
}

TEST_F(RunnerTest, CarriesTheAccessOfImports) {
    Runner runner(*device_);
    const rhi::TextureHandle texture =
        must(device_->create_texture({.format = rhi::Format::Rgba16Float, .size = {64, 32}, .label = "kept"}));
    {
        Graph g(runner);
        Image kept = g.import("kept", texture);
        g.clear(kept);
        g.readback(kept);
        must(runner.execute(g));
    }
    EXPECT_EQ(runner.access(texture), rhi::Access::CopyRead);
    must(device_->write_texture({.place = {.texture = texture}, .size = {64, 32}, .before = runner.access(texture)},
                                std::vector<std::byte>(64 * 32 * 8)));
    runner.set_access(texture, rhi::Access::SampledReadCompute);
    {
        Graph g(runner);
        const Image kept = g.import("kept", texture);
        Image out = g.create("out", kSmall);
        g.dispatch(kDown, out.size, {g.read(kept), g.write(out)});
        g.readback(out);
        must(runner.execute(g));
    }
    runner.forget(texture);
    device_->destroy(texture);
}

TEST_F(RunnerTest, UploadsChangeSizeWithoutTrouble) {
    Runner runner(*device_);
    for (const size_t count : {1u, 100u, 3u, 5000u, 0u, 64u}) {
        std::vector<uint32_t> words(count);
        for (size_t i = 0; i < count; ++i) words[i] = uint32_t(i * 3);
        Graph g(runner);
        const Readback r = g.readback(g.upload("words", std::span<const uint32_t>(words)));
        must(runner.execute(g));
        std::vector<uint32_t> back = must(r.get_as<uint32_t>());
        back.resize(count);
        EXPECT_EQ(back, words);
    }
}

TEST_F(RunnerTest, CopiesOfManyRegionsReachOneImageInOrder) {
    Runner runner(*device_);
    std::vector<uint16_t> texels(64 * 4);
    for (size_t i = 0; i < texels.size(); ++i) texels[i] = uint16_t(i);
    Graph g(runner);
    Image array =
        g.create("array", {.size = {4, 4, 2}, .format = rhi::Format::R16Uint, .dimension = rhi::Dimension::D2Array});
    g.clear(array);
    const Buffer source = g.upload("texels", std::span<const uint16_t>(texels));
    const CopyRegion in[] = {{.buffer_offset = 0, .size = {2, 2}},
                             {.buffer_offset = 16, .origin = {2, 0, 0}, .size = {2, 2}},
                             {.buffer_offset = 32, .origin = {1, 1, 0}, .size = {2, 2, 2}}};
    g.copy(source, array, in);
    Buffer out = g.create_buffer("out", 64);
    g.clear(out);
    const CopyRegion back[] = {{.buffer_offset = 0, .size = {4, 4}},
                               {.buffer_offset = 32, .origin = {0, 0, 1}, .size = {4, 4}}};
    g.copy(array, out, back);
    const Readback r = g.readback(out);
    must(runner.execute(g));
    EXPECT_EQ(must(r.get_as<uint16_t>()),
              (std::vector<uint16_t>{0, 1, 8, 9, 2, 16, 17, 11, 0, 18, 19, 0, 0, 0, 0, 0,  //
                                     0, 0, 0, 0, 0, 20, 21, 0,  0, 22, 23, 0, 0, 0, 0, 0}));
}

TEST_F(RunnerTest, KernelsAreReplacedOnlyByTheirLike) {
    Runner runner(*device_);
    must(runner.pipelines().warm_up(kKernels));
    must(runner.pipelines().replace(kFill, std::vector<uint32_t>(std::begin(kGraphFillSpv), std::end(kGraphFillSpv))));
    const auto other = runner.pipelines().replace(kFill, kGraphDownSpv);
    ASSERT_FALSE(bool(other));
    EXPECT_THAT(other.error().message, HasSubstr("replace kernel 'fill'"));
    const uint32_t garbage[] = {1, 2, 3};
    EXPECT_FALSE(bool(runner.pipelines().replace(kFill, garbage)));
    Graph g(runner);
    Image a = g.create("a", kSmall);
    g.dispatch(kFill, a.size, {g.write(a)}, FillPush{});
    g.output(a);
    must(runner.execute(g));
}

// ---- on a GPU

TEST_F(RunnerGpuTest, RandomFramesAreTheSameWithAndWithoutAliasing) {
    for (uint32_t seed = 100; seed < 106; ++seed) {
        const FuzzOptions options{.passes = 40, .whole_writes = true};
        const auto shared = run_random(*device_, seed, {}, options, 3);
        const auto apart = run_random(*device_, seed, {.aliasing = false}, options, 3);
        const auto poisoned = run_random(*device_, seed, {.poison = true}, options, 3);
        ASSERT_GT(shared.size(), 3u);
        ASSERT_EQ(shared.size(), apart.size());
        ASSERT_EQ(shared.size(), poisoned.size());
        for (size_t i = 0; i < shared.size(); ++i) {
            EXPECT_TRUE(shared[i] == apart[i]) << "seed " << seed << ", read-back " << i << " differs without aliasing";
            EXPECT_TRUE(shared[i] == poisoned[i]) << "seed " << seed << ", read-back " << i << " differs with poison";
        }
        ASSERT_TRUE(complaints_.empty()) << "seed " << seed << ": " << complaints_[0];
    }
}

TEST_F(RunnerGpuTest, ADeferredFrameIsTheSameWithAndWithoutAliasing) {
    std::vector<std::vector<std::byte>> pictures;
    for (const RunnerOptions& options :
         {RunnerOptions{}, RunnerOptions{.aliasing = false}, RunnerOptions{.poison = true}}) {
        DeferredFrames frames(*device_, options);
        for (int i = 0; i < 4; ++i) frames.frame();
        pictures.push_back(must(frames.picture.get()));
        EXPECT_EQ(frames.runner.pipelines().made_late(), 0u);
    }
    ASSERT_EQ(pictures[0].size(), 96u * 64 * 8);
    EXPECT_TRUE(pictures[0] == pictures[1]);
    EXPECT_TRUE(pictures[0] == pictures[2]);
    EXPECT_FALSE(std::all_of(pictures[0].begin(), pictures[0].end(), [](std::byte b) { return b == std::byte{0}; }));
}

TEST_F(RunnerGpuTest, EveryPassHasATime) {
    DeferredFrames frames(*device_);
    if (!device_->caps().timestamp) GTEST_SKIP() << "no timestamps";
    rhi::SubmitId id = 0;
    for (int i = 0; i < 3; ++i) id = frames.frame();
    const FrameTimes times = must(frames.runner.times(id));
    ASSERT_EQ(times.passes.size(), frames.runner.plan().passes.size());
    double sum = 0;
    for (size_t i = 0; i < times.passes.size(); ++i) {
        EXPECT_EQ(times.passes[i].name, frames.runner.plan().passes[i].name);
        EXPECT_GT(times.passes[i].ms, 0) << times.passes[i].name;
        sum += times.passes[i].ms;
    }
    EXPECT_GT(times.total_ms, 0);
    EXPECT_LE(sum, times.total_ms * 1.001) << "this device runs one pass after the other";
    EXPECT_EQ(frames.runner.last_times().submit, id);
    EXPECT_FALSE(bool(frames.runner.times(id + 100)));
}

TEST_F(RunnerGpuTest, PoisonIsWhatUnwrittenTexelsHold) {
    Runner runner(*device_, {.poison = true});
    Graph g(runner);
    Image a = g.create("a", kSmall);
    g.dispatch(kFill, a.size, {g.write(a)}, FillPush{.value = {2, 0, 0, 0}, .columns = 8});
    Buffer words = g.create_buffer("words", 64);
    g.clear(words, 5, 0, 32);
    const Readback texels = g.readback(a), bytes = g.readback(words);
    must(runner.execute(g));
    const std::vector<uint16_t> half = must(texels.get_as<uint16_t>());
    ASSERT_EQ(half.size(), 64u * 32 * 4);
    EXPECT_EQ(from_half(half[0]), 2.0f);
    EXPECT_EQ(from_half(half[7 * 4]), 2.0f + 7 / 64.0f);
    EXPECT_TRUE(std::isnan(from_half(half[8 * 4]))) << from_half(half[8 * 4]);
    const std::vector<uint32_t> w = must(bytes.get_as<uint32_t>());
    EXPECT_EQ(w[0], 5u);
    EXPECT_EQ(w[15], 0xCDCDCDCDu);
}

TEST_F(RunnerGpuTest, RowsOfReadbacksAreTight) {
    Runner runner(*device_);
    Graph g(runner);
    Image a = g.create("a", {.size = {5, 3}});
    g.dispatch(kFill, a.size, {g.write(a)}, FillPush{});
    const Readback r = g.readback(a);
    must(runner.execute(g));
    const std::vector<uint16_t> half = must(r.get_as<uint16_t>());
    ASSERT_EQ(half.size(), 5u * 3 * 4);
    for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 5; ++x) {
            EXPECT_EQ(from_half(half[(y * 5 + x) * 4]), float(x) / 64);
            EXPECT_EQ(from_half(half[(y * 5 + x) * 4 + 1]), float(y) / 64);
        }
}

TEST_F(RunnerGpuTest, UniformBlocksReachTheirPasses) {
    Runner runner(*device_);
    for (uint32_t frame = 0; frame < 5; ++frame) {
        Graph g(runner);
        const std::vector<uint32_t> words(kWords, 10);
        const Buffer source = g.upload("words", std::span<const uint32_t>(words));
        std::vector<Readback> back;
        for (uint32_t n = 0; n < 30; ++n) {
            Buffer out = g.create_buffer("out", kWords * 4);
            g.dispatch(kCombine, rhi::Extent{kWords}, {g.read(source), g.write(out)},
                       CombineParams{.factor = n, .offset = frame});
            back.push_back(g.readback(out));
        }
        must(runner.execute(g));
        for (uint32_t n = 0; n < 30; ++n) EXPECT_EQ(must(back[n].get_as<uint32_t>())[kWords - 1], 10 * n + frame);
    }
}

TEST_F(RunnerGpuTest, ReplacedKernelsDrawTheNextFrame) {
    Runner runner(*device_);
    must(runner.pipelines().warm_up(kKernels));
    const auto first_texel = [&] {
        Graph g(runner);
        Image a = g.create("a", kSmall);
        g.dispatch(kFill, a.size, {g.write(a)}, FillPush{.value = {3, 0, 0, 0}});
        const Readback r = g.readback(a);
        must(runner.execute(g));
        return from_half(must(r.get_as<uint16_t>())[0]);
    };
    EXPECT_EQ(first_texel(), 3.0f);
    // The same shader with 1/64 turned into 1/2 is still the same interface; only texel 1 differs.
    std::vector<uint32_t> words(std::begin(kGraphFillSpv), std::end(kGraphFillSpv));
    size_t changed = 0;
    for (uint32_t& w : words)
        if (w == std::bit_cast<uint32_t>(1.0f / 64)) w = std::bit_cast<uint32_t>(0.5f), ++changed;
    ASSERT_EQ(changed, 1u);
    must(runner.pipelines().replace(kFill, words));
    Graph g(runner);
    Image a = g.create("a", kSmall);
    g.dispatch(kFill, a.size, {g.write(a)}, FillPush{});
    const Readback r = g.readback(a);
    must(runner.execute(g));
    EXPECT_EQ(from_half(must(r.get_as<uint16_t>())[4]), 0.5f);
}

}  // namespace
}  // namespace kiln::render::samples
