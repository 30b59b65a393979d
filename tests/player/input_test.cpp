// SPDX-License-Identifier: MIT
// Files of input events, the camera that they move, and what is written over pictures.
#include "player/canvas.h"
#include "player/fly.h"
#include "player/hud.h"
#include "player/input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace kiln::player {
namespace {

using Kind = InputEvent::Kind;
using testing::HasSubstr;

TEST(InputEvents, EachLineIsOneEvent) {
    const auto events = parse_input_events(
        "{\"frame\": 0, \"mouse\": [10, 20.5]}\r\n"
        "\n"
        "{\"frame\": 2, \"mouse\": [3, 4], \"button\": \"left\", \"down\": true}\n"
        "{ \"down\" : false , \"key\" : \"left shift\" , \"frame\" : 2 }\n"
        "{\"frame\": 3, \"look\": [-4, 5]}\n{\"frame\": 3, \"wheel\": -2}\n{\"frame\": 9, \"size\": [64, 48]}\n"
        "{\"frame\": 9, \"close\": true}",
        "keys.jsonl");
    ASSERT_TRUE(events) << events.error().message;
    ASSERT_EQ(events->size(), 8u);
    const auto& e = *events;
    EXPECT_EQ(e[0].kind, Kind::Mouse);
    EXPECT_EQ(e[0].y, 20.5f);
    EXPECT_EQ(e[1].kind, Kind::Mouse);
    EXPECT_EQ(e[2].kind, Kind::Button);
    EXPECT_TRUE(e[2].down);
    EXPECT_EQ(e[2].x, 3);
    EXPECT_EQ(e[3].name, "left shift");
    EXPECT_FALSE(e[3].down);
    EXPECT_EQ(e[4].x, -4);
    EXPECT_EQ(e[5].y, -2);
    EXPECT_EQ(e[6].kind, Kind::Size);
    EXPECT_EQ(e[7].kind, Kind::Close);
    EXPECT_EQ(e[7].frame, 9);
}

TEST(InputEvents, EachErrorNamesFileLineAndMend) {
    const std::pair<const char*, const char*> cases[] = {
        {"w", "not an object; write"},
        {"{\"frame\": 0, \"key\": \"w\", \"down\": true", "not JSON"},
        {"{\"frame\": 0, \"key\": \"w\", \"down\": true} x", "one a line"},
        {"{\"frame\": 0, \"key\": \"w\\n\", \"down\": true}", "column 22"},
        {"{\"key\": \"w\", \"down\": true}", "no \"frame\""},
        {"{\"frame\": -1, \"key\": \"w\", \"down\": true}", "whole number"},
        {"{\"frame\": 1.5, \"key\": \"w\", \"down\": true}", "whole number"},
        {"{\"frame\": 1e999, \"close\": true}", "not JSON"},
        {"{\"frame\": 0, \"frame\": 0, \"close\": true}", "twice"},
        {"{\"frame\": 0, \"kay\": \"w\", \"down\": true}", "did you mean \"key\"?"},
        {"{\"frame\": 0, \"key\": \"escap\", \"down\": true}", "did you mean \"escape\"?"},
        {"{\"frame\": 0, \"key\": \"w\"}", "true when it is pressed"},
        {"{\"frame\": 0, \"mouse\": [1, 2], \"down\": true}", "belongs to a key or a button"},
        {"{\"frame\": 0, \"key\": 5, \"down\": true}", "a word in quotes"},
        {"{\"frame\": 0, \"mouse\": [1]}", "not JSON"},
        {"{\"frame\": 0, \"mouse\": [1, 1e9]}", "at most 16384"},
        {"{\"frame\": 0, \"button\": \"thumb\", \"down\": true}", "use left, middle or right"},
        {"{\"frame\": 0, \"size\": [-1, 2]}", "0 or more"},
        {"{\"frame\": 0, \"close\": false}", "left out"},
        {"{\"frame\": 0}", "one thing a line"},
        {"{\"frame\": 0, \"wheel\": 1, \"close\": true}", "one thing a line"},
        {"{}", "no \"frame\""},
    };
    for (const auto& [line, mend] : cases) {
        const auto events = parse_input_events(std::string("{\"frame\": 0, \"close\": true}\n") + line, "keys.jsonl");
        ASSERT_FALSE(events) << line;
        EXPECT_THAT(events.error().message, testing::StartsWith("keys.jsonl:2: ")) << line;
        EXPECT_THAT(events.error().message, HasSubstr(mend)) << line;
        EXPECT_EQ(events.error().kind, ErrorKind::Input);
    }
    const auto backwards =
        parse_input_events("{\"frame\": 4, \"close\": true}\n{\"frame\": 3, \"close\": true}\n", "keys.jsonl");
    ASSERT_FALSE(backwards);
    EXPECT_THAT(backwards.error().message, HasSubstr("keys.jsonl:2: frame 3 after frame 4"));
    EXPECT_THAT(read_input_events("/nonexistent/keys").error().message, HasSubstr("cannot be read"));
}

TEST(InputEvents, EveryPartOfAFileIsReadOrRefusedAndNothingElseHappens) {
    const std::string whole =
        "{\"frame\": 2, \"mouse\": [3, 4], \"button\": \"left\", \"down\": true}\n{\"frame\": 3, \"look\": [-4e0, "
        "5.25]}";
    for (size_t i = 0; i <= whole.size(); ++i) {
        (void)parse_input_events(whole.substr(0, i), "keys");
        for (const char c : {'\0', '"', '{', '[', '\n', '\xff', '9'}) {
            std::string other = whole;
            if (i < other.size()) other[i] = c;
            (void)parse_input_events(other, "keys");
        }
    }
}

TEST(InputState, KeepsWhatIsHeld) {
    InputState s;
    s.take({.kind = Kind::Key, .name = "w", .down = true});
    s.take({.kind = Kind::Button, .name = "left", .down = true});
    s.take({.kind = Kind::Mouse, .x = 3, .y = 4});
    EXPECT_TRUE(s.key("w") && s.button("left") && !s.key("s"));
    s.take({.kind = Kind::Key, .name = "w"});
    s.take({.kind = Kind::Key, .name = "q"});  // let go without having been pressed
    EXPECT_FALSE(s.key("w") || s.key("q"));
    EXPECT_EQ(s.x, 3);
}

TEST(FlyCamera, LooksAsItsStartDoes) {
    const Camera start{.position = {3, 2, 4}, .target = {-1, 0.5f, 7}, .fov_y_deg = 40};
    const FlyCamera fly(start);
    const vec3 d = normalize(start.target - start.position);
    EXPECT_NEAR(dot(fly.forward(), d), 1, 1e-6);
    EXPECT_EQ(fly.camera().fov_y_deg, 40);
    EXPECT_EQ(fly.camera().position, start.position);
}

TEST(FlyCamera, RaysThroughPixelsSpanTheAngleOfView) {
    const FlyCamera fly(Camera{.position = {0, 0, 0}, .target = {0, 0, -1}, .fov_y_deg = 90});
    const int w = 200, h = 100;
    const auto angle = [&](float x, float y) {
        return std::acos(double(dot(fly.ray(x, y, w, h).direction, {0, 0, -1})));
    };
    EXPECT_NEAR(angle(w * 0.5f - 0.5f, h * 0.5f - 0.5f), 0, 1e-3);
    EXPECT_NEAR(angle(w * 0.5f - 0.5f, -0.5f), M_PI / 4, 1e-3);     // the upper edge
    EXPECT_NEAR(std::tan(angle(-0.5f, h * 0.5f - 0.5f)), 2, 1e-3);  // the left one, twice as far out
    EXPECT_GT(fly.ray(150, 50, w, h).direction.x, 0);
    EXPECT_GT(fly.ray(100, 10, w, h).direction.y, 0);
}

TEST(FlyCamera, GoesWhereItLooksAndToItsRight) {
    FlyCamera fly(Camera{.position = {0, 0, 0}, .target = {0, 0, -1}});
    fly.look(float(M_PI) / 2 / 0.003f, 0);  // a quarter turn to the right
    fly.move(2, 0, 0);
    EXPECT_NEAR(fly.position().z, 2, 1e-4);
    fly.move(0, 1, 3);
    EXPECT_NEAR(fly.position().x, 3, 1e-4);
    EXPECT_NEAR(fly.position().y, 1, 1e-4);
    fly.look(0, 1e6f);  // never over the top
    EXPECT_NEAR(length(fly.forward()), 1, 1e-5);
    EXPECT_GT(fly.forward().x, 0);
    EXPECT_LT(fly.forward().y, -0.9f);
}

TEST(Canvas, TextIsAsWideAsItSaysAndStaysWithinThePicture) {
    Picture p;
    p.width = 40, p.height = 20;
    p.srgb.assign(size_t(p.width) * size_t(p.height) * 4, 0);
    Canvas canvas(p, 1);
    EXPECT_EQ(canvas.text_width("ab \xc2\xb7 c"), 6 * 6);
    canvas.text(2, 3, "Hg\xc2\xb7\xe2\x82\xac");
    int last = 0, lit = 0;
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x)
            if (p.srgb[size_t(y * p.width + x) * 4] != 0) last = std::max(last, x), ++lit;
    EXPECT_GT(lit, 20);
    EXPECT_LT(last, 2 + canvas.text_width("Hg\xc2\xb7\xe2\x82\xac"));
    canvas.text(-3, -3, "edges");
    canvas.text(38, 18, "edges");
    canvas.fill({-100, -100, 1000, 1000}, 255, 0, 0, 1);
    for (size_t i = 0; i < p.srgb.size(); i += 4) EXPECT_EQ(p.srgb[i], 255);
}

TEST(Hud, AMessageThatIsTooWideHasAsManyLinesAsItTakes) {
    const auto height = [](int width, const char* text) {
        Picture p;
        p.width = width, p.height = 90;
        p.srgb.assign(size_t(p.width) * size_t(p.height) * 4, 0);
        Hud hud;
        hud.hints = false;
        hud.message = text;
        const auto widgets = hud.draw(p);
        EXPECT_EQ(widgets.size(), 1u);
        const Rect bar = widgets[0].second;
        EXPECT_LE(bar.x + bar.width, width);
        EXPECT_EQ(bar.y + bar.height, p.height);
        return bar.height;
    };
    const int one = height(200, "twelve signs");
    EXPECT_EQ(height(12 * 6 + 6, "twelve signs"), one) << "it just fits";
    EXPECT_EQ(height(12 * 6 + 5, "twelve signs"), one + 10);
    EXPECT_EQ(height(40, "a b c d e f g h"), one + 20);
    EXPECT_EQ(height(40, "averylongword"), one) << "what cannot be broken is cut";
}

}  // namespace
}  // namespace kiln::player
