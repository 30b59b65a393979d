// SPDX-License-Identifier: MIT

#include "render/reference.h"

#include "base/parallel_for.h"
#include "render/lib/color.gpu.h"
#include "render/lib/pack.h"
#include "render/lib/shading.gpu.h"
#include "render/lib/glass.gpu.h"
#include "render/mesh_trace.h"
#include "render/reference_glass.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kiln::render {
namespace {

using gpu::largest3;
using shade::LightRecord;
using shade::LightSample;
using shade::SkyParams;
using shade::SurfaceView;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

vec3 narrow(dvec3 v) { return {float(v.x), float(v.y), float(v.z)}; }
double size_of(dvec3 v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

// PCG (O'Neill, 2014) with the 32-bit output of the shaders' hash; a sequence of its own for each pixel and sample.
class Random {
public:
    Random(uint32_t x, uint32_t y, uint32_t sample, uint32_t seed)
        : state_(gpu::pcg_hash(x + gpu::pcg_hash(y + gpu::pcg_hash(sample + gpu::pcg_hash(seed))))) {}
    float next() {
        state_ = state_ * 747796405u + 2891336453u;
        const uint32_t word = ((state_ >> ((state_ >> 28) + 4)) ^ state_) * 277803737u;
        return gpu::unit_float((word >> 22) ^ word);
    }

private:
    uint32_t state_;
};

// The part of a ray that is inside the box; empty when first > last.
struct Span {
    double first, last;
};
Span clipped(const Box3& box, dvec3 o, dvec3 d, double t_last) {
    Span s{0, t_last};
    const double lo[] = {box.min.x, box.min.y, box.min.z}, hi[] = {box.max.x, box.max.y, box.max.z};
    const double from[] = {o.x, o.y, o.z}, by[] = {d.x, d.y, d.z};
    for (size_t i = 0; i < 3; ++i) {
        if (by[i] == 0) {
            if (from[i] < lo[i] || from[i] > hi[i]) return {1, 0};
            continue;
        }
        const double a = (lo[i] - from[i]) / by[i], b = (hi[i] - from[i]) / by[i];
        s.first = std::max(s.first, std::min(a, b));
        s.last = std::min(s.last, std::max(a, b));
    }
    return s;
}

struct Scene {
    const ReferenceField& field;
    std::vector<LightRecord> lights;
    SkyParams sky;         // with the sun's disc: for rays from the eye
    SkyParams sky_no_sun;  // for all others: the sun is a light of its own
    const ReferenceSettings& settings;
    const GlassTrace& glass;

    dvec3 normal(dvec3 p) const {
        if (field.normal) return field.normal(p);
        const double h = 1e-5 * std::max(1.0, size_of(p));
        const dvec3 g{field.distance({p.x + h, p.y, p.z}) - field.distance({p.x - h, p.y, p.z}),
                      field.distance({p.x, p.y + h, p.z}) - field.distance({p.x, p.y - h, p.z}),
                      field.distance({p.x, p.y, p.z + h}) - field.distance({p.x, p.y, p.z - h})};
        const double size = size_of(g);
        return size > 0 ? dvec3{g.x / size, g.y / size, g.z / size} : dvec3{0, 1, 0};
    }

    vec3 tint() const { return {sky.c0.x, sky.c0.y, sky.c0.z}; }
    // What a ray that hits nothing sees.
    vec3 radiance(dvec3 direction, bool with_sun) const {
        const vec3 d = narrow(direction);
        if (settings.environment)
            return tint() * shade::EnvironmentLight{settings.environment->words}.environment_radiance(d);
        return shade::sky_radiance(with_sun ? sky : sky_no_sun, d);
    }
    // Light from all around, where so much of it arrives.
    vec3 around(const SurfaceView& s, float open) const {
        const vec3 mirror = shade::reflected_view(s);
        vec3 ambient, reflection;
        if (settings.environment) {
            shade::EnvironmentLight light{settings.environment->words};
            ambient = tint() * light.environment_ambient(s.n);
            reflection = tint() * light.environment_reflection(mirror, s.optics.roughness);
        } else {
            ambient = shade::sky_ambient(sky_no_sun, s.n);
            reflection = shade::sky_reflection(sky_no_sun, mirror, s.alpha);
        }
        return settings.sky_samples > 0 ? shade::shade_around_seen(s, ambient, reflection, open)
                                        : shade::shade_around(s, ambient, reflection) * open;
    }

    bool reaches(dvec3 p, dvec3 direction, double distance) const {
        return reference_hit(field, p, direction, distance) < 0 &&
               !(field.meshes && field.meshes->hides(p, direction, distance));
    }
};

struct Hit {
    double t = 0;
    dvec3 p;  // just off the surface: where the next rays start
    vec3 n;   // as the shaders get it
    Material material;
    float ambient = 1;   // share of the sky's light that a texture leaves, where nothing else occludes it
    bool matte = false;  // it reflects no more: that was done before
};

// The nearer of the field and the meshes; t < 0: neither.
Hit first_hit(const Scene& scene, dvec3 origin, dvec3 direction, double t_last) {
    Hit hit;
    double t = reference_hit(scene.field, origin, direction, t_last);
    if (scene.field.meshes) {
        if (const auto seen = scene.field.meshes->hit(origin, direction, t < 0 ? t_last : t)) {
            hit.t = seen->t;
            hit.n = narrow(seen->normal);
            hit.material = seen->material;
            hit.ambient = seen->ambient;
            hit.p = along(seen->round, seen->face, 1e-6 * std::max(0.1, seen->t));
            return hit;
        }
    }
    if (t < 0) {
        hit.t = -1;
        return hit;
    }
    hit.t = t;
    const dvec3 p = along(origin, direction, t);
    const dvec3 n = scene.normal(p);
    hit.n = narrow(n);
    hit.material = scene.field.material(p);
    // Off the surface by a ten-thousandth of the distance it is seen from: nearer, sphere tracing would crawl away.
    hit.p = along(p, n, 1e-4 * std::max(0.1, t));
    return hit;
}

SurfaceView view_of(const Scene& scene, const Hit& hit, dvec3 direction) {
    shade::SurfaceOptics optics =
        shade::surface_optics(hit.material.base_color, hit.material.metallic, hit.material.roughness);
    if (scene.settings.lambert || hit.matte) {
        optics.metallic = 0;
        optics.dielectric_f0 = 0;
        optics.f90 = 0;
    }
    return shade::surface_view(optics, hit.n, normalize(narrow(direction) * -1.0f));
}

// A point of the unit disc, equal areas (Shirley and Chiu, "A Low Distortion Map Between Disk and Square", 1997).
vec2 on_disc(double u, double v) {
    const double a = 2 * u - 1, b = 2 * v - 1;
    if (a == 0 && b == 0) return {0, 0};
    const double r = std::fabs(a) > std::fabs(b) ? a : b;
    const double angle = std::fabs(a) > std::fabs(b) ? std::numbers::pi / 4 * (b / a)
                                                     : std::numbers::pi / 2 - std::numbers::pi / 4 * (a / b);
    return {float(r * std::cos(angle)), float(r * std::sin(angle))};
}

// Direction to a point of a light's disc, seen from hit.p.
dvec3 to_disc(const LightSample& light, vec2 at) {
    const gpu::Basis basis = gpu::basis_around(light.l);
    const dvec3 d =
        wide(light.l + basis.tangent * (at.x * light.tan_radius) + basis.bitangent * (at.y * light.tan_radius));
    const double size = size_of(d);
    return {d.x / size, d.y / size, d.z / size};
}

double disc_distance(const LightSample& light, const Scene& scene) {
    return light.distance >= 1e30f ? scene.settings.farthest : double(light.distance);
}

// Share of the hemisphere that is open, and no more than a texture leaves.
float open_share(const Scene& scene, const Hit& hit, Random& random) {
    const int side = int(std::lround(std::sqrt(double(scene.settings.sky_samples))));
    if (side == 0) return hit.ambient;
    const gpu::Basis b = gpu::basis_around(hit.n);
    int open = 0;
    for (int i = 0; i < side * side; ++i) {
        const double u = (i % side + double(random.next())) / side, v = (i / side + double(random.next())) / side;
        const vec2 d = on_disc(u, v);
        const vec3 up =
            b.tangent * d.x + b.bitangent * d.y + hit.n * std::sqrt(std::max(1 - d.x * d.x - d.y * d.y, 0.0f));
        open += scene.reaches(hit.p, wide(normalize(up)), scene.settings.farthest);
    }
    return std::min(hit.ambient, float(open) / float(side * side));
}

// samples = 0: as the lighting pass does it, with the visible fraction counted by rays.
vec3 direct(const Scene& scene, const Hit& hit, dvec3 direction, Random& random, float open) {
    const SurfaceView s = view_of(scene, hit, direction);
    vec3 sum = scene.around(s, open) + hit.material.emissive;
    for (const LightRecord& record : scene.lights) {
        const LightSample light = shade::sample_light(record, narrow(hit.p));
        if (dot(hit.n, light.l) <= 0 || largest3(light.illuminance) <= 0) continue;
        const double far = disc_distance(light, scene);
        double seen = 0;
        if (light.tan_radius <= 0) {
            seen = scene.reaches(hit.p, wide(light.l), far) ? 1 : 0;
        } else {
            const int side = std::max(1, int(std::lround(std::sqrt(double(scene.settings.shadow_samples)))));
            for (int i = 0; i < side * side; ++i) {
                const double u = (i % side + double(random.next())) / side,
                             v = (i / side + double(random.next())) / side;
                if (scene.reaches(hit.p, to_disc(light, on_disc(u, v)), far)) seen += 1.0 / (side * side);
            }
        }
        sum = sum + shade::shade_light(s, light, float(seen));
    }
    return sum;
}

// A direction that the surface is likely to send to v: the base by cosine, the reflection by normals that v sees, each as
// often as it reflects.
struct Bounce {
    vec3 direction;
    vec3 weight;  // brdf cosine / density; 0: the path ends
};
Bounce bounce(const SurfaceView& s, Random& random) {
    const float specular = largest3(s.reflected), base = largest3(s.base_ambient);
    if (!(specular + base > 0)) return {};
    const float p_specular = specular / (specular + base);
    const gpu::Basis b = gpu::basis_around(s.n);
    const float pick = random.next(), u = random.next(), phi = gpu::kTwoPi * random.next();
    const vec3 v{dot(b.tangent, s.v), dot(b.bitangent, s.v), std::max(dot(s.n, s.v), 1e-4f)};
    vec3 l;
    if (pick < p_specular) {
        const vec3 h = shade::visible_normal(v, s.alpha, u, phi);
        l = h * (2 * dot(v, h)) - v;
    } else {
        const float r = std::sqrt(u);
        l = {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1 - u))};
    }
    if (l.z <= 0) return {};
    l = normalize(l);
    const vec3 h = normalize(v + l);
    const vec3 across{h.x, h.y, 0};
    const float distribution = shade::ggx_distribution(h.z, dot(across, across), s.alpha);
    // Density of reflected directions: G1(v) D / (4 n·v), G1(v) = 2 n·v / (n·v + sqrt(alpha² sin² + n·v²)).
    const float g = std::sqrt(s.alpha * s.alpha * (v.x * v.x + v.y * v.y) + v.z * v.z);
    const float density = p_specular * distribution / (2 * (v.z + g)) + (1 - p_specular) * l.z / gpu::kPi;
    const vec3 world = normalize(b.tangent * l.x + b.bitangent * l.y + s.n * l.z);
    return {world, shade::brdf_times_cosine(s, world) * (1 / density)};
}

