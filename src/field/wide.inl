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

static inline F3 select(M m, F3 a, F3 b) { return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)}; }
static inline I3 select(M m, I3 a, I3 b) { return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)}; }

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

// ---- cells

// Flags of an entry (wide.h), as they stand in its upper half.
constexpr int32_t kInsideFlag = int32_t(kWideInside >> 32), kSolidFlag = int32_t(kWideSolid >> 32);
static inline M is_occupied(I flags) { return lt(flags, splat(0)); }
static inline I jump_of(I flags) { return (flags >> (kWideJumpShift - 32)) & 7; }
static inline M has(I flags, int32_t flag) { return eq(flags & flag, splat(flag)); }

// Where cells of the grid have their entries: which page, which of its words.
struct CellPlace {
    I page, word;
};
static inline CellPlace cell_place(const WideView& view, I3 cell) {
    return {((cell.z >> 3) * view.pages_y + (cell.y >> 3)) * view.pages_x + (cell.x >> 3),
            ((cell.z & 7) * 8 + (cell.y & 7)) * 8 + (cell.x & 7)};
}
static inline Pointers entries_of(const WideView& view, const CellPlace& at, I& flags) {
    return gather_entries(moved(gather_pages(view.pages, at.page), at.word * int32_t(sizeof(WideEntry))), flags);
}

// ---- points

// One axis of a point: its cell in the grid and the voxel in the cell (whole numbers), the place in the voxel.
struct Place {
    F cell, voxel, part;
    M inside;
};
static inline Place place_of(F p, F inverse_voxel, float first_texel, float past_texel) {
    const F q = p * inverse_voxel;
    const F down = floor(q);
    const F texel = down - first_texel;
    const F cell = floor((texel + 0.5f) * (1.0f / 7.0f));  // right for grids of fewer than 2^22 texels an axis
    const M inside = both(le(number(first_texel), down), lt(down, number(past_texel)));
    return {cell, texel - cell * 7.0f, q - down, inside};
}

// A packet of points.
struct Located {
    Place x, y, z;
    M inside;
    CellPlace cell;  // of the grid's first cell for points outside the grid

    Located(const WideView& view, F3 p) {
        const F inverse = number(view.inverse_voxel);
        x = place_of(p.x, inverse, view.low[0], view.high[0]);
        y = place_of(p.y, inverse, view.low[1], view.high[1]);
        z = place_of(p.z, inverse, view.low[2], view.high[2]);
        inside = both(both(x.inside, y.inside), z.inside);
        const auto held = [&](F c) { return select(inside, to_int(c), splat(0)); };  // before they are multiplied
        cell = cell_place(view, {held(x.cell), held(y.cell), held(z.cell)});
    }
    I row() const { return to_int(y.voxel * 8.0f + x.voxel); }
    F3 part() const { return {x.part, y.part, z.part}; }
    // The answer where there is no brick, voxels.
    F empty(I flags) const {
        // Every cell nearer than the jump is empty too.
        const auto to_face = [](const Place& a) {
            const F at = a.voxel + a.part;
            return min(at, 7.0f - at);
        };
        const I jump = jump_of(flags);
        const F free = to_float(jump - 1) * 7.0f + min(min(to_face(x), to_face(y)), to_face(z));
        const F size = select(eq(jump, splat(0)), number(0), free);
        return select(inside, select(has(flags, kInsideFlag), -size, size), number(0));
    }
};

// Points whose texels are on their way from memory.
struct Waiting {
    Pointers brick;  // of some texels where there is no brick
    I texel;
    M occupied;
    F3 part;
    F empty;
    int at;  // in the list
};

static inline void wait_for(const WideView& view, const Located& p, Waiting& out) {
    I flags;
    out.brick = entries_of(view, p.cell, flags);
    out.occupied = both(p.inside, is_occupied(flags));
    out.texel = select(out.occupied, to_int(p.z.voxel) * 64 + p.row(), splat(0));
    out.part = p.part();
    out.empty = number(0);
    if (any(without(p.inside, out.occupied))) out.empty = p.empty(flags);
}

template <bool Half>
static inline F answer(const Waiting& at) {
    if (!any(at.occupied)) return at.empty;
    return select(at.occupied, trilinear(corners_at<Half>(at.brick, at.texel), at.part), at.empty);
}

