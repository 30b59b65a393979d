// SPDX-License-Identifier: MIT
// Windows of a device, without one: the null device's, through the decorator that holds everyone to the order of calls. Real ones are in
// tests/player.
#include "rhi/rhi_test.h"

namespace kiln::rhi {
namespace {

class NullSurface : public NullTest {
protected:
    SurfaceHandle surface(uint32_t width = 8, uint32_t height = 4) {
        const SurfaceHandle out = must(device_->create_surface({.label = "window"}));
        const SurfaceState state = must(device_->configure(out, {.width = width, .height = height}));
        EXPECT_EQ(state, width == 0 || height == 0 ? SurfaceState::Hidden : SurfaceState::Ready);
        return out;
    }
    Result<void> fill(const SurfaceImage& image, Access after = Access::Present) {
        const std::vector<uint32_t> texels(size_t{image.width} * image.height, 0xff204060);
        return device_->write_texture({.place = {.texture = image.texture},
                                       .size = {image.width, image.height},
                                       .before = Access::Undefined,
                                       .after = after},
                                      bytes_of(texels));
    }
    void submit() { must(device_->submit(device_->create_encoder("show"))); }
};

TEST_F(NullSurface, ShowsPictureAfterPicture) {
    const SurfaceHandle window = surface();
    for (int i = 0; i < 3; ++i) {
        const SurfaceImage image = must(device_->acquire(window));
        EXPECT_EQ(image.state, SurfaceState::Ready);
        EXPECT_EQ(image.width, 8u);
        EXPECT_EQ(image.height, 4u);
        must(fill(image));
        submit();
        EXPECT_EQ(must(device_->present(window)), SurfaceState::Ready);
    }
    EXPECT_NE(device_->trace().find("present 'window' 8x4"), std::string::npos);
    device_->destroy(window);
}

TEST_F(NullSurface, AWindowWithoutPixelsIsHidden) {
    const SurfaceHandle window = surface(0, 4);
    device_->destroy(window);
}

TEST_F(NullSurface, ATextureThatNothingFilledIsNotShown) {
    const SurfaceHandle window = surface();
    (void)must(device_->acquire(window));
    EXPECT_FALSE(device_->present(window));
    EXPECT_TRUE(complained("ready for Present"));
    device_->destroy(window);
}

TEST_F(NullSurface, ATextureThatWasFilledButNotSubmittedIsNotShown) {
    const SurfaceHandle window = surface();
    must(fill(must(device_->acquire(window))));
    EXPECT_FALSE(device_->present(window));
    EXPECT_TRUE(complained("submitted"));
    device_->destroy(window);
}

TEST_F(NullSurface, OneTextureAtATime) {
    const SurfaceHandle window = surface();
    const SurfaceImage image = must(device_->acquire(window));
    EXPECT_FALSE(device_->acquire(window));
    EXPECT_TRUE(complained("not presented"));
    EXPECT_FALSE(device_->configure(window, {.width = 4, .height = 4}));
    must(fill(image));
    submit();
    must(device_->present(window));
    EXPECT_FALSE(device_->present(window));
    EXPECT_TRUE(complained("acquire one"));
    device_->destroy(window);
}

TEST_F(NullSurface, ItsTextureIsNobodyElsesToDestroyAndGoesWhenItIsShown) {
    const SurfaceHandle window = surface();
    const SurfaceImage image = must(device_->acquire(window));
    device_->destroy(image.texture);
    EXPECT_TRUE(complained("its own"));
    must(fill(image));
    submit();
    must(device_->present(window));
    EXPECT_FALSE(fill(image));
    EXPECT_TRUE(complained("was destroyed"));
    device_->destroy(window);
}

TEST_F(NullSurface, ItMustBeConfiguredAndFitTheFloor) {
    const SurfaceHandle window = must(device_->create_surface({.label = "window"}));
    EXPECT_FALSE(device_->acquire(window));
    EXPECT_TRUE(complained("not configured"));
    EXPECT_FALSE(device_->configure(window, {.width = kMaxTexture2d + 1, .height = 4}));
    EXPECT_TRUE(complained("beyond the floor"));
    device_->destroy(window);
}

TEST_F(NullSurface, AStaleSurfaceIsNamed) {
    const SurfaceHandle window = surface();
    device_->destroy(window);
    EXPECT_FALSE(device_->acquire(window));
    EXPECT_TRUE(complained("surface 'window' was destroyed"));
}

TEST_F(NullSurface, OnlyTexturesOfSurfacesArePresented) {
    const TextureHandle plain =
        must(device_->create_texture({.size = {2, 2}, .usage = TextureUsage::CopyDst, .label = "plain"}));
    const std::vector<uint32_t> texels(4);
    EXPECT_FALSE(device_->write_texture({.place = {.texture = plain}, .size = {2, 2}, .after = Access::Present},
                                        bytes_of(texels)));
    EXPECT_TRUE(complained("Present"));
    device_->destroy(plain);
}

}  // namespace
}  // namespace kiln::rhi
