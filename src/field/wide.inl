// SPDX-License-Identifier: MIT
// The wide loops, for one instruction set: F and I are kLanes floats and integers, M a mask of lanes. Included inside a namespace.
// Every line that makes a stored number does it as cubic.gpu.h, march.gpu.h and trilinear.gpu.h do, in their order.

struct F3 {
    F x, y, z;
};
struct I3 {
    I x, y, z;
};

static inline F number(float v) { return v - F{}; }  // not F{} + v: that would lose the sign of -0
static inline I splat(int v) { return I{} + v; }
static inline F to_float(I v) { return __builtin_convertvector(v, F); }
static inline I to_int(F v) { return __builtin_convertvector(v, I); }
static inline F abs(F v) { return (F)((I)v & 0x7fffffff); }
static inline I min(I a, I b) { return select(lt(b, a), b, a); }
static inline I max(I a, I b) { return select(lt(a, b), b, a); }
static inline M ge0(I v) { return without(all(), lt(v, splat(0))); }

static inline F load(const float* from) {
    F v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
static inline I load(const int32_t* from) {
    I v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

// ---- texels

// Values at x and x + 1 of a row, voxels.
struct Pair {
    F a, b;
};
struct WideCorners {
    Pair v00, v10, v01, v11;  // by y and z
};

template <int kTexels>
static inline Pair half_pair(const Pointers& texel) {
    // A half's bits as those of a float are 2^112 times too small: normal halves and zero only, so exactly. The shifts
    // copy the sign into the exponent, the mask takes it out again.
    constexpr int32_t kKept = int32_t(0x8fffe000);
    const I w = gather_from<2 * kTexels>(texel);
    return {(F)(((w << 16) >> 3) & kKept) * 0x1p112f, (F)((w >> 3) & kKept) * 0x1p112f};
}
static inline Pair byte_pair(const Pointers& brick, I texel) {
    const I at = min(texel, splat(kBrickTexelCount - 4));  // four bytes that end in the brick
    const I w = gather_from<0>(moved(brick, at)) >> ((texel - at) * 8);
    const I a = max((w << 24) >> 24, splat(-127)), b = max((w << 16) >> 24, splat(-127));
    return {to_float(a) * kSnorm8StepVoxels, to_float(b) * kSnorm8StepVoxels};
}
// Lanes that do not count may ask for any texel of any brick.
template <bool Half>
static inline WideCorners corners_at(const Pointers& brick, I texel) {
    if constexpr (Half) {
        const Pointers at = moved(brick, texel * 2);
        return {half_pair<0>(at), half_pair<8>(at), half_pair<64>(at), half_pair<72>(at)};
    } else {
        return {byte_pair(brick, texel), byte_pair(brick, texel + 8), byte_pair(brick, texel + 64), byte_pair(brick, texel + 72)};
    }
}

static inline F lerp(F a, F b, F t) { return a * (1.0f - t) + b * t; }
static inline F trilinear(const WideCorners& c, F3 p) {
    const F low = lerp(lerp(c.v00.a, c.v00.b, p.x), lerp(c.v10.a, c.v10.b, p.x), p.y);
    const F high = lerp(lerp(c.v01.a, c.v01.b, p.x), lerp(c.v11.a, c.v11.b, p.x), p.y);
    return lerp(low, high, p.z);
}

static inline I texel_of(I3 voxel) { return (voxel.z * 8 + voxel.y) * 8 + voxel.x; }
static inline I cell_index(const GridParams& g, I3 cell) { return (cell.z * g.size_y + cell.y) * g.size_x + cell.x; }

// ---- points

// One axis of a point: its cell in the grid and the voxel in the cell (whole numbers), the place in the voxel.
struct Place {
    F cell, voxel, part;
    M inside;
};
static inline Place place_of(F p, F inverse_voxel, int first_cell, int cells) {
    const F q = p * inverse_voxel;
    const F down = floor(q);
    const F texel = down - float(first_cell * kBrickVoxels);
    const F cell = floor((texel + 0.5f) * (1.0f / 7.0f));  // right for grids of fewer than 2^22 texels an axis
    const M inside = both(le(number(0), texel), lt(texel, number(float(cells * kBrickVoxels))));
    return {cell, texel - cell * 7.0f, q - down, inside};
}

// Points whose texels are on their way from memory.
struct Located {
    Pointers brick;  // of some brick where there is none
    I texel;
    M inside, occupied;
    F3 part;
    F empty;  // the answer where there is no brick, voxels
};

static inline void locate(const WideView& view, F3 p, Located& out) {
    const GridParams& g = view.grid;
    const F inverse = number(1.0f / g.voxel_size);
    const Place x = place_of(p.x, inverse, g.cell_x, g.size_x), y = place_of(p.y, inverse, g.cell_y, g.size_y),
                z = place_of(p.z, inverse, g.cell_z, g.size_z);
    out.inside = both(both(x.inside, y.inside), z.inside);
    const auto held = [&](F cell) { return select(out.inside, to_int(cell), splat(0)); };  // before they are multiplied
    const I index = cell_index(g, {held(x.cell), held(y.cell), held(z.cell)});
    const I word = gather(view.cells, index);
    out.occupied = both(out.inside, lt(word, splat(0)));
    out.brick = gather_pointers(view.bricks, select(out.occupied, word & int32_t(kCellSlotMask), splat(0)));
    out.texel = select(out.occupied, to_int((z.voxel * 8.0f + y.voxel) * 8.0f + x.voxel), splat(0));
    out.part = {x.part, y.part, z.part};
    out.empty = number(0);
    const M empty = without(out.inside, out.occupied);
    if (any(empty)) {
        // Every cell nearer than the jump is empty too.
        const auto to_face = [](const Place& a) {
            const F at = a.voxel + a.part;
            return min(at, 7.0f - at);
        };
        const I jump = word & 7;
        const F free = to_float(jump - 1) * 7.0f + min(min(to_face(x), to_face(y)), to_face(z));
        const F size = select(eq(jump, splat(0)), number(0), free);
        const M solid = eq(word & int32_t(kCellInside), splat(int32_t(kCellInside)));
        out.empty = select(empty, select(solid, -size, size), out.empty);
    }
}

template <bool Half>
static inline void answer(const WideView& view, const Located& at, float* out) {
    F d = at.empty;
    if (any(at.occupied)) d = select(at.occupied, trilinear(corners_at<Half>(at.brick, at.texel), at.part), d);
    d = d * view.grid.voxel_size;
    std::memcpy(out, &d, sizeof d);
}

template <bool Half>
static void all_distances(const WideView& view, const sdf::Points& points, float* out) {
    constexpr int kBlock = 128;  // points whose texels are fetched together
    Located located[kBlock / kLanes];
    for (int at = 0; at < points.count; at += kBlock) {
        const int count = points.count - at < kBlock ? points.count - at : kBlock;
        const float* from[3] = {points.x + at, points.y + at, points.z + at};
        float padded[3][kBlock], answers[kBlock];
        if (count < kBlock) {
            for (int axis = 0; axis < 3; ++axis) {
                for (int i = 0; i < kBlock; ++i) padded[axis][i] = from[axis][i < count ? i : count - 1];
                from[axis] = padded[axis];
            }
        }
        for (int i = 0; i < kBlock / kLanes; ++i) {
            locate(view, {load(from[0] + i * kLanes), load(from[1] + i * kLanes), load(from[2] + i * kLanes)}, located[i]);
            const Pointers texels = moved(located[i].brick, located[i].texel * (Half ? 2 : 1));
            const std::byte* rows[kLanes];
            std::memcpy(rows, &texels, sizeof rows);
            for (const std::byte* const row : rows) {
                __builtin_prefetch(row);
                __builtin_prefetch(row + 72 * (Half ? 2 : 1));
            }
        }
        float* const to = count < kBlock ? answers : out + at;
        for (int i = 0; i < kBlock / kLanes; ++i) answer<Half>(view, located[i], to + i * kLanes);
        if (count < kBlock) std::memcpy(out + at, answers, sizeof(float) * size_t(count));
    }
}

void distances(const WideView& view, const sdf::Points& points, float* out) {
    if (view.texel_bytes == 2) {
        all_distances<true>(view, points, out);
    } else {
        all_distances<false>(view, points, out);
    }
}

// ---- rays

struct WideCubic {
    F b0, b1, b2, b3;
};
// Each of the eight values is trilinear()'s, bit for bit: what they share is made once.
static inline WideCubic cubic_of(const WideCorners& c, F3 p, F3 q) {
    struct Square {
        F v00, v10, v01, v11;  // by y and z
    };
    const auto along_x = [&](F x) {
        return Square{lerp(c.v00.a, c.v00.b, x), lerp(c.v10.a, c.v10.b, x), lerp(c.v01.a, c.v01.b, x), lerp(c.v11.a, c.v11.b, x)};
    };
    const Square xp = along_x(p.x), xq = along_x(q.x);
    const auto along_y = [](const Square& v, F y, F& low, F& high) {
        low = lerp(v.v00, v.v10, y);
        high = lerp(v.v01, v.v11, y);
    };
    F low_pp, high_pp, low_pq, high_pq, low_qp, high_qp, low_qq, high_qq;  // by the ends of x and y
    along_y(xp, p.y, low_pp, high_pp);
    along_y(xp, q.y, low_pq, high_pq);
    along_y(xq, p.y, low_qp, high_qp);
    along_y(xq, q.y, low_qq, high_qq);
    const F ppq = lerp(low_pp, high_pp, q.z), pqp = lerp(low_pq, high_pq, p.z), qpp = lerp(low_qp, high_qp, p.z);
    const F pqq = lerp(low_pq, high_pq, q.z), qpq = lerp(low_qp, high_qp, q.z), qqp = lerp(low_qq, high_qq, p.z);
    return {lerp(low_pp, high_pp, p.z), (qpp + pqp + ppq) * 0.33333334f, (pqq + qpq + qqp) * 0.33333334f,
            lerp(low_qq, high_qq, q.z)};
}
static inline F value_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return ((c.b0 * r + 3.0f * c.b1 * s) * r + 3.0f * c.b2 * s * s) * r + c.b3 * s * s * s;
}
static inline F slope_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return 3.0f * ((c.b1 - c.b0) * r * r + 2.0f * (c.b2 - c.b1) * r * s + (c.b3 - c.b2) * s * s);
}

