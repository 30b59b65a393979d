// SPDX-License-Identifier: MIT
// The slow judge of pictures: a CPU renderer over any distance field, in double precision, with the shaders' own texts for
// surface, lights, sky and camera. Two ways:
//   samples = 0: what the real-time renderer claims to draw. One ray through each pixel's middle, every light with the
//     visible fraction of its disc, the sky's light unoccluded or by the share of the hemisphere that is open.
//   samples > 0: what is true. Path tracing with next-event estimation; the sky and all bounces occlude each other.
// Results are the same bytes for any number of workers: every pixel has its own random sequence.
#pragma once

#include "render/lib/environment_map.h"
#include "render/lib/sky.gpu.h"

#include <kiln/edit.h>
#include <kiln/math.h>
#include <kiln/renderer.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace kiln::render {

class MeshTrace;

// Something that light goes through, see Material::opacity.
struct ReferenceGlass {
    std::function<double(dvec3)> distance;
    Box3 bounds;
    Material material;
};

// All functions are called from many threads at once.
struct ReferenceField {
    std::function<double(dvec3)> distance;    // metres, negative inside, 1-Lipschitz
    std::function<dvec3(dvec3)> normal;       // unit, at a surface point; empty: central differences of the distance
    std::function<Material(dvec3)> material;  // at a surface point
    Box3 bounds;                              // holds all that is solid; faces may be infinite
    const MeshTrace* meshes = nullptr;        // triangles beside it
    std::vector<ReferenceGlass> glass{};      // likewise; with paths alone
};

struct ReferenceSettings {
    int width = 256, height = 256;
    int samples = 0;           // paths a pixel; 0: direct light alone, see above
    bool whole_pixels = true;  // paths start all over the pixel; false: through its middle, as the real-time renderer's
    int shadow_samples = 64;   // rays to each light's disc, with samples = 0
    int sky_samples =
        0;  // … and over the hemisphere, a square number: what AmbientOcclusion claims; 0: the sky's light unoccluded
    int most_bounces = 16;  // 0: light that comes straight from the lights, and emission
    bool lambert = false;   // surfaces without reflection: for closed forms
    uint32_t seed = 1;
    int workers = 0;                                     // 0: every core
    const shade::EnvironmentMap* environment = nullptr;  // an image all around, multiplied by the constant sky
    double farthest = 1e5;                               // metres: what lies beyond is not seen
};

struct ReferencePicture {
    int width = 0, height = 0;
    std::vector<float> rgba;   // scene-linear, before exposure; alpha 1 where something is hit
    std::vector<float> depth;  // metres along the ray through the pixel's middle; +infinity: nothing
    std::vector<vec3> normal;  // there; (0, 0, 0) where nothing is hit
    std::vector<float>
        open;  // share of the hemisphere, with sky_samples; else what a texture leaves; 1 where nothing is hit
    std::vector<float> standard_error;  // of a pixel's luminance; 0 with samples < 2
};

ReferencePicture render_reference(const ReferenceField& field, std::span<const Light> lights,
                                  const shade::SkyParams& sky, const Camera& camera, const ReferenceSettings& settings);

inline dvec3 along(dvec3 o, dvec3 d, double t) { return {o.x + d.x * t, o.y + d.y * t, o.z + d.z * t}; }

// First point of the ray where the distance is <= 0, by sphere tracing, then bisection to 1e-12 of t; a negative number if there
// is none before t_last. `direction` is unit. A ray that starts inside answers 0.
double reference_hit(const ReferenceField& field, dvec3 origin, dvec3 direction, double t_last);

}  // namespace kiln::render
