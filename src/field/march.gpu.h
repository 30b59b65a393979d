// SPDX-License-Identifier: MIT
// The primary march: jump over empty cells, walk the voxels of each brick, solve the cubic in each. No stepping by distance.
// The includer provides the field, before this text (C++: as members of the struct that includes it):
//     uint field_cell(ivec3 cell)                   cell word; `cell` counts from the grid's first cell and is inside
//     Corners field_corners(int slot, ivec3 voxel)  stored values, in voxels, at the corners of voxel 0 … 6 of a brick
//     bool field_voxel_solid(int slot, ivec3 voxel) may any of these be solid? (true, if one does not know)
//     void field_enter(uint word, ivec3 texel)      the brick of this word, whose first texel this is, comes next
// Which voxels are looked at never changes what one of them answers, so a march with and without jumps finds the same hit.
// In C++ this text is included inside a struct; it opens no namespace and includes nothing. Needs brick.gpu.h and brick_walk.gpu.h.

// Plane through which a ray leaves voxel v of a brick; the brick's own faces are pushed out by kFaceOverlap.
KILN_FN float voxel_exit_plane(int v, bool up) {
    if (up) return v == kBrickVoxels - 1 ? float(kBrickVoxels) + kFaceOverlap : float(v + 1);
    return v == 0 ? -kFaceOverlap : float(v);
}

// Begins between t_min and t_max (voxels along the ray).
KILN_FN BrickWalk brick_walk(BrickRay ray, float t_min, float t_max) {
    bool up_x = ray.inverse.x > 0.0f;
    bool up_y = ray.inverse.y > 0.0f;
    bool up_z = ray.inverse.z > 0.0f;
    // Neighbouring bricks round the crossing of their common face apart: each looks a little past it, so none leaves a gap.
    float first = -kFaceOverlap;
    float last = float(kBrickVoxels) + kFaceOverlap;
    float enter = t_min - ray.t_base;
    float leave = t_max - ray.t_base;
    enter = max(enter, plane_crossing(up_x ? first : last, ray.high.x, ray.low.x, ray.inverse.x, -kFarVoxels));
    enter = max(enter, plane_crossing(up_y ? first : last, ray.high.y, ray.low.y, ray.inverse.y, -kFarVoxels));
    enter = max(enter, plane_crossing(up_z ? first : last, ray.high.z, ray.low.z, ray.inverse.z, -kFarVoxels));
    leave = min(leave, plane_crossing(up_x ? last : first, ray.high.x, ray.low.x, ray.inverse.x, kFarVoxels));
    leave = min(leave, plane_crossing(up_y ? last : first, ray.high.y, ray.low.y, ray.inverse.y, kFarVoxels));
    leave = min(leave, plane_crossing(up_z ? last : first, ray.high.z, ray.low.z, ray.inverse.z, kFarVoxels));
    BrickWalk walk = ended_walk();
    walk.ray = ray;
    walk.enter = enter;
    walk.leave = leave;
    walk.voxel = voxel_at(ray, enter);
    walk.in_brick = !(enter > leave);
    return walk;
}

// On to the next voxel that may hold the surface: true; or to the end.
KILN_FN bool brick_walk_seek(KILN_INOUT(BrickWalk) walk, int slot) {
    bool up_x = walk.ray.inverse.x > 0.0f;
    bool up_y = walk.ray.inverse.y > 0.0f;
    bool up_z = walk.ray.inverse.z > 0.0f;
    bool solid = false;
    do {
        if (walk.looks > 0) {
            walk.enter = walk.exit;
            if (walk.out_any == walk.out_x)
                walk.voxel.x += up_x ? 1 : -1;
            else if (walk.out_any == walk.out_y)
                walk.voxel.y += up_y ? 1 : -1;
            else
                walk.voxel.z += up_z ? 1 : -1;
            walk.in_brick = walk.in_brick && walk.out_any < walk.leave && walk.looks < 3 * kBrickVoxels + 3 &&
                            min(min(walk.voxel.x, walk.voxel.y), walk.voxel.z) >= 0 &&
                            max(max(walk.voxel.x, walk.voxel.y), walk.voxel.z) < kBrickVoxels;
        }
        if (walk.in_brick) {
            walk.looks++;
            walk.out_x = plane_crossing(voxel_exit_plane(walk.voxel.x, up_x), walk.ray.high.x, walk.ray.low.x,
                                        walk.ray.inverse.x, kFarVoxels);
            walk.out_y = plane_crossing(voxel_exit_plane(walk.voxel.y, up_y), walk.ray.high.y, walk.ray.low.y,
                                        walk.ray.inverse.y, kFarVoxels);
            float out_z = plane_crossing(voxel_exit_plane(walk.voxel.z, up_z), walk.ray.high.z, walk.ray.low.z,
                                         walk.ray.inverse.z, kFarVoxels);
            walk.out_any = min(min(walk.out_x, walk.out_y), out_z);
            walk.exit = max(min(walk.out_any, walk.leave), walk.enter);
            solid = field_voxel_solid(slot, walk.voxel);
        }
    } while (walk.in_brick && !solid);
    return solid;
}

