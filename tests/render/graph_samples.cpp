// SPDX-License-Identifier: MIT
#include "render/graph_samples.h"

#include <algorithm>

namespace kiln::render::samples {

namespace {

// What the generator knows about one image: which mips and layers hold something.
struct FuzzImage {
    Image image;
    uint32_t layers = 1;
    std::vector<bool> written;
    bool written_at(uint32_t mip_level, uint32_t layer_index) const {
        return written[mip_level + layer_index * image.mips];
    }
};
struct FuzzBuffer {
    Buffer buffer;
    bool written = false;
};

class Generator {
public:
    Generator(Graph& g, std::mt19937& random, World& world, const FuzzOptions& options)
        : g_(g), random_(random), world_(world), options_(options) {}

    std::vector<Readback> run() {
        for (size_t i = 0; i < world_.textures.size(); ++i) {
            const ImageDesc& d = World::kImages[i];
            FuzzImage f{g_.import("imported " + std::to_string(i), world_.textures[i], d, world_.image_access[i]),
                        layers_of(d),
                        {}};
            if (world_.written[i].empty()) world_.written[i].assign(size_t{d.mips} * f.layers, false);
            f.written = world_.written[i];
            images_.push_back(std::move(f));
        }
        for (size_t i = 0; i < world_.buffers.size(); ++i)
            buffers_.push_back({g_.import("imported buffer " + std::to_string(i), world_.buffers[i], kWords * 4,
                                          world_.buffer_access[i]),
                                true});
        const ImageHistory h = g_.history("history", kSmall);
        add(h.previous, true);
        add(h.current, false);
        const BufferHistory hb = g_.history_buffer("history buffer", kWords * 4);
        buffers_.push_back({hb.previous, true});
        buffers_.push_back({hb.current, false});
        std::vector<uint32_t> words(kWords);
        for (uint32_t& w : words) w = below(1000);
        buffers_.push_back({g_.upload("upload", std::span<const uint32_t>(words)), true});

        const uint32_t passes = 1 + below(options_.passes);
        for (uint32_t p = 0; p < passes; ++p) step(p);
        // The histories' new halves must hold something, and some of the rest comes out.
        fill_all(images_[World::kImages.size() + 1]);
        for (FuzzImage& f : images_)
            if (f.written_at(0, 0) && below(3) == 0) out_.push_back(g_.readback(f.image));
        for (FuzzBuffer& b : buffers_)
            if (b.written && below(3) == 0) out_.push_back(g_.readback(b.buffer));
        for (FuzzImage& f : images_)
            if (f.written_at(0, 0) && below(8) == 0)
                g_.output(f.image, below(2) ? rhi::Access::CopyRead : rhi::Access::Undefined);
        for (size_t i = 0; i < world_.textures.size(); ++i) world_.written[i] = images_[i].written;
        return std::move(out_);
    }

private:
    uint32_t below(uint32_t n) { return uint32_t(random_() % n); }
    static uint32_t layers_of(const ImageDesc& d) { return d.dimension == rhi::Dimension::D2Array ? d.size.depth : 1; }

    FuzzImage& add(const Image& image, bool written) {
        const uint32_t layers = image.dimension == rhi::Dimension::D2Array ? image.size.depth : 1;
        images_.push_back({image, layers, std::vector<bool>(size_t{image.mips} * layers, written)});
        return images_.back();
    }

    struct Place {
        FuzzImage* f;
        uint32_t mip_level, layer_index;
        rhi::Subresources range() const { return {mip_level, 1, layer_index, 1}; }
    };

    // A mip and layer that holds something, of no image in `not_of`.
    bool pick_source(Place& out, std::initializer_list<const FuzzImage*> not_of = {}) {
        std::vector<Place> all;
        for (FuzzImage& f : images_) {
            if (f.image.format != rhi::Format::Rgba16Float ||
                std::find(not_of.begin(), not_of.end(), &f) != not_of.end())
                continue;
            for (uint32_t l = 0; l < f.layers; ++l)
                for (uint32_t m = 0; m < f.image.mips; ++m)
                    if (f.written_at(m, l)) all.push_back({&f, m, l});
        }
        if (all.empty()) return false;
        out = all[below(uint32_t(all.size()))];
        return true;
    }