#ifdef KILN_WIDE_SLICES
// Neighbours that lie in one or two cells, as points do that are asked in the order of space: no texel is gathered, each slice of
// voxels is read once. False where they lie in more.
template <bool Half>
static inline bool answer_by_slices(const WideView& view, const Located& p, F& out) {
    const I index = p.cell.page * int32_t(std::tuple_size_v<WidePage>) + p.cell.word;
    const M first = eq(index, splat(index[0])), others = without(all(), first);
    if (any(without(all(), p.inside)) || any(without(others, eq(index, splat(index[kLanes - 1]))))) return false;
    int32_t slices[kLanes];
    const I slice = to_int(p.z.voxel);
    std::memcpy(slices, &slice, sizeof slices);
    const Words texel = pair_of(p.row());
    Words v00{}, v10{}, v01{}, v11{};
    I flags = splat(0);
    const auto look = [&](M lanes, int one) {
        const WideEntry entry = (*view.pages[p.cell.page[one]])[size_t(p.cell.word[one])];
        flags = select(lanes, splat(int32_t(entry >> 32)), flags);
        if ((entry & kWideOccupied) == 0) return;
        const std::byte* const brick = reinterpret_cast<const std::byte*>(uintptr_t(entry & kWideAddress));
        do {
            const int z = slices[__builtin_ctz(bits(lanes))];
            const M here = both(lanes, eq(slice, splat(z)));
            const std::byte* const codes = brick + z * (Half ? 128 : 64);
            const SliceTable near = slice_table<Half>(codes), far = slice_table<Half>(codes + (Half ? 128 : 64));
            v00 = looked_up(near, texel, 0, here, v00);
            v10 = looked_up(near, texel, 8, here, v10);
            v01 = looked_up(far, texel, 0, here, v01);
            v11 = looked_up(far, texel, 8, here, v11);
            lanes = without(lanes, here);
        } while (any(lanes));
    };
    look(first, 0);
    if (any(others)) look(others, kLanes - 1);
    WideCorners corners;
    values_of<Half>(v00, corners.v00.a, corners.v00.b);
    values_of<Half>(v10, corners.v10.a, corners.v10.b);
    values_of<Half>(v01, corners.v01.a, corners.v01.b);
    values_of<Half>(v11, corners.v11.a, corners.v11.b);
    out = trilinear(corners, p.part());
    const M occupied = is_occupied(flags);
    if (any(without(all(), occupied))) out = select(occupied, out, p.empty(flags));
    return true;
}
#endif

