// SPDX-License-Identifier: MIT
// Where what a pixel sees was in the frame before. `words`: its visibility. A new kind of surface that moves has its case here.

vec3 point_before(uint state, uvec4 words, vec3 p_world) {
    return p_world;  // bricks and exact code stand still
}
