// SPDX-License-Identifier: MIT
// glTF 2.0 as it is drawn: every node of the default scene, with surfaces, images, skins and animations. Where something cannot be drawn
// without harm to the rest (an image of another kind, a blend of alpha, points and lines) it is left out and a note says so; what is
// broken is one error that names the element.

#include "model/drawable.h"
#include "model/gltf_file.h"
#include "model/triangles.h"

#include "base/format.h"
#include "image/jpeg_file.h"
#include "image/png_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace kiln::model {
namespace {

constexpr float kFarthest = 1e6f;
constexpr size_t kMostNodes = 1 << 20;

// What this reader honours. A file that requires another extension cannot be drawn as it is meant.
constexpr std::string_view kKnownExtensions[] = {"KHR_materials_emissive_strength", "KHR_texture_transform",
                                                 "KHR_mesh_quantization"};

class DrawableReader {
public:
    DrawableReader(const tinygltf::Model& model, const std::string& name) : model_(model), name_(name) {}

    Result<Drawable> run() {
        out_.name = name_;
        for (const std::string& need : model_.extensionsRequired)
            if (std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), need) == std::end(kKnownExtensions))
                return Error{
                    formatted("{}: requires the extension {}, which is not drawn; export it without", name_, need),
                    ErrorKind::Input};
        images();
        if (auto ok = surfaces(); !ok) return ok.error();
        if (auto ok = nodes(); !ok) return ok.error();
        if (auto ok = skins(); !ok) return ok.error();
        if (auto ok = animations(); !ok) return ok.error();
        if (out_.indices.empty())
            return Error{name_ + ": has no triangles; export the model as a triangle mesh", ErrorKind::Input};
        finish(out_);
        if (auto ok = near_enough(); !ok) return ok.error();
        return std::move(out_);
    }