// Is the surface in the voxel at hand? Then t, voxel and p are set.
KILN_FN bool brick_walk_solve(BrickWalk walk, int slot, KILN_INOUT(MarchHit) hit) {
    hit.voxels++;
    Cubic cubic = cubic_along(field_corners(slot, walk.voxel), voxel_point(walk.ray, walk.voxel, walk.enter),
                              voxel_point(walk.ray, walk.voxel, walk.exit));
    float root = cubic_first_root(cubic);
    if (root > 1.0f) return false;
    float s = walk.enter + root * (walk.exit - walk.enter);
    hit.t = walk.ray.t_base + s;
    hit.voxel = walk.voxel;
    vec3 p = voxel_point(walk.ray, walk.voxel, s);
    hit.p = vec3(min(max(p.x, 0.0f), 1.0f), min(max(p.y, 0.0f), 1.0f), min(max(p.z, 0.0f), 1.0f));
    return true;
}

// Voxels of one brick between t_min and t_max (voxels along the ray). True when hit; then t, voxel and p are set.
KILN_FN bool march_brick(BrickRay ray, int slot, float t_min, float t_max, KILN_INOUT(MarchHit) hit) {
    BrickWalk walk = brick_walk(ray, t_min, t_max);
    while (brick_walk_seek(walk, slot))
        if (brick_walk_solve(walk, slot, hit)) return true;
    return false;
}

// Parameter at which the ray crosses the plane of texels number `texel` of an axis.
KILN_FN float texel_plane_crossing(int texel, int whole, float part, float inverse, float parallel) {
    return inverse == 0.0f ? parallel : (float(texel - whole) - part) * inverse;
}

// Cell that holds the coordinate at t.
KILN_FN int cell_at(int whole, float part, float direction, float t) {
    return int(floor((float(whole) + (part + direction * t)) * kCellsPerVoxel));
}