    // Somewhere to write, new or old; never the history's previous half, never a source's own mip and layer.
    Place pick_target() {
        if (images_.size() < 24 && below(3) == 0) {
            static constexpr ImageDesc kDescs[] = {kSmall,
                                                   {.size = {48, 48}, .mips = 3},
                                                   {.size = {24, 24, 2}, .dimension = rhi::Dimension::D2Array},
                                                   {.size = {128, 16}}};
            const ImageDesc& d = kDescs[below(4)];
            FuzzImage& f = add(g_.create("image " + std::to_string(images_.size()), d), false);
            return {&f, below(f.image.mips), below(f.layers)};
        }
        for (;;) {
            const uint32_t i = below(uint32_t(images_.size()));
            if (i == World::kImages.size() || images_[i].image.format != rhi::Format::Rgba16Float) continue;
            return {&images_[i], below(images_[i].image.mips), below(images_[i].layers)};
        }
    }

    void wrote(const Place& p) { p.f->written[p.mip_level + p.layer_index * p.f->image.mips] = true; }
    rhi::Extent size_of(const Place& p) {
        rhi::Extent e = mip_size(p.f->image.size, p.mip_level);
        e.depth = 1;
        return e;
    }
    static bool same(const Place& a, const Place& b) {
        return a.f == b.f && a.mip_level == b.mip_level && a.layer_index == b.layer_index;
    }

    FuzzBuffer& pick_full_buffer() {
        for (;;) {
            FuzzBuffer& b = buffers_[below(uint32_t(buffers_.size()))];
            if (b.written) return b;
        }
    }
    FuzzBuffer& pick_any_buffer() {
        if (buffers_.size() < 16 && below(3) == 0)
            buffers_.push_back({g_.create_buffer("buffer " + std::to_string(buffers_.size()), kWords * 4), false});
        return buffers_[below(uint32_t(buffers_.size()))];
    }

    void fill_all(FuzzImage& f) {
        for (uint32_t l = 0; l < f.layers; ++l)
            for (uint32_t m = 0; m < f.image.mips; ++m) fill({&f, m, l}, ~0u);
    }
    void fill(const Place& p, uint32_t columns) {
        const FillPush push{.value = {float(below(16)), float(below(16)), 1, 0.5f}, .columns = columns};
        g_.dispatch(kFill, size_of(p), {g_.write(p.f->image, p.range())}, push);
        wrote(p);
    }

