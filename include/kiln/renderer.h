// SPDX-License-Identifier: MIT
// Renderer: turns a Frame (what to show) into a Picture. One frame is three calls:
//   auto renderer = kiln::Renderer::create();   auto frame = world.frame();   auto picture = renderer->render(*frame);
#pragma once

#include <kiln/edit.h>
#include <kiln/math.h>
#include <kiln/result.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

namespace field {
class BrickSet;
class Clipmap;
class Field;
}  // namespace field
namespace model {
struct Drawable;
}
namespace render::shade {
struct EnvironmentMap;
}

enum class ToneMap : uint8_t { None, Exponential, Aces, Neutral, Agx };
/// How light spreads round what is bright: over many sizes, or as a blur of a few pixels around what exceeds a threshold.
enum class BloomKind : uint8_t { Pyramid, Gaussian };

struct Camera {
    vec3 position{3, 2, 4};
    vec3 target{0, 0, 0};
    vec3 up{0, 1, 0};
    float fov_y_deg = 45;   ///< (0, 180)
    float exposure = 1.0f;  ///< linear multiplier before the tone map, > 0
    ToneMap tone_map = ToneMap::Aces;
    bool auto_exposure = false;  ///< the picture's middle luminance becomes middle grey, times `exposure`
    float bloom = 0;             ///< share of the light that the lens scatters, [0, 1]; Gaussian: what is added
    float bloom_size = 0.1f;     ///< Pyramid: the widest glow, as a share of the picture's height, (0, 1]
    float bloom_threshold = 1;   ///< Gaussian: exposed luminance above which light glows, >= 0
    BloomKind bloom_kind = BloomKind::Pyramid;
    friend bool operator==(const Camera&, const Camera&) = default;
};

/// One light. Illuminance in lux, intensity in candela; colour scales both.
struct Light {
    enum class Kind : uint8_t { Directional, Point, Spot };
    Kind kind = Kind::Directional;
    vec3 color{1, 1, 1};
    vec3 direction{-0.4f, -1, -0.3f};      ///< Directional, Spot: where the light goes; any length > 0
    vec3 position{};                       ///< Point, Spot
    float illuminance = 3;                 ///< Directional
    float angular_diameter_deg = 0.53f;    ///< Directional: disc seen from the ground; 0 is a hard shadow
    float intensity = 20;                  ///< Point, Spot
    float range = 0;                       ///< Point, Spot: where the light has faded to 0; 0 is no limit
    float radius = 0;                      ///< Point, Spot: metres, for soft shadows; 0 is a hard shadow
    float inner_deg = 15, outer_deg = 25;  ///< Spot: half angles of full and of no light
    friend bool operator==(const Light&, const Light&) = default;
};

struct Environment {
    vec3 color{0.5f, 0.6f, 0.8f};  ///< radiance of a constant sky; not used where there is an image
    float intensity = 1;           ///< multiplies it
    std::string file{};  ///< equirectangular OpenEXR image, its middle towards -Z; relative to the scene's file
    friend bool operator==(const Environment&, const Environment&) = default;
};

enum class View : uint8_t { Shaded, Albedo, Normal, Depth, Steps, Bricks, Levels, Ao };

/// Something that moves as a whole: bricks of its own, in a frame of its own, which a pose puts into the world. Moving one bakes nothing.
struct Instance {
    std::shared_ptr<const field::BrickSet> bricks;  ///< shared by all that look alike
    Pose pose, before;                              ///< now, and in the frame before
    uint32_t material = 0;                          ///< number of what its parts without a material are made of
    uint32_t glass = 0;  ///< number of the material that light goes through it by, with opacity below 1; 0: it is solid
};

/// A line around an edit, by its row in the field's program, or in that of the instance that it is part of.
struct EditOutline {
    uint32_t row = 0;
    Outline outline;
    uint32_t instance = UINT32_MAX;  ///< number of the instance
};

/// An edit of the field that stood elsewhere in the frame before: what is nearest to it has moved with it.
struct EditMotion {
    uint32_t row = 0;       ///< of the field's program
    Transform now, before;  ///< its own
};

/// A triangle mesh in the world.
struct MeshInstance {
    std::shared_ptr<const model::Drawable> model;  ///< immutable
    Transform transform, before;                   ///< world from model: now, and in the frame before (for motion)
    std::optional<Outline> outline{};              ///< round what is seen of it, in shaded pictures
};

