// SPDX-License-Identifier: MIT
#include "render/graph_kernel.h"

#include "base/log.h"

#include <algorithm>
#include <optional>

namespace kiln::render {

namespace {

// The bindings of both stages in one list; a binding that both declare is there once.
void fold(rhi::Reflection& into, const rhi::Reflection& from) {
    into.push_bytes = std::max(into.push_bytes, from.push_bytes);
    if (into.push_members.empty()) into.push_members = from.push_members;
    for (const rhi::ReflectedBinding& b : from.bindings) {
        const auto same = std::find_if(into.bindings.begin(), into.bindings.end(), [&](const rhi::ReflectedBinding& o) {
            return o.set == b.set && o.binding == b.binding;
        });
        if (same == into.bindings.end()) {
            into.bindings.push_back(b);
        } else {
            same->stages |= b.stages;
            same->write_only = same->write_only && b.write_only;
        }
    }
    std::sort(into.bindings.begin(), into.bindings.end(),
              [](const rhi::ReflectedBinding& a, const rhi::ReflectedBinding& b) {
                  return std::pair(a.set, a.binding) < std::pair(b.set, b.binding);
              });
}

// Empty, or what the second reflection has differently.
std::string interface_difference(const rhi::Reflection& was, const rhi::Reflection& is) {
    if (was.workgroup != is.workgroup)
        return formatted("workgroup {}x{}x{} was {}x{}x{}", is.workgroup[0], is.workgroup[1], is.workgroup[2],
                         was.workgroup[0], was.workgroup[1], was.workgroup[2]);
    if (was.push_bytes != is.push_bytes) return formatted("push data of {} B was {} B", is.push_bytes, was.push_bytes);
    if (was.bindings.size() != is.bindings.size())
        return formatted("{} bindings were {}", is.bindings.size(), was.bindings.size());
    for (size_t i = 0; i < is.bindings.size(); ++i) {
        const rhi::ReflectedBinding &a = was.bindings[i], &b = is.bindings[i];
        if (a.set != b.set || a.binding != b.binding || a.kind != b.kind || a.format != b.format ||
            a.dimension != b.dimension || a.write_only != b.write_only || a.block_size != b.block_size ||
            a.sample_type != b.sample_type)
            return formatted("binding {}.{} '{}' ({}) was {}.{} '{}' ({})", b.set, b.binding, b.name, rhi::name(b.kind),
                             a.set, a.binding, a.name, rhi::name(a.kind));
    }
    return {};
}

}  // namespace

const rhi::Reflection* Reflections::of(const Kernel& kernel, std::string& error) {
    const auto known = entries_.find(kernel.name);
    if (known != entries_.end()) {
        if (known->second.words.data() == kernel.spirv.data()) return known->second.reflection.get();
        error = formatted("two kernels are called '{}'", kernel.name);
        return nullptr;
    }
    Result<rhi::Reflection> reflection = rhi::reflect_spirv(kernel.spirv);
    if (!reflection || reflection->stage != rhi::ShaderStage::Compute) {
        error =
            formatted("kernel '{}': {}", kernel.name, reflection ? "not a compute shader" : reflection.error().message);
        return nullptr;
    }
    Entry entry{kernel.spirv, std::make_unique<rhi::Reflection>(std::move(*reflection))};
    return entries_.emplace(std::string(kernel.name), std::move(entry)).first->second.reflection.get();
}

const rhi::Reflection* Reflections::of(const RasterKernel& kernel, std::string& error) {
    return folded(kernel.name, kernel.words(), {kernel.vertex, kernel.mesh, kernel.fragment}, error);
}

const rhi::Reflection* Reflections::of(const TraceKernel& kernel, std::string& error) {
    return folded(kernel.name, kernel.raygen.data(),
                  {kernel.raygen, kernel.miss, kernel.intersection, kernel.closest_hit}, error);
}

const rhi::Reflection* Reflections::folded(std::string_view name, const uint32_t* words,
                                           std::initializer_list<std::span<const uint32_t>> stages,
                                           std::string& error) {
    const auto known = entries_.find(name);
    if (known != entries_.end()) {
        if (known->second.words.data() == words) return known->second.reflection.get();
        error = formatted("two kernels are called '{}'", name);
        return nullptr;
    }
    auto all = std::make_unique<rhi::Reflection>();
    for (const std::span<const uint32_t> stage : stages) {
        if (stage.empty()) continue;
        Result<rhi::Reflection> reflection = rhi::reflect_spirv(stage);
        if (!reflection) {
            error = formatted("kernel '{}': {}", name, reflection.error().message);
            return nullptr;
        }
        fold(*all, *reflection);
    }
    return entries_.emplace(std::string(name), Entry{{words, 1}, std::move(all)}).first->second.reflection.get();
}

void Reflections::forget(std::string_view name) {
    if (const auto it = entries_.find(name); it != entries_.end()) entries_.erase(it);
}

// ---- pipelines

PipelineLibrary::~PipelineLibrary() {
    for (const auto& [name, c] : compute_) device_->destroy(c.pipeline);
    for (const auto& [name, r] : raster_) device_->destroy(r.pipeline);
    for (const auto& [name, t] : traces_) device_->destroy(t.pipeline);
}

Result<void> PipelineLibrary::warm_up(std::span<const Kernel* const> kernels,
                                      std::span<const RasterKernel* const> raster,
                                      std::span<const TraceKernel* const> traces) {
    warm_ = false;
    for (const Kernel* kernel : kernels)
        if (const auto p = get(*kernel); !p) return p.error();
    for (const RasterKernel* kernel : raster)
        if (const auto p = get(*kernel); !p) return p.error();
    for (const TraceKernel* kernel : traces)
        if (const auto p = get(*kernel); !p) return p.error();
    warm_ = true;
    return {};
}

void PipelineLibrary::count(std::string_view name) {
    ++made_;
    if (!warm_) return;
    ++made_late_;
    log::warn("pipeline '{}' was made inside a frame: give its kernel to warm_up()", name);
}

Result<rhi::ComputePipeline> PipelineLibrary::make(const Kernel& kernel, std::span<const uint32_t> spirv) {
    const auto module = device_->create_shader_module({.spirv = spirv, .label = kernel.name});
    if (!module) return module.error();
    auto pipeline =
        device_->create_compute_pipeline({.shader = *module, .constants = kernel.constants, .label = kernel.name});
    device_->destroy(*module);
    return pipeline;
}

namespace {

// What stands for these words.
std::span<const uint32_t> now(const std::map<const uint32_t*, std::vector<uint32_t>>& replaced,
                              std::span<const uint32_t> words) {
    const auto it = replaced.find(words.data());
    return it != replaced.end() && !words.empty() ? std::span<const uint32_t>(it->second) : words;
}

}  // namespace

Result<rhi::ComputePipeline> PipelineLibrary::get(const Kernel& kernel) {
    if (const auto it = compute_.find(kernel.name); it != compute_.end()) {
        if (it->second.words == kernel.spirv.data()) return it->second.pipeline;
        return Error{formatted("two kernels are called '{}'", kernel.name)};
    }
    const auto pipeline = make(kernel, now(replaced_, kernel.spirv));
    if (!pipeline) return pipeline.error();
    compute_.emplace(std::string(kernel.name),
                     Compute{.words = kernel.spirv.data(), .pipeline = *pipeline, .kernel = kernel});
    count(kernel.name);
    return *pipeline;
}

namespace {

// Shader modules of one pipeline, gone with this.
class Modules {
public:
    Modules(rhi::Device& device, std::string_view label) : device_(device), label_(label) {}
    ~Modules() {
        for (const rhi::ShaderModule module : made_) device_.destroy(module);
    }
    Modules(const Modules&) = delete;
    Modules& operator=(const Modules&) = delete;