static inline F bracketed(const WideCubic& c, M active, F lo, F hi, F value_lo, F value_hi) {
    F s = lo + (hi - lo) * (value_lo / (value_lo - value_hi));
    for (int i = 0; i < 24 && any(active); ++i) {
        const F value = value_of(c, s);
        const M above = lt(number(0), value);
        lo = select(both(active, above), s, lo);
        hi = select(without(active, above), s, hi);
        const F slope = slope_of(c, s);
        F next = select(lt(slope, number(0)), s - value / slope, lo);
        next = select(both(le(lo, next), le(next, hi)), next, 0.5f * (lo + hi));
        const F moved = abs(next - s);
        s = select(active, next, s);
        active = without(active, lt(moved, number(1e-6f)));
    }
    return s;
}

static inline F first_root(const WideCubic& c, M active) {
    const F one = number(1), zero = number(0);
    const M start = le(c.b0, zero);
    F root = select(start, zero, number(kNoRoot));
    active = without(without(active, start), lt(zero, min(min(c.b1, c.b2), c.b3)));
    if (!any(active)) return root;
    const F d0 = c.b1 - c.b0;
    const F h = (c.b2 - c.b1) - d0;
    const F a = (c.b3 - c.b2) - (c.b2 - c.b1) - h;
    const F squared = h * h - a * d0;
    const M split = lt(zero, squared);
    const F size = sqrt(max(squared, zero));
    const F w = select(lt(h, zero), size - h, -size - h);
    F u = select(lt(abs(a), abs(w)), one, w / a);
    F v = select(lt(abs(w), abs(d0)), one, d0 / w);
    u = select(both(split, both(lt(zero, u), lt(u, one))), u, one);
    v = select(both(split, both(lt(zero, v), lt(v, one))), v, one);
    const F first = min(u, v), second = max(u, v);
    const F value_first = select(lt(first, one), value_of(c, first), c.b3);
    const F value_second = select(lt(second, one), value_of(c, second), c.b3);
    const M in_first = le(value_first, zero);
    const M in_second = both(lt(first, one), le(value_second, zero));
    const M in_third = both(both(lt(first, one), lt(second, one)), le(c.b3, zero));
    const M found = both(active, either(either(in_first, in_second), in_third));
    if (!any(found)) return root;
    const F lo = select(in_first, zero, select(in_second, first, second));
    const F hi = select(in_first, first, select(in_second, second, one));
    const F value_lo = select(in_first, c.b0, select(in_second, value_first, value_second));
    const F value_hi = select(in_first, value_first, select(in_second, value_second, c.b3));
    return select(found, bracketed(c, found, lo, hi, value_lo, value_hi), root);
}

