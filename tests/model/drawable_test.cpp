// SPDX-License-Identifier: MIT
#include "model/drawable.h"

#include "feed.h"
#include "glb.h"
#include "image/jpeg_bytes.h"
#include "model/triangles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace kiln::model {
namespace {

using testing::HasSubstr;

Drawable good(const std::string& bytes) {
    auto d = parse_gltf_drawable(bytes, "m.glb", "");
    EXPECT_TRUE(d) << (d ? "" : d.error().message);
    return d ? std::move(*d) : Drawable{};
}
std::string fault(const std::string& bytes) {
    auto d = parse_gltf_drawable(bytes, "m.glb", "");
    EXPECT_FALSE(d);
    if (d) return "";
    EXPECT_EQ(d.error().kind, ErrorKind::Input);
    EXPECT_THAT(d.error().message, testing::StartsWith("m.glb: "));
    EXPECT_EQ(d.error().message.find('\n'), std::string::npos);
    return d.error().message;
}
void expect_near(vec3 a, vec3 b, float by = 1e-6f) {
    EXPECT_NEAR(a.x, b.x, by);
    EXPECT_NEAR(a.y, b.y, by);
    EXPECT_NEAR(a.z, b.z, by);
}

TEST(Drawable, FactorsTexturesAndModesAreAsTheFileHasThem) {
    SquareGlb g;
    g.material = ",\"material\":0";
    g.materials =
        "{\"name\":\"brass\",\"doubleSided\":true,\"alphaMode\":\"MASK\",\"alphaCutoff\":0.25,\"emissiveFactor\":[1,0."
        "5,0],"
        "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":4}},"
        "\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.1,0.2,0.3,0.4],\"metallicFactor\":0.6,\"roughnessFactor\":0."
        "7}}";
    const Drawable d = good(g.whole());
    ASSERT_EQ(d.surfaces.size(), 1u);
    const Surface& s = d.surfaces[0];
    EXPECT_EQ(s.base_color, (vec4{0.1f, 0.2f, 0.3f, 0.4f}));
    EXPECT_EQ(s.emissive, (vec3{4, 2, 0}));
    EXPECT_EQ(s.metallic, 0.6f);
    EXPECT_EQ(s.roughness, 0.7f);
    EXPECT_EQ(s.alpha_cutoff, 0.25f);
    EXPECT_TRUE(s.mask && s.double_sided);
    EXPECT_EQ(d.triangle_count(), 2u);
    for (const Vertex& v : d.vertices) expect_near(v.normal, {0, 0, 1});  // flat, as glTF asks where there are none
}

TEST(Drawable, NodesPlaceWhatTheyHoldAndMirrorsTurnTriangles) {
    SquareGlb g;
    g.nodes =
        "{\"translation\":[1,2,3],\"scale\":[2,2,2],\"children\":[1]},{\"mesh\":0,\"scale\":[-1,1,1],\"rotation\":[0,0,"
        "0.70710678,0.70710678]}";
    const Drawable d = good(g.whole());
    const std::vector<Matrix> places = pose(d, 0);
    ASSERT_EQ(places.size(), 2u);
    const dvec3 p = transform_point(places[1], {1, 0, 0});  // mirrored to -x, turned to -y, doubled, moved
    EXPECT_NEAR(p.x, 1, 1e-6);
    EXPECT_NEAR(p.y, 0, 1e-6);
    EXPECT_NEAR(p.z, 3, 1e-6);
    // Seen in the world every triangle still faces +z.
    for (size_t t = 0; t < d.indices.size(); t += 3) {
        dvec3 q[3];
        for (size_t c = 0; c < 3; ++c) {
            const vec3 v = d.vertices[d.indices[t + c]].position;
            q[c] = transform_point(places[1], {v.x, v.y, v.z});
        }
        EXPECT_GT((q[1].x - q[0].x) * (q[2].y - q[0].y) - (q[1].y - q[0].y) * (q[2].x - q[0].x), 0);
    }
}

