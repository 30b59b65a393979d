// SPDX-License-Identifier: MIT
// Glass in the judge of pictures: rays that bend, are thrown back or go on as chance has it, and how much of a light comes straight through.
#pragma once

#include "render/reference.h"

namespace kiln::render {

class GlassTrace {
public:
    explicit GlassTrace(std::span<const ReferenceGlass> glass);
    bool empty() const { return things_.empty(); }

    struct Hit {
        double t = -1;  // < 0: none
        int which = -1;
        dvec3 normal;  // unit, out of the glass
    };
    // The nearest surface that a ray from outside meets; or, from inside of `inside`, where it leaves that.
    Hit first(dvec3 origin, dvec3 direction, double t_last, int inside = -1) const;
    const Material& material(int which) const { return things_[size_t(which)].material; }
    // What is left of light after that many metres inside.
    vec3 left_after(int which, double metres) const;
    // What arrives over a distance along a straight line: less what surfaces reflect, keep out, and what the way absorbs.
    vec3 straight(dvec3 origin, dvec3 direction, double distance) const;

private:
    struct Thing {
        ReferenceField outside, inside;
        Material material;
        dvec3 absorbed;  // a metre
    };
    std::vector<Thing> things_;
};

}  // namespace kiln::render
