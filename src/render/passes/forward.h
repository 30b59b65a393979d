// SPDX-License-Identifier: MIT
// Passes behind the light of what is solid: what lets light through, particles, debug lines. They read its depth and write none.
#pragma once

#include "render/passes/passes.h"

namespace kiln::render {

extern const RasterKernel kLines, kOutlineHull;
extern const Kernel kLinesOver, kOutlineMeshes, kOutlineHidden, kOutlineHiddenMeshes;
extern const Kernel kMarchGlass, kThroughBegin, kThroughLayer, kThroughSurface, kThroughBend, kThroughBendImage,
    kThroughTotal, kThroughEnd, kThroughFront, kMeshTrace, kShadowGlass;
extern const Kernel kParticles, kParticlesStart, kParticlesLight, kParticlesLightImage;

// What each pixel shows first, transparent or not; without anything transparent what is solid as it is, and images that are not read.
struct Front {
    Image seen, depth;
    Image light;  // of that alone
    Image left;   // share of light from behind it that comes through
};
// Radiance with what lets light through.
Front draw_through(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth, Image& radiance);
// Glass along rays where it is nearer than what is solid; in.instances: of_glass().
Image march_glass(Graph& g, const TileInputs& in, const Image& solid);
// What glass leaves of lights first_light … + 15: the fractions are less by it, and the colours that the light pass takes.
std::vector<Image> shadow_glass(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                                const Buffer& light_masks, uint32_t first_light, Image& fractions);
void through_kernels(const TileInputs& in, std::vector<const Kernel*>& out);

// Radiance with particles. With taa, depth and motion are theirs where they hide more than half of what is behind.
void draw_particles(Graph& g, const TileInputs& in, const Image& solid_depth, Front& front, Image& radiance,
                    Image& motion);

// Meshes with an outline into the mask; their records follow `records_before` others.
void mark_meshes(Graph& g, const TileInputs& in, const Image& visibility, uint32_t records_before, OutlineMask& mask);
// … and what something hides of outlined edits and meshes, where nothing outlined is seen.
void mark_hidden(Graph& g, const TileInputs& in, OutlineMask& mask);
// The finished picture with outlines of meshes by a stencil and larger hulls; see outline_hull.vert.
Image draw_hulls(Graph& g, const TileInputs& in, const Image& seen, const Image& depth, const Image& shown);
// The finished picture with something over it: colour times share, and share.
Image lay_over(Graph& g, const Image& drawn, const Image& shown);

// As kernels see them, counted from the eye; those that are not finite are left out.
std::vector<LineRecord> line_records(std::span<const DebugLine> lines, vec3 eye);
// The finished picture with the frame's lines. `depth`: metres along the ray.
Image draw_lines(Graph& g, const TileInputs& in, const Image& depth, const Image& shown);

}  // namespace kiln::render