TEST(Drawable, TangentsFollowTheTextureAndItsMirrorImage) {
    for (const bool mirrored : {false, true}) {
        // Upright: u to the right, v down.
        const float a = mirrored ? 1.0f : 0.0f, b = 1 - a;
        std::vector<Vertex> vertices(4);
        const float corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, at[4][2] = {{a, 1}, {b, 1}, {b, 0}, {a, 0}};
        for (size_t i = 0; i < 4; ++i) {
            vertices[i].position = {corner[i][0], corner[i][1], 0};
            vertices[i].normal = {0, 0, 1};
            vertices[i].uv[0] = {at[i][0], at[i][1]};
        }
        std::vector<uint32_t> order{0, 1, 2, 0, 2, 3};
        make_tangents(vertices, order, {});
        for (const Vertex& v : vertices) {
            expect_near({v.tangent.x, v.tangent.y, v.tangent.z}, {mirrored ? -1.0f : 1.0f, 0, 0});
            const vec3 bitangent = cross(v.normal, {v.tangent.x, v.tangent.y, v.tangent.z}) * v.tangent.w;
            expect_near(bitangent, {0, 1, 0});  // up, where the picture is
        }
    }
}

TEST(Drawable, AVertexBetweenATextureAndItsMirrorImageIsParted) {
    // Two triangles share an edge; u runs away from it on both sides.
    std::vector<Vertex> v(4);
    const float p[4][3] = {{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}};
    for (size_t i = 0; i < 4; ++i) {
        v[i].position = {p[i][0], p[i][1], p[i][2]};
        v[i].normal = {0, 0, 1};
        v[i].uv[0] = {std::fabs(p[i][0]), 1 - p[i][1]};
    }
    std::vector<uint32_t> c{0, 1, 2, 0, 3, 1};
    make_tangents(v, c, {});
    EXPECT_EQ(v.size(), 6u);
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(v[c[i]].tangent.x, -1, 1e-6f) << i;
    for (size_t i = 3; i < 6; ++i) EXPECT_NEAR(v[c[i]].tangent.x, 1, 1e-6f) << i;
}

TEST(Drawable, EdgesSharperThanTheAngleStaySharp) {
    Triangles cube;
    for (int i = 0; i < 8; ++i) cube.positions.push_back({float(i & 1), float(i >> 1 & 1), float(i >> 2 & 1)});
    const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) cube.faces.insert(cube.faces.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
    const Drawable d = drawable_of(cube, "cube");
    EXPECT_EQ(d.vertices.size(), 24u);  // a normal a face at every corner
    for (size_t t = 0; t < d.indices.size(); t += 3) {
        const Vertex &a = d.vertices[d.indices[t]], &b = d.vertices[d.indices[t + 1]],
                     &c = d.vertices[d.indices[t + 2]];
        const vec3 n = normalize(cross(b.position - a.position, c.position - a.position));
        for (const Vertex* v : {&a, &b, &c}) expect_near(v->normal, n, 1e-5f);
    }
}

TEST(Drawable, AnimationsGiveTheFormulasValues) {
    SquareGlb g;
    const int times = g.floats({0, 1, 3}, "SCALAR", 1);
    const int moves = g.floats({0, 0, 0, 2, 0, 0, 2, 4, 0}, "VEC3", 3);
    const float h = std::sqrt(0.5f);
    const int turns = g.floats({0, 0, 0, 1, 0, 0, h, h, 0, 0, h, h}, "VEC4", 4);
    g.rest = ",\"animations\":[{\"samplers\":[{\"input\":" + std::to_string(times) +
             ",\"output\":" + std::to_string(moves) + "},{\"input\":" + std::to_string(times) +
             ",\"output\":" + std::to_string(turns) +
             "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"translation\"}},{\"sampler\":1,"
             "\"target\":{\"node\":"
             "0,\"path\":\"rotation\"}}]}]";
    const Drawable d = good(g.whole());
    EXPECT_EQ(d.duration, 3);
    const auto at = [&](double t) { return transform_point(pose(d, t)[0], {0, 0, 0}); };
    EXPECT_NEAR(at(0.5).x, 1, 1e-9);
    EXPECT_NEAR(at(2).y, 2, 1e-9);
    EXPECT_NEAR(at(3.5).x, 1, 1e-6) << "it plays again";
    // Half of a quarter turn, halfway.
    const dvec3 x = transform_vector(pose(d, 0.5)[0], {1, 0, 0});
    EXPECT_NEAR(std::atan2(x.y, x.x), std::numbers::pi / 4, 1e-6);
}