/// A straight line over the finished picture, for whoever looks for a fault.
struct DebugLine {
    dvec3 a, b;             ///< its ends, world metres
    vec3 color{1, 1, 1};    ///< linear Rec. 709, as the screen shows it: neither exposed nor tone-mapped
    float width_px = 1.5f;  ///< (0, 64]
    float hidden = 0.15f;   ///< share of it that shows where something solid is nearer, [0, 1]
};

/// A soft round puff that faces the camera.
struct Particle {
    vec3 position, before;  ///< its middle, world metres: now, and in the frame before
    float radius = 0.1f;    ///< metres, > 0
    vec3 color{1, 1, 1};    ///< share of light that it scatters, linear Rec. 709
    float opacity = 0.5f;   ///< of its middle, [0, 1]
    vec3 emissive{};        ///< radiance of its middle
};

/// Everything a picture is made from. World::frame() fills one in.
struct Frame {
    std::shared_ptr<const field::Field> field;     ///< immutable snapshot; none in a world of several levels
    std::shared_ptr<const field::Clipmap> levels;  ///< those, likewise
    std::vector<Material> materials;               ///< indexed by the field's material numbers
    std::vector<Light> lights;
    std::optional<Environment> environment;  ///< none: a clear sky, with the disc of the first directional light
    std::shared_ptr<const render::shade::EnvironmentMap> environment_map;  ///< of environment->file
    Camera camera;
    int coarsened = 0;                  ///< times the voxel size was doubled to fit the pool
    std::vector<Instance> instances;    ///< beside the field; solid ones as a hard union with it
    std::vector<EditOutline> outlines;  ///< of shaded pictures
    std::vector<MeshInstance> meshes;
    double time = 0, time_before = 0;  ///< seconds: what the meshes' animations show, and showed in the frame before
    std::vector<EditMotion> moved;     ///< for motion
    std::vector<Box3>
        changed;  ///< where the field, or what is beside it, has become another since the frame before: none of it was anywhere
    std::vector<Particle> particles;
    std::vector<DebugLine> lines;  ///< of shaded pictures; later ones over earlier ones
};

/// Ways to the same picture. Compute is there on every device; the others march the bricks of a world of one level by a ray-tracing
/// pipeline (Rt) or draw clusters of meshes by a mesh shader (Mesh), and are refused where the device has none. Auto is the fastest way
/// that was measured, which is Compute on every device so far.
enum class Tier : uint8_t { Auto, Compute, Rt, Mesh };

/// Who finds what meshes hide of a light. Rays: exact, whatever the light. Cascades: shadow maps for the first directional light, snapped to texels,
/// and for the first lamps and spots, with half shadows of about the right width; lights that find no map keep their rays.
enum class MeshShadows : uint8_t { Rays, Cascades };

/// How point and spot lights reach the picture. Clusters: lists by tile, walked by a compute pass. Volumes: each light's ball or cone is rasterised and
/// added by blending, as deferred renderers began; the same picture to the rounding of half floats.
enum class LightTechnique : uint8_t { Clusters, Volumes };

/// Ambient occlusion: light from all around reaches a point by the share of its hemisphere that is open, by rays through the field, what moves and
/// meshes. Half: rays for a pixel of four, and only the field and what moves are met.
enum class AmbientOcclusion : uint8_t { Off, Half, Full };

