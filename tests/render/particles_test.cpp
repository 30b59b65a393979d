// SPDX-License-Identifier: MIT
// Particles: each pixel against all of them, one after another; bins that lose none; orders that change nothing.
#include "drawables.h"
#include "field/brick_set.h"
#include "gpu_worlds.h"
#include "render/lib/pack.h"
#include "render/particle_bins.h"

#include <cmath>
#include <cstring>
#include <random>

namespace kiln::render {
namespace {

using field::worlds::edit;

constexpr int kDustWidth = 96, kDustHeight = 72;

std::vector<Particle> cloud(int count, uint32_t seed, float most_radius) {
    std::mt19937 random(seed);
    const auto in = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    std::vector<Particle> out;
    for (int i = 0; i < count; ++i) {
        Particle& p = out.emplace_back();
        p.position = p.before = {in(-2, 2), in(-1.5f, 1.5f), in(-3, 3)};
        p.radius = in(0.02f, most_radius);
        p.color = {in(0, 1), in(0, 1), in(0, 1)};
        p.opacity = in(0.1f, 0.9f);
        p.emissive = {in(0, 0.5f), in(0, 0.5f), in(0, 0.5f)};
    }
    return out;
}

struct ParticlesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
        field::worlds::World world{
            "ball", {edit(Sphere{0.5f})}, {.voxel_size = 0.05f, .bounds = {{-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.7f}}}};
        frame.field = world.field();
        frame.materials.resize(2);
        frame.environment = Environment{.color = {0.5f, 0.4f, 0.3f}};
        frame.lights = {Light{.illuminance = 2},
                        Light{.kind = Light::Kind::Point, .position = {1, 2, 1}, .intensity = 3}};
        frame.camera.position = {0.3f, 0.2f, 4};
        frame.camera.tone_map = ToneMap::None;
    }
    Picture picture() { return rhi::must(renderer->render(frame, {.width = kDustWidth, .height = kDustHeight})); }
    std::unique_ptr<Renderer> renderer;
    Frame frame;
};

// How far from the ray towards the sun the world's origin is; far away where that ray begins past it.
float from_axis(const Light& sun, vec3 p) {
    const vec3 l = normalize(sun.direction) * -1.0f;
    const float along = -dot(p, l);
    return along < 0 ? 1e9f : length(p + l * along);
}

// What the kernel claims, without bins, in double precision.
vec3 over(const Frame& frame, const Picture& bare, int x, int y) {
    const size_t at = size_t(y * kDustWidth + x);
    const shade::CameraParams eye = shade::camera_params(frame.camera, kDustWidth, kDustHeight);
    const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f);
    std::vector<std::pair<double, const Particle*>> order;
    for (const Particle& p : frame.particles) {
        const vec3 m = p.position - frame.camera.position;
        order.push_back({double(dot(m, m)), &p});
    }
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    double left = 1, sum[3] = {};
    for (const auto& [distance, p] : order) {
        const vec3 m = p->position - frame.camera.position;
        const double along = double(dot(m, d)), r = double(p->radius);
        const double inside = 1 - (double(dot(m, m)) - along * along) / (r * r);
        if (inside <= 0 || along + r < 0) continue;
        const double half_way = r * std::sqrt(inside);
        const double seen = std::clamp((double(bare.depth[at]) - along + half_way) / (2 * half_way), 0.0, 1.0);
        const double covers = double(p->opacity) * inside * inside * seen;
        vec3 light = frame.environment->color;
        for (const Light& l : frame.lights) {
            if (l.kind == Light::Kind::Directional && from_axis(l, p->position) < 0.5f) continue;  // behind the ball
            light =
                light + shade::sample_light(shade::light_record(l), p->position).illuminance * (0.25f / 3.14159265f);
        }
        const vec3 c = p->color * light + p->emissive;
        const double color[3] = {c.x, c.y, c.z};
        for (size_t k = 0; k < 3; ++k) sum[k] += left * covers * color[k];
        left *= 1 - covers;
    }
    const float* c = &bare.rgba[at * 4];
    return {float(sum[0] + left * double(c[0])), float(sum[1] + left * double(c[1])),
            float(sum[2] + left * double(c[2]))};
}