// A tree finds what a look at every box finds, and refitting changes no answer.
TEST(Bvh, WalkingItMeetsEveryBoxThatHoldsThePoint) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> in(-1, 1);
    for (const size_t count : {size_t(1), size_t(2), size_t(5), size_t(300)}) {
        std::vector<Box3> boxes(count);
        for (Box3& b : boxes) {
            const vec3 c{in(random), in(random), in(random)};
            const float r = 0.05f + 0.2f * std::fabs(in(random));
            b = {c - vec3{r, r, r}, c + vec3{r, r, r}};
        }
        if (count == 5)
            for (Box3& b : boxes) b = boxes[0];  // all in one place
        std::vector<uint32_t> order;
        std::vector<BvhNode> nodes = build_bvh(boxes, order);
        std::vector<Box3> ordered;
        for (const uint32_t i : order) ordered.push_back(boxes[i]);
        for (int refitted = 0; refitted < 2; ++refitted) {
            for (int n = 0; n < 200; ++n) {
                const vec3 p{in(random), in(random), in(random)};
                std::vector<uint32_t> found, all;
                for (uint32_t i = 0; i < nodes.size();) {
                    if (!Box3{nodes[i].min, nodes[i].max}.contains(p)) {
                        i = nodes[i].skip;
                        continue;
                    }
                    for (uint32_t k = 0; k < (nodes[i].leaf & 7u); ++k)
                        if (ordered[(nodes[i].leaf >> 3) + k].contains(p))
                            found.push_back(order[(nodes[i].leaf >> 3) + k]);
                    ++i;
                }
                for (uint32_t i = 0; i < count; ++i)
                    if (boxes[i].contains(p)) all.push_back(i);
                std::sort(found.begin(), found.end());
                EXPECT_EQ(found, all);
            }
            refit_bvh(nodes, ordered);
        }
    }
}

TEST(Drawable, EveryBrokenReferenceIsOneErrorThatNamesTheElement) {
    const auto with = [](auto change) {
        SquareGlb g;
        change(g);
        return fault(g.whole());
    };
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":0,\"children\":[1]},{\"children\":[0]}"; }),
                HasSubstr("nodes[0] is reached twice"));
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":0,\"children\":[7]}"; }), HasSubstr("names node 7 of 1"));
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":3}"; }), HasSubstr("mesh 3 of 1"));
    EXPECT_THAT(with([](SquareGlb& g) { g.material = ",\"material\":2"; }),
                HasSubstr("meshes[0].primitives[0] names material 2 of 0"));
    EXPECT_THAT(with([](SquareGlb& g) { g.attributes = "\"POSITION\":0,\"NORMAL\":9"; }),
                HasSubstr("NORMAL names accessor 9 of 2"));
    EXPECT_THAT(with([](SquareGlb& g) { g.attributes = "\"POSITION\":1"; }),
                HasSubstr("POSITION: accessors[1] holds another type"));
    EXPECT_THAT(with([](SquareGlb& g) {
                    g.attributes += ",\"TEXCOORD_0\":" + std::to_string(g.floats({0, 0}, "VEC2", 2));
                }),
                HasSubstr("TEXCOORD_0 has 1 values for 4 vertices"));
    EXPECT_THAT(with([](SquareGlb& g) {
                    const uint16_t far[] = {0, 1, 99};
                    std::memcpy(g.bin.data() + 48, far, sizeof far);
                }),
                HasSubstr("index 2 is 99, of 4 vertices"));
    EXPECT_THAT(with([](SquareGlb& g) {
                    const float nan = NAN;
                    std::memcpy(g.bin.data() + 4, &nan, 4);
                }),
                HasSubstr("meshes[0].primitives[0].POSITION: value 0 is nan"));
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":0,\"translation\":[0,1e9,0]}"; }),
                HasSubstr("from its origin"));
    EXPECT_THAT(with([](SquareGlb& g) { g.rest = ",\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]"; }),
                HasSubstr("requires the extension KHR_draco_mesh_compression"));
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":0,\"skin\":4}"; }),
                HasSubstr("nodes[0] names skin 4 of 0"));
    EXPECT_THAT(with([](SquareGlb& g) {
                    g.material = ",\"material\":0";
                    g.materials = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":5}}}";
                }),
                HasSubstr("materials[0].baseColorTexture names texture 5 of 0"));
}