template <bool Half>
static void all_distances(const WideView& view, const sdf::Points& points, float* out) {
    constexpr int kBlock = 128;  // points whose texels are fetched together
    Waiting waiting[kBlock / kLanes];
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
        float* const to = count < kBlock ? answers : out + at;
        const auto store = [&](int i, F d) {
            d = d * view.grid.voxel_size;
            std::memcpy(to + i, &d, sizeof d);
        };
        int n = 0;
        for (int i = 0; i < kBlock; i += kLanes) {
            const Located p(view, {load(from[0] + i), load(from[1] + i), load(from[2] + i)});
#ifdef KILN_WIDE_SLICES
            if (F d; answer_by_slices<Half>(view, p, d)) {
                store(i, d);
                continue;
            }
#endif
            Waiting& w = waiting[n++];
            w.at = i;
            wait_for(view, p, w);
            const Pointers texels = moved(w.brick, w.texel * (Half ? 2 : 1));
            const std::byte* rows[kLanes];
            std::memcpy(rows, &texels, sizeof rows);
            for (const std::byte* const row : rows) {
                __builtin_prefetch(row);
                __builtin_prefetch(row + 72 * (Half ? 2 : 1));
            }
        }
        for (int i = 0; i < n; ++i) store(waiting[i].at, answer<Half>(waiting[i]));
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
static inline M select_lanes(M m, M a, M b) { return either(both(m, a), without(b, m)); }
static inline Packet select(M m, const Packet& a, const Packet& b) {
    return {select(m, a.whole, b.whole),         select(m, a.part, b.part),
            select(m, a.direction, b.direction), select(m, a.inverse, b.inverse),
            select_lanes(m, a.up_x, b.up_x),     select_lanes(m, a.up_y, b.up_y),
            select_lanes(m, a.up_z, b.up_z),     select_lanes(m, a.flat_x, b.flat_x),
            select_lanes(m, a.flat_y, b.flat_y), select_lanes(m, a.flat_z, b.flat_z)};
}

// The plane through which a ray leaves a voxel, of one axis; the brick's own faces are pushed out by kFaceOverlap.
static inline F exit_plane(M up, I voxel) {
    const F last = select(up, number(float(kBrickVoxels) + kFaceOverlap), number(-kFaceOverlap));
    const I plane = select(up, voxel + 1, voxel);
    return select(eq(plane, select(up, splat(kBrickVoxels), splat(0))), last, to_float(plane));
}
static inline F entry_plane(M up, I voxel) { return exit_plane(without(all(), up), voxel); }
static inline I stepped(M m, M up, I voxel) { return select(m, voxel + select(up, splat(1), splat(-1)), voxel); }

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
static inline WideBrickRay select(M m, const WideBrickRay& a, const WideBrickRay& b) {
    return {select(m, a.high, b.high), select(m, a.low, b.low), select(m, a.lead, b.lead), select(m, a.rest, b.rest),
            select(m, a.t_base, b.t_base)};
}
static inline F3 point_in_voxel(const WideBrickRay& r, I3 voxel, F s) {
    const auto one = [&](I v, F high, F low, F lead, F rest) {
        return min(max(coordinate(to_float(v), high, low, lead, rest, s), number(-kFaceOverlap)), number(1.0f + kFaceOverlap));
    };
    return {one(voxel.x, r.high.x, r.low.x, r.lead.x, r.rest.x), one(voxel.y, r.high.y, r.low.y, r.lead.y, r.rest.y),
            one(voxel.z, r.high.z, r.low.z, r.lead.z, r.rest.z)};
}
static inline I cell_of(I whole, F part, F direction, F t) {
    return to_int(floor((to_float(whole) + (part + direction * t)) / 7.0f));
}

// Rays under way, one a lane. What they have to do next differs: look at the next cell, enter a brick, walk its voxels, solve a voxel's cubic.
// All that wait for the same do it together, the most first; a lane that is done takes the next ray of the list.
template <bool Half>
struct Marching {
    const WideView& view;
    const WideRays& list;
    const int total;
    MarchHit* const hits;
    int& next;

    // By lane:
    I number_in_list{};
    Packet packet{};
    F t_max{}, t{};  // t: where the ray has come to, by cells
    I3 cell{};
    I reach{};       // cells around that are empty too
    Pointers brick = same_pointer(wide_no_texels());  // or the last one, so that every lane may read
    WideBrickRay ray{};
    F enter{}, leave{};  // from ray.t_base: into the voxel, out of the brick
    F past{};            // there no voxel with a solid corner comes any more
    I3 voxel{};
    M looking = none(), entering = none(), walking = none(), solving = none();
    M stepping = none();  // of those looking: not at the cell where they are, but at the next

    // Does what most lanes wait for; false when there is nothing left to do.
    bool turn() {
        constexpr int kSpare = kLanes / 4;  // lanes that wait for new rays
        const int look = count(looking), in = count(entering), walk = count(walking), solve = count(solving);
        const int busy = look + in + walk + solve;
        if (next < total && kLanes - busy >= kSpare) {
            take();
        } else if (busy == 0) {
            return false;
        } else if (solve >= max_of(look, in, walk)) {
            solve_voxels();
        } else if (in >= max_of(look, walk, 0)) {
            enter_bricks();
        } else if (walk >= look) {
            walk_voxels();
        } else {
            look_at_cells();
        }
        return true;
    }
    static int max_of(int a, int b, int c) { return std::max(std::max(a, b), c); }

    // Gives the next rays to free lanes.
    void take() {
        const M free = without(all(), either(either(looking, entering), either(walking, solving)));
        int32_t whole[3][kLanes] = {}, order[kLanes] = {}, taken[kLanes] = {};
        float part[3][kLanes] = {}, direction[3][kLanes] = {}, far[kLanes] = {};
        for (uint32_t left = bits(free); left != 0 && next < total; left &= left - 1, ++next) {
            const int lane = __builtin_ctz(left);
            for (int axis = 0; axis < 3; ++axis) {
                whole[axis][lane] = list.whole[axis][next];
                part[axis][lane] = list.part[axis][next];
                direction[axis][lane] = list.direction[axis][next];
            }
            far[lane] = list.t_max[next];
            order[lane] = next;
            taken[lane] = -1;
        }
        const M fresh = lt(load(taken), splat(0));
        const auto component = [](F d) { return select(lt(abs(d), number(1e-12f)), number(0), d); };
        const auto inverse = [](F d) { return select(eq(d, number(0)), number(0), 1.0f / d); };
        Packet p;
        p.whole = {load(whole[0]) - view.grid.cell_x * kBrickVoxels, load(whole[1]) - view.grid.cell_y * kBrickVoxels,
                   load(whole[2]) - view.grid.cell_z * kBrickVoxels};
        p.part = {load(part[0]), load(part[1]), load(part[2])};
        p.direction = {component(load(direction[0])), component(load(direction[1])), component(load(direction[2]))};
        p.inverse = {inverse(p.direction.x), inverse(p.direction.y), inverse(p.direction.z)};
        p.flat_x = eq(p.inverse.x, number(0));
        p.flat_y = eq(p.inverse.y, number(0));
        p.flat_z = eq(p.inverse.z, number(0));
        p.up_x = lt(number(0), p.inverse.x);
        p.up_y = lt(number(0), p.inverse.y);
        p.up_z = lt(number(0), p.inverse.z);
        packet = select(fresh, p, packet);
        number_in_list = select(fresh, load(order), number_in_list);
        t_max = select(fresh, load(far), t_max);

        // Into the grid.
        const GridParams& g = view.grid;
        F from = number(0), end = t_max;
        const auto clip = [&](M up, int cells, I whole_texel, F in_texel, F inverse_direction, M flat) {
            const I wide = splat(cells * kBrickVoxels);
            from = max(from, texel_crossing(select(up, splat(0), wide), whole_texel, in_texel, inverse_direction, flat, -kFarVoxels));
            end = min(end, texel_crossing(select(up, wide, splat(0)), whole_texel, in_texel, inverse_direction, flat, kFarVoxels));
        };
        clip(packet.up_x, g.size_x, packet.whole.x, packet.part.x, packet.inverse.x, packet.flat_x);
        clip(packet.up_y, g.size_y, packet.whole.y, packet.part.y, packet.inverse.y, packet.flat_y);
        clip(packet.up_z, g.size_z, packet.whole.z, packet.part.z, packet.inverse.z, packet.flat_z);
        M in = both(fresh, le(from, end));
        t = select(in, from, t);
        const auto enter_axis = [&](I& c, I whole_texel, F in_texel, F along, int size) {
            const I first = select(in, cell_of(whole_texel, in_texel, along, t), splat(0));
            const M outside = either(lt(first, splat(0)), lt(splat(size - 1), first));
            in = without(in, both(eq(along, number(0)), outside));
            c = select(in, min(max(first, splat(0)), splat(size - 1)), c);  // on the other axes rounding may have put it just outside
        };
        enter_axis(cell.x, packet.whole.x, packet.part.x, packet.direction.x, g.size_x);
        enter_axis(cell.y, packet.whole.y, packet.part.y, packet.direction.y, g.size_y);
        enter_axis(cell.z, packet.whole.z, packet.part.z, packet.direction.z, g.size_z);
        looking = either(looking, in);
        stepping = without(stepping, in);
    }

    void look_at_cells() {
        looking = without(looking, without(both(looking, stepping), step_cells(both(looking, stepping))));
        const CellPlace at = cell_place(view, cell);
        I flags;
        const Pointers found = entries_of(view, {select(looking, at.page, splat(0)), select(looking, at.word, splat(0))}, flags);
        const M arrived = both(looking, has(flags, kSolidFlag));
        brick = select(arrived, found, brick);
        entering = either(entering, arrived);
        looking = without(looking, arrived);
        const M inside = both(looking, has(flags, kInsideFlag));
        if (any(inside)) {
            write(inside, kMarchInside, t, {splat(0), splat(0), splat(0)}, {number(0), number(0), number(0)});
            looking = without(looking, inside);
        }
        reach = max(jump_of(flags) - 1, splat(0));  // of an occupied cell 0; that of lanes elsewhere is set when they come back
        stepping = looking;
    }

    // Leaves the cube of empty cells around each lane's; answers the lanes that are in the grid still.
    M step_cells(M m) {
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
        const GridParams& g = view.grid;
        const M in_grid = both(ge0(min(min(cell.x, cell.y), cell.z)),
                               both(both(lt(cell.x, splat(g.size_x)), lt(cell.y, splat(g.size_y))), lt(cell.z, splat(g.size_z))));
        return without(both(m, in_grid), lt(t_max, t));
    }

    // Lanes whose brick holds no hit go on to the next cell.
    void go_on(M m) {
        reach = select(m, splat(0), reach);
        stepping = either(stepping, m);
        looking = either(looking, m);
    }

    // Each to its first voxel of the box that holds all voxels with a solid corner, as if it had walked there.
    void enter_bricks() {
        const M m = entering;
        entering = none();
        ray = select(m, brick_ray_of(packet, {cell.x * kBrickVoxels, cell.y * kBrickVoxels, cell.z * kBrickVoxels}), ray);
        const F first = number(-kFaceOverlap), last = number(float(kBrickVoxels) + kFaceOverlap);
        F in = 0.0f - ray.t_base, out = t_max - ray.t_base;
        const auto clip = [&](M up, F high, F low, F inverse, M flat) {
            in = max(in, crossing(select(up, first, last), high, low, inverse, flat, -kFarVoxels));
            out = min(out, crossing(select(up, last, first), high, low, inverse, flat, kFarVoxels));
        };
        clip(packet.up_x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        clip(packet.up_y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        clip(packet.up_z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);

        const I box = gather_from<-kSolidBoxBeforeCodes>(brick);
        const auto corner = [&](int shift) { return (box >> shift) & 7; };
        const I3 low{corner(0), corner(3), corner(6)}, high{corner(9), corner(12), corner(15)};
        const auto to_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(entry_plane(up, select(up, from, to)), h, l, inverse, flat, -kFarVoxels);
        };
        const auto from_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(exit_plane(up, select(up, to, from)), h, l, inverse, flat, kFarVoxels);
        };
        const F to_x = to_box(packet.up_x, low.x, high.x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        const F to_y = to_box(packet.up_y, low.y, high.y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        const F to_z = to_box(packet.up_z, low.z, high.z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);
        const F from_x = from_box(packet.up_x, low.x, high.x, ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x);
        const F from_y = from_box(packet.up_y, low.y, high.y, ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y);
        const F from_z = from_box(packet.up_z, low.z, high.z, ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z);
        const F to_any = max(max(to_x, to_y), to_z), from_any = min(min(from_x, from_y), from_z);
        const M skips = lt(in, to_any);
        // A walk ends where it comes to `out`, and one that has not begun may begin there.
        const M alive = without(without(m, lt(out, in)), both(skips, either(le(out, to_any), lt(from_any, to_any))));

        const auto voxel_of = [&](F h, F l, F lead, F rest, F s) {
            return to_int(min(max(coordinate(number(0), h, l, lead, rest, s), number(0)), number(6.5f)));
        };
        I3 at{voxel_of(ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, in), voxel_of(ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, in),
              voxel_of(ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, in)};
        if (any(both(alive, skips))) {
            // Planes are crossed in the order of their crossings, those of x before those of y before those of z where they are equal: at
            // `to_any` all crossed before it are behind, and of those crossed right there all up to the last axis that enters the box.
            const M by_z = eq(to_any, to_z), by_y = either(by_z, eq(to_any, to_y));
            const auto skip = [&](I& v, M up, M equal_too, F h, F l, F lead, F rest, F inverse, M flat) {
                const I near = voxel_of(h, l, lead, rest, to_any);  // or next to it
                const auto crossed = [&](F plane, float parallel) {
                    const F s = crossing(plane, h, l, inverse, flat, parallel);
                    return either(lt(s, to_any), both(equal_too, eq(s, to_any)));
                };
                const M ahead = crossed(exit_plane(up, near), kFarVoxels);
                const M behind = without(all(), either(ahead, crossed(entry_plane(up, near), -kFarVoxels)));
                I there = stepped(ahead, up, near);
                there = stepped(behind, without(all(), up), there);
                there = min(max(there, splat(0)), splat(kBrickVoxels - 1));
                const I furthest = select(up, max(there, v), min(there, v));  // a walk never goes back
                v = select(skips, furthest, v);
            };
            skip(at.x, packet.up_x, all(), ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, packet.inverse.x, packet.flat_x);
            skip(at.y, packet.up_y, by_y, ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, packet.inverse.y, packet.flat_y);
            skip(at.z, packet.up_z, by_z, ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, packet.inverse.z, packet.flat_z);
        }
        voxel = select(m, at, voxel);
        enter = select(m, select(skips, to_any, in), enter);
        leave = select(m, out, leave);
        past = select(m, from_any, past);
        walking = either(walking, alive);
        go_on(without(m, alive));
    }

    F exits(F& out_x, F& out_y, F& out_z) const {
        out_x = crossing(exit_plane(packet.up_x, voxel.x), ray.high.x, ray.low.x, packet.inverse.x, packet.flat_x, kFarVoxels);
        out_y = crossing(exit_plane(packet.up_y, voxel.y), ray.high.y, ray.low.y, packet.inverse.y, packet.flat_y, kFarVoxels);
        out_z = crossing(exit_plane(packet.up_z, voxel.z), ray.high.z, ray.low.z, packet.inverse.z, packet.flat_z, kFarVoxels);
        return min(min(out_x, out_y), out_z);
    }
    // To the next voxel; answers the lanes that are in the brick still.
    M step_voxels(M m, F out_any, F out_x, F out_y) {
        enter = select(m, max(min(out_any, leave), enter), enter);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        voxel.x = stepped(both(m, by_x), packet.up_x, voxel.x);
        voxel.y = stepped(both(m, by_y), packet.up_y, voxel.y);
        voxel.z = stepped(both(m, by_z), packet.up_z, voxel.z);
        const M outside = either(lt(min(min(voxel.x, voxel.y), voxel.z), splat(0)),
                                 lt(splat(kBrickVoxels - 1), max(max(voxel.x, voxel.y), voxel.z)));
        return without(m, either(le(leave, out_any), outside));
    }

    // Past a voxel without a solid corner, whose eight values are positive: it holds no root. Others wait to be solved.
    void walk_voxels() {
        F out_x, out_y, out_z;
        const F out_any = exits(out_x, out_y, out_z);
        const M here = without(walking, lt(past, out_any));
        const I row = gather_from<-kSolidRowsBeforeCodes>(moved(brick, select(here, voxel.z * 8 + voxel.y, splat(0))));
        const M found = both(here, eq((row >> (voxel.x & 7)) & 1, splat(1)));
        solving = either(solving, found);
        const M still = step_voxels(without(here, found), out_any, out_x, out_y);
        go_on(without(without(walking, found), still));
        walking = still;
    }

    void solve_voxels() {
        const M m = solving;
        solving = none();
        F out_x, out_y, out_z;
        const F out_any = exits(out_x, out_y, out_z);
        const F exit = max(min(out_any, leave), enter);
        const WideCorners corners = corners_at<Half>(brick, select(m, texel_of(voxel), splat(0)));
        const F root = first_root(cubic_of(corners, point_in_voxel(ray, voxel, enter), point_in_voxel(ray, voxel, exit)), m);
        const M hit = both(m, le(root, number(1)));
        if (any(hit)) {
            const F s = enter + root * (exit - enter);
            const F3 p = point_in_voxel(ray, voxel, s);
            const auto unit = [](F v) { return min(max(v, number(0)), number(1)); };
            write(hit, kMarchHit, ray.t_base + s, voxel, {unit(p.x), unit(p.y), unit(p.z)});
        }
        const M missed = without(m, hit);
        const M still = step_voxels(missed, out_any, out_x, out_y);
        walking = either(walking, still);
        go_on(without(missed, still));
    }

    void write(M m, int state, F at, I3 in_voxel, F3 p) const {
        for (uint32_t left = bits(m); left != 0; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            MarchHit& hit = hits[number_in_list[lane]];
            hit.state = state;
            hit.t = at[lane];
            hit.slot = state == kMarchHit ? 0 : -1;
            hit.cell = {cell.x[lane] + view.grid.cell_x, cell.y[lane] + view.grid.cell_y, cell.z[lane] + view.grid.cell_z};
            hit.voxel = {in_voxel.x[lane], in_voxel.y[lane], in_voxel.z[lane]};
            hit.p = {p.x[lane], p.y[lane], p.z[lane]};
        }
    }
};

// Two packets take turns: what one does waits for reads and long sums, in which the processor does the other's.
template <bool Half>
static void march_all(const WideView& view, const WideRays& rays, int count, MarchHit* hits) {
    int next = 0;
    Marching<Half> one{view, rays, count, hits, next}, other{view, rays, count, hits, next};
    for (bool more = true; more;) {
        more = one.turn();
        more = other.turn() || more;
    }
}

void march(const WideView& view, const WideRays& rays, int count, MarchHit* hits) {
    for (int i = 0; i < count; ++i) {
        MarchHit miss{};
        miss.state = kMarchMiss;
        miss.t = rays.t_max[i];
        miss.slot = -1;
        hits[i] = miss;
    }
    if (view.texel_bytes == 2) {
        march_all<true>(view, rays, count, hits);
    } else {
        march_all<false>(view, rays, count, hits);
    }
}
