// SPDX-License-Identifier: MIT
// Hits moved along their rays to where code has the surface: by Newton's step with the slope that the texels have along the ray, then by
// the secants of two looks. See RayPolish. Included after wide_math.inl.

static inline void store(float* to, F v) { std::memcpy(to, &v, sizeof v); }
static inline void store(int32_t* to, I v) { std::memcpy(to, &v, sizeof v); }

void polish_looks(const RayPolish& rays, int count, float* x, float* y, float* z) {
    for (int i = 0; i < count; i += kLanes) {
        const F t = load(rays.t + i);
        const auto axis = [&](int a, float* out) {
            store(out + i, (rays.base[a] + (load(rays.first[a] + i) + load(rays.along[a] + i) * t)) * rays.voxel_size);
        };
        axis(0, x), axis(1, y), axis(2, z);
    }
}

int polish_steps(RayPolish& rays, int count_of_rays, const float* metres) {
    // Slopes are known to a few hundredths: a step of d / slope that starts this near and is this short ends within a thousandth or two.
    constexpr float kNearEnough = 0.02f, kFirstNearEnough = 0.01f, kShortEnough = 0.1f;  // voxels
    constexpr float kFlattest = -0.02f;
    constexpr float kFurthest = 1.5f;  // voxels: a surface further away is another one
    const float voxels = 1.0f / rays.voxel_size;
    const float near_enough = rays.round == 0 ? kFirstNearEnough : kNearEnough;
    int open = 0;
    for (int i = 0; i < count_of_rays; i += kLanes) {
        const I state = load(rays.state + i);
        const M was_open = eq(state, splat(RayPolish::kOpen));
        const F d = load(metres + i) * voxels, t = load(rays.t + i), t_before = load(rays.t_before + i);
        F slope = load(rays.slope + i);
        if (rays.round > 0) {
            const F moved = t - t_before;
            slope = select(lt(number(1e-5f), abs(moved)), (d - load(rays.d_before + i)) / moved, number(-1));
        }
        const M enters = lt(slope, number(kFlattest));
        const F step = min(max(d / select(enters, slope, number(-1)), number(-kFurthest)), number(kFurthest));
        // Along the surface, or out of something thinner than a voxel: whose front is before.
        const F back = min(t, t_before) - max(abs(d), number(RayPolish::kStepBack));
        const F next = select(enters, t - step, select(lt(number(kNearEnough), d), t + d, back));
        const M stays = without(all(), le(abs(next), number(kFurthest)));  // it is where it was
        const M done = both(enters, both(le(abs(d), number(near_enough)), le(abs(step), number(kShortEnough))));
        const I after = select(stays, splat(RayPolish::kIdle), select(done, splat(RayPolish::kDone), state));
        store(rays.state + i, select(was_open, after, state));
        store(rays.t + i, select(was_open, next, t));
        store(rays.t_before + i, t);
        store(rays.d_before + i, d);
        open += count(both(was_open, eq(after, splat(RayPolish::kOpen))));
    }
    ++rays.round;
    return open;
}

void polish_places(RayPolish& rays, int count_of_rays) {
    for (int i = 0; i < count_of_rays; i += kLanes) {
        const F t = load(rays.t + i);
        for (int a = 0; a < 3; ++a) {
            const F q = load(rays.first[a] + i) + load(rays.along[a] + i) * t;
            const F voxel = min(max(floor(q), number(0)), number(float(kBrickVoxels - 1)));
            store(rays.voxel[a] + i, to_int(voxel));
            store(rays.p[a] + i, min(max(q - voxel, number(0)), number(1)));
        }
    }
}