// Most of the elements as a view has them, or zeros, and a list of others.
TEST(Drawable, SparseAccessorsAreReadAndWhatIsWrongWithThemIsOneError) {
    struct Sparse : SquareGlb {
        std::vector<uint16_t> numbers{2};
        std::vector<float> values{2, 3, 4};
        std::string type = "5123", count = "4", base = "\"bufferView\":0,", listed = "1";
        int moved = 0;  // of the views
        std::string made() {
            const int first = add_bytes(std::as_bytes(std::span(numbers))),
                      second = add_bytes(std::as_bytes(std::span(values)));
            accessors += ",{" + base + "\"componentType\":5126,\"count\":" + count +
                         ",\"type\":\"VEC3\",\"sparse\":{\"count\":" + listed +
                         ",\"indices\":{\"bufferView\":" + std::to_string(first + moved) +
                         ",\"componentType\":" + type +
                         "},\"values\":{\"bufferView\":" + std::to_string(second + moved) + "}}}";
            attributes = "\"POSITION\":2";
            return whole();
        }
    };
    // Without normals each triangle has corners of its own: 0 1 2, 0 2 3.
    const auto corners = [](const Drawable& d) {
        std::vector<vec3> out;
        for (const auto& v : d.vertices) out.push_back(v.position);
        return out;
    };
    EXPECT_THAT(corners(good(Sparse().made())), testing::ElementsAre(vec3{0, 0, 0}, vec3{1, 0, 0}, vec3{2, 3, 4},
                                                                     vec3{0, 0, 0}, vec3{2, 3, 4}, vec3{0, 1, 0}));
    Sparse zeros;
    zeros.base.clear();
    zeros.numbers = {1, 2, 3}, zeros.values = {5, 0, 0, 5, 6, 0, 0, 6, 0}, zeros.listed = "3";
    EXPECT_THAT(corners(good(zeros.made())), testing::ElementsAre(vec3{0, 0, 0}, vec3{5, 0, 0}, vec3{5, 6, 0},
                                                                  vec3{0, 0, 0}, vec3{5, 6, 0}, vec3{0, 6, 0}));
    const auto with = [](auto change) {
        Sparse g;
        change(g);
        return fault(g.made());
    };
    EXPECT_THAT(with([](Sparse& g) { g.numbers = {4}; }),
                HasSubstr("POSITION: refers to element 4 of a sparse accessor of 4"));
    EXPECT_THAT(with([](Sparse& g) { g.type = "5126"; }), HasSubstr("elements by numbers of a wrong type"));
    EXPECT_THAT(with([](Sparse& g) { g.moved = 1; }), HasSubstr("a buffer view that does not exist"));
    EXPECT_THAT(with([](Sparse& g) { g.listed = "999"; }), HasSubstr("bytes outside its buffer"));
    EXPECT_THAT(with([](Sparse& g) { g.base.clear(), g.count = "4000000000"; }), HasSubstr("more than 256 MiB"));
    EXPECT_THAT(with([](Sparse& g) { g.count = "9"; }), HasSubstr("bytes outside its buffer"));
}