    void step(uint32_t n) {
        // A reference into either list must not be held while the other half of a pass is picked: targets may grow it.
        images_.reserve(512);
        buffers_.reserve(64);
        const Place target = pick_target();
        Place a{}, b{};
        switch (below(options_.raster ? 13 : 12)) {
        case 0: {
            const bool holds = target.f->written_at(target.mip_level, target.layer_index);
            return fill(target, options_.whole_writes && !holds ? ~0u : below(2) ? ~0u : 7);
        }
        case 1:
            if (!pick_source(a) || !pick_source(b) || same(a, target) || same(b, target)) return;
            // Read before write in the list, as versions demand.
            {
                const Use one = g_.sampled(a.f->image, kLinearClamp, a.range());
                const Use other = g_.read(b.f->image, b.range());
                g_.dispatch(kBlend, size_of(target), {one, other, g_.write(target.f->image, target.range())});
            }
            return wrote(target);
        case 2:
            if (!pick_source(a) || same(a, target)) return;
            g_.dispatch(kDown, size_of(target),
                        {g_.read(a.f->image, a.range()), g_.write(target.f->image, target.range())});
            return wrote(target);
        case 3:
            if (!pick_source(a) || same(a, target)) return;
            g_.dispatch(kMirror, size_of(target),
                        {g_.read(a.f->image, a.range()), g_.write(target.f->image, target.range())});
            return wrote(target);
        case 4: {
            FuzzImage* scalar = nullptr;
            for (FuzzImage& f : images_)
                if (f.image.format == rhi::Format::R32Float && below(3)) scalar = &f;
            if (!scalar) {
                scalar = &add(g_.create("scalar " + std::to_string(images_.size()),
                                        {.size = kSmall.size, .format = rhi::Format::R32Float}),
                              true);
                g_.clear(scalar->image, {float(n), 0, 0, 0});
            }
            g_.dispatch(kScale, kSmall.size, {g_.read_write(scalar->image)});
            if (below(2)) {
                FuzzBuffer& sums = pick_full_buffer();
                g_.dispatch(kSum, kSmall.size, {g_.read(scalar->image), g_.read_write(sums.buffer)});
            }
            return;
        }
        case 5: {
            if (!pick_source(a)) return;
            FuzzBuffer& sums = pick_full_buffer();
            return g_.dispatch(kSum, size_of(a), {g_.read(a.f->image, a.range()), g_.read_write(sums.buffer)});
        }
        case 6: {
            FuzzBuffer& to = pick_any_buffer();
            FuzzBuffer& from = pick_full_buffer();
            if (&from == &to) return;
            to.written = true;
            return g_.dispatch(kCombine, rhi::Extent{kWords}, {g_.read(from.buffer), g_.write(to.buffer)},
                               CombineParams{.factor = 1 + below(5), .offset = n});
        }
        case 7: {
            FuzzBuffer& from = pick_full_buffer();
            FuzzBuffer& to = pick_full_buffer();
            if (&from == &to) return;
            return g_.dispatch(kAccumulate, rhi::Extent{kWords}, {g_.read(from.buffer), g_.read_write(to.buffer)});
        }
        case 8: {
            FuzzBuffer& from = pick_full_buffer();
            FuzzBuffer& to = pick_full_buffer();
            if (&from == &to) return;
            Buffer counts = g_.create_buffer("group counts", 12);
            g_.dispatch(kGroups, Groups{}, {g_.read(from.buffer), g_.write(counts)});
            return g_.dispatch_indirect(kAccumulate, counts, 0, {g_.read(from.buffer), g_.read_write(to.buffer)});
        }
        case 9: {
            FuzzBuffer& to = pick_any_buffer();
            if (below(2) || (options_.whole_writes && !to.written)) {
                g_.clear(to.buffer, below(100));
            } else {
                g_.clear(to.buffer, below(100), 16, 32);
            }
            to.written = true;
            return;
        }
        case 10: {
            g_.clear(target.f->image, {1, 2, 3, 4}, target.range());
            return wrote(target);
        }
        case 11: {
            if (!pick_source(a) || same(a, target)) return;
            const rhi::Extent from = size_of(a), to = size_of(target);
            CopyRegion region{.mip = target.mip_level, .src_mip = a.mip_level};
            region.origin.z = target.layer_index;
            region.src_origin.z = a.layer_index;
            region.size = {std::min(from.width, to.width), std::min(from.height, to.height), 1};
            const bool covers = region.size == to;
            if (options_.whole_writes && !covers && !target.f->written_at(target.mip_level, target.layer_index)) return;
            const Image source = a.f->image;
            if (a.f == target.f) return;
            g_.copy(source, target.f->image, {&region, 1});
            return wrote(target);
        }
        case 12: {
            if (target.f->image.mips > 1 || target.f->layers > 1 || target.f->image.size != kSmall.size) return;
            FuzzImage* depth = nullptr;
            for (FuzzImage& f : images_)
                if (rhi::is_depth(f.image.format) && below(2)) depth = &f;
            if (!depth)
                depth = &add(g_.create("depth " + std::to_string(images_.size()),
                                       {.size = kSmall.size, .format = rhi::Format::Depth32Float}),
                             false);
            const bool color_holds = target.f->written_at(0, 0), depth_holds = depth->written_at(0, 0);
            const bool read_only = depth_holds && below(3) == 0;
            Targets targets{.colors = {{.image = &target.f->image,
                                        .load = color_holds && below(2) ? rhi::Load::Load : rhi::Load::Clear}},
                            .depth = {.image = &depth->image,
                                      .load = depth_holds && below(2) ? rhi::Load::Load : rhi::Load::Clear,
                                      .read_only = read_only}};
            const DrawCall call{.vertices = 3};
            g_.draw(read_only ? kOverlay : kTriangle, targets, {},
                    TrianglePush{.color = {1, float(n), 0, 1}, .depth = float(below(4)) / 4}, {&call, 1});
            target.f->written[0] = depth->written[0] = true;
            // Depth read in two ways that need two layouts.
            Image sampled = g_.create("depth seen " + std::to_string(images_.size()), kSmall);
            if (below(2)) {
                g_.dispatch(kDown, sampled.size, {g_.read(depth->image), g_.write(sampled)});
                add(sampled, true);
            }
            if (below(2)) out_.push_back(g_.readback(depth->image));
            return;
        }
        default:
            return;
        }
    }

