// SPDX-License-Identifier: MIT
// Textures of meshes: pages of one size each, a layer a texture. The including kernel defines KILN_PAGES, the first of 13 bindings.

layout(set = 0, binding = KILN_PAGES) uniform texture2DArray page_0;
layout(set = 0, binding = KILN_PAGES + 1) uniform texture2DArray page_1;
layout(set = 0, binding = KILN_PAGES + 2) uniform texture2DArray page_2;
layout(set = 0, binding = KILN_PAGES + 3) uniform texture2DArray page_3;
layout(set = 0, binding = KILN_PAGES + 4) uniform texture2DArray page_4;
layout(set = 0, binding = KILN_PAGES + 5) uniform texture2DArray page_5;
layout(set = 0, binding = KILN_PAGES + 6) uniform texture2DArray page_6;
layout(set = 0, binding = KILN_PAGES + 7) uniform texture2DArray page_7;
layout(set = 0, binding = KILN_PAGES + 8) uniform texture2DArray page_8;
layout(set = 0, binding = KILN_PAGES + 9) uniform texture2DArray page_9;
layout(set = 0, binding = KILN_PAGES + 10) uniform texture2DArray page_10;
layout(set = 0, binding = KILN_PAGES + 11) uniform texture2DArray page_11;
layout(set = 0, binding = KILN_PAGES + 12) uniform sampler page_sampler;  // trilinear, repeating

vec2 page_size(uint page) {
    switch (page) {
        case 0u: return vec2(textureSize(page_0, 0).xy);
        case 1u: return vec2(textureSize(page_1, 0).xy);
        case 2u: return vec2(textureSize(page_2, 0).xy);
        case 3u: return vec2(textureSize(page_3, 0).xy);
        case 4u: return vec2(textureSize(page_4, 0).xy);
        case 5u: return vec2(textureSize(page_5, 0).xy);
        case 6u: return vec2(textureSize(page_6, 0).xy);
        case 7u: return vec2(textureSize(page_7, 0).xy);
        case 8u: return vec2(textureSize(page_8, 0).xy);
        case 9u: return vec2(textureSize(page_9, 0).xy);
        case 10u: return vec2(textureSize(page_10, 0).xy);
        default: return vec2(textureSize(page_11, 0).xy);
    }
}

vec4 page_texel(uint page, vec3 at, float lod) {
    switch (page) {
        case 0u: return textureLod(sampler2DArray(page_0, page_sampler), at, lod);
        case 1u: return textureLod(sampler2DArray(page_1, page_sampler), at, lod);
        case 2u: return textureLod(sampler2DArray(page_2, page_sampler), at, lod);
        case 3u: return textureLod(sampler2DArray(page_3, page_sampler), at, lod);
        case 4u: return textureLod(sampler2DArray(page_4, page_sampler), at, lod);
        case 5u: return textureLod(sampler2DArray(page_5, page_sampler), at, lod);
        case 6u: return textureLod(sampler2DArray(page_6, page_sampler), at, lod);
        case 7u: return textureLod(sampler2DArray(page_7, page_sampler), at, lod);
        case 8u: return textureLod(sampler2DArray(page_8, page_sampler), at, lod);
        case 9u: return textureLod(sampler2DArray(page_9, page_sampler), at, lod);
        case 10u: return textureLod(sampler2DArray(page_10, page_sampler), at, lod);
        default: return textureLod(sampler2DArray(page_11, page_sampler), at, lod);
    }
}

// A repeating sampler clamps and mirrors where the coordinate stays half a texel of the coarser level away from the seam.
float wrapped(float u, uint mode, float half_texel) {
    if (mode == 0u) return u;
    if (mode == 1u) u = abs(u - 2.0 * floor(0.5 * u + 0.5));
    return clamp(u, half_texel, 1.0 - half_texel);
}

const float kMostTaps = 8.0;

// The texture round `uv`, over the parallelogram that dx and dy span: trilinear taps along its longer side, as fine as the shorter one.
vec4 mesh_texture(MeshTexture t, vec2 uv, vec2 dx, vec2 dy) {
    uint page = (t.where >> kTexturePageShift) & 15u;
    float layer = float(t.where & 255u);
    vec2 size = page_size(page);
    mat2 map = mat2(t.m0, t.m1, t.m2, t.m3);
    uv = map * uv + vec2(t.m4, t.m5);
    dx = map * dx;
    dy = map * dy;
    float along_x = length(dx * size);
    float along_y = length(dy * size);
    float major = max(max(along_x, along_y), 1e-6);
    float minor = max(min(along_x, along_y), major / kMostTaps);
    int taps = int(clamp(ceil(major / minor - 0.01), 1.0, kMostTaps));
    if (major <= 1.0) taps = 1;
    float lod = max(log2(taps == 1 ? major : minor), 0.0);
    vec2 half_texel = min(0.5 * exp2(ceil(lod)) / size, vec2(0.5));
    vec2 axis = along_x > along_y ? dx : dy;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < taps; ++i) {
        vec2 at = uv + axis * ((float(i) + 0.5) / float(taps) - 0.5);
        if ((t.where & kTextureNearest) != 0u && lod <= 0.0) at = (floor(at * size) + 0.5) / size;
        at.x = wrapped(at.x, (t.where >> kTextureWrapU) & 3u, half_texel.x);
        at.y = wrapped(at.y, (t.where >> kTextureWrapV) & 3u, half_texel.y);
        sum += page_texel(page, vec3(at, layer), lod);
    }
    return sum / float(taps);
}
