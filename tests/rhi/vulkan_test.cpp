// SPDX-License-Identifier: MIT
// The Vulkan backend on a real (or software) device, with the driver's validation and synchronisation validation on.
#include "rhi_test.h"

#include "shaders/rhi_add.spv.h"
#include "shaders/rhi_triangle_frag.spv.h"
#include "shaders/rhi_triangle_vert.spv.h"
#include "shaders/rhi_volume_sample.spv.h"
#include "shaders/rhi_volume_write.spv.h"

#include <cmath>

namespace kiln::rhi {

using VulkanGpu = VulkanTest;

struct AddPush {
    uint32_t scale, offset, count, pad;
};

TEST_F(VulkanGpu, ComputeComesBackRight) {
    Device& d = *device_;
    constexpr uint32_t kCount = 1000;
    std::vector<uint32_t> input(kCount);
    for (uint32_t i = 0; i < kCount; ++i) input[i] = i * 7;
    const BufferHandle in = must(d.create_buffer({.size = kCount * 4, .label = "in"}));
    const BufferHandle out = must(d.create_buffer({.size = kCount * 4, .label = "out"}));
    const BufferHandle back =
        must(d.create_buffer({.size = kCount * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    const ShaderModule shader = must(d.create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
    const ComputePipeline pipeline = must(d.create_compute_pipeline({.shader = shader, .label = "add"}));
    d.destroy(shader);
    const BindGroupEntry entries[] = {{.binding = 0, .buffer = in}, {.binding = 1, .buffer = out}};
    const BindGroup group = must(d.create_bind_group({.layout = d.group_layout(pipeline, 0), .entries = entries, .label = "add"}));

    must(d.write_buffer(in, 0, bytes_of(input)));
    auto e = d.create_encoder("add");
    ComputePass& pass = e->begin_compute("add");
    pass.set_bind_group(0, group);
    pass.set_push_struct(AddPush{3, 11, kCount, 0});
    pass.set_pipeline(pipeline);
    pass.dispatch((kCount + 63) / 64);
    pass.end();
    barrier(*e, {.buffer = out, .before = Access::StorageWriteCompute, .after = Access::CopyRead});
    e->copy_buffer(out, 0, back, 0, kCount * 4);
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    const SubmitId id = must(d.submit(std::move(e)));
    // Allowed at once: the device keeps them until the submit is done.
    d.destroy(in);
    d.destroy(group);
    d.destroy(pipeline);
    must(d.wait(id));
    EXPECT_TRUE(d.completed(id));
    const std::vector<uint32_t> result = mapped<uint32_t>(d, back, kCount);
    for (uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(result[i], input[i] * 3 + 11) << i;
    d.destroy(out);
    d.destroy(back);
}

}  // namespace kiln::rhi
