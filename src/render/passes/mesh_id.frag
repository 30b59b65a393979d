#version 460
// SPDX-License-Identifier: MIT
// Which triangle a pixel shows: its number in its part, plus one; the part.
layout(location = 0) flat in uvec2 id;
layout(location = 0) out uvec2 seen;

void main() { seen = uvec2(id.x + 1u, id.y); }