private:
    Error damaged(const std::string& what) const {
        return {formatted("{}: {}; the file is damaged, export it again", name_, what), ErrorKind::Input};
    }

    void images() {
        for (size_t i = 0; i < model_.images.size(); ++i) {
            const tinygltf::Image& in = model_.images[i];
            Image& out = out_.images.emplace_back();
            out.name = formatted("images[{}]", i);
            const auto bytes = std::as_bytes(std::span(in.image));
            const auto left_out = [&](std::string_view why) {
                out_.notes.push_back(formatted("{} of {}: {}; drawn as white", out.name, name_, why));
            };
            constexpr unsigned char kPng[] = {0x89, 'P', 'N', 'G'};
            if (in.image.empty()) {
                left_out("is missing; put it beside the model");
                continue;
            }
            const bool png = in.image.size() >= 4 && std::memcmp(in.image.data(), kPng, 4) == 0;
            if (!png && !image::is_jpeg(bytes)) {
                left_out(formatted("is neither a PNG nor a JPEG image{}; convert it",
                                   in.mimeType.empty() ? "" : formatted(" but {}", in.mimeType)));
                continue;
            }
            auto pixels = png ? image::decode_png(bytes, out.name) : image::decode_jpeg(bytes, out.name);
            if (!pixels) {
                left_out(pixels.error().message);
                continue;
            }
            constexpr int kMostSide = 8192;
            if (pixels->width > kMostSide || pixels->height > kMostSide) {
                left_out(formatted("is {} x {}; at most {} a side", pixels->width, pixels->height, kMostSide));
                continue;
            }
            out.width = pixels->width, out.height = pixels->height;
            out.rgba.resize(size_t(out.width) * size_t(out.height) * 4);
            const int shift = pixels->bits - 8, n = pixels->channels;
            for (size_t p = 0; p < out.rgba.size() / 4; ++p) {
                const uint16_t* v = &pixels->values[p * size_t(n)];
                for (size_t c = 0; c < 3; ++c) out.rgba[4 * p + c] = uint8_t(v[n >= 3 ? c : 0] >> shift);
                out.rgba[4 * p + 3] = n == 2 || n == 4 ? uint8_t(v[n - 1] >> shift) : uint8_t(255);
            }
        }
    }

    // Texture infos come in three types of the same members.
    template <typename Info>
    Result<TextureUse> texture(const Info& info, const std::string& what) {
        TextureUse use;
        if (info.index < 0) return use;
        if (size_t(info.index) >= model_.textures.size())
            return damaged(formatted("{} names texture {} of {}", what, info.index, model_.textures.size()));
        const tinygltf::Texture& t = model_.textures[size_t(info.index)];
        if (t.source >= 0) {
            if (size_t(t.source) >= model_.images.size())
                return damaged(
                    formatted("textures[{}] names image {} of {}", info.index, t.source, model_.images.size()));
            if (out_.images[size_t(t.source)].width > 0) use.image = t.source;
        } else {
            note(formatted("textures[{}] of {}: has no image that is read; drawn as white", info.index, name_));
        }
        if (t.sampler >= 0) {
            if (size_t(t.sampler) >= model_.samplers.size())
                return damaged(
                    formatted("textures[{}] names sampler {} of {}", info.index, t.sampler, model_.samplers.size()));
            const tinygltf::Sampler& s = model_.samplers[size_t(t.sampler)];
            const auto wrap = [](int mode) {
                if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::Clamp;
                return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::Mirror : Wrap::Repeat;
            };
            use.wrap_u = wrap(s.wrapS);
            use.wrap_v = wrap(s.wrapT);
            use.nearest = s.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
        }
        int set = info.texCoord;
        if (const auto ext = info.extensions.find("KHR_texture_transform"); ext != info.extensions.end()) {
            const tinygltf::Value& v = ext->second;
            const auto pair = [&](const char* key, double fallback, double* to) {
                to[0] = to[1] = fallback;
                if (!v.Has(key) || v.Get(key).ArrayLen() != 2) return;
                for (int i = 0; i < 2; ++i) to[i] = v.Get(key).Get(i).GetNumberAsDouble();
            };
            double offset[2], scale[2];
            pair("offset", 0, offset);
            pair("scale", 1, scale);
            const double angle = v.Has("rotation") ? v.Get("rotation").GetNumberAsDouble() : 0;
            if (v.Has("texCoord")) set = v.Get("texCoord").GetNumberAsInt();
            const double c = std::cos(angle), s = std::sin(angle);
            use.map = {float(scale[0] * c), float(-scale[0] * s), float(scale[1] * s),
                       float(scale[1] * c), float(offset[0]),     float(offset[1])};
            for (const float f : use.map)
                if (!(std::fabs(f) <= kFarthest)) return damaged(what + " has a texture transform that is not finite");
        }
        if (set < 0 || set > 1) {
            note(formatted("{} of {}: uses TEXCOORD_{}; two sets are read, the first is used", what, name_, set));
            set = 0;
        }
        use.uv_set = uint8_t(set);
        return use;
    }

    void note(std::string sentence) {
        if (noted_.insert(sentence).second) out_.notes.push_back(std::move(sentence));
    }

    Result<void> surfaces() {
        for (size_t i = 0; i < model_.materials.size(); ++i) {
            const tinygltf::Material& m = model_.materials[i];
            const std::string what = formatted("materials[{}]", i);
            Surface s;
            s.name = m.name;
            const auto number = [&](double v, double low, double high, float* to) {
                if (!(v >= low && v <= high)) return false;
                *to = float(v);
                return true;
            };
            const tinygltf::PbrMetallicRoughness& pbr = m.pbrMetallicRoughness;
            bool good = number(pbr.metallicFactor, 0, 1, &s.metallic) &&
                        number(pbr.roughnessFactor, 0, 1, &s.roughness) &&
                        number(m.normalTexture.scale, -100, 100, &s.normal_scale) &&
                        number(m.occlusionTexture.strength, 0, 1, &s.occlusion_strength) &&
                        number(m.alphaCutoff, 0, 1e6, &s.alpha_cutoff);
            if (pbr.baseColorFactor.size() == 4) {
                float* to[] = {&s.base_color.x, &s.base_color.y, &s.base_color.z, &s.base_color.w};
                for (size_t c = 0; c < 4; ++c) good = good && number(pbr.baseColorFactor[c], 0, 1, to[c]);
            }
            double strength = 1;
            if (const auto ext = m.extensions.find("KHR_materials_emissive_strength"); ext != m.extensions.end())
                if (ext->second.Has("emissiveStrength"))
                    strength = ext->second.Get("emissiveStrength").GetNumberAsDouble();
            if (m.emissiveFactor.size() == 3) {
                float* to[] = {&s.emissive.x, &s.emissive.y, &s.emissive.z};
                for (size_t c = 0; c < 3; ++c) good = good && number(m.emissiveFactor[c] * strength, 0, 1e6, to[c]);
            }
            if (!good) return damaged(what + " has a factor that is out of range or not a number");
            s.mask = m.alphaMode == "MASK";
            s.double_sided = m.doubleSided;
            s.blend = m.alphaMode == "BLEND";
            const auto take = [&](const auto& info, const char* which, TextureUse& to) {
                auto use = texture(info, what + "." + which);
                if (use) to = *use;
                return use ? Result<void>{} : Result<void>(use.error());
            };
            if (auto ok = take(pbr.baseColorTexture, "baseColorTexture", s.base_texture); !ok) return ok;
            if (auto ok = take(pbr.metallicRoughnessTexture, "metallicRoughnessTexture", s.rough_metal_texture); !ok)
                return ok;
            if (auto ok = take(m.normalTexture, "normalTexture", s.normal_texture); !ok) return ok;
            if (auto ok = take(m.occlusionTexture, "occlusionTexture", s.occlusion_texture); !ok) return ok;
            if (auto ok = take(m.emissiveTexture, "emissiveTexture", s.emissive_texture); !ok) return ok;
            out_.surfaces.push_back(std::move(s));
        }
        return {};
    }

    // The surface of primitives that name none: glTF's default.
    uint32_t default_surface() {
        if (default_surface_ == UINT32_MAX) {
            default_surface_ = uint32_t(out_.surfaces.size());
            out_.surfaces.emplace_back();
        }
        return default_surface_;
    }

    struct Floats {
        std::vector<float> values;
        size_t count = 0;
    };
    // Any component type; normalised integers as glTF 2.0 (3.6.2.2) turns them into numbers.
    Result<Floats> floats(int accessor, int components, const std::string& what) {
        if (accessor < 0 || size_t(accessor) >= model_.accessors.size())
            return damaged(formatted("{} names accessor {} of {}", what, accessor, model_.accessors.size()));
        const tinygltf::Accessor& a = model_.accessors[size_t(accessor)];
        const int has = tinygltf::GetNumComponentsInType(uint32_t(a.type));
        const int size = tinygltf::GetComponentSizeInBytes(uint32_t(a.componentType));
        if (has != components || size < 1 || size > 4)
            return damaged(formatted("{}: accessors[{}] holds another type of value", what, accessor));
        auto bytes = accessor_bytes(model_, a, size_t(size * components), name_ + ": " + what);
        if (!bytes) return bytes.error();
        Floats out{std::vector<float>(bytes->count * size_t(components)), bytes->count};
        for (size_t i = 0; i < bytes->count; ++i) {
            for (size_t c = 0; c < size_t(components); ++c) {
                const unsigned char* at = bytes->at + i * bytes->stride + c * size_t(size);
                uint32_t word = 0;
                for (size_t b = size_t(size); b-- > 0;) word = word << 8 | at[b];
                float v = 0;
                switch (a.componentType) {
                case TINYGLTF_COMPONENT_TYPE_FLOAT:
                    std::memcpy(&v, &word, 4);
                    break;
                case TINYGLTF_COMPONENT_TYPE_BYTE:
                    v = float(int8_t(word));
                    if (a.normalized) v = std::max(v / 127, -1.0f);
                    break;
                case TINYGLTF_COMPONENT_TYPE_SHORT:
                    v = float(int16_t(word));
                    if (a.normalized) v = std::max(v / 32767, -1.0f);
                    break;
                case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                    v = float(word);
                    if (a.normalized) v /= 255;
                    break;
                case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                    v = float(word);
                    if (a.normalized) v /= 65535;
                    break;
                default:
                    v = float(word);
                }
                if (!(std::fabs(v) <= kFarthest))
                    return Error{formatted("{}: {}: value {} is {}; numbers must be finite and at most 1000000", name_,
                                           what, i, v),
                                 ErrorKind::Input};
                out.values[i * size_t(components) + c] = v;
            }
        }
        return out;
    }

    Result<std::vector<uint32_t>> corners(const tinygltf::Primitive& p, size_t vertices, const std::string& what) {
        constexpr int kTriangles = 4, kStrip = 5;
        std::vector<uint32_t> order;
        if (p.indices >= 0) {
            if (size_t(p.indices) >= model_.accessors.size())
                return damaged(formatted("{} names accessor {} of {}", what, p.indices, model_.accessors.size()));
            const tinygltf::Accessor& a = model_.accessors[size_t(p.indices)];
            size_t size = 0;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) size = 1;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) size = 2;
            if (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) size = 4;
            if (size == 0 || a.type != TINYGLTF_TYPE_SCALAR) return damaged(what + " has indices of a wrong type");
            const auto bytes = accessor_bytes(model_, a, size, name_ + ": " + what);
            if (!bytes) return bytes.error();
            order.resize(bytes->count);
            for (size_t i = 0; i < order.size(); ++i) {
                const unsigned char* at = bytes->at + i * bytes->stride;
                for (size_t b = size; b-- > 0;) order[i] = order[i] << 8 | at[b];
                if (order[i] >= vertices)
                    return damaged(formatted("{}: index {} is {}, of {} vertices", what, i, order[i], vertices));
            }
        } else {
            order.resize(vertices);
            for (size_t i = 0; i < order.size(); ++i) order[i] = uint32_t(i);
        }
        const int mode = p.mode < 0 ? kTriangles : p.mode;
        if (mode == kTriangles) {
            order.resize(order.size() / 3 * 3);
            return order;
        }
        std::vector<uint32_t> out;
        for (size_t i = 2; i < order.size(); ++i) {
            if (mode == kStrip) {
                const bool even = i % 2 == 0;
                out.insert(out.end(), {order[even ? i - 2 : i - 1], order[even ? i - 1 : i - 2], order[i]});
            } else {
                out.insert(out.end(), {order[0], order[i - 1], order[i]});
            }
        }
        return out;
    }

    // One glTF primitive at the end of the drawable; `mirrored`: its triangles turn the other way.
    Result<void> primitive(const tinygltf::Primitive& p, const std::string& what, bool mirrored, bool skinned) {
        if (p.mode >= 0 && p.mode < 4) {
            note(formatted("{} of {}: points and lines are not drawn", what, name_));
            return {};
        }
        if (p.mode > 6) return damaged(formatted("{} has mode {}", what, p.mode));
        const auto attribute = [&](const char* key) {
            const auto found = p.attributes.find(key);
            return found == p.attributes.end() ? -1 : found->second;
        };
        if (attribute("POSITION") < 0) return {};
        auto positions = floats(attribute("POSITION"), 3, what + ".POSITION");
        if (!positions) return positions.error();
        const size_t count = positions->count;
        if (out_.vertices.size() + count > 3 * kMostTriangles)
            return Error{name_ + ": too many vertices; simplify the model", ErrorKind::Input};
        std::vector<Vertex> vertices(count);
        for (size_t i = 0; i < count; ++i) {
            const float* v = &positions->values[3 * i];
            vertices[i].position = {v[0], v[1], v[2]};
        }
        auto order = corners(p, count, what);
        if (!order) return order.error();
        if (order->empty()) return {};
        if (out_.indices.size() + order->size() > 3 * kMostTriangles)
            return Error{name_ + ": too many triangles; simplify the model", ErrorKind::Input};
        if (mirrored)
            for (size_t t = 0; t + 2 < order->size(); t += 3) std::swap((*order)[t + 1], (*order)[t + 2]);

        const auto optional = [&](const char* key, int components, const auto& put) -> Result<bool> {
            const int accessor = attribute(key);
            if (accessor < 0) return false;
            auto values = floats(accessor, components, what + "." + key);
            if (!values) return values.error();
            if (values->count != count)
                return damaged(formatted("{}.{} has {} values for {} vertices", what, key, values->count, count));
            for (size_t i = 0; i < count; ++i) put(vertices[i], &values->values[i * size_t(components)]);
            return true;
        };
        for (size_t set = 0; set < 2; ++set) {
            const std::string key = formatted("TEXCOORD_{}", set);
            const auto has = optional(key.c_str(), 2, [&](Vertex& v, const float* f) { v.uv[set] = {f[0], f[1]}; });
            if (!has) return has.error();
        }
        const int color = attribute("COLOR_0");
        const bool four = color >= 0 && size_t(color) < model_.accessors.size() &&
                          model_.accessors[size_t(color)].type == TINYGLTF_TYPE_VEC4;
        const auto colored = optional("COLOR_0", four ? 4 : 3, [&](Vertex& v, const float* f) {
            v.color = {std::clamp(f[0], 0.0f, 1.0f), std::clamp(f[1], 0.0f, 1.0f), std::clamp(f[2], 0.0f, 1.0f),
                       four ? std::clamp(f[3], 0.0f, 1.0f) : 1.0f};
        });
        if (!colored) return colored.error();
        const auto normals = optional("NORMAL", 3, [](Vertex& v, const float* f) {
            const float size = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
            if (size > 1e-20f) v.normal = {f[0] / size, f[1] / size, f[2] / size};
        });
        if (!normals) return normals.error();
        const auto tangents = optional("TANGENT", 4, [](Vertex& v, const float* f) {
            const float size = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
            if (size > 1e-20f) v.tangent = {f[0] / size, f[1] / size, f[2] / size, f[3] < 0 ? -1.0f : 1.0f};
        });
        if (!tangents) return tangents.error();

        Primitive out;
        if (p.material >= int(model_.materials.size()))
            return damaged(formatted("{} names material {} of {}", what, p.material, model_.materials.size()));
        out.surface = p.material >= 0 ? uint32_t(p.material) : default_surface();
        std::vector<SkinWeights> weights;
        if (skinned) {
            if (auto ok = skin_weights(attribute("JOINTS_0"), attribute("WEIGHTS_0"), count, what, weights); !ok)
                return ok;
        }
        // Weights follow the vertices that are made anew.
        const auto renumbered = [&](const auto& make) {
            if (weights.empty()) return make(vertices);
            std::vector<Vertex> marked = vertices;
            std::vector<uint32_t> before = *order;
            make(marked);
            std::vector<SkinWeights> moved(marked.size());
            for (size_t i = 0; i < order->size(); ++i) moved[(*order)[i]] = weights[before[i]];
            weights = std::move(moved);
            vertices = std::move(marked);
        };
        if (!*normals) renumbered([&](std::vector<Vertex>& v) { make_flat_normals(v, *order); });
        const TextureUse& bumps = out_.surfaces[out.surface].normal_texture;
        if (bumps.image >= 0 && !(*normals && *tangents))
            renumbered([&](std::vector<Vertex>& v) { make_tangents(v, *order, bumps); });

        out.first_vertex = uint32_t(out_.vertices.size());
        out.vertex_count = uint32_t(vertices.size());
        out.first_index = uint32_t(out_.indices.size());
        out.index_count = uint32_t(order->size());
        for (const uint32_t c : *order) out_.indices.push_back(out.first_vertex + c);
        out_.vertices.insert(out_.vertices.end(), vertices.begin(), vertices.end());
        if (!weights.empty()) {
            out.first_weights = uint32_t(out_.weights.size());
            out_.weights.insert(out_.weights.end(), weights.begin(), weights.end());
        }
        out_.primitives.push_back(out);
        return {};
    }

    Result<void> skin_weights(int joints, int shares, size_t count, const std::string& what,
                              std::vector<SkinWeights>& out) {
        if (joints < 0 || shares < 0) return {};
        auto numbers = floats(joints, 4, what + ".JOINTS_0");
        if (!numbers) return numbers.error();
        auto values = floats(shares, 4, what + ".WEIGHTS_0");
        if (!values) return values.error();
        if (numbers->count != count || values->count != count)
            return damaged(what + " has weights for another number of vertices");
        out.resize(count);
        for (size_t i = 0; i < count; ++i) {
            float sum = 0;
            for (size_t k = 0; k < 4; ++k) {
                const float joint = numbers->values[4 * i + k], share = values->values[4 * i + k];
                if (!(joint >= 0 && joint < 65536) || !(share >= 0))
                    return damaged(formatted("{}: the weights of vertex {} are out of range", what, i));
                out[i].joints[k] = uint16_t(joint);
                out[i].weights[k] = share;
                sum += share;
            }
            for (float& w : out[i].weights) w = sum > 0 ? w / sum : 0;
            if (!(sum > 0)) out[i].weights[0] = 1;
        }
        return {};
    }

    Result<void> nodes() {
        struct Visit {
            int node;
            int32_t parent;
            bool mirrored;
            Matrix place;
        };
        std::vector<Visit> stack;
        const int scene = model_.defaultScene >= 0 ? model_.defaultScene : 0;
        if (!model_.scenes.empty()) {
            if (size_t(scene) >= model_.scenes.size())
                return damaged(formatted("names scene {} of {}", scene, model_.scenes.size()));
            const std::vector<int>& roots = model_.scenes[size_t(scene)].nodes;
            for (auto n = roots.rbegin(); n != roots.rend(); ++n) stack.push_back({*n, -1, false, kIdentity});
        } else {
            std::vector<bool> child(model_.nodes.size(), false);
            for (const auto& node : model_.nodes)
                for (const int c : node.children)
                    if (c >= 0 && size_t(c) < child.size()) child[size_t(c)] = true;
            for (size_t n = child.size(); n-- > 0;)
                if (!child[n]) stack.push_back({int(n), -1, false, kIdentity});
        }
        number_.assign(model_.nodes.size(), -1);
        while (!stack.empty()) {
            const Visit v = stack.back();
            stack.pop_back();
            if (v.node < 0 || size_t(v.node) >= model_.nodes.size())
                return damaged(formatted("names node {} of {}", v.node, model_.nodes.size()));
            const std::string what = formatted("nodes[{}]", v.node);
            if (number_[size_t(v.node)] >= 0)
                return damaged(what + " is reached twice; it contains itself or has two parents");
            const tinygltf::Node& in = model_.nodes[size_t(v.node)];
            if (out_.nodes.size() >= kMostNodes)
                return Error{formatted("{}: more than {} nodes; simplify the model", name_, kMostNodes),
                             ErrorKind::Input};
            const auto number = int32_t(out_.nodes.size());
            number_[size_t(v.node)] = number;
            DrawNode node;
            node.name = in.name;
            node.parent = v.parent;
            const Matrix local = node_matrix(in);
            for (const double e : local)
                if (!(std::fabs(e) <= 1e12)) return damaged(what + " has a place that is not finite");
            if (in.matrix.size() == 16) {
                node.has_matrix = true;
                node.matrix = local;
            }
            if (in.translation.size() == 3)
                std::copy(in.translation.begin(), in.translation.end(), node.translation.begin());
            if (in.rotation.size() == 4) std::copy(in.rotation.begin(), in.rotation.end(), node.rotation.begin());
            if (in.scale.size() == 3) std::copy(in.scale.begin(), in.scale.end(), node.scale.begin());
            const Matrix place = times(v.place, local);
            const bool mirrored = determinant(place) < 0;
            if (in.skin >= 0) {
                if (size_t(in.skin) >= model_.skins.size())
                    return damaged(formatted("{} names skin {} of {}", what, in.skin, model_.skins.size()));
                node.skin = in.skin;
            }
            if (in.mesh >= 0) {
                if (auto ok = mesh(in.mesh, mirrored && in.skin < 0, in.skin >= 0, node); !ok) return ok;
            }
            out_.nodes.push_back(std::move(node));
            for (auto c = in.children.rbegin(); c != in.children.rend(); ++c)
                stack.push_back({*c, number, mirrored, place});
        }
        return {};
    }

    // A mesh that several nodes share is held once, and once more where they mirror it.
    Result<void> mesh(int number, bool mirrored, bool skinned, DrawNode& node) {
        if (size_t(number) >= model_.meshes.size())
            return damaged(formatted("a node names mesh {} of {}", number, model_.meshes.size()));
        const int key = number * 4 + (mirrored ? 1 : 0) + (skinned ? 2 : 0);
        auto known = meshes_.find(key);
        if (known == meshes_.end()) {
            const auto first = uint32_t(out_.primitives.size());
            const tinygltf::Mesh& mesh = model_.meshes[size_t(number)];
            for (size_t p = 0; p < mesh.primitives.size(); ++p)
                if (auto ok = primitive(mesh.primitives[p], formatted("meshes[{}].primitives[{}]", number, p), mirrored,
                                        skinned);
                    !ok)
                    return ok;
            if (!mesh.weights.empty())
                note(formatted("meshes[{}] of {}: morph targets are not drawn; it stays as it is modelled", number,
                               name_));
            known = meshes_.emplace(key, std::pair{first, uint32_t(out_.primitives.size()) - first}).first;
        }
        node.first_primitive = known->second.first;
        node.primitive_count = known->second.second;
        return {};
    }

    Result<void> skins() {
        for (size_t i = 0; i < model_.skins.size(); ++i) {
            const tinygltf::Skin& in = model_.skins[i];
            const std::string what = formatted("skins[{}]", i);
            Skin skin;
            for (const int j : in.joints) {
                if (j < 0 || size_t(j) >= number_.size() || number_[size_t(j)] < 0)
                    return damaged(formatted("{} names node {}, which is not in the scene", what, j));
                skin.joints.push_back(uint32_t(number_[size_t(j)]));
            }
            skin.from_model.assign(skin.joints.size(), kIdentity);
            if (in.inverseBindMatrices >= 0) {
                auto values = floats(in.inverseBindMatrices, 16, what + ".inverseBindMatrices");
                if (!values) return values.error();
                if (values->count < skin.joints.size()) return damaged(what + " has fewer matrices than joints");
                for (size_t j = 0; j < skin.joints.size(); ++j)
                    for (size_t e = 0; e < 16; ++e) skin.from_model[j][e] = double(values->values[16 * j + e]);
            }
            out_.skins.push_back(std::move(skin));
        }
        for (const DrawNode& node : out_.nodes) {
            if (node.skin < 0) continue;
            const size_t joints = out_.skins[size_t(node.skin)].joints.size();
            for (uint32_t i = 0; i < node.primitive_count; ++i) {
                const Primitive& p = out_.primitives[node.first_primitive + i];
                if (p.first_weights == UINT32_MAX) continue;
                for (uint32_t v = 0; v < p.vertex_count; ++v)
                    for (const uint16_t j : out_.weights[p.first_weights + v].joints)
                        if (j >= joints)
                            return damaged(formatted("vertex {} of a mesh names joint {} of {} (skins[{}])", v, j,
                                                     joints, node.skin));
            }
        }
        return {};
    }

    Result<void> animations() {
        for (size_t a = 0; a < model_.animations.size(); ++a) {
            const tinygltf::Animation& in = model_.animations[a];
            for (size_t c = 0; c < in.channels.size(); ++c) {
                const tinygltf::AnimationChannel& channel = in.channels[c];
                const std::string what = formatted("animations[{}].channels[{}]", a, c);
                if (channel.target_node < 0 || channel.target_path == "weights") continue;
                if (size_t(channel.target_node) >= number_.size())
                    return damaged(formatted("{} names node {} of {}", what, channel.target_node, number_.size()));
                if (number_[size_t(channel.target_node)] < 0) continue;
                Channel out;
                out.node = uint32_t(number_[size_t(channel.target_node)]);
                if (channel.target_path == "translation") {
                    out.path = Channel::Path::Translation;
                } else if (channel.target_path == "rotation") {
                    out.path = Channel::Path::Rotation;
                } else if (channel.target_path == "scale") {
                    out.path = Channel::Path::Scale;
                } else {
                    note(formatted("{} of {}: the path \"{}\" is not known; left out", what, name_,
                                   channel.target_path));
                    continue;
                }
                if (channel.sampler < 0 || size_t(channel.sampler) >= in.samplers.size())
                    return damaged(formatted("{} names sampler {} of {}", what, channel.sampler, in.samplers.size()));
                const tinygltf::AnimationSampler& sampler = in.samplers[size_t(channel.sampler)];
                out.kind = sampler.interpolation == "STEP"          ? Channel::Kind::Step
                           : sampler.interpolation == "CUBICSPLINE" ? Channel::Kind::Cubic
                                                                    : Channel::Kind::Linear;
                auto times = floats(sampler.input, 1, what + ".input");
                if (!times) return times.error();
                auto values = floats(sampler.output, out.path == Channel::Path::Rotation ? 4 : 3, what + ".output");
                if (!values) return values.error();
                if (times->count == 0 || values->count != times->count * (out.kind == Channel::Kind::Cubic ? 3 : 1))
                    return damaged(what + " has another number of values than of times");
                if (!std::is_sorted(times->values.begin(), times->values.end()) || times->values.front() < 0)
                    return damaged(what + " has times that do not ascend from 0");
                out.times = std::move(times->values);
                out.values = std::move(values->values);
                out_.duration = std::max(out_.duration, double(out.times.back()));
                out_.channels.push_back(std::move(out));
            }
        }
        return {};
    }

    Result<void> near_enough() const {
        const Box3 box = bounds_of(out_);
        const float far = std::max({std::fabs(box.min.x), std::fabs(box.min.y), std::fabs(box.min.z),
                                    std::fabs(box.max.x), std::fabs(box.max.y), std::fabs(box.max.z)});
        if (!box.empty() && !(far <= kFarthest))
            return Error{formatted("{}: its nodes put it {} m from its origin; at most 1000000", name_, far),
                         ErrorKind::Input};
        return {};
    }

    const tinygltf::Model& model_;
    const std::string& name_;
    Drawable out_;
    std::set<std::string> noted_;
    uint32_t default_surface_ = UINT32_MAX;
    std::vector<int32_t> number_;                          // of nodes, by glTF's
    std::map<int, std::pair<uint32_t, uint32_t>> meshes_;  // primitives
};

}  // namespace

Result<Drawable> parse_gltf_drawable(std::string_view bytes, const std::string& name, const std::string& folder) {
    auto model = load_gltf(bytes, name, folder);
    if (!model) return model.error();
    try {
        return DrawableReader(*model, name).run();
    } catch (const std::bad_alloc&) {
        return Error{name + ": not enough memory for it; simplify the model", ErrorKind::OutOfMemory};
    }
}

}  // namespace kiln::model