struct RenderSettings {
    int width = 1280, height = 720;  ///< pixels, 1 to 16384
    View view = View::Shaded;
    bool analytic = false;   ///< march the exact program instead of the bricks (D15)
    bool unpruned = false;   ///< with analytic: every edit at every step, no culling
    bool accelerate = true;  ///< false: visit every cell and voxel (the slow twin of the jumps)
    bool refine = true;  ///< what bricks show is moved to where the exact program has it, with its normal and materials
    bool cull_lights = true;     ///< false: every light at every pixel (the slow twin of the lists by tile)
    bool atlas_by_copy = false;  ///< bake to a buffer and copy, instead of to a storage image
    bool taa = false;  ///< anti-alias by the pictures before of this renderer; the whole picture must be one tile
    bool taa_jitter =
        true;           ///< … and look through another place of each pixel every time; false: through their middles
    bool cut = false;   ///< taa: this picture follows on none before
    float elapsed = 0;  ///< seconds since this renderer's picture before, for automatic exposure; 0: adapted at once
    Tier tier = Tier::Auto;
    bool soft_shadows = true;  ///< false: lights are points to shadows, whatever their size
    int transparent_layers =
        4;  ///< things of glass and panes that a ray may go through, [0, 16]; those behind are not seen
    bool outline_hulls = false;  ///< meshes are outlined by their back faces made larger, for comparison
    bool cull_meshes = true;     ///< false: triangles that something hides are drawn too, and rays go on behind meshes
    MeshShadows mesh_shadows = MeshShadows::Rays;
    LightTechnique lighting = LightTechnique::Clusters;
    float scale =
        1;  ///< below 1, with taa: rays a pixel along each side, [0.25, 1]; the picture is made whole over time
    int shadow_map_side = 0;  ///< Cascades: texels, a power of two from 64 to 8192; 0: as the picture's size asks
    int glass_bounces =
        4;  ///< times that glass may throw light back inside, [0, 16]; 0: and its mirror shows no other glass
    AmbientOcclusion ao = AmbientOcclusion::Full;
    bool shown_alone = false;     ///< of a shaded picture only `srgb` is brought from the device, for whoever shows it
    bool outline_hidden = false;  ///< outlined things have their line also where something hides them
};

/// What a picture may cost. Low: hard shadows, of meshes by maps; two things of glass behind one another, which throw no light back inside; surfaces as the
/// bricks have them; no ambient occlusion. Medium: the same, but surfaces as the exact program has them. High: everything that one picture can show. Ultra:
/// anti-aliased over time too.
enum class Quality : uint8_t { Low, Medium, High, Ultra };
/// Sets `refine`, `soft_shadows`, `mesh_shadows`, `transparent_layers`, `glass_bounces`, `ao` and `taa`, no more.
void set_quality(RenderSettings& settings, Quality quality);

/// Pixels, top row first.
struct Picture {
    int width = 0, height = 0;
    std::vector<float>
        rgba;  ///< scene-linear, before bloom, exposure and tone map (or the view's values); 4 floats a pixel
    std::vector<uint8_t> srgb;  ///< what a screen shows: tone-mapped sRGB, 4 bytes a pixel
    std::vector<float> depth;   ///< metres along the ray, +infinity where nothing is hit
    /// Writes .png (srgb) or .exr (rgba as half; the depth view as 32-bit float). The file appears whole or not at all.
    Result<void> save(const std::string& path) const;
    View view = View::Shaded;
    /// `srgb` in so many pixels, blended where it is stretched; nothing else.
    Picture stretched(int to_width, int to_height) const;
};