// Sizes that no file holds, bytes that are not there, numbers that are none.
TEST(Drawable, AbsurdSizesAndMissingBuffersAreOneErrorThatNamesTheElement) {
    const auto with = [](auto change) {
        SquareGlb g;
        change(g);
        return fault(g.whole());
    };
    const auto swap = [](std::string& text, const std::string& from, const std::string& to) {
        const size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
    };
    for (const char* count : {"99", "4294967295", "4000000000000000000"})
        EXPECT_THAT(with([&](SquareGlb& g) { swap(g.accessors, "\"count\":4", std::string("\"count\":") + count); }),
                    HasSubstr("meshes[0].primitives[0].POSITION: refers to bytes outside its buffer"))
            << count;
    // A view that claims more than there is harms nobody who reads less.
    SquareGlb claims;
    swap(claims.views, "\"byteLength\":48", "\"byteLength\":4000000000");
    EXPECT_THAT(good(claims.whole()).notes, testing::IsEmpty());
    EXPECT_THAT(with([&](SquareGlb& g) { swap(g.views, "\"buffer\":0", "\"buffer\":3"); }),
                HasSubstr("meshes[0].primitives[0].POSITION: refers to a buffer that does not exist"));
    EXPECT_THAT(
        with([](SquareGlb& g) { g.rest = ",\"skins\":[{\"joints\":[9]}]", g.nodes = "{\"mesh\":0,\"skin\":0}"; }),
        HasSubstr("skins[0]"));
    EXPECT_THAT(with([](SquareGlb& g) {
                    const int times = g.floats({0, 1}, "SCALAR", 1), moves = g.floats({0, 0, 0, 2, 0, 0}, "VEC3", 3);
                    g.rest = ",\"animations\":[{\"samplers\":[{\"input\":" + std::to_string(times) +
                             ",\"output\":" + std::to_string(moves) +
                             "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":9,\"path\":\"translation\"}}]}]";
                }),
                HasSubstr("animations[0]"));
    EXPECT_THAT(with([](SquareGlb& g) { g.nodes = "{\"mesh\":0,\"scale\":[1e300,1,1]}"; }), HasSubstr("nodes[0]"));
    const std::string gone =
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":48,\"uri\":\"gone.bin\"}],\"bufferViews\":[{"
        "\"buffer\":0,"
        "\"byteLength\":48}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{\"mesh\":0}],\"scenes\":[{"
        "\"nodes\":[0]}]}";
    EXPECT_THAT(fault(gone), HasSubstr("gone.bin"));
    // A picture larger than any: a note, and the rest is drawn.
    SquareGlb g;
    const unsigned char png[] = {0x89, 'P',  'N',  'G',  13,   10,   26,   10, 0, 0, 0, 13, 'I', 'H', 'D', 'R', 0x7f,
                                 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 8,  6, 0, 0, 0,  0,   0,   0,   0};
    const int view = g.add_bytes(std::as_bytes(std::span(png)));
    g.material = ",\"material\":0";
    g.materials = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}";
    g.rest = ",\"textures\":[{\"source\":0}],\"images\":[{\"mimeType\":\"image/png\",\"bufferView\":" +
             std::to_string(view) + "}]";
    const Drawable d = good(g.whole());
    ASSERT_EQ(d.notes.size(), 1u);
    EXPECT_THAT(d.notes[0], HasSubstr("images[0]"));
    EXPECT_EQ(d.surfaces[0].base_texture.image, -1);
}

TEST(Drawable, AnImageOfAnotherKindIsANoteAndTheRestIsDrawn) {
    SquareGlb g;
    const std::string webp = "RIFF....WEBP";
    const int view = g.add_bytes(std::as_bytes(std::span(webp)));
    g.material = ",\"material\":0";
    g.materials = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}";
    g.rest = ",\"textures\":[{\"source\":0}],\"images\":[{\"mimeType\":\"image/webp\",\"bufferView\":" +
             std::to_string(view) + "}]";
    const Drawable d = good(g.whole());
    ASSERT_EQ(d.notes.size(), 1u);
    EXPECT_THAT(d.notes[0], HasSubstr("images[0] of m.glb: is neither a PNG nor a JPEG image but image/webp"));
    EXPECT_EQ(d.surfaces[0].base_texture.image, -1);
}

TEST(Drawable, AnImageThatReachesBeyondItsBufferIsRefused) {
    SquareGlb g;
    const int view = g.add_bytes(std::as_bytes(std::span("RIFF....WEBP")));
    g.rest = ",\"images\":[{\"mimeType\":\"image/webp\",\"bufferView\":" + std::to_string(view) + "}]";
    const std::string placed = g.views.substr(0, g.views.rfind("\"byteOffset\""));
    for (const char* where : {"\"byteOffset\":0,\"byteLength\":99999}", "\"byteOffset\":8,\"byteLength\":2147483600}",
                              "\"byteOffset\":99999,\"byteLength\":1}"}) {
        g.views = placed + where;
        EXPECT_THAT(fault(g.whole()), HasSubstr("images[0] reaches beyond its buffer")) << where;
    }
}

