// SPDX-License-Identifier: MIT
// A camera that flies where it is sent.
#pragma once

#include <kiln/query.h>
#include <kiln/renderer.h>

namespace kiln::player {

class FlyCamera {
public:
    /// Looks as `start` does and keeps its lens.
    explicit FlyCamera(const Camera& start);

    Camera camera() const;
    vec3 position() const { return position_; }
    vec3 forward() const;
    /// Metres to the right, up along the world's axis, and forward.
    void move(float right, float up, float forward);
    /// To be at a place, looking as before.
    void place(vec3 position) { position_ = position; }
    /// Level, in the direction that it looks: so much to the right, and ahead.
    vec3 along_ground(float right, float ahead) const;
    /// Pixels of the mouse, to the right and down.
    void look(float x, float y);
    /// Through the middle of a pixel of a picture of so many.
    Ray ray(float x, float y, int width, int height) const;

private:
    Camera lens_;
    vec3 position_;
    float yaw_ = 0, pitch_ = 0;  // radians: from -Z to the right, and up
};

}  // namespace kiln::player
