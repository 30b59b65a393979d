// SPDX-License-Identifier: MIT
// SdfField: what bodies, cloth and fluids collide with: distance and gradient at points of some frame. Answers from the exact edits;
// no mesh, no GPU. Values are lower bounds of the true distance with the right sign (1-Lipschitz), so a cast may advance by them.
#pragma once

#include "sdf/eval.h"
#include "sdf/program.h"
#include "sdf/regions.h"

#include <kiln/math.h>

#include <memory>
#include <span>

namespace kiln::field {

/// All functions: any thread.
class SdfField {
public:
    virtual ~SdfField() = default;
    /// Metres, negative inside; at least sdf::kEmptyTest where nothing exists.
    virtual float distance(vec3 p) const = 0;
    /// Also the gradient, not normalised; 0 where it vanishes or nothing exists.
    virtual float distance(vec3 p, vec3& gradient) const = 0;
    /// The same for many points, near each other: out[i], gradients[i].
    virtual void distances(std::span<const vec3> points, float* out, vec3* gradients) const;
    /// What a question found on its way, handed to the next one near it, of the same field and before the next step: it need not search.
    struct Trail {
        uint64_t key = 0;
        const void* place = nullptr;
    };
    virtual float distance(vec3 p, vec3& gradient, Trail&) const { return distance(p, gradient); }
    virtual void distances(std::span<const vec3> points, float* out, vec3* gradients, Trail&) const {
        distances(points, out, gradients);
    }
    /// As exactly as can be told: what this field interpolates is asked itself.
    virtual void measure(std::span<const vec3> points, float* out, vec3* gradients, Trail&) const {
        distances(points, out, gradients);
    }
    /// This field within a cube (and 2 cm around it): the same bits there, for less; null: for nothing less. Keeps what it needs.
    virtual std::unique_ptr<const SdfField> within(vec3, float /*side*/) const { return nullptr; }
    /// out[i] = distance at point i; neighbours of the list should be neighbours in space.
    virtual void distances(const sdf::Points& points, float* out) const = 0;
    /// Values of the 512 texels (x[i], y[j], z[k]), i fastest, of the cube of this side around `center`; false, and nothing written, where
    /// the value at the centre says that all in it are larger than `near`.
    virtual bool texels(vec3 center, float side, float near, const float* x, const float* y, const float* z,
                        float* out) const;
    /// Number of the heaviest material (sdf::material_number); of a surface where none is said, sdf::kDefaultMaterial.
    virtual uint32_t material(vec3) const { return sdf::kDefaultMaterial; }
    /// Holds the solid; infinite faces where it has no end there, empty when there is none.
    virtual Box3 bounds() const = 0;
    /// About how many instructions a question costs.
    virtual size_t cost() const { return 1; }
    /// How far values may lie above or below the solid's, metres: where they are interpolated.
    virtual float error() const { return 0; }
    /// Between steps: what is to answer from now on, where this one keeps more than it may; null: this one.
    virtual std::shared_ptr<const SdfField> renewed() const { return nullptr; }
};

/// The exact value of a compiled program. A question costs the edits around it (sdf/regions.h).
class ProgramField final : public SdfField {
public:
    explicit ProgramField(std::shared_ptr<const sdf::Program> program);

    float distance(vec3 p) const override;
    float distance(vec3 p, vec3& gradient) const override;
    void distances(std::span<const vec3> points, float* out, vec3* gradients) const override;
    void distances(const sdf::Points& points, float* out) const override;
    bool texels(vec3 center, float side, float near, const float* x, const float* y, const float* z,
                float* out) const override;
    std::unique_ptr<const SdfField> within(vec3 center, float side) const override;
    uint32_t material(vec3 p) const override;
    Box3 bounds() const override { return bounds_; }
    size_t cost() const override;
    const sdf::Program& program() const { return *program_; }

private:
    std::shared_ptr<const sdf::Program> program_;
    sdf::Regions regions_;
    Box3 bounds_;
};

}  // namespace kiln::field