    Graph& g_;
    std::mt19937& random_;
    World& world_;
    FuzzOptions options_;
    std::vector<FuzzImage> images_;
    std::vector<FuzzBuffer> buffers_;
    std::vector<Readback> out_;
};

}  // namespace

std::vector<Readback> record_random(Graph& g, std::mt19937& random, World& world, const FuzzOptions& options) {
    return Generator(g, random, world, options).run();
}

Readback record_deferred_frame(Graph& g, rhi::TextureHandle atlas_texture, rhi::BufferHandle exposure_buffer,
                               rhi::Extent size) {
    using rhi::Format;
    const auto fill = [&](Image& image, float v) {
        g.dispatch(kFill, image.size, {g.write(image)}, FillPush{.value = {v, v, v, 1}});
    };
    const auto blend = [&](const Image& a, const Image& b, Image& to, uint32_t level = 0) {
        g.dispatch(kBlend, mip_size(to.size, level), {g.sampled(a), g.read(b), g.write(to, mip(level))});
    };
    // Bake: bricks to a buffer, the buffer to the atlas.
    Image atlas = g.import("atlas", atlas_texture, {.size = {64, 64}}, rhi::Access::SampledReadCompute);
    Buffer exposure = g.import("exposure", exposure_buffer, kWords * 4, rhi::Access::StorageReadCompute);
    const std::vector<uint32_t> jobs(kWords, 3);
    const Buffer job_list = g.upload("bake jobs", std::span<const uint32_t>(jobs));
    Buffer bricks = g.create_buffer("baked bricks", kWords * 4);
    g.dispatch(kCombine, rhi::Extent{kWords}, {g.read(job_list), g.write(bricks)}, CombineParams{.factor = 2});
    const CopyRegion brick{.bytes_per_row = 32, .size = {4, 8}};
    g.copy(bricks, atlas, {&brick, 1});
    // March and resolve.
    Image hits = g.create("hits", {.size = size});
    blend(atlas, atlas, hits);
    Image normals = g.create("normals", {.size = size});
    blend(hits, atlas, normals);
    Image albedo = g.create("albedo", {.size = size});
    blend(hits, atlas, albedo);
    Image unused = g.create("debug view", {.size = size});
    blend(hits, normals, unused);
    // Meshes.
    Image depth = g.create("depth", {.size = size, .format = Format::Depth32Float});
    const DrawCall mesh{.vertices = 3};
    g.draw(kTriangle, {.colors = {{.image = &albedo, .load = rhi::Load::Load}}, .depth = {.image = &depth}}, {},
           TrianglePush{}, {&mesh, 1});
    // Shadows and light.
    Image shadow = g.create("shadow", {.size = size / 2});
    blend(hits, depth, shadow);
    Image shadow_blurred = g.create("shadow blurred", {.size = size / 2});
    blend(shadow, shadow, shadow_blurred);
    Image lit = g.create("lit", {.size = size});
    blend(albedo, normals, lit);
    Image shaded = g.create("shaded", {.size = size});
    blend(shadow_blurred, lit, shaded);
    Image blurred = g.create("motion blurred", {.size = size});
    Image speeds = g.create("speeds", {.size = size / 4, .format = Format::R32Float});
    g.clear(speeds);
    g.dispatch(kScale, speeds.size, {g.read_write(speeds)});
    blend(shaded, speeds, blurred);
    ImageHistory taa = g.history("taa", {.size = size});
    blend(blurred, taa.previous, taa.current);
    // Bloom, down and up one chain.
    Image bloom = g.create("bloom", {.size = size / 2, .mips = 4});
    g.dispatch(kDown, bloom.size, {g.read(taa.current), g.write(bloom, mip(0))});
    for (uint32_t m = 1; m < bloom.mips; ++m)
        g.dispatch(kDown, mip_size(bloom.size, m), {g.read(bloom, mip(m - 1)), g.write(bloom, mip(m))});
    // Exposure.
    Buffer sums = g.create_buffer("luminance sums", kWords * 4);
    g.clear(sums);
    g.dispatch(kSum, shaded.size, {g.read(shaded), g.read_write(sums)});
    g.dispatch(kAccumulate, rhi::Extent{kWords}, {g.read(sums), g.read_write(exposure)});
    // Tone map.
    Image ldr = g.create("ldr", {.size = size});
    fill(ldr, 0);
    g.dispatch(kBlend, ldr.size, {g.sampled(taa.current), g.read(bloom), g.write(ldr)});
    return g.readback(ldr);
}

}  // namespace kiln::render::samples
