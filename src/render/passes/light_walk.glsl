// SPDX-License-Identifier: MIT
// The lights that may reach a pixel, in the order of the frame's list. The including kernel declares first: FrameParams frame,
// uint light_masks[] (cluster.comp).

#include "render/passes/cluster.gpu.h"

struct LightWalk {
    uint first;  // of the tile's words
    uint word;   // that `bits` are left of
    uint bits;
};

uint light_words() { return (frame.light_count + 31u) >> 5u; }

// Behind the first `skipped` lights of the pixel's tile.
LightWalk light_walk(ivec2 pixel, uint skipped) {
    ivec2 tile = pixel / kClusterSide;
    uint across = uint((frame.tile_width + kClusterSide - 1) / kClusterSide);
    uint words = light_words();
    LightWalk w = LightWalk((uint(tile.y) * across + uint(tile.x)) * words, 0u, 0u);
    for (; w.word < words; ++w.word) {
        w.bits = light_masks[w.first + w.word];
        uint here = uint(bitCount(w.bits));
        if (here > skipped) break;
        skipped -= here;
        w.bits = 0u;
    }
    for (; skipped > 0u; --skipped) w.bits &= w.bits - 1u;
    return w;
}

// What the batch's lights' discs show, a byte each.
float visible_fraction(uvec4 fractions, uint channel) {
    return float((fractions[channel >> 2u] >> (8u * (channel & 3u))) & 255u) / 255.0;
}
void set_visible_fraction(inout uvec4 fractions, uint channel, float fraction) {
    uint shift = 8u * (channel & 3u);
    uint others = fractions[channel >> 2u] & ~(255u << shift);
    fractions[channel >> 2u] = others | (uint(fraction * 255.0 + 0.5) << shift);
}

// The next light's number; kNoLight: that was all.
uint next_light(inout LightWalk w) {
    uint words = light_words();
    while (w.bits == 0u) {
        if (++w.word >= words) return kNoLight;
        w.bits = light_masks[w.first + w.word];
    }
    uint bit = uint(findLSB(w.bits));
    w.bits &= w.bits - 1u;
    return w.word * 32u + bit;
}
