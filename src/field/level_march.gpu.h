// SPDX-License-Identifier: MIT
// A ray through all levels: it is handed from box to box, and over missing cells to the next coarser level. Two levels have the same
// field where one hands over (levels.gpu.h), and a little of the way is looked at by both, so nothing slips through.
// Needs level_field.gpu.h and march.gpu.h before it, in the same struct.

KILN_FN void cut_span(float from, float direction, float inverse, float reach, KILN_INOUT(float) enter,
                      KILN_INOUT(float) leave) {
    if (direction == 0.0f) {
        if (abs(from) >= reach) leave = -kFarVoxels;
        return;
    }
    float a = (-reach - from) * inverse;
    float b = (reach - from) * inverse;
    enter = max(enter, min(a, b));
    leave = min(leave, max(a, b));
}

// First hit between t_min >= 0 and t_max, finest voxels. On a miss hit.t is where the ray left the outermost level, or t_max.
KILN_FN LevelHit level_march(TexelRay ray, float t_min, float t_max, bool accelerate) {
    LevelHit answer;
    answer.level = -1;
    answer.hit.state = kMarchMiss;
    answer.hit.slot = -1;
    answer.hit.cell = ivec3(0, 0, 0);
    answer.hit.voxel = ivec3(0, 0, 0);
    answer.hit.p = vec3(0.0f, 0.0f, 0.0f);
    answer.hit.cells = 0;
    answer.hit.voxels = 0;
    vec3 from = vec3(float(ray.whole.x - levels.focus_x) + (ray.part.x - levels.part_x),
                     float(ray.whole.y - levels.focus_y) + (ray.part.y - levels.part_y),
                     float(ray.whole.z - levels.focus_z) + (ray.part.z - levels.part_z));
    int first = levels.first;
    float reach = level_reach(levels.cells);
    float t = t_min;
    float known_from = t_min;  // up to here the levels below `known` are missing
    int known = first;
    int spans = 0;
    while (first < levels.count) {
        if (spans >= kSpansPerLevel) {
            spans = 0;
            first++;
        }
        spans++;
        // The finest level whose box holds the point at t, and how far that stays so.
        int level = -1;
        float end = t_max;
        for (int l = levels.drawn - 1; l >= min(first, levels.drawn - 1); l--) {
            float enter = -kFarVoxels;
            float leave = kFarVoxels;
            float size = reach * float(1 << l);
            cut_span(from.x, ray.direction.x, ray.inverse.x, size, enter, leave);
            cut_span(from.y, ray.direction.y, ray.inverse.y, size, enter, leave);
            cut_span(from.z, ray.direction.z, ray.inverse.z, size, enter, leave);
            if (!(enter < leave) || t >= leave) break;
            if (t < enter) {
                end = min(end, enter);
                break;
            }
            level = l;
            end = min(t_max, leave);
        }
        if (level < 0) {
            if (t == t_min && end < t_max) {  // it comes from outside
                t = end;
                continue;
            }
            break;
        }
        level = max(level, first);
        if (t < known_from && known > level) {
            level = known;
            end = min(end, known_from);
        }
        if (level < levels.count) {
            float scale = 1.0f / float(1 << level);
            here_level = level;
            MarchHit found = field_march(level_grid(level), level_ray(ray, level), t * scale,
                                         min(end * scale + kHandOver, t_max * scale), accelerate);
            answer.hit.cells += found.cells;
            answer.hit.voxels += found.voxels;
            if (found.state == kMarchHit || found.state == kMarchInside) {
                int cells = answer.hit.cells;
                int voxels = answer.hit.voxels;
                answer.hit = found;
                answer.hit.t = found.t * float(1 << level);
                answer.hit.cells = cells;
                answer.hit.voxels = voxels;
                answer.level = level;
                return answer;
            }
            if (found.state == kMarchMissing && found.t * float(1 << level) < end) {
                t = max(t, found.t * float(1 << level));
                known = level + 1;
                if (t < known_from) continue;
                // Where the ray leaves the missing cell.
                TexelRay local = level_ray(ray, level);
                float x = texel_plane_crossing((found.cell.x + (local.inverse.x > 0.0f ? 1 : 0)) * kBrickVoxels,
                                               local.whole.x, local.part.x, local.inverse.x, kFarVoxels);
                float y = texel_plane_crossing((found.cell.y + (local.inverse.y > 0.0f ? 1 : 0)) * kBrickVoxels,
                                               local.whole.y, local.part.y, local.inverse.y, kFarVoxels);
                float z = texel_plane_crossing((found.cell.z + (local.inverse.z > 0.0f ? 1 : 0)) * kBrickVoxels,
                                               local.whole.z, local.part.z, local.inverse.z, kFarVoxels);
                known_from = max(min(min(x, y), z) * float(1 << level), t + kHandOver * float(1 << level));
                continue;
            }
        }
        t = end;
        if (t >= t_max) break;
    }
    answer.hit.t = min(t, t_max);
    return answer;
}