// Where the walk of a ray through the grid begins.
KILN_FN MarchStart march_start(GridParams grid, TexelRay ray, float t_min, float t_max) {
    MarchStart start;
    start.meets = false;
    start.whole = ivec3(ray.whole.x - grid.cell_x * kBrickVoxels, ray.whole.y - grid.cell_y * kBrickVoxels,
                        ray.whole.z - grid.cell_z * kBrickVoxels);
    start.t = t_min;
    start.cell = ivec3(0, 0, 0);
    bool up_x = ray.inverse.x > 0.0f;
    bool up_y = ray.inverse.y > 0.0f;
    bool up_z = ray.inverse.z > 0.0f;
    ivec3 whole = start.whole;
    float t = t_min;
    t = max(t, texel_plane_crossing(up_x ? 0 : grid.size_x * kBrickVoxels, whole.x, ray.part.x, ray.inverse.x,
                                    -kFarVoxels));
    t = max(t, texel_plane_crossing(up_y ? 0 : grid.size_y * kBrickVoxels, whole.y, ray.part.y, ray.inverse.y,
                                    -kFarVoxels));
    t = max(t, texel_plane_crossing(up_z ? 0 : grid.size_z * kBrickVoxels, whole.z, ray.part.z, ray.inverse.z,
                                    -kFarVoxels));
    float end = t_max;
    end = min(end, texel_plane_crossing(up_x ? grid.size_x * kBrickVoxels : 0, whole.x, ray.part.x, ray.inverse.x,
                                        kFarVoxels));
    end = min(end, texel_plane_crossing(up_y ? grid.size_y * kBrickVoxels : 0, whole.y, ray.part.y, ray.inverse.y,
                                        kFarVoxels));
    end = min(end, texel_plane_crossing(up_z ? grid.size_z * kBrickVoxels : 0, whole.z, ray.part.z, ray.inverse.z,
                                        kFarVoxels));
    if (!(t <= end)) return start;
    ivec3 cell;
    cell.x = cell_at(whole.x, ray.part.x, ray.direction.x, t);
    cell.y = cell_at(whole.y, ray.part.y, ray.direction.y, t);
    cell.z = cell_at(whole.z, ray.part.z, ray.direction.z, t);
    if (ray.direction.x == 0.0f && (cell.x < 0 || cell.x >= grid.size_x)) return start;
    if (ray.direction.y == 0.0f && (cell.y < 0 || cell.y >= grid.size_y)) return start;
    if (ray.direction.z == 0.0f && (cell.z < 0 || cell.z >= grid.size_z)) return start;
    // On the other axes rounding may have put it just outside.
    start.cell.x = min(max(cell.x, 0), grid.size_x - 1);
    start.cell.y = min(max(cell.y, 0), grid.size_y - 1);
    start.cell.z = min(max(cell.z, 0), grid.size_z - 1);
    start.t = t;
    start.meets = true;
    return start;
}

KILN_FN MarchHit march_miss(float t_max) {
    MarchHit hit;
    hit.state = kMarchMiss;
    hit.t = t_max;
    hit.slot = -1;
    hit.cell = ivec3(0, 0, 0);
    hit.voxel = ivec3(0, 0, 0);
    hit.p = vec3(0.0f, 0.0f, 0.0f);
    hit.cells = 0;
    hit.voxels = 0;
    return hit;
}

// Does a cell's word name a brick?
KILN_FN bool is_brick(uint word) { return (word & kCellOccupied) != 0u && word != kCellMissing; }

// Does the march end in this cell (counted from the grid's first), which has this word and which the ray enters at t? Then `hit` says how.
// A pure function of ray and cell: it does not matter where the ray was before.
KILN_FN bool march_cell(GridParams grid, TexelRay ray, ivec3 cell, uint word, float t, float t_min, float t_max,
                        KILN_INOUT(MarchHit) hit) {
    if ((word & (kCellOccupied | kCellInside)) == 0u) return false;
    ivec3 world = ivec3(cell.x + grid.cell_x, cell.y + grid.cell_y, cell.z + grid.cell_z);
    if (is_brick(word)) {
        ivec3 texel = ivec3(world.x * kBrickVoxels, world.y * kBrickVoxels, world.z * kBrickVoxels);
        int slot = int(word & kCellSlotMask);
        field_enter(word, texel);
        if (!march_brick(brick_ray(ray, texel), slot, t_min, t_max, hit)) return false;
        hit.state = kMarchHit;
        hit.slot = slot;
    } else {
        hit.state = word == kCellMissing ? kMarchMissing : kMarchInside;
        hit.t = t;
    }
    hit.cell = world;
    return true;
}