TEST_F(ParticlesGpu, CoverWhatIsBehindThemFromNearToFar) {
    const Picture bare = picture();
    frame.particles = cloud(150, 3, 0.8f);
    // None whose middle sees a part of the sun, or is as near to the ball as rays begin off it.
    const Light sun = frame.lights[0];
    std::erase_if(frame.particles, [&](const Particle& q) {
        return std::fabs(from_axis(sun, q.position) - 0.5f) < 0.08f || std::fabs(length(q.position) - 0.5f) < 0.1f;
    });
    int dark = 0;
    for (const Particle& q : frame.particles) dark += from_axis(sun, q.position) < 0.5f;
    EXPECT_GT(dark, 1);
    const Picture p = picture();
    double worst = 0, changed = 0;
    for (int y = 0; y < kDustHeight; ++y) {
        for (int x = 0; x < kDustWidth; ++x) {
            const vec3 wanted = over(frame, bare, x, y);
            const float* got = &p.rgba[size_t(y * kDustWidth + x) * 4];
            const double off = std::max({std::fabs(double(got[0] - wanted.x)), std::fabs(double(got[1] - wanted.y)),
                                         std::fabs(double(got[2] - wanted.z))});
            worst = std::max(worst, off);
            changed += std::fabs(double(got[0] - bare.rgba[size_t(y * kDustWidth + x) * 4])) > 0.01;
        }
    }
    EXPECT_LT(worst, 0.004);  // what is left of light is not followed below a thousandth
    EXPECT_GT(changed, 0.5 * kDustWidth * kDustHeight);
}

// Of the first sun: by the field, by instances, by meshes with rays and with maps.
TEST_F(ParticlesGpu, LieInTheShadowOfWhatIsSolid) {
    frame.camera.position = {0, 0.5f, 6};
    frame.lights = {Light{.direction = {0, -1, 0}, .illuminance = 3}};
    frame.environment = Environment{.color = {0, 0, 0}};
    const auto puff = [&](vec3 at) {
        Particle p;
        p.position = p.before = at;
        p.radius = 0.2f;
        p.opacity = 1;
        return p;
    };
    // Beside the ball, and under it.
    frame.particles = {puff({-1.2f, -1, 0}), puff({0, -1, 0})};
    const auto brightness = [&](const Picture& p, vec3 at) {
        const shade::CameraParams eye = shade::camera_params(frame.camera, kDustWidth, kDustHeight);
        const vec2 px = shade::camera_pixel(eye, at - frame.camera.position);
        return p.rgba[size_t(int(px.y) * kDustWidth + int(px.x)) * 4];
    };
    const Picture by_field = picture();
    EXPECT_GT(brightness(by_field, {-1.2f, -1, 0}), 0.1f);
    EXPECT_LT(brightness(by_field, {0, -1, 0}), 0.001f);
    frame.meshes = {meshes::at(meshes::sphere(0.4f, 20, meshes::matte({0.5f, 0.5f, 0.5f})), {-1.2f, 0.2f, 0})};
    for (const MeshShadows shadows : {MeshShadows::Rays, MeshShadows::Cascades}) {
        const Picture p =
            rhi::must(renderer->render(frame, {.width = kDustWidth, .height = kDustHeight, .mesh_shadows = shadows}));
        EXPECT_LT(brightness(p, {-1.2f, -1, 0}), 0.001f) << int(shadows);
    }
    frame.meshes.clear();
    Instance instance;
    instance.bricks = rhi::must(field::BrickSet::make(field::worlds::compiled({edit(Sphere{0.4f})}), 0.05f));
    instance.pose.position = instance.before.position = {-1.2f, 0.2f, 0};
    frame.instances = {instance};
    EXPECT_LT(brightness(picture(), {-1.2f, -1, 0}), 0.001f);
}

TEST_F(ParticlesGpu, TheirOrderInTheListChangesNoByte) {
    frame.particles = cloud(200, 5, 0.3f);
    // Some as far from the eye as others, and some the same.
    for (size_t i = 0; i < 50; ++i) {
        Particle twin = frame.particles[i];
        if (i % 2 == 0) twin.color = {1, 0, 0};
        frame.particles.push_back(twin);
    }
    const Picture first = picture();
    std::mt19937 random(11);
    for (int round = 0; round < 3; ++round) {
        std::shuffle(frame.particles.begin(), frame.particles.end(), random);
        const Picture again = picture();
        EXPECT_EQ(std::memcmp(first.rgba.data(), again.rgba.data(), first.rgba.size() * sizeof(float)), 0);
    }
}

