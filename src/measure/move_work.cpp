// SPDX-License-Identifier: MIT

#include "measure/move_work.h"

#include "field/field.h"

#include <kiln/world.h>

#include <cmath>
#include <vector>

namespace kiln {

struct MoveWork::Impl {
    uint32_t things;
    World world{};
    std::vector<EditId> ids{};
    Frame first{}, last{};
};

MoveWork::MoveWork(uint32_t things) : impl_(new Impl{things}) {}
MoveWork::~MoveWork() = default;

Result<void> MoveWork::prepare() {
    Impl& m = *impl_;
    m.world.field_settings.voxel_size = 0.05f;
    m.world.field_settings.bounds = Box3{{-6, -1, -6}, {6, 3, 6}};
    Edit ground;
    ground.node.shape = Plane{};
    if (auto added = m.world.add(ground); !added) return added.error();
    for (uint32_t i = 0; i < m.things; ++i) {
        Edit e;
        e.dynamic = true;
        if (i % 2 == 0) {
            e.node.shape = Sphere{.radius = 0.1f};
        } else {
            e.node.shape = Box{.half_extents = {0.1f, 0.06f, 0.08f}};
        }
        auto added = m.world.add(e);
        if (!added) return added.error();
        m.ids.push_back(*added);
    }
    auto frame = m.world.frame(Camera{});
    if (!frame) return frame.error();
    m.first = *frame;
    m.last = std::move(*frame);
    return {};
}

Result<void> MoveWork::frame(int turn) {
    Impl& m = *impl_;
    for (uint32_t i = 0; i < m.things; ++i) {
        const float a = 0.02f * float(i) + 0.1f * float(turn);
        const Pose pose{{5 * std::sin(a), 0.5f + 0.002f * float(i), 5 * std::cos(a)}, axis_angle({0, 1, 0}, a)};
        if (auto moved = m.world.move(m.ids[i], pose); !moved) return moved;
    }
    auto frame = m.world.frame(Camera{});
    if (!frame) return frame.error();
    m.last = std::move(*frame);
    return {};
}

uint64_t MoveWork::instances() const { return impl_->last.instances.size(); }
uint64_t MoveWork::bricks() const {
    return impl_->last.field == impl_->first.field ? impl_->last.field->stats().bricks : 0;
}

}  // namespace kiln
