#version 460
// SPDX-License-Identifier: MIT
// One step of light's way through what is transparent, for the ray of every pixel. From outside of glass: what its surface sends to the eye is
// added, and the ray goes in, bent (Snell). From inside: the way is paid for (Beer and Lambert), and the ray leaves, or is thrown back where it
// cannot. A pane of triangles covers its share. Rays that meet nothing more end, with what is solid there as it was found, and rest.
//
// At every surface of glass light goes two ways. A camera's ray has both followed twice: where it first meets glass, the mirrored one, and where it
// first leaves glass, the one that is thrown back: these begin a picture of their own, one below the other. Elsewhere the mirrored way shows the sky, and
// what is thrown back inside is as bright as what leaves, less what crossing the glass again takes. So no light is lost.
// Rough glass is one of small smooth surfaces, of which a ray meets one; through_end.comp makes lobes of neighbouring rays.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/lib/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Sets { InstanceSet sets[]; };  // named by instance_rays.glsl, not read
layout(set = 0, binding = 4, std430) readonly buffer Glass { GlassRecord glass[]; };
layout(set = 0, binding = 5, std430) readonly buffer GgxTable { uint ggx_table[]; };
layout(set = 0, binding = 6, std430) readonly buffer Environment { uint environment_words[]; };
layout(set = 0, binding = 7) uniform utexture2D layer_seen;
layout(set = 0, binding = 8) uniform utexture2D layer_words;
layout(set = 0, binding = 9) uniform utexture2D layer_lit_words;
layout(set = 0, binding = 10) uniform texture2D layer_light;
layout(set = 0, binding = 11) uniform utexture2D nearest;        // of what is solid and what lets light through
layout(set = 0, binding = 12) uniform utexture2D solid_seen;
layout(set = 0, binding = 13) uniform texture2D solid_light;     // read with kThroughCamera alone
layout(set = 0, binding = 14) uniform texture2D carried_before;  // share of light that comes this far; a: one of kRay…
layout(set = 0, binding = 15) uniform texture2D sum_before;
layout(set = 0, binding = 16, std430) writeonly buffer RaysNext { FrameRay rays_next[]; };
layout(set = 0, binding = 17, rgba16f) writeonly uniform image2D carried_now;
layout(set = 0, binding = 18, rgba16f) writeonly uniform image2D sum_now;
layout(set = 0, binding = 19, std430) writeonly buffer RaysEnded { FrameRay rays_ended[]; };
layout(set = 0, binding = 20, rgba32ui) writeonly uniform uimage2D seen_ended;
layout(set = 0, binding = 21, std430) writeonly buffer RaysParted { FrameRay rays_parted[]; };  // with kThroughParts
layout(set = 0, binding = 22, rgba16f) writeonly uniform image2D carried_parted;                // likewise
layout(push_constant) uniform Push { ThroughPush push; };

// True: an image is all around, multiplied by the constant sky.
layout(constant_id = 6) const bool kImageSky = false;

uint ggx_table_word(uint i) { return ggx_table[i]; }
uint environment_word(uint i) { return environment_words[i]; }
#include "render/lib/environment.gpu.h"
#include "render/lib/shading.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/through_glass.glsl"

const float kTooLittle = 1e-4;

float most_of(vec3 c) { return max(c.r, max(c.g, c.b)); }

// Of a way of t finest voxels in glass.
vec3 absorbed_in(GlassRecord g, float t) { return exp(-vec3(g.absorbed_red, g.absorbed_green, g.absorbed_blue) * (t * frame.grid.voxel_size)); }

