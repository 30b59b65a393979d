// SPDX-License-Identifier: MIT
// What every kernel of a frame knows: camera, grid, tile, and where the exact programs are. Also the records of lights and
// materials, and the visibility word that march writes and resolve reads.

#ifdef __cplusplus
#pragma once
#endif
#include "field/brick.gpu.h"
#include "render/lib/camera.gpu.h"
#include "render/lib/sky.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using field::GridParams;
using shade::CameraParams;
using shade::SkyParams;
using uint = uint32_t;
#endif

KILN_CONST int kTileGroup = 8;  // a workgroup of the picture's kernels is 8 x 8 pixels

// A half-space that leaves the grid, where such are few and plainly added: scale * dot(normal, p - at), in metres.
struct HorizonPlane {
    float normal_x, normal_y, normal_z;
    float scale;
    float at_x, at_y, at_z;
    uint material;
};
KILN_CONST int kMostPlanes = 4;

struct FrameParams {
    GridParams grid;                           // of a clipmap: the box that its levels fill, in finest cells
    int eye_x, eye_y, eye_z;                   // the camera: voxel it is in
    float distance_scale;                      // voxels a unit of the atlas
    float eye_part_x, eye_part_y, eye_part_z;  // and where in it, [0, 1)
    float pixel_angle;                         // radians between neighbouring pixels at the middle of the picture
    CameraParams camera;
    int width, height;   // pixels of the whole picture
    int tile_x, tile_y;  // of this tile's first pixel
    int tile_width, tile_height;
    uint flags;  // kFrame…
    uint light_count;
    uint outside_first, outside_count;  // code of what leaves the grid, in the program buffer; count 0: nothing does
    uint program_count;                 // code of the whole program, from the program buffer's start
    uint params_first;                  // of Program::params in the numbers buffer
    SkyParams sky;
    uint view;  // kiln::View
    uint material_count;
    float refine_reach;  // how far refining may move what march found, finest voxels, on the coarsest level or instance
    int first_row;       // of the tile's images, where the first row of this frame's band of it is
    // Outside of this box, voxels of the world, the code of what leaves the grid has nothing solid.
    float outside_low_x, outside_low_y, outside_low_z, pad_0;
    float outside_high_x, outside_high_y, outside_high_z, pad_1;
    HorizonPlane planes[kMostPlanes];  // as many as kernels are made for, see TapeUse
};

KILN_CONST uint kFrameAccelerate = 1u;       // jump over empty cells
KILN_CONST uint kFrameRays = 2u;             // rays come from the rays buffer instead of the camera
KILN_CONST uint kFrameAnalytic = 4u;         // march the pruned programs of the cells
KILN_CONST uint kFrameUnpruned = 8u;         // march the whole program
KILN_CONST uint kFrameOutsideConcave = 16u;  // half-spaces alone leave the grid: their field is concave along a ray
KILN_CONST uint kFrameAllLights = 64u;       // every light at every pixel: the slow twin of the lists
KILN_CONST uint kFrameRayEnds = 128u;        // march's rays end behind the meshes that are drawn already
KILN_CONST uint kFrameAmbient = 256u;        // the G-buffer's ambient visibility is that of the hemisphere
KILN_CONST uint kFrameRefine = 32u;          // points of bricks are moved to where their code has the surface

// A ray given from outside (tests, queries): origin in voxels, unit direction.
struct FrameRay {
    int whole_x, whole_y, whole_z;
    float within;  // the number of the glass that it goes through, plus one; 0: none
    float part_x, part_y, part_z;
    float pad_1;
    float direction_x, direction_y, direction_z;
    float pad_2;
};

struct MaterialRecord {
    float base_red, base_green, base_blue;  // linear
    float roughness;
    float emissive_red, emissive_green, emissive_blue;
    float metallic;
};

// Visibility of a pixel, four words: t in (finest) voxels along the ray (bits of a float); state << 28 | slot;
// voxel x | y << 3 | z << 6 | level << 12; steps | evaluations << 16 (each at most 65535).
KILN_CONST uint kSeenLevelShift = 12u;
KILN_CONST uint kSeenNothing = 0u;
KILN_CONST uint kSeenBrick = 1u;    // the trilinear surface in a brick
KILN_CONST uint kSeenInside = 2u;   // solid without a brick: the camera is in it
KILN_CONST uint kSeenPruned = 3u;   // exact code of brick `slot`
KILN_CONST uint kSeenOutside = 4u;  // exact code of what leaves the grid
KILN_CONST uint kSeenProgram = 5u;  // exact code of the whole program
KILN_CONST uint kSeenMesh = 6u;     // triangle `slot` of the frame's meshes; z: the part it belongs to
// The trilinear surface in a brick of an instance: slot is the instance's number; z is its voxel | the brick's slot in its set << 9.
KILN_CONST uint kSeenInstance = 7u;

#ifdef __cplusplus
static_assert(sizeof(FrameParams) == 416 && sizeof(HorizonPlane) == 32 && sizeof(FrameRay) == 48 &&
              sizeof(MaterialRecord) == 32);
}  // namespace kiln::render
#endif
