// SPDX-License-Identifier: MIT
// The packed G-buffer, 16 bytes a pixel: sRGB-encoded albedo | octahedral normal, 2 x 16 bits | roughness, metallic, ambient
// visibility, flags | emissive radiance with a shared exponent.

#include "render/lib/color.gpu.h"
#include "render/lib/octahedral.gpu.h"

const uint kSurfaceHit = 1u;  // flags: something is there

struct SurfaceSample {
    vec3 albedo;    // linear
    vec3 normal;    // world, unit
    float roughness;
    float metallic;
    float ambient;  // visibility of the sky, 1: all of it
    uint flags;
    vec3 emissive;
};

// Three 9-bit fractions under one 5-bit exponent; up to 65408, the largest component to within 1/512.
uint pack_shared_exponent(vec3 c) {
    c = clamp(c, vec3(0.0), vec3(65408.0));
    float largest = max(max(c.r, c.g), c.b);
    if (largest < 1.5e-5) return 0u;
    int exponent = max(-16, int(floor(log2(largest)))) + 1;
    if (floor(largest * exp2(float(9 - exponent)) + 0.5) >= 512.0) exponent += 1;
    uvec3 fraction = uvec3(floor(c * exp2(float(9 - exponent)) + 0.5));
    return fraction.r | (fraction.g << 9u) | (fraction.b << 18u) | (uint(exponent + 15) << 27u);
}

vec3 unpack_shared_exponent(uint word) {
    vec3 fraction = vec3(float(word & 511u), float((word >> 9u) & 511u), float((word >> 18u) & 511u));
    return fraction * exp2(float(int(word >> 27u) - 15 - 9));
}

uvec4 pack_surface(SurfaceSample s) {
    uvec4 words;
    words.x = packUnorm4x8(vec4(srgb_from_linear3(s.albedo), 0.0));
    words.y = pack_unit(s.normal);
    words.z = packUnorm4x8(vec4(s.roughness, s.metallic, s.ambient, float(s.flags) / 255.0));
    words.w = pack_shared_exponent(s.emissive);
    return words;
}

SurfaceSample unpack_surface(uvec4 words) {
    SurfaceSample s;
    s.albedo = linear_from_srgb3(unpackUnorm4x8(words.x).rgb);
    s.normal = unpack_unit(words.y);
    vec4 rest = unpackUnorm4x8(words.z);
    s.roughness = rest.x;
    s.metallic = rest.y;
    s.ambient = rest.z;
    s.flags = words.z >> 24u;
    s.emissive = unpack_shared_exponent(words.w);
    return s;
}
