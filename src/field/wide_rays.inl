// SPDX-License-Identifier: MIT
// Rays, each in a lane of its own and at its own place. Included after wide_math.inl.

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
// How far eight values are from those of a plane: the largest mixed difference on a face. Each of the three kinds lifts what is interpolated
// from what four of the eight say together by a quarter of it or less.
static inline F bend_of(const WideCorners& c) {
    const auto mixed = [](F p, F q, F r, F s) { return abs((p - q) - (r - s)); };
    const F xy = max(mixed(c.v00.a, c.v00.b, c.v10.a, c.v10.b), mixed(c.v01.a, c.v01.b, c.v11.a, c.v11.b));
    const F xz = max(mixed(c.v00.a, c.v00.b, c.v01.a, c.v01.b), mixed(c.v10.a, c.v10.b, c.v11.a, c.v11.b));
    const F yz = max(mixed(c.v00.a, c.v10.a, c.v01.a, c.v11.a), mixed(c.v00.b, c.v10.b, c.v01.b, c.v11.b));
    return max(max(xy, xz), yz);
}
static inline F value_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return ((c.b0 * r + 3.0f * c.b1 * s) * r + 3.0f * c.b2 * s * s) * r + c.b3 * s * s * s;
}
static inline F slope_of(const WideCubic& c, F s) {
    const F r = 1.0f - s;
    return 3.0f * ((c.b1 - c.b0) * r * r + 2.0f * (c.b2 - c.b1) * r * s + (c.b3 - c.b2) * s * s);
}

// Where a cubic first comes to 0 in [0, 1]: between `lo` and `hi`, where it has these values; at `lo` where that of `lo` is none above 0.
struct WideBracket {
    F lo, hi, value_lo, value_hi;
};
// Answers the lanes of `active` where it does.
static inline M bracket_of(const WideCubic& c, M active, WideBracket& out) {
    const F one = number(1), zero = number(0);
    const M start = both(active, le(c.b0, zero));
    out = {zero, zero, c.b0, c.b0};
    active = without(without(active, start), lt(zero, min(min(c.b1, c.b2), c.b3)));
    if (!any(active)) return start;
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
    const M at_zero = either(start, in_first);
    out = {select(at_zero, zero, select(in_second, first, second)),
           select(in_first, first, select(in_second, second, one)),
           select(at_zero, c.b0, select(in_second, value_first, value_second)),
           select(in_first, value_first, select(in_second, value_second, c.b3))};
    return either(start, found);
}

// `enough`: a step this short is the last one.
static inline F root_of(const WideCubic& c, const WideBracket& b, M active, float enough) {
    const M start = le(b.value_lo, number(0));
    active = without(active, start);
    F lo = b.lo, hi = b.hi;
    F s = select(start, lo, lo + (hi - lo) * (b.value_lo / (b.value_lo - b.value_hi)));
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
        active = without(active, lt(moved, number(enough)));
    }
    return s;
}

static inline F leading(F a) { return floats_of(bits_of(a) & int32_t(0xfffff000)); }
static inline F crossing(F plane, F high, F low, F inverse, M flat, float parallel) {
    return select(flat, number(parallel), ((plane - high) - low) * inverse);
}
static inline F texel_crossing(I texel, I whole, F part, F inverse) { return (to_float(texel - whole) - part) * inverse; }

struct Counting {
    int32_t of[kLanes];
    constexpr Counting() : of() {
        for (int i = 0; i < kLanes; ++i) of[i] = i;
    }
};
constexpr Counting kCounting;
static inline M first_lanes(int count) { return lt(load(kCounting.of), splat(count)); }

// What does not change along rays stays where it is, in rows of four numbers, a ray's four on one line of the cache: to move it with the rays
// takes longer. Rows of four rays are a square of numbers; turned, each of its rows is a part of a register that has one number a ray.
struct Quad {
    F a, b, c, d;
};
static inline Quad turned(const Quad& q) {
    const F ab = low_in_turns(q.a, q.b), cd = low_in_turns(q.c, q.d);
    const F ab_high = high_in_turns(q.a, q.b), cd_high = high_in_turns(q.c, q.d);
    return {low_pairs(ab, cd), high_pairs(ab, cd), low_pairs(ab_high, cd_high), high_pairs(ab_high, cd_high)};
}
struct RayRows {
    float* at[kLanes];
    RayRows(WideRay* rays, I numbers) {
        int32_t number[kLanes];
        std::memcpy(number, &numbers, sizeof number);
        for (int i = 0; i < kLanes; ++i) at[i] = rays[number[i]].inverse;
    }
    Quad get(int first) const {
        return turned({rows_from(at, 0, first), rows_from(at, 1, first), rows_from(at, 2, first), rows_from(at, 3, first)});
    }
    void put(int first, const Quad& numbers) const {
        const Quad rows = turned(numbers);
        rows_to(at, 0, first, rows.a), rows_to(at, 1, first, rows.b), rows_to(at, 2, first, rows.c), rows_to(at, 3, first, rows.d);
    }
};
// Of WideRay. What is not asked for is not read.
struct Course {
    F3 inverse;  // kFarVoxels along axes to whose planes the ray is parallel, so that it crosses none
    F t_max;
    F3 direction;
    I octant;  // where its octant's bits are in the word of a free cell (ways.h)
    F3 part;
    I3 whole;
    explicit Course(const RayRows& rows) {
        const Quad a = rows.get(0), b = rows.get(4), c = rows.get(8), d = rows.get(12);
        inverse = {a.a, a.b, a.c}, t_max = a.d;
        direction = {b.a, b.b, b.c}, octant = bits_of(b.d);
        part = {c.a, c.b, c.c};
        whole = {bits_of(d.a), bits_of(d.b), bits_of(d.c)};
    }
    M up_x() const { return lt(number(0), inverse.x); }
    M up_y() const { return lt(number(0), inverse.y); }
    M up_z() const { return lt(number(0), inverse.z); }
    M flat_x() const { return eq(inverse.x, number(kFarVoxels)); }
    M flat_y() const { return eq(inverse.y, number(kFarVoxels)); }
    M flat_z() const { return eq(inverse.z, number(kFarVoxels)); }
};