// How a ray sees rough glass here, (u, phi) of rough_normal(): sixteen neighbours' rays are spread over the lobe, otherwise at every step, in
// the next sixteen and in the next picture (additive recurrence: Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
vec2 lobe_place(ivec2 pixel) {
    ivec2 in_block = pixel & (kLobeSide - 1);
    uint of_step = pcg_hash(push.passed);
    // An odd factor gives the sixteen another order.
    uint place = (uint(in_block.x + kLobeSide * in_block.y) * (of_step | 1u) + (of_step >> 8u)) & 15u;
    uint of_block = pcg_hash(uint(pixel.x / kLobeSide) + 65536u * uint(pixel.y / kLobeSide));
    float n = float(place + 16u * ((push.picture + of_block) & 255u));
    vec2 turned = fract(vec2(unit_float(pcg_hash(of_step + 1u)), unit_float(pcg_hash(of_step + 2u))) + n * vec2(0.7548776662, 0.5698402910));
    return vec2(turned.x, kTwoPi * turned.y);
}

// The small surface that a ray along d sees of glass with normal n, unless it would send the ray out of where it belongs.
vec3 small_surface(ivec2 pixel, GlassRecord g, vec3 n, vec3 d, float ratio) {
    if (g.alpha <= kLobePixels * frame.pixel_angle) return n;
    vec2 place = lobe_place(pixel);
    vec3 h = rough_normal(n, d, g.alpha, place.x, place.y);
    if (dot(h, d) > -1e-3 || dot(reflect(d, h), n) <= 1e-3) return n;
    if (dielectric_reflectance(-dot(h, d), ratio) < 1.0 && dot(refracted(d, h, ratio), n) >= -1e-3) return n;
    return h;
}