TEST_F(ParticlesGpu, BehindClearGlassAreSeenThroughIt) {
    frame.particles = {Particle{.position = {0.2f, 0.9f, -1},
                                .before = {},
                                .radius = 0.5f,
                                .color = {0, 0, 0},
                                .opacity = 1,
                                .emissive = {2, 0, 0}}};
    const Picture open = picture();
    auto set = rhi::must(field::BrickSet::make(field::worlds::compiled({edit(Box{{1.5f, 1.5f, 0.05f}})}), 0.03f));
    frame.materials[1] = {.roughness = 0, .opacity = 1e-6f, .ior = 1.0f, .attenuation_color = {0.25f, 1, 1}};
    frame.materials[1].attenuation_distance = 0.1f;
    Instance glass{.bricks = set, .pose = {{0, 0, 1}, {}}, .before = {{0, 0, 1}, {}}, .material = 1, .glass = 1};
    frame.instances = {glass};
    const Picture behind = picture();
    frame.instances[0].pose.position.z = frame.instances[0].before.position.z = -2;
    const Picture before = picture();
    const vec2 at = shade::camera_pixel(shade::camera_params(frame.camera, kDustWidth, kDustHeight),
                                        frame.particles[0].position - frame.camera.position);
    const size_t pixel = (size_t(at.y) * kDustWidth + size_t(at.x)) * 4;
    EXPECT_NEAR(open.rgba[pixel], 2.0f, 0.05f);
    EXPECT_NEAR(before.rgba[pixel], 2.0f, 0.05f);
    EXPECT_NEAR(behind.rgba[pixel], 0.5f, 0.03f);
}

TEST(Particles, AreInEveryBinThatShowsThem) {
    std::mt19937 random(23);
    const auto in = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    size_t seen = 0, most = 0;
    for (int round = 0; round < 40; ++round) {
        const Camera camera{.position = {in(-3, 3), in(-3, 3), in(-3, 3)}, .target = {0.1f, 0.2f, 0.3f}};
        const shade::CameraParams eye = shade::camera_params(camera, 800, 600);
        std::vector<Particle> particles = cloud(60, uint32_t(round), round % 3 == 0 ? 3.0f : 0.2f);
        const int left = 100, top = 50, width = 500, height = 400;
        const ParticleBins bins = particle_bins(particles, eye, left, top, width, height);
        most = std::max(most, bins.numbers.size());
        for (uint32_t i = 0; i < bins.records.size(); ++i) {
            const ParticleRecord &r = bins.records[i], &nearer = bins.records[i > 0 ? i - 1 : 0];
            EXPECT_LE(std::hypot(nearer.x, nearer.y, nearer.z), std::hypot(r.x, r.y, r.z) * 1.000001f);
        }
        for (int k = 0; k < 400; ++k) {
            const int x = int(in(0, width)), y = int(in(0, height));
            const vec3 d = shade::camera_direction_at(eye, float(x + left) + 0.5f, float(y + top) + 0.5f);
            std::vector<char> listed(bins.records.size());
            for (size_t level = 0; level < size_t(kParticleLevels); ++level) {
                const uint32_t side = uint32_t(kParticleBin) << (2 * level);
                const uint32_t bin =
                    bins.first_level[level] + uint32_t(y) / side * bins.across[level] + uint32_t(x) / side;
                for (uint32_t n = bin == 0 ? 0 : bins.ends[bin - 1]; n < bins.ends[bin]; ++n)
                    listed[bins.numbers[n]] = 1;
            }
            for (const Particle& p : particles) {
                const vec3 m = p.position - camera.position;
                const float along = dot(m, d), away = dot(m, m) - along * along;
                if (!(away < p.radius * p.radius * 0.999f) || along + p.radius < 0.001f) continue;
                ++seen;
                bool found = false;
                for (size_t i = 0; i < bins.records.size() && !found; ++i)
                    found =
                        listed[i] != 0 && bins.records[i].radius == p.radius && bins.records[i].opacity == p.opacity;
                EXPECT_TRUE(found) << "round " << round << " at " << x << ", " << y;
            }
        }
    }
    EXPECT_GT(seen, 10000u);
    EXPECT_LE(most, 60u * 9);
}

}  // namespace
}  // namespace kiln::render