// A ray between bricks. `each` gives all of a record's registers in their order.
struct Seeker {
    I number;  // in the list
    F t;       // where it has come to, by cells
    I3 cell;
    I way;  // the cell's word (ways.h); 0 where it has been looked at and the next one is to come

    template <typename Self, typename Fn>
    [[gnu::always_inline]] static void each(Self& r, Fn&& fn) {
        fn(r.number), fn(r.t), fn(r.cell.x), fn(r.cell.y), fn(r.cell.z), fn(r.way);
    }
};
// A ray in a brick.
struct Walker {
    I number;
    F t;  // as it was before
    I3 cell;
    F3 high, low;  // where it is at t_base, from the brick's first texel
    F t_base;
    F enter, leave;  // from t_base: into the voxel, out of the brick
    F past;          // there no voxel with a solid corner comes any more
    I3 voxel;
    I address[2];  // of its codes: lower and upper half

    template <typename Self, typename Fn>
    [[gnu::always_inline]] static void each(Self& r, Fn&& fn) {
        fn(r.number), fn(r.t), fn(r.cell.x), fn(r.cell.y), fn(r.cell.z);
        fn(r.high.x), fn(r.high.y), fn(r.high.z), fn(r.low.x), fn(r.low.y), fn(r.low.z), fn(r.t_base);
        fn(r.enter), fn(r.leave), fn(r.past), fn(r.voxel.x), fn(r.voxel.y), fn(r.voxel.z), fn(r.address[0]), fn(r.address[1]);
    }
};
// A ray that hits in a voxel; where remains to be seen.
struct Striker {
    I number;
    I3 cell, voxel;
    F3 high, low;  // see Walker
    F t_base, enter, exit;
    WideCubic cubic;
    WideBracket root;

    template <typename Self, typename Fn>
    [[gnu::always_inline]] static void each(Self& r, Fn&& fn) {
        fn(r.number), fn(r.cell.x), fn(r.cell.y), fn(r.cell.z), fn(r.voxel.x), fn(r.voxel.y), fn(r.voxel.z);
        fn(r.high.x), fn(r.high.y), fn(r.high.z), fn(r.low.x), fn(r.low.y), fn(r.low.z), fn(r.t_base), fn(r.enter), fn(r.exit);
        fn(r.cubic.b0), fn(r.cubic.b1), fn(r.cubic.b2), fn(r.cubic.b3);
        fn(r.root.lo), fn(r.root.hi), fn(r.root.value_lo), fn(r.root.value_hi);
    }
};

// Rays that wait for the same.
constexpr int kMostUnderWay = 512;

template <typename Record>
struct RayList {
    static constexpr int kFields = int(sizeof(Record) / sizeof(I));
    int size = 0;
    alignas(64) int32_t of[kFields][kMostUnderWay + kLanes];
    RayList() {}  // `of` stays as it is: what is read has been written

    [[gnu::always_inline]] Record from(int first) const {
        Record r;
        int field = 0;
        Record::each(r, [&](auto& v) __attribute__((always_inline)) { std::memcpy(&v, of[field++] + first, sizeof v); });
        return r;
    }
    // Lanes of m, at the end. Behind them as many may be overwritten as a register has.
    [[gnu::always_inline]] void add(const Record& r, M m) {
        const Packing packing(m);
        const int end = size;
        int field = 0;
        Record::each(r, [&](const auto& v) __attribute__((always_inline)) {
            const auto packed = packing(v);
            std::memcpy(of[field++] + end, &packed, sizeof packed);
        });
        size = end + count(m);
    }
    // All rays in full registers, and with `rest` those left too, to `step`, which may add here those that stay: they take the places of
    // those that were read.
    template <typename Fn>
    void pass(bool rest, Fn&& step) {
        const int had = size, full = had / kLanes * kLanes;
        size = 0;
        for (int first = 0; first < full; first += kLanes) {
            Record r = from(first);
            step(r, all());
        }
        if (full == had) return;
        Record r = from(full);
        const M left = first_lanes(had - full);
        if (rest) {
            // The other lanes are to have numbers of rays, too.
            Record::each(r, [&](auto& v) { v = select(left, v, std::remove_reference_t<decltype(v)>{}); });
            step(r, left);
        } else {
            add(r, left);
        }
    }
};

