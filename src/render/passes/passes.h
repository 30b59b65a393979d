// SPDX-License-Identifier: MIT
// The passes of a frame, each a function of images, each in the file of its name. Kernels are named here for warm-up.
#pragma once

#include "render/gpu_boxes.h"
#include "render/gpu_field.h"
#include "render/gpu_instances.h"
#include "render/gpu_meshes.h"
#include "render/graph.h"
#include "render/passes/bake.gpu.h"
#include "render/passes/cascades.gpu.h"
#include "render/passes/lamps.gpu.h"
#include "render/passes/frame.gpu.h"
#include "render/passes/lines.gpu.h"
#include "render/passes/outline.gpu.h"
#include "render/passes/particles.gpu.h"
#include "render/passes/shadow.gpu.h"
#include "render/passes/tape_use.h"

#include <kiln/renderer.h>

#include <array>
#include <vector>

namespace kiln::render {

// What of a frame's passes reads a sky: here from an image.
inline constexpr rhi::SpecConstant kWithImage[] = {{6, 1}};

extern const Kernel kBakeHalf, kBakeSnorm8, kBakeCopyHalf, kBakeCopySnorm8;
extern const Kernel kMarch, kMarchLevels, kMarchInstances, kMarchLevelsInstances, kMarchExact, kRefine, kSettle,
    kResolve, kResolveExact, kResolveLevels, kResolveLevelsExact, kShadow, kShadowExact, kShadowHorizons, kShadowLevels,
    kShadowLevelsExact, kShadowLevelsHorizons, kCluster, kDepthOf, kLight, kLightImage, kLightGlass, kLightGlassImage,
    kTonemap, kView;
extern const Kernel kMotion, kTaa, kOutlineMask, kOutlineFlood, kOutlineDraw;
extern const Kernel kDepthPyramid, kDepthPyramidRest, kMeshCull, kMeshPack, kMeshPick;
extern const Kernel kMeshSee, kMeshResolve, kMeshShadow, kMeshShadowHoles;
extern const RasterKernel kMeshOneSided, kMeshDoubleSidedDraw, kMeshMasked;
extern const RasterKernel kMeshOneSidedGroups, kMeshDoubleSidedGroups, kMeshMaskedGroups;  // by a mesh shader
extern const TraceKernel kMarchTrace;
extern const Kernel kBloomDown, kBloomUp, kBloomBlur, kExposureCount, kExposureAdapt;

// Bakes `slots` (at most a slice) into the field's atlas.
void bake_bricks(Graph& g, FieldHandles& f, std::span<const uint32_t> slots, const BakePush& push, rhi::Format format,
                 bool by_copy, const TapeUse& use);

// Texels made elsewhere into the atlas. Row r (y + 8 z) of job i's brick is at packed_at(i, r, bytes of a row) of `codes` and `words`:
// rows of 256 bytes, as many bricks side by side as fit, so that every device can copy them.
size_t packed_at(size_t job, size_t row, size_t row_bytes);
size_t packed_bytes(size_t jobs, size_t row_bytes);
void store_bricks(Graph& g, FieldHandles& f, std::span<const uint32_t> slots, std::span<const std::byte> codes,
                  std::span<const std::byte> words, uint32_t atlas_bricks_x_y, rhi::Format format);

const Kernel& bake_kernel(rhi::Format format, bool by_copy, const TapeUse& use);

// Edits, each with its own code, whose pixels are asked for.
struct OwnerHandles {
    Buffer records, code;  // OutlineRecord
    uint32_t count = 0;
    TapeUse use;
};
// What of the field moved or changed since the frame before.
struct MovedHandles {
    OwnerHandles owners;
    Buffer edits, boxes;  // MovedRecord of each owner; ChangedBox
    bool has_boxes = false;
};
// A frame's debug lines; none: count 0.
struct LineHandles {
    Buffer lines;  // LineRecord
    Block params;  // LineParams
    uint32_t count = 0;
};

// A frame's particles, see particle_bins.h; none: count 0.
struct ParticleHandles {
    Buffer records, ends, numbers;
    uint32_t count = 0;
    std::array<uint32_t, size_t(kParticleLevels)> first_level{}, across{};
    // The sun on them: a picture with a pixel each, whose rays begin in their middles and whose tiles' lists have that light alone.
    uint32_t sun = kNoSun;
    rhi::Extent size;
    Block frame;
    Buffer rays, masks;
};

// Shadow maps of meshes under one light, see cascades.h; none: maps is not an image.
struct CascadeHandles {
    Image maps;
    Block block;  // CascadesBlock
};

// Those of lamps and spots, see lamps.h.
struct LampHandles {
    Image maps;
    Buffer faces;  // LampFace
};

// A part of a tile, behind whose pixels something may let light through: a picture of its own, whose rays then go elsewhere.
struct ThroughPart {
    int x = 0, y = 0;  // its first pixel in the tile
    rhi::Extent size;
    Block frame, frame_of_rays;  // FrameParams, by the camera's rays and by given ones
    Block frame_of_parted;       // likewise of two pictures, one below the other
    Buffer light_rects;          // for the camera's rays
    uint32_t lights_of_tile = 0;
};

// Rows of a tile that are marched and lit by themselves, so that its other images need be no larger.
struct Band {
    uint32_t y = 0;  // its first row in the tile
    rhi::Extent size;
    Block frame;  // FrameParams
    Buffer light_rects;
    uint32_t lights_of_tile = 0;
};

// What every pass of one tile reads.
struct TileInputs {
    FieldHandles field;
    Block frame;         // FrameParams
    Block levels_block;  // LevelsBlock; of a clipmap
    Buffer rays;         // FrameRay a pixel; a dummy unless kFrameRays
    Buffer materials;    // MaterialEntry
    Buffer lights;       // LightRecord
    Buffer ggx_table;
    Buffer environment;  // EnvironmentMap::words; a dummy unless image_sky
    Buffer light_rects;  // LightRect a light
    uint32_t light_count = 0;
    uint32_t lights_of_tile = 0;  // at most
    bool local_lights = false;    // some light ends somewhere
    rhi::Extent size;             // of the tile
    bool exact = false;           // some code is marched: analytic, or edits leave the grid
    bool analytic = false;        // … instead of the bricks
    bool horizons = false;        // exact code is half-spaces outside the grid, no more
    bool image_sky = false;
    bool levels = false;  // the field is a clipmap
    bool refine = false;  // by the device: the host may do it
    // A shaded tile becomes what a screen shows here; else by develop() of lens.h, when the picture is whole.
    bool develops = true;
    Camera camera;
    Buffer exposure;    // ExposureState: as it was, and as it is
    float elapsed = 0;  // seconds since the picture before
    TapeUse use;        // of the code that is marched and resolved
    TapeUse use_of_bricks;
    InstanceHandles instances;  // none where the frame has none
    bool has_instances = false;
    TapeUse use_of_instances;
    bool taa = false;
    bool has_history = false;  // the frame before is the one that `motion` leads to
    Block motion;              // MotionParams, with taa
    Buffer outlines;           // OutlineRecord, where outline_count is above 0
    Buffer outline_code;
    uint32_t outline_count = 0;
    float widest_outline = 0;
    TapeUse use_of_outlines;
    MeshHandles meshes;
    bool has_meshes = false;
    BoxHandles boxes;          // with `rt`
    bool rt = false;           // the bricks are marched by rays through their boxes
    bool mesh_shader = false;  // clusters of meshes are drawn by a mesh shader
    bool cull_meshes = false;  // those that something hides are not: see mesh_cull.cpp
    MovedHandles moved;        // with taa
    bool mesh_holes = false;
    bool has_lines = false;
    LineHandles lines;
    bool has_glass = false;   // instances that light goes through
    bool has_blends = false;  // likewise of meshes
    int transparent_layers = 0;
    int glass_bounces = 0;  // inside glass
    std::vector<ThroughPart> through;
    std::vector<Band> bands;       // from the top down; none: the tile is drawn whole
    bool outlines_meshes = false;  // their records follow those of edits
    bool outline_hulls = false;    // … or are not used: see draw_hulls()
    bool has_particles = false;
    ParticleHandles particles;
    Buffer all_light_rects;  // LightRect a light, all of twice any picture; where `through` is not empty
    bool has_cascades = false;
    uint32_t mapped_light = 0;  // whose
    CascadeHandles cascades;
    bool has_lamps = false;
    LampHandles lamps;
    bool maps_alone = false;      // no light has rays for what meshes hide of it
    uint32_t volume_count = 0;    // lights that are rasterised
    Buffer volumes;               // their numbers
    bool upscales = false;        // with taa: the rays of a smaller picture are made into this one over time
    rhi::Extent shown_size;       // of the picture: else `size`
    vec2 jitter;                  // where in its pixels this frame looks
    uint32_t picture = 0;         // of the row of pictures that becomes one over time
    uint32_t ao_every = 0;        // pixel of a row, and row, has rays of ambient occlusion; 0: there is none
    bool outline_hidden = false;  // outlined things have lines where something hides them too
};

// Visibility words, and the evaluations of each workgroup of each march.
struct Visibility {
    Image words;
    std::vector<Buffer> evaluations;
};
const Kernel& march_kernel(const TileInputs& in);
// First hits on the field and on instances. With `mesh_depth` (and kFrameRayEnds) rays end where they have passed what it shows.
Visibility march(Graph& g, const TileInputs& in, const Image* mesh_depth = nullptr);
// The words of the bricks, by rays through in.boxes that end behind `ends` (with kFrameRayEnds); what it answers counts evaluations.
Buffer march_boxes(Graph& g, const TileInputs& in, const Image& ends, Image& words);

struct Surface {
    Image words;  // packed G-buffer, see surface.glsl
    Image seen;   // visibility words, with t where the surface is
};
// Metres along the ray of what resolved words see, +infinity where that is nothing.
Image depth_of(Graph& g, const TileInputs& in, const Image& seen);
void depth_of(Graph& g, const TileInputs& in, const Image& seen, Image& depth);  // a band's rows of it
// The words with t where refine() has the surface.
Image settle(Graph& g, const TileInputs& in, const Image& visibility, const Image& refined);
// `seen`: settled words. `refined`: what refine() answers; any image of words without kFrameRefine.
Surface resolve(Graph& g, const TileInputs& in, const Image& seen, const Image& refined);

// What the bricks' code says of the points that march found in them; see refine.comp.
Image refine(Graph& g, const TileInputs& in, const Image& visibility);
// The same words from the same visibility words, made here: software devices run the tape many times slower.
std::vector<uint32_t> refine_on_host(const BrickCode& bricks, const FrameParams& frame,
                                     std::span<const uint32_t> visibility);

// Triangles as the rasteriser leaves them: number in their part plus one (0: none), part; reversed depth.
struct MeshIds {
    Image ids, depth;
};
// Clusters of the list, or of `clusters`, of whose kinds `numbers` (of mesh_pack.comp) tells how many there are.
MeshIds draw_clusters(Graph& g, const TileInputs& in, const Buffer* clusters = nullptr,
                      const Buffer* numbers = nullptr);
// Draws in two phases, each chosen on the device: what the picture before showed, and, once the field is marched, what of the rest
// `visibility` and the first phase do not hide.
struct MeshesEarly {
    MeshIds drawn;
    Buffer chosen, numbers, seen;
};
struct MeshesSeen {
    Image ids;
    std::vector<Buffer> numbers;  // of each phase: kMeshDrawnWords
};
MeshesEarly draw_early(Graph& g, const TileInputs& in);
MeshesSeen draw_late(Graph& g, const TileInputs& in, const MeshesEarly& early, const Image& visibility);
// Levels of a pyramid of what a tile shows; see depth_pyramid.gpu.h.
Buffer depth_pyramid(Graph& g, const TileInputs& in, const Image& mesh_depth, const Image& visibility);

// What settle() answers, with meshes where they are nearer than the field.
Image see_meshes(Graph& g, const TileInputs& in, const Image& ids, const Image& visibility, const Image& refined);
// Fills in the surface where meshes are seen.
void resolve_meshes(Graph& g, const TileInputs& in, Surface& surface);
// The fractions, less what meshes hide.
Image shadow_meshes(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                    const Image& fractions, const ShadowPush& push);

const Kernel& mesh_shadow_kernel(const TileInputs& in);
const Kernel& resolve_kernel(const TileInputs& in);
const Kernel& shadow_kernel(const TileInputs& in);
// Which lights may reach which tile; see cluster.comp and light_walk.glsl.
Buffer cluster(Graph& g, const TileInputs& in, const Image& visibility);
// Visible fractions of the discs of lights push.first_light … + 15 of each tile's list, a byte each.
Image shadow(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface, const Buffer& masks,
             const ShadowPush& push);
const Kernel& light_kernel(const TileInputs& in);
// Scene-linear radiance, before exposure. `depth`: depth_of() what is seen.
Image light(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth);
void light(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth, Image& radiance);

// Where each pixel's surface was in the frame before; see motion.comp.
Image motion(Graph& g, const TileInputs& in, const Image& visibility);
// With what the frames before saw of the same places; see taa.comp.
Image taa(Graph& g, const TileInputs& in, const Image& radiance, const Image& depth, const Image& motion);

// Outlined edits, each with its own code.
struct OutlineCode {
    std::vector<OutlineRecord> records;
    std::vector<sdf::Instruction> code;
    float widest = 0;
    int left_out = 0;          // no code for a GPU
    std::vector<uint32_t> of;  // the outline that each record is
};
OutlineCode outline_code(std::span<const EditOutline> outlines, const sdf::Program& program,
                         std::span<const Instance> instances);
struct OutlineMask {
    Image owners, seeds;
};
OutlineMask edit_owners(Graph& g, const TileInputs& in, const OwnerHandles& asked, const Image& visibility);
OutlineMask outline_mask(Graph& g, const TileInputs& in, const Image& visibility);
// Seeds of the pixels that lines reach.
Image outline_flood(Graph& g, const Buffer& records, const OutlineMask& mask, float widest);
// The picture with its lines.
Image outline(Graph& g, const TileInputs& in, const Image& visibility, const Image& shown);

// The exposure that this picture asks for, from its histogram.
void expose(Graph& g, const Image& radiance, Buffer& exposure, float seconds, float correction);
// What the lens scatters: half the size (pyramid), or the same (Gaussian).
Image bloom(Graph& g, const Image& radiance, const Buffer& exposure, const Camera& camera);
// With its glow, exposed, tone-mapped, sRGB-encoded. `glow`: any image without bloom.
Image tonemap(Graph& g, const Image& radiance, const Image& glow, const Buffer& exposure, const Camera& camera);

// A debug view: its numbers, and its bytes as they are shown.
struct Shown {
    Image values, bytes;
};
Shown view(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth);

}  // namespace kiln::render