static inline F leading(F a) { return (F)((I)a & int32_t(0xfffff000)); }
static inline F crossing(F plane, F high, F low, F inverse, M flat, float parallel) {
    return select(flat, number(parallel), ((plane - high) - low) * inverse);
}
static inline F texel_crossing(I texel, I whole, F part, F inverse, M flat, float parallel) {
    return select(flat, number(parallel), (to_float(texel - whole) - part) * inverse);
}

// Rays of one packet, texels counted from the grid's first.
struct Packet {
    I3 whole;
    F3 part, direction, inverse;
    M up_x, up_y, up_z;
    M flat_x, flat_y, flat_z;  // parallel to the planes of an axis
};

// One axis of a packet's way through bricks.
struct BrickAxis {
    I stride;      // -1, 1
    I ahead;       // from a voxel to the plane through which the ray leaves it: 0, 1
    I last;        // that plane of the last voxel: 0, 7
    F last_plane;  // pushed out by kFaceOverlap

    explicit BrickAxis(M up)
        : stride(select(up, splat(1), splat(-1))), ahead(select(up, splat(1), splat(0))),
          last(select(up, splat(kBrickVoxels), splat(0))),
          last_plane(select(up, number(float(kBrickVoxels) + kFaceOverlap), number(-kFaceOverlap))) {}
    F exit_plane(I voxel) const {
        const I plane = voxel + ahead;
        return select(eq(plane, last), last_plane, to_float(plane));
    }
};