// First hit between t_min >= 0 and t_max (voxels). `accelerate` false visits every cell.
KILN_FN MarchHit field_march(GridParams grid, TexelRay ray, float t_min, float t_max, bool accelerate) {
    MarchHit hit = march_miss(t_max);
    MarchStart start = march_start(grid, ray, t_min, t_max);
    if (!start.meets) return hit;
    bool up_x = ray.inverse.x > 0.0f;
    bool up_y = ray.inverse.y > 0.0f;
    bool up_z = ray.inverse.z > 0.0f;
    // From here on, texels and cells count from the grid's first.
    ivec3 whole = start.whole;
    float t = start.t;
    ivec3 cell = start.cell;
    int most = grid.size_x + grid.size_y + grid.size_z + 3;
    int slot = -1;
    uint word = 0u;
    BrickWalk walk = ended_walk();
    bool stays = true;
    // Loops are nested so that rays in step do together what costs most (Aila and Laine, "Understanding the Efficiency of Ray Traversal on
    // GPUs", 2009): all walk on to a voxel that may hold the surface, through empty cells and past what bricks have of air, then all solve.
    while (stays) {
        bool solid = false;
        do {
            bool arrived = walk.in_brick;
            do {
                if (!arrived && hit.cells > 0) {
                    // Cells around this one that are empty too.
                    int reach = accelerate && (word & kCellOccupied) == 0u ? max(int(word & 7u) - 1, 0) : 0;
                    // Leave the cube of empty cells around this one.
                    int out_cell_x = up_x ? cell.x + reach + 1 : cell.x - reach;
                    int out_cell_y = up_y ? cell.y + reach + 1 : cell.y - reach;
                    int out_cell_z = up_z ? cell.z + reach + 1 : cell.z - reach;
                    float out_x =
                        texel_plane_crossing(out_cell_x * kBrickVoxels, whole.x, ray.part.x, ray.inverse.x, kFarVoxels);
                    float out_y =
                        texel_plane_crossing(out_cell_y * kBrickVoxels, whole.y, ray.part.y, ray.inverse.y, kFarVoxels);
                    float out_z =
                        texel_plane_crossing(out_cell_z * kBrickVoxels, whole.z, ray.part.z, ray.inverse.z, kFarVoxels);
                    float out_any = min(min(out_x, out_y), out_z);
                    t = max(t, out_any);
                    bool leave_x = out_any == out_x;
                    bool leave_y = !leave_x && out_any == out_y;
                    bool leave_z = !leave_x && !leave_y;
                    if (reach > 0) {  // the other axes may have moved within the cube
                        ivec3 from = cell;
                        if (!leave_x && ray.direction.x != 0.0f)
                            cell.x = min(max(cell_at(whole.x, ray.part.x, ray.direction.x, t), from.x - reach),
                                         from.x + reach);
                        if (!leave_y && ray.direction.y != 0.0f)
                            cell.y = min(max(cell_at(whole.y, ray.part.y, ray.direction.y, t), from.y - reach),
                                         from.y + reach);
                        if (!leave_z && ray.direction.z != 0.0f)
                            cell.z = min(max(cell_at(whole.z, ray.part.z, ray.direction.z, t), from.z - reach),
                                         from.z + reach);
                    }
                    if (leave_x) cell.x = up_x ? out_cell_x : out_cell_x - 1;
                    if (leave_y) cell.y = up_y ? out_cell_y : out_cell_y - 1;
                    if (leave_z) cell.z = up_z ? out_cell_z : out_cell_z - 1;
                    stays = t <= t_max && hit.cells < most && min(min(cell.x, cell.y), cell.z) >= 0 &&
                            cell.x < grid.size_x && cell.y < grid.size_y && cell.z < grid.size_z;
                }
                if (!arrived && stays) {
                    hit.cells++;
                    word = field_cell(cell);
                    arrived = (word & (kCellOccupied | kCellInside)) != 0u;
                }
            } while (stays && !arrived);
            if (stays && !walk.in_brick) {
                hit.cell = ivec3(cell.x + grid.cell_x, cell.y + grid.cell_y, cell.z + grid.cell_z);
                if (is_brick(word)) {
                    ivec3 texel =
                        ivec3(hit.cell.x * kBrickVoxels, hit.cell.y * kBrickVoxels, hit.cell.z * kBrickVoxels);
                    slot = int(word & kCellSlotMask);
                    field_enter(word, texel);
                    walk = brick_walk(brick_ray(ray, texel), t_min, t_max);
                } else {
                    hit.state = word == kCellMissing ? kMarchMissing : kMarchInside;
                    hit.t = t;
                    stays = false;
                }
            }
            if (stays) solid = brick_walk_seek(walk, slot);
        } while (stays && !solid);
        if (solid && brick_walk_solve(walk, slot, hit)) {
            hit.state = kMarchHit;
            hit.slot = slot;
            stays = false;
        }
    }
    if (hit.state == kMarchMiss) hit.cell = ivec3(0, 0, 0);
    return hit;
}