// The plane through which a ray leaves a voxel, of one axis; the brick's own faces are pushed out by kFaceOverlap.
static inline F exit_plane(M up, I voxel) {
    const F last = select(up, number(float(kBrickVoxels) + kFaceOverlap), number(-kFaceOverlap));
    const I plane = select(up, voxel + 1, voxel);
    return select(eq(plane, select(up, splat(kBrickVoxels), splat(0))), last, to_float(plane));
}
static inline F entry_plane(M up, I voxel) { return exit_plane(without(all(), up), voxel); }
static inline I stepped(M m, M up, I voxel) { return select(m, voxel + select(up, splat(1), splat(-1)), voxel); }

static inline void rebase(I whole, F part, F direction, F t, F& high, F& low) {
    const F lead = leading(direction);
    const F a = to_float(whole), b = lead * t;
    const F sum = a + b;
    const F b_seen = sum - a;
    const F lost = (a - (sum - b_seen)) + (b - b_seen);
    high = sum;
    low = ((direction - lead) * t + lost) + part;
}
static inline F coordinate(F from, F high, F low, F direction, F s) {
    const F lead = leading(direction), rest = direction - lead, c = leading(s);
    const F large = (high - from) + lead * c;
    const F small = low + (rest * c + (lead + rest) * (s - c));
    return large + small;
}
static inline F3 point_in_voxel(I3 voxel, F3 high, F3 low, F3 direction, F s) {
    const auto one = [s](I v, F h, F l, F d) {
        return min(max(coordinate(to_float(v), h, l, d, s), number(-kFaceOverlap)), number(1.0f + kFaceOverlap));
    };
    return {one(voxel.x, high.x, low.x, direction.x), one(voxel.y, high.y, low.y, direction.y), one(voxel.z, high.z, low.z, direction.z)};
}
static inline I cell_of(I whole, F part, F direction, F t) {
    return to_int(floor((to_float(whole) + (part + direction * t)) * kCellsPerVoxel));
}

// Rays under way. What they have to do next differs: look at the next cell, enter a brick, walk its voxels, solve a voxel's cubic. Those that
// wait for the same are in one list, and a list is gone through by full registers, each of its rays one step on: registers of one pass do not
// wait for each other.
template <bool Half>
struct Marching {
    const WideView& view;
    WideRay* const rays;
    const int total;
    MarchHit* const hits;
    RayNote* const notes;
    int next = 0;
    RayList<Seeker> seeking{}, entering{};
    RayList<Walker> walking{}, solving{};
    RayList<Striker> striking{};

    void run() {
        for (;;) {
            while (under_way() <= kMostUnderWay - kLanes && next < total) take();
            if (under_way() == 0) return;
            const bool rest = !any_full();  // nor will there be a full register any more
            seeking.pass(rest, [this](Seeker& s, M m) { seek(s, m); });
            entering.pass(rest, [this](const Seeker& s, M m) { enter(s, m); });
            walking.pass(rest, [this](Walker& w, M m) { walk(w, m); });
            solving.pass(rest, [this](Walker& w, M m) { solve(w, m); });
            striking.pass(rest, [this](Striker& s, M m) { strike(s, m); });
        }
    }
    int under_way() const { return seeking.size + entering.size + walking.size + solving.size + striking.size; }
    bool any_full() const {
        return seeking.size >= kLanes || entering.size >= kLanes || walking.size >= kLanes || solving.size >= kLanes ||
               striking.size >= kLanes;
    }

    Course course_of(I numbers) const { return Course(RayRows(rays, numbers)); }