struct WideBrickRay {
    F3 high, low, lead, rest;
    F t_base;
};
static inline void rebase(I whole, F part, F direction, F t, F& high, F& low) {
    const F lead = leading(direction);
    const F a = to_float(whole), b = lead * t;
    const F sum = a + b;
    const F b_seen = sum - a;
    const F lost = (a - (sum - b_seen)) + (b - b_seen);
    high = sum;
    low = ((direction - lead) * t + lost) + part;
}
static inline WideBrickRay brick_ray_of(const Packet& ray, I3 texel) {
    const I3 away{ray.whole.x - texel.x, ray.whole.y - texel.y, ray.whole.z - texel.z};
    const F3 d = ray.direction;
    const F middle = (3.5f - ray.part.x - to_float(away.x)) * d.x + (3.5f - ray.part.y - to_float(away.y)) * d.y +
                     (3.5f - ray.part.z - to_float(away.z)) * d.z;
    WideBrickRay out;
    out.t_base = leading(middle);
    out.lead = {leading(d.x), leading(d.y), leading(d.z)};
    out.rest = {d.x - out.lead.x, d.y - out.lead.y, d.z - out.lead.z};
    rebase(away.x, ray.part.x, d.x, out.t_base, out.high.x, out.low.x);
    rebase(away.y, ray.part.y, d.y, out.t_base, out.high.y, out.low.y);
    rebase(away.z, ray.part.z, d.z, out.t_base, out.high.z, out.low.z);
    return out;
}
static inline F coordinate(F from, F high, F low, F lead, F rest, F s) {
    const F c = leading(s);
    const F large = (high - from) + lead * c;
    const F small = low + (rest * c + (lead + rest) * (s - c));
    return large + small;
}
static inline F3 point_in_voxel(const WideBrickRay& r, I3 voxel, F s) {
    const auto one = [&](I v, F high, F low, F lead, F rest) {
        return min(max(coordinate(to_float(v), high, low, lead, rest, s), number(-kFaceOverlap)), number(1.0f + kFaceOverlap));
    };
    return {one(voxel.x, r.high.x, r.low.x, r.lead.x, r.rest.x), one(voxel.y, r.high.y, r.low.y, r.lead.y, r.rest.y),
            one(voxel.z, r.high.z, r.low.z, r.lead.z, r.rest.z)};
}
// What the packet's rays have met, by lane.
struct Met {
    I state, slot;
    F t;
    I3 cell, voxel;
    F3 p;
};

