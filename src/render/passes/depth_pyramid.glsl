// SPDX-License-Identifier: MIT
// Reduces 64 x 64 values to one and writes the six levels on the way, a workgroup each: two levels in registers, four in shared memory.
// The including kernel declares first: DepthPyramidPush push, float pyramid[], float pyramid_source(ivec2 at) of level push.from.

layout(local_size_x = 16, local_size_y = 16) in;

shared float sixteenths[16][16];  // of the workgroup's tile

void write_level(int level, ivec2 at, float value) {
    int absolute = push.from + level;
    ivec2 size = ivec2(pyramid_side(push.width, absolute), pyramid_side(push.height, absolute));
    if (absolute > push.levels || at.x >= size.x || at.y >= size.y) return;
    pyramid[pyramid_first(push.width, push.height, absolute) + at.y * size.x + at.x] = value;
}

void main() {
    ivec2 size = ivec2(pyramid_side(push.width, push.from), pyramid_side(push.height, push.from));
    ivec2 group = ivec2(gl_WorkGroupID.xy);
    ivec2 local = ivec2(gl_LocalInvocationID.xy);
    ivec2 first = group * kPyramidTile + local * 4;
    float least = kPyramidNone;
    for (int quarter = 0; quarter < 4; ++quarter) {
        ivec2 corner = first + 2 * ivec2(quarter & 1, quarter >> 1);
        float of_four = kPyramidNone;
        for (int i = 0; i < 4; ++i) {
            ivec2 at = corner + ivec2(i & 1, i >> 1);
            if (at.x < size.x && at.y < size.y) of_four = min(of_four, pyramid_source(at));
        }
        write_level(1, corner >> 1, of_four);
        least = min(least, of_four);
    }
    write_level(2, first >> 2, least);
    sixteenths[local.y][local.x] = least;
    for (int level = 3; level <= kPyramidAtOnce; ++level) {
        int side = kPyramidTile >> level;
        bool mine = local.x < side && local.y < side;
        barrier();
        if (mine) {
            ivec2 from = 2 * local;
            least = min(min(sixteenths[from.y][from.x], sixteenths[from.y][from.x + 1]),
                        min(sixteenths[from.y + 1][from.x], sixteenths[from.y + 1][from.x + 1]));
        }
        barrier();
        if (mine) {
            sixteenths[local.y][local.x] = least;
            write_level(level, group * side + local, least);
        }
    }
}