    // None of no words.
    rhi::ShaderModule of(std::span<const uint32_t> words) {
        if (words.empty() || fault_) return {};
        const auto module = device_.create_shader_module({.spirv = words, .label = label_});
        if (!module) return fault_ = module.error(), rhi::ShaderModule{};
        made_.push_back(*module);
        return *module;
    }
    const std::optional<Error>& fault() const { return fault_; }

private:
    rhi::Device& device_;
    std::string_view label_;
    std::vector<rhi::ShaderModule> made_;
    std::optional<Error> fault_;
};

}  // namespace

Result<rhi::RenderPipeline> PipelineLibrary::make(const RasterKernel& kernel, const Words& replaced) {
    Modules modules(*device_, kernel.name);
    rhi::RenderPipelineDesc desc{.vertex = modules.of(now(replaced, kernel.vertex)),
                                 .fragment = modules.of(now(replaced, kernel.fragment)),
                                 .vertex_buffers = kernel.vertex_buffers,
                                 .topology = kernel.topology,
                                 .cull = kernel.cull,
                                 .colors = kernel.colors,
                                 .depth = kernel.depth,
                                 .label = kernel.name};
    desc.mesh = modules.of(now(replaced, kernel.mesh));
    if (modules.fault()) return *modules.fault();
    return device_->create_render_pipeline(desc);
}

Result<rhi::RenderPipeline> PipelineLibrary::get(const RasterKernel& kernel) {
    if (const auto it = raster_.find(kernel.name); it != raster_.end()) {
        if (it->second.words == kernel.words()) return it->second.pipeline;
        return Error{formatted("two kernels are called '{}'", kernel.name)};
    }
    const auto pipeline = make(kernel, replaced_);
    if (!pipeline) return pipeline.error();
    raster_.emplace(std::string(kernel.name), Raster{.words = kernel.words(), .pipeline = *pipeline, .kernel = kernel});
    count(kernel.name);
    return *pipeline;
}

Result<rhi::TracePipeline> PipelineLibrary::get(const TraceKernel& kernel) {
    if (const auto it = traces_.find(kernel.name); it != traces_.end()) {
        if (it->second.words == kernel.raygen.data()) return it->second.pipeline;
        return Error{formatted("two kernels are called '{}'", kernel.name)};
    }
    Modules modules(*device_, kernel.name);
    const rhi::TracePipelineDesc desc{.raygen = modules.of(kernel.raygen),
                                      .miss = modules.of(kernel.miss),
                                      .intersection = modules.of(kernel.intersection),
                                      .closest_hit = modules.of(kernel.closest_hit),
                                      .label = kernel.name};
    if (modules.fault()) return *modules.fault();
    const auto pipeline = device_->create_trace_pipeline(desc);
    if (!pipeline) return pipeline.error();
    traces_.emplace(std::string(kernel.name), Trace{.words = kernel.raygen.data(), .pipeline = *pipeline});
    count(kernel.name);
    return *pipeline;
}

Result<void> PipelineLibrary::replace(const Kernel& kernel, std::span<const uint32_t> spirv) {
    const auto it = compute_.find(kernel.name);
    if (it == compute_.end()) return Error{formatted("replace kernel '{}': it was never made", kernel.name)};
    const auto was = rhi::reflect_spirv(kernel.spirv);
    const auto is = rhi::reflect_spirv(spirv);
    if (!was) return was.error();
    if (!is) return Error{formatted("replace kernel '{}': {}", kernel.name, is.error().message), ErrorKind::Input};
    if (const std::string difference = interface_difference(*was, *is); !difference.empty())
        return Error{formatted("replace kernel '{}': {}", kernel.name, difference), ErrorKind::Input};
    const auto pipeline = make(kernel, spirv);
    if (!pipeline) return pipeline.error();
    device_->destroy(it->second.pipeline);
    it->second.pipeline = *pipeline;
    ++made_;
    return {};
}

Result<void> PipelineLibrary::replace_words(std::span<const uint32_t> old, std::span<const uint32_t> spirv) {
    const auto was = rhi::reflect_spirv(old);
    const auto is = rhi::reflect_spirv(spirv);
    if (!was) return was.error();
    if (!is) return Error{is.error().message, ErrorKind::Input};
    if (const std::string difference = interface_difference(*was, *is); !difference.empty())
        return Error{difference, ErrorKind::Input};
    Words replaced = replaced_;
    replaced[old.data()].assign(spirv.begin(), spirv.end());
    std::vector<std::pair<Compute*, rhi::ComputePipeline>> compute;
    std::vector<std::pair<Raster*, rhi::RenderPipeline>> raster;
    std::optional<Error> fault;
    for (auto& [name, c] : compute_) {
        if (fault || c.words != old.data()) continue;
        if (auto made = make(c.kernel, spirv))
            compute.emplace_back(&c, *made);
        else
            fault = made.error();
    }
    for (auto& [name, r] : raster_) {
        const RasterKernel& k = r.kernel;
        if (fault || (k.vertex.data() != old.data() && k.fragment.data() != old.data() && k.mesh.data() != old.data()))
            continue;
        if (auto made = make(k, replaced))
            raster.emplace_back(&r, *made);
        else
            fault = made.error();
    }
    // Whichever of the two are not wanted: what was, or, after a fault, what was just made.
    for (auto& [entry, pipeline] : compute) {
        if (!fault) std::swap(entry->pipeline, pipeline);
        device_->destroy(pipeline);
    }
    for (auto& [entry, pipeline] : raster) {
        if (!fault) std::swap(entry->pipeline, pipeline);
        device_->destroy(pipeline);
    }
    if (fault) return *fault;
    made_ += compute.size() + raster.size();
    replaced_ = std::move(replaced);
    return {};
}

}  // namespace kiln::render
