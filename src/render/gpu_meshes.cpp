// SPDX-License-Identifier: MIT
#include "render/gpu_meshes.h"

#include "base/format.h"
#include "base/log.h"
#include "render/lib/octahedral.gpu.h"
#include "render/texture_pages.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

namespace kiln::render {
namespace {

using model::Drawable;
using model::Matrix;
using model::Primitive;

static_assert(sizeof(model::BvhNode) == sizeof(MeshNode));

uint32_t unorm16(float a, float b) {
    const auto word = [](float v) { return uint32_t(std::lround(std::clamp(v, 0.0f, 1.0f) * 65535)); };
    return word(a) | word(b) << 16;
}

MeshVertex packed(const model::Vertex& v) {
    const uint32_t tangent = shade::pack_unit({v.tangent.x, v.tangent.y, v.tangent.z});
    return {v.position.x,
            v.position.y,
            v.position.z,
            shade::pack_unit(v.normal),
            (tangent & ~1u) | (v.tangent.w < 0 ? 1u : 0u),
            unorm16(v.color.x, v.color.y),
            unorm16(v.color.z, v.color.w),
            v.uv[0].x,
            v.uv[0].y,
            v.uv[1].x,
            v.uv[1].y};
}

MeshNode packed(const model::BvhNode& n) {
    return {n.min.x, n.min.y, n.min.z, n.skip, n.max.x, n.max.y, n.max.z, n.leaf};
}

vec4 row(const Matrix& m, size_t r) { return {float(m[r]), float(m[4 + r]), float(m[8 + r]), float(m[12 + r])}; }

uint32_t clusters_of(const Primitive& p) { return (p.index_count / 3 + kMeshCluster - 1) / kMeshCluster; }

// Boxes of a primitive's clusters. vertex(i): where the corner with that index is.
template <typename Vertex>
void add_boxes(std::vector<MeshBox>& to, const Drawable& d, const Primitive& p, Vertex&& vertex) {
    for (uint32_t first = 0; first < p.index_count; first += 3 * kMeshCluster) {
        Box3 box;
        for (uint32_t i = first; i < std::min(first + 3 * kMeshCluster, p.index_count); ++i) {
            const vec3 at = vertex(d.indices[p.first_index + i]);
            box = box_union(box, {at, at});
        }
        to.push_back({box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z});
    }
}

std::vector<MeshBox> moved_boxes(const MeshSet& set) {
    std::vector<MeshBox> out;
    for (const MeshSet::Part& part : set.parts) {
        if (part.first_moved == UINT32_MAX) continue;
        const Primitive& p = set.primitive(part);
        add_boxes(out, set.drawable(part), p,
                  [&](uint32_t i) { return set.moved[part.first_moved + i - p.first_vertex].position; });
    }
    return out;
}

// False where all of the box is outside one side of the picture, or behind the eye.
bool may_be_seen(const Box3& box, dvec3 eye, const shade::CameraParams& camera) {
    const auto dotted = [](const vec4& a, dvec3 b) {
        return double(a.x) * b.x + double(a.y) * b.y + double(a.z) * b.z;
    };
    const double wide = dotted(camera.right, {camera.right.x, camera.right.y, camera.right.z}),
                 high = dotted(camera.up, {camera.up.x, camera.up.y, camera.up.z});
    bool outside[5] = {true, true, true, true, true};
    for (int corner = 0; corner < 8; ++corner) {
        const dvec3 p{double(corner & 1 ? box.max.x : box.min.x) - eye.x,
                      double(corner & 2 ? box.max.y : box.min.y) - eye.y,
                      double(corner & 4 ? box.max.z : box.min.z) - eye.z};
        // Half a thousandth of the picture more than it shows. Jitter over time (temporal.h) moves rays from the middles of pixels by at most
        // half a pixel, so none leaves the picture.
        const double ahead = dotted(camera.forward, p), edge = ahead + 5e-4 * std::fabs(ahead);
        const double x = dotted(camera.right, p) / wide, y = dotted(camera.up, p) / high;
        const bool out[5] = {x > edge, x<-edge, y> edge, y < -edge, ahead <= 0};
        for (size_t i = 0; i < 5; ++i) outside[i] = outside[i] && out[i];
    }
    return std::none_of(std::begin(outside), std::end(outside), [](bool all) { return all; });
}

}  // namespace

GpuMeshes::~GpuMeshes() {
    let_go();
    if (!seen_) return;
    runner_->forget(seen_);
    runner_->device().destroy(seen_);
}

void GpuMeshes::let_go() {
    for (rhi::BufferHandle* buffer : {&corners_, &vertices_, &surfaces_, &nodes_, &boxes_}) {
        if (!*buffer) continue;
        runner_->forget(*buffer);
        runner_->device().destroy(*buffer);
        *buffer = {};
    }
    for (rhi::TextureHandle& page : pages_) {
        if (!page) continue;
        runner_->forget(page);
        runner_->device().destroy(page);
        page = {};
    }
    models_.clear();
}

Result<void> GpuMeshes::bring_page(size_t page, rhi::Extent size, const std::vector<std::vector<uint8_t>>& layers) {
    rhi::Device& device = runner_->device();
    const bool srgb = page < kMeshPages;
    const uint32_t mips = uint32_t(std::bit_width(std::max(size.width, size.height)));
    auto texture = device.create_texture({.dimension = rhi::Dimension::D2Array,
                                          .format = srgb ? rhi::Format::Rgba8Srgb : rhi::Format::Rgba8Unorm,
                                          .size = size,
                                          .mips = mips,
                                          .usage = rhi::TextureUsage::Sampled | rhi::TextureUsage::CopyDst,
                                          .label = "mesh textures"});
    if (!texture) return texture.error();
    pages_[page] = *texture;
    const std::vector<uint8_t> white(size_t{size.width} * size.height * 4, 255);
    for (uint32_t layer = 0; layer < size.depth; ++layer) {
        std::vector<uint8_t> level = layer < layers.size() ? layers[layer] : white;
        rhi::Extent at{size.width, size.height, 1};
        for (uint32_t mip = 0; mip < mips; ++mip) {
            if (auto ok = device.write_texture(
                    {.place = {.texture = *texture, .mip = mip, .origin = {0, 0, layer}}, .size = at},
                    std::as_bytes(std::span(level)));
                !ok)
                return ok;
            if (mip + 1 == mips) break;
            level = half_sized(level, at, srgb);
            at = {std::max(at.width / 2, 1u), std::max(at.height / 2, 1u), 1};
        }
    }
    runner_->set_access(*texture, rhi::Access::SampledReadCompute);
    return {};
}

Result<void> GpuMeshes::bring_textures(const MeshSet& set, std::vector<MeshSurface>& surfaces) {
    std::vector<PagedTexture> textures;
    std::map<std::tuple<size_t, int32_t, bool>, size_t> numbers;  // model, image, colour
    const auto number = [&](size_t model, const model::TextureUse& use, bool srgb) {
        const model::Image& image = set.models[model]->images[size_t(use.image)];
        const auto [known, fresh] = numbers.emplace(std::tuple(model, use.image, srgb), textures.size());
        if (fresh) textures.push_back({image.width, image.height, image.rgba.data(), srgb});
        return known->second;
    };
    const auto each = [&](const auto& visit) {
        for (size_t m = 0; m < set.models.size(); ++m) {
            for (size_t s = 0; s < set.models[m]->surfaces.size(); ++s) {
                const model::Surface& in = set.models[m]->surfaces[s];
                MeshSurface& out = surfaces[places_[m].first_surface + s];
                visit(m, in.base_texture, out.base, true);
                visit(m, in.rough_metal_texture, out.rough_metal, false);
                visit(m, in.normal_texture, out.bumps, false);
                visit(m, in.occlusion_texture, out.occlusion, false);
                visit(m, in.emissive_texture, out.glow, true);
            }
        }
    };
    each([&](size_t m, const model::TextureUse& use, MeshTexture&, bool srgb) {
        if (use.image >= 0) number(m, use, srgb);
    });
    const std::vector<rhi::Extent> sizes = assign_pages(textures);
    size_t refused = 0;
    for (const PagedTexture& t : textures) refused += t.page < 0;
    if (refused > 0) log::warn("{} textures of meshes found no room and are drawn as white", refused);
    each([&](size_t m, const model::TextureUse& use, MeshTexture& out, bool srgb) {
        if (use.image < 0) return;
        const PagedTexture& t = textures[number(m, use, srgb)];
        if (t.page < 0) return;
        out = {t.layer | uint32_t(t.page) << kTexturePageShift | (use.uv_set ? kTextureSet1 : 0u) |
                   uint32_t(use.wrap_u) << kTextureWrapU | uint32_t(use.wrap_v) << kTextureWrapV |
                   (use.nearest ? kTextureNearest : 0u) | kTextureIs,
               use.map[0],
               use.map[1],
               use.map[2],
               use.map[3],
               use.map[4],
               use.map[5]};
    });
    for (size_t page = 0; page < sizes.size(); ++page) {
        std::vector<std::vector<uint8_t>> layers;
        for (const PagedTexture& t : textures)
            if (t.page == int(page)) layers.push_back(resized(t, sizes[page]));
        if (auto ok = bring_page(page, sizes[page], layers); !ok) return ok;
    }
    return {};
}

Result<void> GpuMeshes::bring(const MeshSet& set) {
    let_go();
    places_.clear();
    std::vector<MeshBox> boxes;
    std::vector<MeshVertex> vertices;
    std::vector<uint32_t> corners;
    std::vector<MeshNode> nodes(top_nodes_);
    std::vector<MeshSurface> surfaces;
    uint64_t vertex_count = set.moved.size(), corner_count = 0;
    for (const auto& d : set.models) vertex_count += d->vertices.size(), corner_count += d->indices.size();
    const uint64_t most = runner_->device().limits().max_storage_binding;
    if (vertex_count * sizeof(MeshVertex) > most || corner_count * 4 > most)
        return Error{formatted("the scene's meshes have {} vertices and {} triangles; this device holds at most {} "
                               "bytes of either; simplify "
                               "them",
                               vertex_count, corner_count / 3, most),
                     ErrorKind::Input};
    vertices.reserve(vertex_count);
    corners.reserve(corner_count);
    for (const auto& d : set.models) {
        places_.push_back(
            {uint32_t(vertices.size()), uint32_t(corners.size()), uint32_t(nodes.size()), uint32_t(surfaces.size())});
        for (const Primitive& p : d->primitives) {
            places_.back().first_boxes.push_back(uint32_t(boxes.size()));
            add_boxes(boxes, *d, p, [&](uint32_t i) { return d->vertices[i].position; });
        }
        for (const model::Vertex& v : d->vertices) vertices.push_back(packed(v));
        corners.insert(corners.end(), d->indices.begin(), d->indices.end());
        for (const model::BvhNode& n : d->bvh) nodes.push_back(packed(n));
        for (const model::Surface& s : d->surfaces) {
            MeshSurface& out = surfaces.emplace_back();
            out.base_red = s.base_color.x, out.base_green = s.base_color.y, out.base_blue = s.base_color.z;
            out.alpha = s.base_color.w;
            out.emissive_red = s.emissive.x, out.emissive_green = s.emissive.y, out.emissive_blue = s.emissive.z;
            out.metallic = s.metallic, out.roughness = s.roughness;
            out.normal_scale = s.normal_scale, out.occlusion_strength = s.occlusion_strength;
            out.alpha_cutoff = s.alpha_cutoff;
        }
    }
    first_moved_vertex_ = uint32_t(vertices.size());
    first_moved_node_ = uint32_t(nodes.size());
    first_moved_box_ = uint32_t(boxes.size());
    moved_boxes_ = uint32_t(moved_boxes(set).size());
    boxes.resize(boxes.size() + moved_boxes_);
    moved_vertices_ = uint32_t(set.moved.size());
    moved_nodes_ = uint32_t(set.moved_nodes.size());
    vertices.resize(vertices.size() + moved_vertices_);
    nodes.resize(nodes.size() + moved_nodes_);
    if (auto ok = bring_textures(set, surfaces); !ok) return ok;
    const auto make = [&](rhi::BufferHandle& to, std::span<const std::byte> bytes,
                          std::string_view label) -> Result<void> {
        auto buffer = runner_->device().create_buffer({.size = bytes.size(), .label = label});
        if (!buffer) return buffer.error();
        to = *buffer;
        return runner_->device().write_buffer(to, 0, bytes);
    };
    if (auto ok = make(vertices_, std::as_bytes(std::span(vertices)), "mesh vertices"); !ok) return ok;
    if (auto ok = make(corners_, std::as_bytes(std::span(corners)), "mesh corners"); !ok) return ok;
    if (auto ok = make(surfaces_, std::as_bytes(std::span(surfaces)), "mesh surfaces"); !ok) return ok;
    if (auto ok = make(nodes_, std::as_bytes(std::span(nodes)), "mesh boxes"); !ok) return ok;
    if (auto ok = make(boxes_, std::as_bytes(std::span(boxes)), "mesh cluster boxes"); !ok) return ok;
    models_ = set.models;
    return {};
}

// Numbers the clusters of all parts in the frame's order, and makes room to remember of each whether it was seen.
Result<void> GpuMeshes::count_clusters(const MeshSet& set) {
    std::vector<uint32_t> firsts(set.parts.size() + 1);  // by number
    for (const MeshSet::Part& part : set.parts) firsts[part.number + 1] = clusters_of(set.primitive(part));
    for (size_t i = 1; i < firsts.size(); ++i) firsts[i] += firsts[i - 1];
    first_clusters_.clear();
    for (const MeshSet::Part& part : set.parts) first_clusters_.push_back(firsts[part.number]);
    if (firsts.back() == clusters_of_all_) return {};
    clusters_of_all_ = 0;
    if (seen_) {
        runner_->forget(seen_);
        runner_->device().destroy(seen_);
        seen_ = {};
    }
    // All count as seen, so that rays end behind meshes in the first picture too.
    const std::vector<uint32_t> all(std::max(firsts.back(), 1u), 1);
    auto buffer = runner_->device().create_buffer({.size = all.size() * 4, .label = "mesh clusters seen"});
    if (!buffer) return buffer.error();
    seen_ = *buffer;
    if (auto ok = runner_->device().write_buffer(seen_, 0, std::as_bytes(std::span(all))); !ok) return ok;
    clusters_of_all_ = firsts.back();
    return {};
}

Result<void> GpuMeshes::update(const Frame& frame, const shade::CameraParams& camera) {
    parts_.clear();
    clusters_.clear();
    blends_.clear();
    outlined_.clear();
    casters_.clear();
    one_sided_ = double_sided_ = masked_ = 0;
    triangles_ = triangles_in_sight_ = 0;
    holes_ = false;
    if (frame.meshes.empty()) return {};
    const MeshSet set = make_mesh_set(frame);
    if (set.empty()) return {};
    const std::vector<MeshBox> boxes_now = moved_boxes(set);
    if (set.models != models_ || boxes_now.size() != moved_boxes_ || set.tree.size() > top_nodes_ ||
        set.moved.size() != moved_vertices_ || set.moved_nodes.size() != moved_nodes_) {
        top_nodes_ = std::bit_ceil(uint32_t(set.tree.size()));
        if (auto ok = bring(set); !ok) {
            let_go();
            return ok;
        }
    }
    // The eye becomes the origin.
    const dvec3 eye{frame.camera.position.x, frame.camera.position.y, frame.camera.position.z};
    std::vector<MeshNode> top;
    for (const model::BvhNode& n : set.tree) {
        MeshNode out = packed(n);
        const auto low = [](double v) { return std::nextafter(float(v), -INFINITY); };
        const auto high = [](double v) { return std::nextafter(float(v), INFINITY); };
        out.min_x = low(n.min.x - eye.x), out.min_y = low(n.min.y - eye.y), out.min_z = low(n.min.z - eye.z);
        out.max_x = high(n.max.x - eye.x), out.max_y = high(n.max.y - eye.y), out.max_z = high(n.max.z - eye.z);
        top.push_back(out);
    }
    rhi::Device& device = runner_->device();
    if (auto ok = count_clusters(set); !ok) return ok;
    if (!boxes_now.empty()) {
        if (auto ok = device.write_buffer(boxes_, uint64_t{first_moved_box_} * sizeof(MeshBox),
                                          std::as_bytes(std::span(boxes_now)));
            !ok)
            return ok;
    }
    if (auto ok = device.write_buffer(nodes_, 0, std::as_bytes(std::span(top))); !ok) return ok;
    if (moved_vertices_ > 0) {
        std::vector<MeshVertex> vertices;
        for (const model::Vertex& v : set.moved) vertices.push_back(packed(v));
        std::vector<MeshNode> nodes;
        for (const model::BvhNode& n : set.moved_nodes) nodes.push_back(packed(n));
        if (auto ok = device.write_buffer(vertices_, uint64_t{first_moved_vertex_} * sizeof(MeshVertex),
                                          std::as_bytes(std::span(vertices)));
            !ok)
            return ok;
        if (auto ok = device.write_buffer(nodes_, uint64_t{first_moved_node_} * sizeof(MeshNode),
                                          std::as_bytes(std::span(nodes)));
            !ok)
            return ok;
    }
    std::vector<uint32_t> outline_of(frame.meshes.size(), 0);  // by number of the mesh
    for (size_t i = 0; i < frame.meshes.size(); ++i) {
        if (!frame.meshes[i].outline) continue;
        outlined_.push_back({.outline = *frame.meshes[i].outline, .middle = {}});
        outline_of[i] = uint32_t(outlined_.size());
    }
    std::vector<Box3> boxes(outlined_.size());
    uint32_t next_moved_box = first_moved_box_;
    for (const MeshSet::Part& part : set.parts) {
        const Primitive& p = set.primitive(part);
        if (const uint32_t n = outline_of[part.mesh]; n > 0) boxes[n - 1] = box_union(boxes[n - 1], part.bounds);
        const Model& at = places_[part.model];
        casters_.push_back({part.place, part.bounds, p.index_count / 3, false});
        Matrix place = part.place, before = part.before;
        for (Matrix* m : {&place, &before}) (*m)[12] -= eye.x, (*m)[13] -= eye.y, (*m)[14] -= eye.z;
        const Matrix back = model::inverse(place);
        const model::Surface& surface = set.drawable(part).surfaces[p.surface];
        const bool moved = part.first_moved != UINT32_MAX, holes = surface.mask || surface.blend;
        parts_.push_back({row(place, 0), row(place, 1), row(place, 2), row(before, 0), row(before, 1), row(before, 2),
                          row(back, 0), row(back, 1), row(back, 2), at.first_surface + p.surface,
                          (at.first_corner + p.first_index) / 3,
                          moved ? first_moved_vertex_ + part.first_moved - p.first_vertex : at.first_vertex,
                          moved ? first_moved_node_ + part.first_node : at.first_node + p.first_node, p.node_count,
                          // What blends shadows where it covers more than its cutoff, as if it had holes.
                          (surface.double_sided ? kMeshDoubleSided : 0u) | (holes ? kMeshMask : 0u) |
                              (surface.blend ? kMeshBlend : 0u) | (p.closed && !moved && !holes ? kMeshClosed : 0u) |
                              (model::determinant(place) < 0 ? kMeshMirrored : 0u),
                          p.index_count / 3, outline_of[part.mesh], first_clusters_[parts_.size()],
                          moved ? next_moved_box : at.first_boxes[part.primitive], 0, 0});
        if (moved) next_moved_box += clusters_of(p);
        holes_ = holes_ || holes;
        casters_.back().holes = holes;
        if (surface.blend) {
            const auto from_eye = [&](vec3 v) {
                return vec3{float(double(v.x) - eye.x), float(double(v.y) - eye.y), float(double(v.z) - eye.z)};
            };
            blends_.push_back({from_eye(part.bounds.min), from_eye(part.bounds.max)});
        }
        triangles_ += p.index_count / 3;
    }
    std::vector<bool> in_sight;
    for (const MeshSet::Part& part : set.parts) in_sight.push_back(may_be_seen(part.bounds, eye, camera));
    for (size_t i = 0; i < parts_.size(); ++i)
        if (in_sight[i]) triangles_in_sight_ += parts_[i].triangle_count;
    const auto list = [&](uint32_t& count, bool holes, bool both) {
        for (uint32_t i = 0; i < parts_.size(); ++i) {
            if (!in_sight[i] || (parts_[i].flags & kMeshBlend) != 0) continue;  // what blends: mesh_trace.comp
            const bool masked = (parts_[i].flags & kMeshMask) != 0, two = (parts_[i].flags & kMeshDoubleSided) != 0;
            if (masked != holes || (!holes && two != both)) continue;
            for (uint32_t t = 0; t < parts_[i].triangle_count; t += kMeshCluster, ++count) clusters_.push_back({i, t});
        }
    };
    list(one_sided_, false, false);
    list(double_sided_, false, true);
    list(masked_, true, true);
    for (uint32_t n = 0; n < outlined_.size(); ++n) {
        MeshOutline& o = outlined_[n];
        if (boxes[n].empty()) continue;
        const vec3 middle = boxes[n].center();
        o.middle = {float(double(middle.x) - eye.x), float(double(middle.y) - eye.y), float(double(middle.z) - eye.z)};
        o.first_cluster = uint32_t(clusters_.size());
        for (uint32_t i = 0; i < parts_.size(); ++i) {
            if (!in_sight[i] || parts_[i].outline != n + 1) continue;
            for (uint32_t t = 0; t < parts_[i].triangle_count; t += kMeshCluster, ++o.clusters)
                clusters_.push_back({i, t});
        }
    }
    return {};
}

MeshHandles GpuMeshes::import(Graph& g) const {
    MeshHandles out;
    if (empty()) return out;
    // Buffers have a size: where nothing is in sight, one cluster that is not drawn.
    const MeshClusterRef none{};
    out.clusters = g.upload("mesh clusters", clusters_.empty() ? std::span(&none, 1) : std::span(clusters_));
    out.parts = g.upload("mesh parts", std::span(parts_));
    out.corners = g.import("mesh corners", corners_);
    out.vertices = g.import("mesh vertices", vertices_);
    out.surfaces = g.import("mesh surfaces", surfaces_);
    out.nodes = g.import("mesh boxes", nodes_);
    for (size_t page = 0; page < pages_.size(); ++page)
        out.pages[page] = g.import(formatted("mesh textures {}", page), pages_[page]);
    out.one_sided = one_sided_;
    out.double_sided = double_sided_;
    out.masked = masked_;
    out.outlined = outlined_;
    out.boxes = g.import("mesh cluster boxes", boxes_);
    out.seen = g.import("mesh clusters seen", seen_);
    return out;
}

}  // namespace kiln::render