// A packet's walk through the voxels of one brick a lane.
template <bool Half>
struct BrickWalk {
    const WideView& view;
    const Packet& packet;
    const WideBrickRay ray;
    const I slot;
    const BrickAxis x, y, z;
    F enter, leave;
    I3 voxel;
    M walking;

    // Steps to the next voxel; lanes that leave the brick walk no more.
    void step(M m) {
        F out_x, out_y, out_z;
        const F out_any = exits(out_x, out_y, out_z);
        const M last = le(leave, out_any);
        enter = select(m, max(min(out_any, leave), enter), enter);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        voxel.x = select(both(m, by_x), voxel.x + x.stride, voxel.x);
        voxel.y = select(both(m, by_y), voxel.y + y.stride, voxel.y);
        voxel.z = select(both(m, by_z), voxel.z + z.stride, voxel.z);
        const M outside = either(lt(min(min(voxel.x, voxel.y), voxel.z), splat(0)),
                                 lt(splat(kBrickVoxels - 1), max(max(voxel.x, voxel.y), voxel.z)));
        walking = without(walking, both(m, either(last, outside)));
    }
    F exits(F& out_x, F& out_y, F& out_z) const {
        out_x = crossing(x.exit_plane(voxel.x), ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x, kFarVoxels);
        out_y = crossing(y.exit_plane(voxel.y), ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y, kFarVoxels);
        out_z = crossing(z.exit_plane(voxel.z), ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z, kFarVoxels);
        return min(min(out_x, out_y), out_z);
    }

    // Walks each lane to its next voxel with a solid corner: the others' eight values are positive, so they hold no root.
    M candidates() {
        M found = none();
        const I first = slot * kSolidMaskBytes;
        for (M now = walking; any(now); now = without(walking, found)) {
            const I row = gather_bytes(view.solid, select(now, first + voxel.z * 8 + voxel.y, splat(0)));
            found = either(found, both(now, eq((row >> voxel.x) & 1, splat(1))));
            step(without(now, found));
        }
        return found;
    }

    // Lanes with a hit.
    M run(M m, Met& met) {
        M hits = none();
        const Pointers brick = gather_pointers(view.bricks, slot);
        walking = m;
        while (true) {
            const M now = candidates();
            if (!any(now)) return hits;
            F out_x, out_y, out_z;
            const F exit = max(min(exits(out_x, out_y, out_z), leave), enter);
            const WideCorners corners = corners_at<Half>(brick, select(now, texel_of(voxel), splat(0)));
            const F root = first_root(cubic_of(corners, point_in_voxel(ray, voxel, enter), point_in_voxel(ray, voxel, exit)), now);
            const M hit = both(now, le(root, number(1)));
            if (any(hit)) {
                const F s = enter + root * (exit - enter);
                const F3 p = point_in_voxel(ray, voxel, s);
                const auto unit = [](F v) { return min(max(v, number(0)), number(1)); };
                met.t = select(hit, ray.t_base + s, met.t);
                met.voxel = {select(hit, voxel.x, met.voxel.x), select(hit, voxel.y, met.voxel.y), select(hit, voxel.z, met.voxel.z)};
                met.p = {select(hit, unit(p.x), met.p.x), select(hit, unit(p.y), met.p.y), select(hit, unit(p.z), met.p.z)};
                hits = either(hits, hit);
                walking = without(walking, hit);
            }
            step(without(now, hit));
        }
    }
};