    // The next rays, into the grid.
    void take() {
        const M taken = first_lanes(total - next);
        Seeker s;
        s.number = min(load(kCounting.of) + next, splat(total - 1));
        next += kLanes;
        const RayRows rows(rays, s.number);
        Course ray(rows);
        const auto component = [](F d) { return select(lt(abs(d), number(1e-12f)), number(0), d); };
        ray.direction = {component(ray.direction.x), component(ray.direction.y), component(ray.direction.z)};
        const auto inverse = [](F d) { return select(eq(d, number(0)), number(kFarVoxels), 1.0f / d); };
        ray.inverse = {inverse(ray.direction.x), inverse(ray.direction.y), inverse(ray.direction.z)};
        const M up_x = ray.up_x(), up_y = ray.up_y(), up_z = ray.up_z();
        const auto bit = [](M up, int octant) { return select(up, splat(way_shift(octant)), splat(0)); };
        ray.octant = bit(up_x, 1) + bit(up_y, 2) + bit(up_z, 4);
        rows.put(0, {ray.inverse.x, ray.inverse.y, ray.inverse.z, ray.t_max});
        rows.put(4, {ray.direction.x, ray.direction.y, ray.direction.z, floats_of(ray.octant)});

        const GridParams& g = view.grid;
        F from = number(0), end = ray.t_max;
        const auto clip = [&](M up, int cells, I whole, F part, F over, M flat) {
            const I wide = splat(cells * kBrickVoxels);
            from = max(from, select(flat, number(-kFarVoxels), texel_crossing(select(up, splat(0), wide), whole, part, over)));
            end = min(end, select(flat, number(kFarVoxels), texel_crossing(select(up, wide, splat(0)), whole, part, over)));
        };
        clip(up_x, g.size_x, ray.whole.x, ray.part.x, ray.inverse.x, ray.flat_x());
        clip(up_y, g.size_y, ray.whole.y, ray.part.y, ray.inverse.y, ray.flat_y());
        clip(up_z, g.size_z, ray.whole.z, ray.part.z, ray.inverse.z, ray.flat_z());
        M in = both(taken, le(from, end));
        s.t = select(in, from, number(0));
        const auto enter_axis = [&](I whole, F part, F along, int size) {
            const I first = select(in, cell_of(whole, part, along, s.t), splat(0));
            const M outside = either(lt(first, splat(0)), lt(splat(size - 1), first));
            in = without(in, both(eq(along, number(0)), outside));
            return min(max(first, splat(0)), splat(size - 1));  // on the other axes rounding may have put it just outside
        };
        s.cell.x = enter_axis(ray.whole.x, ray.part.x, ray.direction.x, g.size_x);
        s.cell.y = enter_axis(ray.whole.y, ray.part.y, ray.direction.y, g.size_y);
        s.cell.z = enter_axis(ray.whole.z, ray.part.z, ray.direction.z, g.size_z);
        look(s, ray, in);
    }

    // To the next cell that may not be free.
    void seek(Seeker& s, M m) {
        const Course ray = course_of(s.number);
        m = step_cells(s, ray, m);
        look(s, ray, m);
    }

    void look(Seeker& s, const Course& ray, M m) {
        const I at = (s.cell.z * view.grid.size_y + s.cell.y) * view.grid.size_x + s.cell.x;
        Lanes ways(select(m, at, splat(0)));
        for (int i = 0; i < kLanes; ++i) ways[i] = int32_t(view.ways[ways[i]]);  // a gather takes longer
        s.way = ways.all();
        const M solid = both(m, lt(s.way, splat(0)));  // kWaySolid
        m = without(m, solid);
        const M inside = both(m, lt(s.way << 1, splat(0)));  // kWayInside
        if (any(inside)) {
            write(s, inside, kMarchInside, s.t, {splat(0), splat(0), splat(0)}, {number(0), number(0), number(0)});
            m = without(m, inside);
        }
        if (any(solid)) {
            const M meets = meets_box(s, ray, solid);
            entering.add(s, meets);
            const M passes = without(solid, meets);
            s.way = select(passes, splat(0), s.way);
            m = either(m, passes);
        }
        seeking.add(s, m);
    }