// The small surface that a ray along d sees of rough glass, unless it would send the ray to where it does not belong.
vec3 small_surface(const Material& m, vec3 n, vec3 d, float ratio, float u, float phi) {
    if (dot(n, d) >= 0) return n;
    const vec3 h = shade::rough_normal(n, d, m.roughness * m.roughness, u, phi);
    const float cosine = -dot(h, d);
    if (cosine <= 0 || dot(d + h * (2 * cosine), n) <= 0) return n;
    if (shade::dielectric_reflectance(cosine, ratio) < 1 && dot(shade::refracted(d, h, ratio), n) >= 0) return n;
    return h;
}

// Along a ray, and where glass takes it, to something solid; t < 0: none. Chance picks one way at every surface of glass.
Hit follow(const Scene& scene, dvec3& origin, dvec3& direction, Random& random, vec3& carried, bool& bent) {
    constexpr int kMostSurfaces = 64;
    int inside = -1;
    for (int i = 0; i < kMostSurfaces; ++i) {
        const Hit hit = first_hit(scene, origin, direction, scene.settings.farthest);
        if (scene.glass.empty()) return hit;
        const double t_solid = hit.t < 0 ? scene.settings.farthest : hit.t;
        const GlassTrace::Hit glass = scene.glass.first(origin, direction, t_solid, inside);
        if (inside >= 0) carried = carried * scene.glass.left_after(inside, glass.t < 0 ? t_solid : glass.t);
        if (glass.t < 0) return hit;
        bent = true;
        const Material& m = scene.glass.material(glass.which);
        const dvec3 p = along(origin, direction, glass.t);
        const double off = 1e-6 * std::max(0.1, glass.t) + 1e-7;
        const bool in = inside < 0;
        vec3 n = narrow(glass.normal) * (in ? 1.0f : -1.0f);  // against the ray
        const vec3 d = narrow(direction);
        const vec3 smooth = n;
        if (m.roughness > 0) {
            const float u = random.next(), phi = gpu::kTwoPi * random.next();
            n = small_surface(m, smooth, d, in ? 1 / m.ior : m.ior, u, phi);
        }
        const float cosine = std::clamp(-dot(n, d), 0.0f, 1.0f), ratio = in ? 1 / m.ior : m.ior;
        if (random.next() < shade::dielectric_reflectance(cosine, ratio)) {
            direction = wide(normalize(d + n * (2 * cosine)));
            origin = along(p, wide(smooth), off);
            continue;
        }
        if (in && random.next() < m.opacity) {
            Hit outside;
            outside.t = glass.t;
            outside.p = along(p, wide(smooth), 1e-4 * std::max(0.1, glass.t));
            outside.n = smooth;
            outside.material = m;
            outside.matte = true;
            return outside;
        }
        direction = wide(shade::refracted(d, n, ratio));
        origin = along(p, wide(smooth), -off);
        inside = in ? glass.which : -1;
    }
    carried = {};
    Hit none;
    none.t = -1;
    return none;
}