template <bool Half>
static inline M march_in_bricks(const WideView& view, const Packet& packet, I3 cell, I slot, M m, F t_max, Met& met) {
    const WideBrickRay ray = brick_ray_of(packet, {cell.x * kBrickVoxels, cell.y * kBrickVoxels, cell.z * kBrickVoxels});
    const F first = number(-kFaceOverlap), last = number(float(kBrickVoxels) + kFaceOverlap);
    F enter = 0.0f - ray.t_base, leave = t_max - ray.t_base;
    const auto clip = [&](M up, F high, F low, F inverse, M flat) {
        enter = max(enter, crossing(select(up, first, last), high, low, inverse, flat, -kFarVoxels));
        leave = min(leave, crossing(select(up, last, first), high, low, inverse, flat, kFarVoxels));
    };
    clip(packet.up_x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
    clip(packet.up_y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
    clip(packet.up_z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);
    const auto voxel_of = [&](F high, F low, F lead, F rest) {
        return to_int(min(max(coordinate(number(0), high, low, lead, rest, enter), number(0)), number(6.5f)));
    };
    BrickWalk<Half> walk{view,
                   packet,
                   ray,
                   select(m, slot, splat(0)),
                   BrickAxis(packet.up_x),
                   BrickAxis(packet.up_y),
                   BrickAxis(packet.up_z),
                   enter,
                   leave,
                   {voxel_of(ray.high.x, ray.low.x, ray.lead.x, ray.rest.x), voxel_of(ray.high.y, ray.low.y, ray.lead.y, ray.rest.y),
                    voxel_of(ray.high.z, ray.low.z, ray.lead.z, ray.rest.z)},
                   none()};
    return walk.run(without(m, lt(leave, enter)), met);
}

static inline I cell_of(I whole, F part, F direction, F t) {
    return to_int(floor((to_float(whole) + (part + direction * t)) / 7.0f));
}

// A packet's walk through the cells of the grid.
struct GridWalk {
    const GridParams& g;
    const Packet& packet;
    F t_max;
    F t;
    I3 cell;

    // Leaves the cube of empty cells around each lane's; answers the lanes that are in the grid still.
    M step(M m, I reach) {
        const auto border = [&](M up, I c) { return select(up, c + reach + 1, c - reach); };
        const I border_x = border(packet.up_x, cell.x), border_y = border(packet.up_y, cell.y),
                border_z = border(packet.up_z, cell.z);
        const F out_x = texel_crossing(border_x * kBrickVoxels, packet.whole.x, packet.part.x, packet.inverse.x, packet.flat_x, kFarVoxels);
        const F out_y = texel_crossing(border_y * kBrickVoxels, packet.whole.y, packet.part.y, packet.inverse.y, packet.flat_y, kFarVoxels);
        const F out_z = texel_crossing(border_z * kBrickVoxels, packet.whole.z, packet.part.z, packet.inverse.z, packet.flat_z, kFarVoxels);
        const F out_any = min(min(out_x, out_y), out_z);
        t = select(m, max(t, out_any), t);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        if (any(both(m, lt(splat(0), reach)))) {  // the other axes may have moved within the cube
            const auto drift = [&](I& c, M by, I whole, F part, F direction) {
                const M drifts = without(without(m, by), eq(direction, number(0)));
                c = select(drifts, min(max(cell_of(whole, part, direction, t), c - reach), c + reach), c);
            };
            drift(cell.x, by_x, packet.whole.x, packet.part.x, packet.direction.x);
            drift(cell.y, by_y, packet.whole.y, packet.part.y, packet.direction.y);
            drift(cell.z, by_z, packet.whole.z, packet.part.z, packet.direction.z);
        }
        const auto leap = [&](I& c, M by, M up, I to) { c = select(both(m, by), select(up, to, to - 1), c); };
        leap(cell.x, by_x, packet.up_x, border_x);
        leap(cell.y, by_y, packet.up_y, border_y);
        leap(cell.z, by_z, packet.up_z, border_z);
        return without(both(m, in_grid()), lt(t_max, t));
    }
    M in_grid() const {
        return both(ge0(min(min(cell.x, cell.y), cell.z)),
                    both(both(lt(cell.x, splat(g.size_x)), lt(cell.y, splat(g.size_y))), lt(cell.z, splat(g.size_z))));
    }
};

template <bool Half>
static void march_packet(const WideView& view, const Packet& packet, M active, F t_max, Met& met) {
    const GridParams& g = view.grid;
    const I wide_x = splat(g.size_x * kBrickVoxels), wide_y = splat(g.size_y * kBrickVoxels), wide_z = splat(g.size_z * kBrickVoxels);
    F t = number(0), end = t_max;
    const auto clip = [&](M up, I wide, I whole, F part, F inverse, M flat) {
        t = max(t, texel_crossing(select(up, splat(0), wide), whole, part, inverse, flat, -kFarVoxels));
        end = min(end, texel_crossing(select(up, wide, splat(0)), whole, part, inverse, flat, kFarVoxels));
    };
    clip(packet.up_x, wide_x, packet.whole.x, packet.part.x, packet.inverse.x, packet.flat_x);
    clip(packet.up_y, wide_y, packet.whole.y, packet.part.y, packet.inverse.y, packet.flat_y);
    clip(packet.up_z, wide_z, packet.whole.z, packet.part.z, packet.inverse.z, packet.flat_z);
    active = both(active, le(t, end));
    if (!any(active)) return;
    GridWalk walk{g, packet, t_max, t, {}};
    const auto enter = [&](I& cell, I whole, F part, F direction, int size) {
        cell = select(active, cell_of(whole, part, direction, t), splat(0));
        const M outside = either(lt(cell, splat(0)), lt(splat(size - 1), cell));
        active = without(active, both(eq(direction, number(0)), outside));
        cell = min(max(cell, splat(0)), splat(size - 1));  // on the other axes rounding may have put it just outside
    };
    enter(walk.cell.x, packet.whole.x, packet.part.x, packet.direction.x, g.size_x);
    enter(walk.cell.y, packet.whole.y, packet.part.y, packet.direction.y, g.size_y);
    enter(walk.cell.z, packet.whole.z, packet.part.z, packet.direction.z, g.size_z);
    I slot = splat(0);
    const int most = 2 * (g.size_x + g.size_y + g.size_z + 3);
    for (int round = 0; any(active) && round < most; ++round) {
        // Every lane goes to its next brick, so that all walk through voxels together.
        M in_brick = none();
        for (M look = active; any(look);) {
            const I word = gather(view.cells, select(look, cell_index(g, walk.cell), splat(0)));
            const M occupied = both(look, lt(word, splat(0)));
            in_brick = either(in_brick, occupied);
            slot = select(occupied, word & int32_t(kCellSlotMask), slot);
            const M empty = without(look, occupied);
            const M solid = both(empty, eq(word & int32_t(kCellInside), splat(int32_t(kCellInside))));
            if (any(solid)) {
                met.state = select(solid, splat(kMarchInside), met.state);
                met.t = select(solid, walk.t, met.t);
                met.cell = {select(solid, walk.cell.x + g.cell_x, met.cell.x), select(solid, walk.cell.y + g.cell_y, met.cell.y),
                            select(solid, walk.cell.z + g.cell_z, met.cell.z)};
                active = without(active, solid);
            }
            const M onwards = without(empty, solid);
            look = walk.step(onwards, max((word & 7) - 1, splat(0)));
            active = without(active, without(onwards, look));
        }
        if (!any(in_brick)) return;
        const M hit = march_in_bricks<Half>(view, packet, walk.cell, slot, in_brick, t_max, met);
        met.state = select(hit, splat(kMarchHit), met.state);
        met.slot = select(hit, slot, met.slot);
        met.cell = {select(hit, walk.cell.x + g.cell_x, met.cell.x), select(hit, walk.cell.y + g.cell_y, met.cell.y),
                    select(hit, walk.cell.z + g.cell_z, met.cell.z)};
        const M onwards = without(in_brick, hit);
        const M still = walk.step(onwards, splat(0));
        active = without(active, either(hit, without(onwards, still)));
    }
}

void march(const WideView& view, const WideRays& rays, int count, MarchHit* hits) {
    for (int at = 0; at < count; at += kLanes) {
        const int lanes = count - at < kLanes ? count - at : kLanes;
        int32_t whole[3][kLanes] = {};
        float part[3][kLanes] = {}, direction[3][kLanes] = {}, far[kLanes] = {};
        std::memcpy(far, rays.t_max + at, sizeof(float) * size_t(lanes));
        for (int axis = 0; axis < 3; ++axis) {
            std::memcpy(whole[axis], rays.whole[axis] + at, sizeof(int32_t) * size_t(lanes));
            std::memcpy(part[axis], rays.part[axis] + at, sizeof(float) * size_t(lanes));
            std::memcpy(direction[axis], rays.direction[axis] + at, sizeof(float) * size_t(lanes));
        }
        const auto component = [](F d) { return select(lt(abs(d), number(1e-12f)), number(0), d); };
        const auto inverse = [](F d) { return select(eq(d, number(0)), number(0), 1.0f / d); };
        Packet packet;
        packet.whole = {load(whole[0]) - view.grid.cell_x * kBrickVoxels, load(whole[1]) - view.grid.cell_y * kBrickVoxels,
                        load(whole[2]) - view.grid.cell_z * kBrickVoxels};
        packet.part = {load(part[0]), load(part[1]), load(part[2])};
        packet.direction = {component(load(direction[0])), component(load(direction[1])), component(load(direction[2]))};
        packet.inverse = {inverse(packet.direction.x), inverse(packet.direction.y), inverse(packet.direction.z)};
        packet.flat_x = eq(packet.inverse.x, number(0));
        packet.flat_y = eq(packet.inverse.y, number(0));
        packet.flat_z = eq(packet.inverse.z, number(0));
        packet.up_x = lt(number(0), packet.inverse.x);
        packet.up_y = lt(number(0), packet.inverse.y);
        packet.up_z = lt(number(0), packet.inverse.z);
        const I lane_numbers = [] {
            I v;
            for (int lane = 0; lane < kLanes; ++lane) v[lane] = lane;
            return v;
        }();
        const F t_max = load(far);
        Met met{splat(kMarchMiss), splat(-1), t_max, {splat(0), splat(0), splat(0)}, {splat(0), splat(0), splat(0)},
                {number(0), number(0), number(0)}};
        (view.texel_bytes == 2 ? march_packet<true> : march_packet<false>)(view, packet, lt(lane_numbers, splat(lanes)), t_max, met);
        for (int lane = 0; lane < lanes; ++lane) {
            MarchHit& hit = hits[at + lane];
            hit.state = met.state[lane];
            hit.t = met.t[lane];
            hit.slot = met.slot[lane];
            hit.cell = {met.cell.x[lane], met.cell.y[lane], met.cell.z[lane]};
            hit.voxel = {met.voxel.x[lane], met.voxel.y[lane], met.voxel.z[lane]};
            hit.p = {met.p.x[lane], met.p.y[lane], met.p.z[lane]};
            hit.cells = hit.voxels = 0;
        }
    }
}