/// What one render cost.
struct RenderStats {
    std::string device;
    int bricks = 0;  ///< resident
    int edits = 0;
    double frame_ms = 0;                                 ///< GPU time, all passes
    std::vector<std::pair<std::string, double>> passes;  ///< name, GPU ms, in order of execution
    uint64_t evaluations = 0;                            ///< distance samples taken by the primary march
    uint64_t atlas_bytes = 0, host_bytes = 0;
    uint64_t pipelines_created = 0;  ///< since creation; constant once warm
    int coarsened = 0;               ///< times the voxel size was doubled to fit the pool
    float exposure = 1;              ///< what radiance was multiplied with, chosen or measured
    /// Of a clipmap, finest first.
    struct Level {
        double voxel_size = 0;                         ///< metres
        uint32_t bricks = 0;                           ///< resident
        uint32_t queued = 0, refused = 0;              ///< cells; refused ones found no room in the pool
        uint32_t baked = 0, evicted = 0, entered = 0;  ///< bricks, bricks and cells, of the last frame
        bool skipped = false;                          ///< its shell was more than the budget
    };
    std::vector<Level> levels;
    uint32_t net_bricks = 0, net_baked = 0;  ///< of what stands in where the last level has nothing yet
    int instances = 0;                       ///< drawn beside the field
    uint32_t instance_bricks = 0;            ///< resident, of their sets
    uint32_t instance_bricks_new = 0;        ///< … of them brought to the device by this frame
    double instances_ms = 0;                 ///< CPU time: their tree and records
    uint64_t triangles = 0;                  ///< of meshes, in the scene
    uint64_t triangles_drawn = 0;            ///< given to the rasteriser
    uint64_t clusters = 0;                   ///< of up to 64 of them, of parts in the picture
    uint64_t clusters_early = 0;             ///< drawn because the picture before showed them
    uint64_t clusters_late = 0;              ///< drawn because nothing of this picture hides them
    std::string march_tier = "compute";      ///< who marched the bricks: "compute", "rt"
    std::string mesh_tier = "vertex";        ///< who drew meshes, where there are any: "vertex", "mesh"
    uint32_t boxes = 0;                      ///< in the tree that rays are traced through
    uint64_t box_tree_builds = 0;            ///< since creation
    uint64_t box_tree_bytes = 0;
    /// Of each of `passes`: bytes of the frame's own images and buffers that it reads and writes, each texel once.
    std::vector<std::pair<std::string, uint64_t>> pass_bytes;
    std::vector<std::pair<std::string, uint64_t>> pass_evaluations;  ///< of those that march
    uint64_t transient_peak_bytes = 0;   ///< memory of images that live for a part of a frame
    uint64_t transient_sum_bytes = 0;    ///< … if they did not share it
    std::string mesh_shadows = "rays";   ///< of the first directional light, where there are meshes: "rays", "cascades"
    int cascades = 0;                    ///< shadow maps
    int rays_across = 0, rays_down = 0;  ///< pixels that were marched and lit, before upscaling
    std::string lighting = "clusters";   ///< of point and spot lights: "clusters", "volumes"
    uint64_t instance_tiles_by_tree =
        0;  ///< of 8 x 8 pixels that met too many instances for a list, so that each ray walked their tree
    uint64_t transient_pass_bytes = 0;  ///< of transient_peak_bytes, what one pass needs alone: no order has less
    double side_by_side_ms = 0;  ///< of frame_ms, what is left where passes that do not wait for each other run at once
};

struct DeviceInfo {
    std::string name, backend, driver, kind;  ///< kind: "cpu", "integrated", "discrete", "virtual", "other"
    std::string api_version;
    bool usable = false;
    std::string why_not;                            ///< when not usable
    bool mesh_shader = false, rt_pipeline = false;  ///< tiers beside compute
};

/// What a window system gives a renderer that is to show pictures in one of its windows. SDL: SDL_Vulkan_GetInstanceExtensions() and
/// SDL_Vulkan_CreateSurface(); the renderer itself knows no window system.
struct WindowSurface {
    std::vector<std::string> extensions;  ///< of the graphics interface, by name
    /// A surface of the window for a VkInstance: a VkSurfaceKHR as a number, 0 where there can be none. The renderer destroys it.
    std::function<uint64_t(void* instance)> make;
};

/// What became of a picture that was to be shown in a window.
enum class Shown : uint8_t {
    Yes,
    Hidden,  ///< the window has no pixels now
    Later,   ///< the window system is not ready for another one
};

struct RendererOptions {
    std::string device = "auto";  ///< "auto", "cpu-vulkan", or part of a device's name
    bool validation = false;      ///< Vulkan validation layer; its first message fails the call that caused it
    std::optional<WindowSurface> window{};  ///< none: pictures are not shown, only made
};

/// Owner's thread only.
class Renderer {
public:
    static Result<Renderer> create(const RendererOptions& options = {});
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;
    ~Renderer();

    Result<Picture> render(const Frame& frame, const RenderSettings& settings = {});
    /// Shows a picture's `srgb` in the renderer's window of so many pixels, stretched to fit. A resized window, or one that lost its surface,
    /// is set up again on the way. `wait`: for the screen's refresh, else the newest picture is shown at each.
    Result<Shown> show(const Picture& picture, int window_width, int window_height, bool wait = true);
    /// Of the last render().
    const RenderStats& stats() const;
    /// What suits the device: Medium on a processor, High where graphics are built into one, Ultra on a card.
    Quality best_quality() const;

private:
    struct Impl;
    explicit Renderer(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Path-traces the frame on the CPU, `samples` a pixel: slow, needs no device; the judge of the renderer. Shaded view only.
Result<Picture> render_reference(const Frame& frame, const RenderSettings& settings, int samples,
                                 RenderStats* stats = nullptr);

/// Every device that could render here, usable or not; empty without a driver. Never fails.
std::vector<DeviceInfo> devices();

}  // namespace kiln