vec3 path(const Scene& scene, dvec3 origin, dvec3 direction, Random& random, bool& seen) {
    vec3 sum{}, carried{1, 1, 1};
    for (int depth = 0;; ++depth) {
        bool bent = false;
        const Hit hit = follow(scene, origin, direction, random, carried, bent);
        if (depth == 0) seen = hit.t >= 0 || bent;
        if (hit.t < 0) return sum + carried * scene.radiance(direction, depth == 0);
        sum = sum + carried * hit.material.emissive;
        const SurfaceView s = view_of(scene, hit, direction);
        for (const LightRecord& record : scene.lights) {
            const LightSample light = shade::sample_light(record, narrow(hit.p));
            const float u = random.next(), v = random.next();
            if (largest3(light.illuminance) <= 0) continue;
            const dvec3 l = light.tan_radius > 0 ? to_disc(light, on_disc(u, v)) : wide(light.l);
            LightSample there = light;
            there.l = narrow(l);
            if (dot(hit.n, there.l) > 0 && scene.reaches(hit.p, l, disc_distance(light, scene)))
                sum = sum + carried * scene.glass.straight(hit.p, l, disc_distance(light, scene)) *
                                shade::shade_light(s, there, 1);
        }
        if (depth == scene.settings.most_bounces) return sum;
        const Bounce next = bounce(s, random);
        carried = carried * next.weight;
        // Dim paths end early, the others make up for them.
        const float alive = std::min(1.0f, largest3(carried));
        if (!(alive > 0)) return sum;
        if (depth >= 2 && alive < 0.5f) {
            if (random.next() >= alive) return sum;
            carried = carried * (1 / alive);
        }
        origin = hit.p;
        direction = wide(next.direction);
    }
}

}  // namespace

