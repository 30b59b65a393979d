// SPDX-License-Identifier: MIT
// Colours of light that came through glass, 16 bits a light, against their largest component, which dims the light's visible fraction.

void pack_tint(inout uvec4 words, uint channel, vec3 tint) {
    uvec3 steps = uvec3(clamp(tint, vec3(0.0), vec3(1.0)) * vec3(31.0, 63.0, 31.0) + 0.5);
    uint shift = 16u * (channel & 1u);
    words[channel >> 1u] = (words[channel >> 1u] & ~(0xffffu << shift)) | ((steps.r | (steps.g << 5u) | (steps.b << 11u)) << shift);
}

vec3 unpack_tint(uvec4 words, uint channel) {
    uint word = words[channel >> 1u] >> (16u * (channel & 1u));
    return vec3(float(word & 31u) / 31.0, float((word >> 5u) & 63u) / 63.0, float((word >> 11u) & 31u) / 31.0);
}