    // Leaves the cube of free cells that each lane's cell begins; answers the lanes that are in the grid still.
    M step_cells(Seeker& s, const Course& ray, M m) const {
        const M up_x = ray.up_x(), up_y = ray.up_y(), up_z = ray.up_z();
        const I reach = (s.way >> ray.octant) & kWayReach, beyond = reach + 1, before = splat(0) - reach;
        const I border_x = s.cell.x + select(up_x, beyond, before), border_y = s.cell.y + select(up_y, beyond, before),
                border_z = s.cell.z + select(up_z, beyond, before);
        const F out_x = texel_crossing(border_x * kBrickVoxels, ray.whole.x, ray.part.x, ray.inverse.x);
        const F out_y = texel_crossing(border_y * kBrickVoxels, ray.whole.y, ray.part.y, ray.inverse.y);
        const F out_z = texel_crossing(border_z * kBrickVoxels, ray.whole.z, ray.part.z, ray.inverse.z);
        const F out_any = min(min(out_x, out_y), out_z);
        s.t = max(s.t, out_any);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x), by_z = without(all(), either(by_x, by_y));
        // The other axes may have moved within the cube.
        const auto next_cell = [&](I& c, M by, M up, I border, I whole, F part, F direction) {
            const I low = select(up, c, border), high = select(up, border - 1, c);
            const I drifted = min(max(cell_of(whole, part, direction, s.t), low), high);
            c = select(by, select(up, border, border - 1), drifted);
        };
        next_cell(s.cell.x, by_x, up_x, border_x, ray.whole.x, ray.part.x, ray.direction.x);
        next_cell(s.cell.y, by_y, up_y, border_y, ray.whole.y, ray.part.y, ray.direction.y);
        next_cell(s.cell.z, by_z, up_z, border_z, ray.whole.z, ray.part.z, ray.direction.z);
        const GridParams& g = view.grid;
        const M in_grid = both(both(below(s.cell.x, g.size_x), below(s.cell.y, g.size_y)), below(s.cell.z, g.size_z));
        return without(both(m, in_grid), lt(ray.t_max, s.t));
    }

    // Lanes whose brick holds no hit go on to the next cell.
    template <typename Record>
    void go_on(const Record& r, M m) {
        seeking.add({r.number, r.t, r.cell, splat(0)}, m);
    }

    static I box_corner(const Seeker& s, int shift) { return (s.way >> shift) & 7; }

    // Whether a ray comes through the box of all voxels with a solid corner. Positions are rounded, so boxes are taken to be larger than they
    // are.
    static M meets_box(const Seeker& s, const Course& ray, M m) {
        F in = number(0), out = ray.t_max;
        const F margin = s.t * 1e-6f + 0.015625f;
        const auto clip = [&](M up, I c, int low, int high, I whole, F part, F inverse) {
            const I base = c * kBrickVoxels - whole, first = base + box_corner(s, low), last = base + box_corner(s, high) + 1;
            const F more = abs(inverse) * margin;
            in = max(in, (to_float(select(up, first, last)) - part) * inverse - more);
            out = min(out, (to_float(select(up, last, first)) - part) * inverse + more);
        };
        clip(ray.up_x(), s.cell.x, 0, 9, ray.whole.x, ray.part.x, ray.inverse.x);
        clip(ray.up_y(), s.cell.y, 3, 12, ray.whole.y, ray.part.y, ray.inverse.y);
        clip(ray.up_z(), s.cell.z, 6, 15, ray.whole.z, ray.part.z, ray.inverse.z);
        return both(m, le(in, out));
    }

    // cell_word_index().
    I cell_word_index_of(I3 c) const {
        const I page = ((c.z >> 3) * view.pages_y + (c.y >> 3)) * view.pages_x + (c.x >> 3);
        return (page << 9) + ((c.z & 7) << 6) + ((c.y & 7) << 3) + (c.x & 7);
    }

    // Each to its first voxel of the box that holds all voxels with a solid corner, as if it had walked there.
    void enter(const Seeker& s, M m) {
        const Course ray = course_of(s.number);
        const M up_x = ray.up_x(), up_y = ray.up_y(), up_z = ray.up_z();
        Walker w;
        w.number = s.number, w.t = s.t, w.cell = s.cell;
        const Lanes index(cell_word_index_of(s.cell));
        Lanes low_half(splat(0)), high_half(splat(0));
        each_lane(m, [&](int i) {
            constexpr int kPageWords = int(std::tuple_size_v<WidePage>);
            const WideEntry entry = (*view.pages[index.of[i] / kPageWords])[size_t(index.of[i] % kPageWords)] & kWideAddress;
            low_half[i] = int32_t(uint32_t(entry)), high_half[i] = int32_t(entry >> 32);
            __builtin_prefetch(reinterpret_cast<const std::byte*>(uintptr_t(entry)) - kSolidRowsBeforeCodes);
        });
        w.address[0] = low_half.all(), w.address[1] = high_half.all();

        const F3 d = ray.direction;
        const auto away_of = [](I whole, I c) { return whole - c * kBrickVoxels; };
        const I3 away{away_of(ray.whole.x, s.cell.x), away_of(ray.whole.y, s.cell.y), away_of(ray.whole.z, s.cell.z)};
        w.t_base = leading((3.5f - ray.part.x - to_float(away.x)) * d.x + (3.5f - ray.part.y - to_float(away.y)) * d.y +
                           (3.5f - ray.part.z - to_float(away.z)) * d.z);
        rebase(away.x, ray.part.x, d.x, w.t_base, w.high.x, w.low.x);
        rebase(away.y, ray.part.y, d.y, w.t_base, w.high.y, w.low.y);
        rebase(away.z, ray.part.z, d.z, w.t_base, w.high.z, w.low.z);
        const F first = number(-kFaceOverlap), last = number(float(kBrickVoxels) + kFaceOverlap);
        F in = 0.0f - w.t_base, out = ray.t_max - w.t_base;
        const auto clip = [&](M up, F high, F low, F inverse, M flat) {
            in = max(in, crossing(select(up, first, last), high, low, inverse, flat, -kFarVoxels));
            out = min(out, crossing(select(up, last, first), high, low, inverse, flat, kFarVoxels));
        };
        clip(up_x, w.high.x, w.low.x, ray.inverse.x, ray.flat_x());
        clip(up_y, w.high.y, w.low.y, ray.inverse.y, ray.flat_y());
        clip(up_z, w.high.z, w.low.z, ray.inverse.z, ray.flat_z());

        const I3 low{box_corner(s, 0), box_corner(s, 3), box_corner(s, 6)}, high{box_corner(s, 9), box_corner(s, 12), box_corner(s, 15)};
        const auto to_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(entry_plane(up, select(up, from, to)), h, l, inverse, flat, -kFarVoxels);
        };
        const auto from_box = [&](M up, I from, I to, F h, F l, F inverse, M flat) {
            return crossing(exit_plane(up, select(up, to, from)), h, l, inverse, flat, kFarVoxels);
        };
        const F to_x = to_box(up_x, low.x, high.x, w.high.x, w.low.x, ray.inverse.x, ray.flat_x());
        const F to_y = to_box(up_y, low.y, high.y, w.high.y, w.low.y, ray.inverse.y, ray.flat_y());
        const F to_z = to_box(up_z, low.z, high.z, w.high.z, w.low.z, ray.inverse.z, ray.flat_z());
        const F from_x = from_box(up_x, low.x, high.x, w.high.x, w.low.x, ray.inverse.x, ray.flat_x());
        const F from_y = from_box(up_y, low.y, high.y, w.high.y, w.low.y, ray.inverse.y, ray.flat_y());
        const F from_z = from_box(up_z, low.z, high.z, w.high.z, w.low.z, ray.inverse.z, ray.flat_z());
        const F to_any = max(max(to_x, to_y), to_z), from_any = min(min(from_x, from_y), from_z);
        const M skips = lt(in, to_any);
        // A walk ends where it comes to `out`, and one that has not begun may begin there.
        const M alive = without(without(m, lt(out, in)), both(skips, either(le(out, to_any), lt(from_any, to_any))));

        const auto voxel_of = [&](F h, F l, F along, F t) {
            return to_int(min(max(coordinate(number(0), h, l, along, t), number(0)), number(6.5f)));
        };
        w.voxel = {voxel_of(w.high.x, w.low.x, d.x, in), voxel_of(w.high.y, w.low.y, d.y, in), voxel_of(w.high.z, w.low.z, d.z, in)};
        if (any(both(alive, skips))) {
            // Planes are crossed in the order of their crossings, those of x before those of y before those of z where they are equal: at
            // `to_any` all crossed before it are behind, and of those crossed right there all up to the last axis that enters the box.
            const M by_z = eq(to_any, to_z), by_y = either(by_z, eq(to_any, to_y));
            const auto skip = [&](I& v, M up, M equal_too, F h, F l, F along, F inverse, M flat) {
                const I near = voxel_of(h, l, along, to_any);  // or next to it
                const auto crossed = [&](F plane, float parallel) {
                    const F t = crossing(plane, h, l, inverse, flat, parallel);
                    return either(lt(t, to_any), both(equal_too, eq(t, to_any)));
                };
                const M ahead = crossed(exit_plane(up, near), kFarVoxels);
                const M behind = without(all(), either(ahead, crossed(entry_plane(up, near), -kFarVoxels)));
                I there = stepped(ahead, up, near);
                there = stepped(behind, without(all(), up), there);
                there = min(max(there, splat(0)), splat(kBrickVoxels - 1));
                const I furthest = select(up, max(there, v), min(there, v));  // a walk never goes back
                v = select(skips, furthest, v);
            };
            skip(w.voxel.x, up_x, all(), w.high.x, w.low.x, d.x, ray.inverse.x, ray.flat_x());
            skip(w.voxel.y, up_y, by_y, w.high.y, w.low.y, d.y, ray.inverse.y, ray.flat_y());
            skip(w.voxel.z, up_z, by_z, w.high.z, w.low.z, d.z, ray.inverse.z, ray.flat_z());
        }
        w.enter = select(skips, to_any, in);
        w.leave = out;
        w.past = from_any;
        const Addresses codes(w);
        Lanes texel(texel_of(w.voxel));
        each_lane(m, [&](int i) {  // they will be read here or nearby
            const std::byte* const row = codes[i] + texel[i] * kBytes;
            __builtin_prefetch(row);
            __builtin_prefetch(row + 72 * kBytes);
        });
        walking.add(w, alive);
        go_on(w, without(m, alive));
    }

    static F exits(const Walker& w, const Course& ray, F& out_x, F& out_y) {
        const auto out = [](M up, I v, F high, F low, F inverse) { return ((exit_plane(up, v) - high) - low) * inverse; };
        out_x = out(ray.up_x(), w.voxel.x, w.high.x, w.low.x, ray.inverse.x);
        out_y = out(ray.up_y(), w.voxel.y, w.high.y, w.low.y, ray.inverse.y);
        const F out_z = out(ray.up_z(), w.voxel.z, w.high.z, w.low.z, ray.inverse.z);
        return min(min(out_x, out_y), out_z);
    }
    // To the next voxel; answers the lanes that are in the brick still.
    static M step_voxels(Walker& w, const Course& ray, M m, F out_any, F out_x, F out_y) {
        w.enter = select(m, max(min(out_any, w.leave), w.enter), w.enter);
        const M by_x = eq(out_any, out_x), by_y = without(eq(out_any, out_y), by_x);
        const M by_z = without(without(all(), by_x), by_y);
        w.voxel.x = stepped(both(m, by_x), ray.up_x(), w.voxel.x);
        w.voxel.y = stepped(both(m, by_y), ray.up_y(), w.voxel.y);
        w.voxel.z = stepped(both(m, by_z), ray.up_z(), w.voxel.z);
        const M outside = either(lt(min(min(w.voxel.x, w.voxel.y), w.voxel.z), splat(0)),
                                 lt(splat(kBrickVoxels - 1), max(max(w.voxel.x, w.voxel.y), w.voxel.z)));
        return without(m, either(le(w.leave, out_any), outside));
    }

    // Past a voxel without a solid corner, whose eight values are positive: it holds no root. Others wait to be solved.
    void walk(Walker& w, M m) {
        const Course ray = course_of(w.number);
        F out_x, out_y;
        const F out_any = exits(w, ray, out_x, out_y);
        const M here = without(m, lt(w.past, out_any));
        const Addresses codes(w);
        const Lanes rows(w.voxel.z * 8 + w.voxel.y);
        Lanes solid(splat(0));
        each_lane(m, [&](int i) { solid[i] = int32_t(codes[i][rows.of[i] - kSolidRowsBeforeCodes]); });
        const M found = both(here, without(all(), eq((solid.all() >> w.voxel.x) & 1, splat(0))));
        solving.add(w, found);
        const M still = step_voxels(w, ray, without(here, found), out_any, out_x, out_y);
        walking.add(w, still);
        go_on(w, without(without(m, found), still));
    }

    static constexpr int kBytes = Half ? 2 : 1;

    struct Lanes {
        alignas(64) int32_t of[kLanes];
        explicit Lanes(I v) { std::memcpy(of, &v, sizeof of); }
        int32_t& operator[](int i) { return of[i]; }
        I all() const { return load(of); }
    };
    // Of codes, by lane.
    struct Addresses {
        Lanes low, high;
        explicit Addresses(const Walker& w) : low(w.address[0]), high(w.address[1]) {}
        const std::byte* operator[](int i) const {
            return reinterpret_cast<const std::byte*>(uintptr_t(uint64_t(uint32_t(high.of[i])) << 32 | uint32_t(low.of[i])));
        }
    };
    // Reads for the lanes of `m`, one after another.
    template <typename Fn>
    static void each_lane(M m, Fn&& fn) {
        if (bits(m) == bits(all())) {
            for (int i = 0; i < kLanes; ++i) fn(i);
        } else {
            for (uint32_t left = bits(m); left != 0; left &= left - 1) fn(__builtin_ctz(left));
        }
    }

    static WideCorners corners_of(const Walker& w, M m) {
        const Addresses codes(w);
        Lanes texel(texel_of(w.voxel));
        Lanes v00(splat(0)), v10(splat(0)), v01(splat(0)), v11(splat(0));
        each_lane(m, [&](int i) {
            const std::byte* const first = codes[i] + texel[i] * kBytes;
            const auto pair = [first](int32_t& to, int offset) { std::memcpy(&to, first + offset * kBytes, 2 * kBytes); };
            pair(v00[i], 0), pair(v10[i], 8), pair(v01[i], 64), pair(v11[i], 72);
        });
        return {values_of<Half>(v00.all()), values_of<Half>(v10.all()), values_of<Half>(v01.all()),
                values_of<Half>(v11.all())};
    }

    void solve(Walker& w, M m) {
        const Course ray = course_of(w.number);
        F out_x, out_y;
        const F out_any = exits(w, ray, out_x, out_y);
        const F exit = max(min(out_any, w.leave), w.enter);
        const WideCorners corners = corners_of(w, m);
        const auto point = [&](F s) { return point_in_voxel(w.voxel, w.high, w.low, ray.direction, s); };
        const WideCubic cubic = cubic_of(corners, point(w.enter), point(exit));
        WideBracket root;
        const M hit = bracket_of(cubic, m, root);
        if (any(hit))
            striking.add({w.number, w.cell, w.voxel, w.high, w.low, w.t_base, w.enter, exit, cubic, root}, hit);
        if (notes != nullptr) {
            const F least = min(min(cubic.b0, cubic.b1), min(cubic.b2, cubic.b3));
            // Along a surface, be it a little towards it; and where texels may have lost some.
            constexpr float kAlong = 0.1f, kRounding = 0.02f;  // voxels
            const F lost = min(bend_of(corners) * 0.75f + kRounding, number(kNearPassVoxels));
            const M near = both(without(m, hit), both(lt(least, lost), le(cubic.b2, cubic.b3 + kAlong)));
            if (any(near)) note_pass(w, near, least, w.t_base + w.enter, w.t_base + exit);
        }
        const M missed = without(m, hit);
        const M still = step_voxels(w, ray, missed, out_any, out_x, out_y);
        walking.add(w, still);
        go_on(w, without(missed, still));
    }

    void strike(const Striker& s, M m) const {
        // Newton's steps: after one of a thousandth, what is left is a rounding. Whoever asks for notes moves the hit anyway.
        const F root = root_of(s.cubic, s.root, m, notes != nullptr ? 1e-3f : 1e-6f);
        const F t = s.enter + root * (s.exit - s.enter);
        const F3 p = point_in_voxel(s.voxel, s.high, s.low, course_of(s.number).direction, t);
        const auto unit = [](F v) { return min(max(v, number(0)), number(1)); };
        write(s, m, kMarchHit, s.t_base + t, s.voxel, {unit(p.x), unit(p.y), unit(p.z)});
        if (notes != nullptr) note_slope(s, m, slope_of(s.cubic, root) / max(s.exit - s.enter, number(1e-6f)));
    }

    void note_pass(const Walker& s, M m, F least, F from, F to) const {
        struct {
            int32_t number[kLanes], cell[3][kLanes];
            float least[kLanes], from[kLanes], to[kLanes];
        } lanes;
        const auto store = [](auto& there, auto v) { std::memcpy(&there, &v, sizeof v); };
        store(lanes.number, s.number);
        store(lanes.cell[0], s.cell.x), store(lanes.cell[1], s.cell.y), store(lanes.cell[2], s.cell.z);
        store(lanes.least, least), store(lanes.from, from), store(lanes.to, to);
        const GridParams& g = view.grid;
        each_lane(m, [&](int i) {
            NearPass(&passes)[2] = notes[lanes.number[i]].passes;
            if (!(lanes.least[i] < passes[1].least)) return;
            const NearPass pass{lanes.least[i], lanes.from[i], lanes.to[i],
                                {lanes.cell[0][i] + g.cell_x, lanes.cell[1][i] + g.cell_y, lanes.cell[2][i] + g.cell_z}};
            const bool first = pass.least < passes[0].least;
            passes[1] = first ? passes[0] : pass;
            if (first) passes[0] = pass;
        });
    }

    void note_slope(const Striker& s, M m, F slope) const {
        Lanes order(s.number), slopes(bits_of(slope));
        each_lane(m, [&](int i) { notes[order[i]].slope = std::bit_cast<float>(slopes[i]); });
    }

    template <typename Record>
    void write(const Record& s, M m, int state, F at, I3 in_voxel, F3 p) const {
        struct {
            int32_t number[kLanes], cell[3][kLanes], voxel[3][kLanes];
            float t[kLanes], p[3][kLanes];
        } lanes;
        const auto store = [](auto& to, auto v) { std::memcpy(&to, &v, sizeof v); };
        store(lanes.number, s.number);
        store(lanes.cell[0], s.cell.x), store(lanes.cell[1], s.cell.y), store(lanes.cell[2], s.cell.z);
        store(lanes.voxel[0], in_voxel.x), store(lanes.voxel[1], in_voxel.y), store(lanes.voxel[2], in_voxel.z);
        store(lanes.t, at);
        store(lanes.p[0], p.x), store(lanes.p[1], p.y), store(lanes.p[2], p.z);
        const GridParams& g = view.grid;
        for (uint32_t left = bits(m); left != 0; left &= left - 1) {
            const int i = __builtin_ctz(left);
            MarchHit& hit = hits[lanes.number[i]];
            hit.state = state;
            hit.t = lanes.t[i];
            hit.slot = state == kMarchHit ? 0 : -1;
            hit.cell = {lanes.cell[0][i] + g.cell_x, lanes.cell[1][i] + g.cell_y, lanes.cell[2][i] + g.cell_z};
            hit.voxel = {lanes.voxel[0][i], lanes.voxel[1][i], lanes.voxel[2][i]};
            hit.p = {lanes.p[0][i], lanes.p[1][i], lanes.p[2][i]};
        }
    }
};

void march(const WideView& view, WideRay* rays, int count, MarchHit* hits, RayNote* notes) {
    for (int i = 0; notes != nullptr && i < count; ++i)
        for (NearPass& pass : notes[i].passes) pass.least = kNearPassVoxels;
    MarchHit miss{};
    miss.state = kMarchMiss;
    miss.slot = -1;
    for (int i = 0; i < count; ++i) {
        std::memcpy(hits + i, &miss, sizeof miss);  // whole: member by member is four times as many stores
        hits[i].t = rays[i].t_max;
    }
    if (view.texel_bytes == 2) {
        Marching<true>{view, rays, count, hits, notes}.run();
    } else {
        Marching<false>{view, rays, count, hits, notes}.run();
    }
}