TEST(Drawable, AJpegIsATextureAndABrokenOneANote) {
    const auto drawn = [](std::span<const std::byte> jpeg) {
        SquareGlb g;
        const int view = g.add_bytes(jpeg);
        g.material = ",\"material\":0";
        g.materials = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}";
        g.rest = ",\"textures\":[{\"source\":0}],\"images\":[{\"mimeType\":\"image/jpeg\",\"bufferView\":" +
                 std::to_string(view) + "}]";
        return good(g.whole());
    };
    const std::vector<std::byte> jpeg = image::jpeg_bytes(16, 8, 3, true);
    const Drawable whole = drawn(jpeg), broken = drawn(std::span(jpeg).first(jpeg.size() / 2));
    EXPECT_THAT(whole.notes, testing::IsEmpty());
    ASSERT_EQ(whole.surfaces[0].base_texture.image, 0);
    ASSERT_EQ(whole.images[0].width, 16);
    ASSERT_EQ(whole.images[0].height, 8);
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(int(whole.images[0].rgba[4 * (3 * 16 + 5) + c]), int(image::jpeg_value(5, 3, int(c))), 12);
    EXPECT_EQ(whole.images[0].rgba[3], 255);
    ASSERT_EQ(broken.notes.size(), 1u);
    EXPECT_THAT(broken.notes[0], HasSubstr("broken JPEG"));
    EXPECT_EQ(broken.surfaces[0].base_texture.image, -1);
}

// Mutated files: a drawable whose numbers are all in range, or one error. Never a crash.
TEST(Drawable, AnyBytesAreADrawableOrAnError) {
    SquareGlb g;
    const int uv = g.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2), times = g.floats({0, 1}, "SCALAR", 1),
              moves = g.floats({0, 0, 0, 2, 0, 0}, "VEC3", 3);
    const std::vector<uint16_t> joints(16, 0);
    const int j = g.add(std::span(joints), 5123, "VEC4", 4);
    const int w = g.floats(std::vector<float>(16, 0.25f), "VEC4", 4);
    g.attributes += ",\"TEXCOORD_0\":" + std::to_string(uv) + ",\"JOINTS_0\":" + std::to_string(j) +
                    ",\"WEIGHTS_0\":" + std::to_string(w);
    g.material = ",\"material\":0";
    g.materials = "{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"metallicFactor\":0.5}}";
    g.nodes = "{\"mesh\":0,\"skin\":0,\"children\":[1]},{\"translation\":[0,0,1]}";
    g.rest = ",\"skins\":[{\"joints\":[1]}],\"animations\":[{\"samplers\":[{\"input\":" + std::to_string(times) +
             ",\"output\":" + std::to_string(moves) +
             "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":1,\"path\":\"translation\"}}]}]";
    const std::string seed = g.whole();
    ASSERT_EQ(good(seed).weights.size(), 6u);
    std::mt19937 random(3);
    int read = 0, refused = 0;
    for (int n = 0; n < 4000; ++n) {
        std::string bytes = seed;
        const int changes = 1 + int(random() % 3);
        for (int k = 0; k < changes; ++k) {
            const size_t at = random() % bytes.size();
            switch (random() % 4) {
            case 0:
                bytes[at] = char(random());
                break;
            case 1:
                bytes[at] = char('0' + random() % 10);
                break;
            case 2:
                bytes.resize(at + 1);
                break;
            default:
                bytes[at] ^= char(1 << random() % 8);
            }
        }
        const auto d = parse_gltf_drawable(bytes, "f.glb", "/nowhere/");
        ++(d ? read : refused);
        ASSERT_EQ(drawable_complaint(d, "f.glb"), "");
    }
    EXPECT_GT(read, 200);
    EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace kiln::model
