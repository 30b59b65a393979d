#version 460
// SPDX-License-Identifier: MIT
// One step of light's way through what is transparent, for the ray of every pixel: what its surface sends to the eye is added, and the ray goes
// on behind it. Through glass that is a walk in the object's own bricks, from inside: bent where it enters (Snell), thrown back where it cannot
// leave, dimmed by the way (Beer and Lambert), bent where it leaves. A pane of triangles only covers its share. Rays that meet nothing more
// take up the light of what is solid, and rest.
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
layout(set = 0, binding = 3, std430) readonly buffer Sets { InstanceSet sets[]; };
layout(set = 0, binding = 4, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };  // named by atlas.glsl, not read
layout(set = 0, binding = 6, std430) readonly buffer Glass { GlassRecord glass[]; };
layout(set = 0, binding = 7) uniform texture3D distances;
layout(set = 0, binding = 8) uniform utexture3D materials;  // likewise
layout(set = 0, binding = 9) uniform utexture2D layer_seen;
layout(set = 0, binding = 10) uniform utexture2D layer_words;
layout(set = 0, binding = 11) uniform texture2D layer_light;
layout(set = 0, binding = 12) uniform texture2D solid_light;
layout(set = 0, binding = 13) uniform texture2D carried_before;  // share of light that comes this far; a: one of kRay…
layout(set = 0, binding = 14) uniform texture2D sum_before;
layout(set = 0, binding = 15, std430) readonly buffer RaysInside { FrameRay rays_inside[]; };  // see through_enter.comp
layout(set = 0, binding = 16) uniform utexture2D seen_inside;                                  // what is solid along those
layout(set = 0, binding = 17, std430) writeonly buffer RaysNext { FrameRay rays_next[]; };
layout(set = 0, binding = 18, rgba16f) writeonly uniform image2D carried_now;
layout(set = 0, binding = 19, rgba16f) writeonly uniform image2D sum_now;
layout(set = 0, binding = 20, std430) readonly buffer Environment { uint environment_words[]; };
layout(push_constant) uniform Push { ThroughPush push; };

// True: an image is all around, multiplied by the constant sky.
layout(constant_id = 6) const bool kImageSky = false;

uint environment_word(uint i) { return environment_words[i]; }

#define KILN_FROM_INSIDE
#define KILN_FIELD_SURFACE
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/through_glass.glsl"
#include "render/lib/environment.gpu.h"

const int kMostTurns = 12;  // inside one object

vec3 unit_or(vec3 v, vec3 other) {
    float size = length(v);
    return size > 1e-20 ? v / size : other;
}

// Counted from the eye, finest voxels.
struct Way {
    vec3 at;
    vec3 direction;
    float inside;     // voxels on the way
    float last;       // of them since it was thrown back last
    float reflected;  // share that is thrown back where it leaves
    vec3 back, back_at;  // … and how that goes on
    bool caught;      // it does not
    bool stopped;     // by something solid inside
};