double reference_hit(const ReferenceField& field, dvec3 origin, dvec3 direction, double t_last) {
    const Span span = clipped(field.bounds, origin, direction, t_last);
    double t = span.first, outside = t;
    // The steps shrink where the ray grazes a surface; the smallest is far below what a picture shows, and what it might
    // cross is found again by bisection.
    for (int i = 0; i < 20000 && t <= span.last; ++i) {
        const double d = field.distance(along(origin, direction, t));
        if (d <= 0) {
            if (t == span.first) return t;
            double inside = t;
            while (inside - outside > 1e-12 * inside) {
                const double middle = 0.5 * (outside + inside);
                if (middle <= outside || middle >= inside) break;
                (field.distance(along(origin, direction, middle)) <= 0 ? inside : outside) = middle;
            }
            return inside;
        }
        outside = t;
        t += std::max(d, 1e-7 * std::max(1.0, t));
    }
    return -1;
}

ReferencePicture render_reference(const ReferenceField& field, std::span<const Light> lights,
                                  const shade::SkyParams& sky, const Camera& camera,
                                  const ReferenceSettings& settings) {
    const GlassTrace glass(field.glass);
    Scene scene{field, {}, sky, sky, settings, glass};
    scene.sky_no_sun.sun.w = 2;
    for (const Light& light : lights) scene.lights.push_back(shade::light_record(light));
    const shade::CameraParams eye = shade::camera_params(camera, settings.width, settings.height);
    const dvec3 origin = wide(camera.position);
    auto direction_at = [&](float x, float y) {
        const dvec3 d = wide(shade::camera_direction_at(eye, x, y));
        const double size = size_of(d);
        return dvec3{d.x / size, d.y / size, d.z / size};
    };

    const size_t count = size_t(settings.width) * size_t(settings.height);
    ReferencePicture out{settings.width,
                         settings.height,
                         std::vector<float>(count * 4),
                         std::vector<float>(count, float(kInfinity)),
                         std::vector<vec3>(count),
                         std::vector<float>(count, 1.0f),
                         std::vector<float>(count)};
    parallel_for(int(count), settings.workers, [&](int i) {
        const size_t at = size_t(i);
        const int x = i % settings.width, y = i / settings.width;
        Random middle_random(uint32_t(x), uint32_t(y), 0, settings.seed);
        const dvec3 middle = direction_at(float(x) + 0.5f, float(y) + 0.5f);
        const Hit hit = first_hit(scene, origin, middle, settings.farthest);
        vec3 sum{};
        double covered = 0;
        if (hit.t >= 0) {
            out.depth[at] = float(hit.t);
            out.normal[at] = hit.n;
            if (settings.samples == 0) {
                out.open[at] = open_share(scene, hit, middle_random);
                sum = direct(scene, hit, middle, middle_random, out.open[at]);
            }
            covered = 1;
        } else if (settings.samples == 0) {
            sum = scene.radiance(middle, true);
        }
        if (settings.samples > 0) {
            double mean = 0, squares = 0;  // Welford
            double total[3] = {};
            covered = 0;
            for (int k = 0; k < settings.samples; ++k) {
                Random random(uint32_t(x), uint32_t(y), uint32_t(k) + 1, settings.seed);
                const float u = random.next(), v = random.next();
                const dvec3 direction = settings.whole_pixels ? direction_at(float(x) + u, float(y) + v) : middle;
                bool seen = false;
                const vec3 light = path(scene, origin, direction, random, seen);
                total[0] += light.x, total[1] += light.y, total[2] += light.z;
                covered += seen ? 1 : 0;
                const double bright = shade::luminance(light), step = bright - mean;
                mean += step / (k + 1);
                squares += step * (bright - mean);
            }
            const double n = settings.samples;
            sum = {float(total[0] / n), float(total[1] / n), float(total[2] / n)};
            covered /= n;
            if (settings.samples > 1) out.standard_error[at] = float(std::sqrt(squares / (n - 1) / n));
        }
        out.rgba[4 * at] = sum.x, out.rgba[4 * at + 1] = sum.y, out.rgba[4 * at + 2] = sum.z,
                     out.rgba[4 * at + 3] = float(covered);
    });
    return out;
}

}  // namespace kiln::render