void part(ivec2 pixel, int which, vec3 carried, FrameRay ray) {
    ivec2 to = pixel + ivec2(0, which * push.height);
    rays_parted[to.y * push.width + to.x] = ray;
    imageStore(carried_parted, to, vec4(carried, most_of(carried) > kTooLittle ? kRayParted : kRayRests));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    bool parts = (push.step & kThroughParts) != 0u;
    bool of_camera = (push.step & kThroughCamera) != 0u;
    int index = pixel.y * push.width + pixel.x;
    FrameRay next = resting_ray();
    if ((push.step & kThroughBegins) != 0u) {
        rays_ended[index] = next;
        imageStore(seen_ended, pixel, uvec4(0x7f800000u, kSeenNothing << 28u, 0u, 0u));
        if (parts) {
            part(pixel, 0, vec3(0.0), next);
            part(pixel, 1, vec3(0.0), next);
        }
    }
    vec4 carried = vec4(1.0);
    vec4 sum = vec4(0.0);
    if (!of_camera) carried = texelFetch(carried_before, pixel, 0);
    if ((push.step & kThroughBegins) == 0u) sum = texelFetch(sum_before, pixel, 0);
    if (carried.a != kRayRests) {
        uvec4 seen = texelFetch(layer_seen, pixel, 0);
        uvec4 solid = texelFetch(solid_seen, pixel, 0);
        uint state = (push.step & kThroughLast) != 0u ? kSeenNothing : seen.y >> 28u;
        float within = of_camera ? 0.0 : rays[index].within;
        TexelRay ray = pixel_ray(pixel);
        vec3 d = ray.direction;
        float t = uintBitsToFloat(seen.x);
        uvec4 left_glass = within > 0.0 && (push.step & kThroughLast) == 0u ? texelFetch(nearest, pixel, 0) : uvec4(0u);
        bool goes = true;
        if ((left_glass.y >> 28u) == kSeenGlassLeft) {
            t = uintBitsToFloat(left_glass.x);
            carried.rgb *= absorbed_in(glass[uint(within) - 1u], t);
            next = frame_ray(from_eye(ray) + d * t, d, 0.0);
        } else if (state == kSeenNothing) {
            goes = false;
            if (of_camera) {
                sum = texelFetch(solid_light, pixel, 0);
                carried.rgb = vec3(0.0);
            } else {
                if (within > 0.0 && (solid.y >> 28u) != kSeenNothing) carried.rgb *= absorbed_in(glass[uint(within) - 1u], uintBitsToFloat(solid.x));
                FrameRay r = rays[index];
                r.within = 0.0;
                rays_ended[index] = r;
                imageStore(seen_ended, pixel, solid);
            }
        } else {
            vec3 at = from_eye(ray) + d * t;
            vec3 light = texelFetch(layer_light, pixel, 0).rgb;
            sum.a = 1.0;
            if (state == kSeenInstance) {
                uint which = seen.y & 0x0fffffffu;
                GlassRecord g = glass[which];
                float off = kOffVoxels / instances[which].voxels;
                vec3 normal = unpack_surface(texelFetch(layer_words, pixel, 0)).normal;
                if (within == 0.0) {
                    vec3 n = towards(normal, d);
                    SurfaceSample s = unpack_surface(texelFetch(layer_lit_words, pixel, 0));
                    SurfaceView view = surface_view(surface_optics(s.albedo, s.metallic, s.roughness), s.normal, -d);
                    vec3 toward = reflected_view(view);
                    vec3 sky = kImageSky ? environment_reflection(toward, view.optics.roughness) * frame.sky.c0.rgb : sky_reflection(frame.sky, toward, view.alpha);
                    // The light pass reflects the sky by the split sum, which is short of Fresnel's law at the rim. Rough glass is half a mirror at best, and
                    // keeps the sky.
                    float smooth_share = clamp(2.0 - 4.0 * s.roughness, 0.0, 1.0);
                    vec3 reflects = mix(view.reflected, vec3(dielectric_reflectance(-dot(d, n), 1.0 / g.ior)), smooth_share);
                    float mirror = parts && of_camera ? smooth_share : 0.0;
                    sum.rgb += carried.rgb * max(light + s.ambient * sky * (reflects * (1.0 - mirror) - view.reflected), vec3(0.0));
                    if (mirror > 0.0) part(pixel, 0, carried.rgb * s.ambient * reflects * mirror, frame_ray(at + n * off, reflect(d, n), 0.0));
                    carried.rgb *= (1.0 - g.opacity) * (1.0 - reflects);
                    next = frame_ray(at - n * off, refracted(d, small_surface(pixel, g, n, d, 1.0 / g.ior), 1.0 / g.ior), float(which + 1u));
                } else {
                    vec3 inwards = towards(-normal, d);
                    vec3 crossing = absorbed_in(g, t);
                    carried.rgb *= crossing;
                    vec3 h = small_surface(pixel, g, inwards, d, g.ior);
                    float back = dielectric_reflectance(-dot(d, h), g.ior);
                    FrameRay thrown_back = frame_ray(at + inwards * off, reflect(d, h), within);
                    if (back >= 1.0) {
                        next = thrown_back;
                    } else {
                        if (parts && carried.a == kRayGoes) {
                            part(pixel, 1, carried.rgb * back, thrown_back);
                            carried = vec4(carried.rgb * (1.0 - back), kRayParted);
                        } else {
                            carried.rgb *= (1.0 - back) / (1.0 - back * crossing);
                        }
                        next = frame_ray(at - inwards * off, refracted(d, h, g.ior), 0.0);
                    }
                }
            } else {
                float opacity = float(texelFetch(layer_words, pixel, 0).x >> 24u) / 255.0;
                sum.rgb += carried.rgb * opacity * light;
                carried.rgb *= 1.0 - opacity;
                at += d * max(2e-3, 4e-6 * max(abs(at.x), max(abs(at.y), abs(at.z))));
                next = frame_ray(at, d, within);
            }
        }
        if (!goes || most_of(carried.rgb) < kTooLittle) {
            if (goes) carried.rgb = vec3(0.0);
            carried.a = kRayRests;
            next = resting_ray();
        }
    }
    rays_next[index] = next;
    imageStore(carried_now, pixel, carried);
    imageStore(sum_now, pixel, min(sum, vec4(65000.0)));
}