// Inside an object, from where a ray has come in; its first stretch goes no farther than t_solid.
Way through_glass(InstanceRecord instance, GlassRecord g, vec3 at, vec3 direction, float t_solid) {
    float off = kOffVoxels / instance.voxels;
    Way way = Way(at, direction, 0.0, 0.0, 0.0, direction, at, false, false);
    for (int i = 0; i < kMostTurns; ++i) {
        MarchHit hit = field_march(here.grid, object_ray(instance, way.at, way.direction), 0.0, kFarVoxels, true);
        float t = hit.t / instance.voxels;
        if (i == 0 && t_solid < (hit.state == kMarchMiss ? kFarVoxels : t)) {
            way.inside = t_solid;
            way.stopped = true;
            return way;
        }
        if (hit.state == kMarchMiss) return way;
        way.at += way.direction * t;
        way.inside += t;
        way.last = t;
        if (hit.state != kMarchHit) return way;  // past an edge too thin for a voxel
        // From inside, distances grow inwards.
        vec3 inwards = towards(unit_or(out_of_object(instance, dual_gradient(hit.slot, hit.cell, vec3(hit.voxel) + hit.p)), -way.direction), way.direction);
        float reflected = dielectric_reflectance(-dot(way.direction, inwards), g.ior);
        if (reflected < 1.0) {
            way.back = reflect(way.direction, inwards);
            way.back_at = way.at + inwards * off;
            way.direction = refracted(way.direction, inwards, g.ior);
            way.at -= inwards * off;
            way.reflected = reflected;
            return way;
        }
        way.direction = reflect(way.direction, inwards);
        way.at += inwards * off;
    }
    way.caught = true;
    return way;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 carried = vec4(1.0);
    vec4 sum = vec4(0.0);
    if (push.passed > 0u) {
        carried = texelFetch(carried_before, pixel, 0);
        sum = texelFetch(sum_before, pixel, 0);
    }
    FrameRay next = resting_ray();
    if (carried.a != kRayRests) {
        uvec4 seen = texelFetch(layer_seen, pixel, 0);
        uint state = seen.y >> 28u;
        vec4 solid = texelFetch(solid_light, pixel, 0);
        if (state == kSeenNothing || push.last != 0u) {
            sum.rgb += carried.rgb * solid.rgb;
            if (push.passed == 0u) sum.a = solid.a;
            carried.a = kRayRests;
        } else {
            uvec4 words = texelFetch(layer_words, pixel, 0);
            vec3 light = texelFetch(layer_light, pixel, 0).rgb;
            TexelRay ray = pixel_ray(pixel);
            vec3 at = from_eye(ray) + ray.direction * uintBitsToFloat(seen.x);
            vec3 direction = ray.direction;
            sum.a = 1.0;
            if (state == kSeenInstance) {
                sum.rgb += carried.rgb * light;
                InstanceRecord instance = instances[seen.y & 0x0fffffffu];
                GlassRecord g = glass[seen.y & 0x0fffffffu];
                here = sets[instance.set];
                float cosine = -dot(direction, towards(unpack_surface(words).normal, direction));
                float enters = (1.0 - g.opacity) * (1.0 - dielectric_reflectance(cosine, 1.0 / g.ior));
                FrameRay r = rays_inside[pixel.y * push.width + pixel.x];
                at = vec3(r.whole_x - frame.eye_x, r.whole_y - frame.eye_y, r.whole_z - frame.eye_z) +
                     (vec3(r.part_x, r.part_y, r.part_z) - vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z));
                uvec4 solid_inside = texelFetch(seen_inside, pixel, 0);
                Way way = through_glass(instance, g, at, vec3(r.direction_x, r.direction_y, r.direction_z), uintBitsToFloat(solid_inside.x));
                at = way.at;
                direction = way.direction;
                if (way.stopped) carried.a = kRayEnds;
                vec3 absorbed = vec3(g.absorbed_red, g.absorbed_green, g.absorbed_blue) * frame.grid.voxel_size;
                vec3 inside = way.caught ? vec3(0.0) : carried.rgb * enters * exp(-absorbed * way.inside);
                carried.rgb = inside * (1.0 - way.reflected);
                // What is thrown back where the ray leaves crosses the object again and sees the sky where it comes out; what is thrown back there, and
                // so on, is taken for as bright. So glass keeps no light to itself. What is nowhere to be seen adds nothing.
                vec3 back = inside * way.reflected;
                if (max(back.r, max(back.g, back.b)) > 1e-3) {
                    Way other = through_glass(instance, g, way.back_at, way.back, kFarVoxels);
                    vec3 sky = kImageSky ? environment_radiance(other.direction) * frame.sky.c0.rgb : sky_radiance(frame.sky, other.direction);
                    vec3 leaves = (1.0 - other.reflected) / (1.0 - other.reflected * exp(-absorbed * other.last));
                    if (!other.caught) sum.rgb += back * leaves * exp(-absorbed * other.inside) * sky;
                }
            } else {
                float opacity = float(words.x >> 24u) / 255.0;
                sum.rgb += carried.rgb * opacity * light;
                carried.rgb *= 1.0 - opacity;
                at += direction * max(2e-3, 4e-6 * max(abs(at.x), max(abs(at.y), abs(at.z))));
            }
            if (max(carried.r, max(carried.g, carried.b)) < 1e-4) {
                carried.a = kRayRests;
            } else {
                next = frame_ray(at, direction);
            }
        }
    }
    rays_next[pixel.y * push.width + pixel.x] = next;
    imageStore(carried_now, pixel, carried);
    imageStore(sum_now, pixel, min(sum, vec4(65000.0)));
}
