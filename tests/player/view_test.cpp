// SPDX-License-Identifier: MIT
// `kiln view` from outside: replays without a display, and one in a window.
#include "player/virtual_display.h"
#include "temp_folder.h"

#include <kiln/math.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <sys/wait.h>

namespace kiln::player {
namespace {

using testing::HasSubstr;

constexpr const char* kThinPillar = R"({"format": 1, "field": {"voxel_size": 0.1},
  "edits": [{"id": "ground", "shape": "plane"},
            {"id": "pillar", "shape": "box", "half_extents": [0.1, 1, 0.1], "position": [0, 1, 0]},
            {"id": "block", "shape": "box", "half_extents": [0.5, 0.3, 0.5], "position": [0, 2.2, 0]}],
  "cameras": {"main": {"position": [0, 1, 6], "target": [0, 1, 0]}}})";

// Digs through the middle of what the camera sees, then takes it back.
constexpr const char* kDig = R"({"frame": 1, "mouse": [32, 18]}
{"frame": 2, "button": "left", "down": true}
{"frame": 28, "button": "left", "down": false}
{"frame": 34, "key": "left ctrl", "down": true}
{"frame": 34, "key": "z", "down": true}
{"frame": 34, "key": "z", "down": false}
)";

struct Outcome {
    int code = -1;
    std::string err;
};

class View : public testing::Test {
protected:
    View() {
        write("pillar.kiln.json", kThinPillar);
        write("dig.jsonl", kDig);
    }
    std::string read(const std::string& name) const {
        std::ifstream in(folder_ / name, std::ios::binary);
        std::stringstream s;
        s << in.rdbuf();
        return s.str();
    }
    void write(const std::string& name, const std::string& text) {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    Outcome run(const std::string& words, const std::string& display = "SDL_VIDEODRIVER=dummy DISPLAY=") {
        const std::string command = "cd '" + folder_.string() + "' && " + display +
                                    " WAYLAND_DISPLAY= '" KILN_PROGRAM "' " + words + " >.out 2>.err";
        const int status = std::system(command.c_str());
        EXPECT_EQ(read(".out"), "");
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), read(".err")};
    }
    // The value of a key in a line of --ui-json, as text.
    std::string value(const std::string& name, int frame, const std::string& key) const {
        std::istringstream in(read(name));
        std::string line;
        for (int i = 0; i <= frame; ++i)
            if (!std::getline(in, line)) return "no frame " + std::to_string(frame);
        const size_t at = line.find("\"" + key + "\": ");
        if (at == std::string::npos) return "no " + key + " in " + line;
        const size_t from = at + key.size() + 4;
        return line.substr(from, line.find_first_of(",}", from) - from);
    }

    const TempFolder folder_;
};

TEST_F(View, SaysInOneLineWhatIsWrong) {
    write("bad.jsonl", "{\"frame\": 0, \"key\": \"escap\", \"down\": true}\n");
    const std::tuple<const char*, int, const char*> cases[] = {
        {"view pillar.kiln.json", 1, "no display to open a window on; --frames N"},
        {"view pillar.kiln.json --frames 1 --keys bad.jsonl", 3, "bad.jsonl:1: "},
        {"view pillar.kiln.json --frames 1 --keys none.jsonl", 3, "none.jsonl: cannot be read"},
        {"view pillar.kiln.json --frames 1 --screenshot a.exr", 2, ".png"},
        {"view pillar.kiln.json --frames 1 --screenshot none/a.png", 1, "cannot write none/a.png"},
        {"view pillar.kiln.json --frames 1 --ui-json -", 2, "a file has to be named"},
        {"view pillar.kiln.json --frames -1", 2, "--frames"},
        {"view pillar.kiln.json --frames 1 --size 0x3", 2, "WIDTHxHEIGHT"},
        {"view pillar.kiln.json --frames 1 --quality best", 2, "no such quality"},
    };
    for (const auto& [words, code, what] : cases) {
        const Outcome o = run(words);
        EXPECT_EQ(o.code, code) << words << "\n" << o.err;
        EXPECT_THAT(o.err, HasSubstr(what)) << words;
        EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    }
    EXPECT_EQ(run("view none.kiln.json --frames 1").code, 3);
}

TEST_F(View, GpuAReplayDigsWhatIsCutFallsAndUndoPutsTheWorldBackTheSameOnEveryRun) {
    const std::string words = "view pillar.kiln.json --size 64x36 --frames 36 --keys dig.jsonl --validation ";
    const Outcome one = run(words + "--screenshot a.png --ui-json a.jsonl");
    ASSERT_EQ(one.code, 0) << one.err;
    EXPECT_EQ(value("a.jsonl", 0, "frame"), "0");
    EXPECT_EQ(value("a.jsonl", 0, "undo_depth"), "0");
    EXPECT_EQ(value("a.jsonl", 0, "dirty"), "false");
    EXPECT_EQ(value("a.jsonl", 33, "parts"), "1");
    EXPECT_EQ(value("a.jsonl", 33, "bodies"), "1");
    EXPECT_EQ(value("a.jsonl", 33, "awake"), "1");
    EXPECT_EQ(value("a.jsonl", 33, "undo_depth"), "1");
    EXPECT_EQ(value("a.jsonl", 33, "dirty"), "true");
    EXPECT_NE(value("a.jsonl", 33, "world"), value("a.jsonl", 0, "world"));
    EXPECT_EQ(value("a.jsonl", 35, "world"), value("a.jsonl", 0, "world"));
    EXPECT_EQ(value("a.jsonl", 35, "bodies"), "0");
    EXPECT_EQ(value("a.jsonl", 35, "undo_depth"), "0");
    EXPECT_THAT(read("a.jsonl"), HasSubstr("\"hints\": [0, "));
    // Again, from the scene as it was: the journal of the first run is not part of it.
    std::filesystem::remove(folder_ / "pillar.kiln.json.journal");
    ASSERT_EQ(run(words + "--screenshot b.png --ui-json b.jsonl").code, 0);
    EXPECT_EQ(read("a.png"), read("b.png"));
    EXPECT_EQ(read("a.jsonl"), read("b.jsonl"));
}

TEST_F(View, GpuAStrokeCutsABodyOfAMeshAndUndoBringsTheMeshBack) {
    write("cube.obj",
          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    write("crate.kiln.json",
          R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [{"id": "ground", "shape": "plane"}],
      "meshes": [{"id": "m", "file": "cube.obj", "position": [-0.5, 0, -0.5]}], "bodies": [{"id": "crate", "mesh": "m"}],
      "cameras": {"main": {"position": [0, 0.5, 4], "target": [0, 0.5, 0]}}})");
    // Before the stroke, after it, and after it was taken back.
    const std::string words = "view crate.kiln.json --size 64x36 --keys dig.jsonl --ui-json ui.jsonl";
    std::vector<std::string> pictures;
    for (const int frames : {2, 30, 60}) {
        const std::string name = std::to_string(frames) + ".png";
        const Outcome ran = run(words + " --frames " + std::to_string(frames) + " --screenshot " + name);
        ASSERT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(value("ui.jsonl", frames - 1, "undo_depth"), frames == 30 ? "1" : "0");
        EXPECT_EQ(value("ui.jsonl", frames - 1, "bodies"), "1");
        pictures.push_back(read(name));
    }
    EXPECT_NE(pictures[0], pictures[1]);
    EXPECT_NE(pictures[1], pictures[2]);
    // What is cut from a body is the play's own: the world has not changed.
    EXPECT_EQ(value("ui.jsonl", 0, "world"), value("ui.jsonl", 59, "world"));
}

TEST_F(View, SlowGpuTheQuarryIsDugAndUndoneTheSameOnEveryRun) {
    write("quarry.jsonl", R"({"frame": 1, "mouse": [32, 16], "button": "left", "down": true}
{"frame": 2, "button": "left", "down": false}
{"frame": 3, "key": "g", "down": true}
{"frame": 6, "key": "left ctrl", "down": true}
{"frame": 6, "key": "z", "down": true}
{"frame": 7, "key": "z", "down": true}
)");
    const std::string words = "view quarry --size 64x36 --frames 9 --keys quarry.jsonl ";
    const Outcome one = run(words + "--screenshot a.png --ui-json a.jsonl");
    ASSERT_EQ(one.code, 0) << one.err;
    const std::string start = value("a.jsonl", 0, "world");
    const int bodies = std::stoi(value("a.jsonl", 0, "bodies"));
    EXPECT_NE(value("a.jsonl", 3, "world"), start);
    EXPECT_EQ(value("a.jsonl", 5, "bodies"), std::to_string(bodies + 1));  // the ball
    EXPECT_EQ(value("a.jsonl", 5, "undo_depth"), "2");
    EXPECT_EQ(value("a.jsonl", 6, "bodies"), std::to_string(bodies));
    EXPECT_NE(value("a.jsonl", 6, "world"), start);
    EXPECT_EQ(value("a.jsonl", 8, "world"), start);
    EXPECT_EQ(value("a.jsonl", 8, "steps"), "9");
    ASSERT_EQ(run(words + "--screenshot b.png --ui-json b.jsonl").code, 0);
    EXPECT_EQ(read("a.png"), read("b.png"));
    EXPECT_EQ(read("a.jsonl"), read("b.jsonl"));
}

TEST_F(View, GpuADemoWithoutADisplayIsAPicture) {
    const Outcome o = run("demo tumble --size 16x9");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_GT(read("tumble.png").size(), 60u);
}

TEST_F(View, GpuKeysFlyThrowPauseAndShowWhatTheyShould) {
    write("keys.jsonl", R"({"frame": 0, "key": "f1", "down": true}
{"frame": 0, "key": "f2", "down": true}
{"frame": 0, "key": "f3", "down": true}
{"frame": 1, "key": "g", "down": true}
{"frame": 3, "key": "p", "down": true}
{"frame": 5, "key": ".", "down": true}
{"frame": 6, "key": "v", "down": true}
{"frame": 7, "size": [40, 24]}
{"frame": 8, "size": [0, 0]}
{"frame": 9, "size": [48, 20]}
{"frame": 10, "button": "right", "down": true}
{"frame": 10, "look": [1, 2]}
{"frame": 10, "wheel": 1}
{"frame": 11, "key": "escape", "down": true}
)");
    const Outcome o =
        run("view pillar.kiln.json --size 64x36 --frames 99 --keys keys.jsonl --screenshot a.png --ui-json a.jsonl");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(value("a.jsonl", 0, "bodies"), "0");
    EXPECT_EQ(value("a.jsonl", 1, "bodies"), "1");
    EXPECT_EQ(value("a.jsonl", 1, "undo_depth"), "1");
    const int paused = std::stoi(value("a.jsonl", 3, "steps"));
    EXPECT_EQ(value("a.jsonl", 3, "paused"), "true");
    EXPECT_EQ(value("a.jsonl", 4, "steps"), std::to_string(paused));
    EXPECT_EQ(value("a.jsonl", 6, "steps"), std::to_string(paused + 1));
    EXPECT_EQ(value("a.jsonl", 5, "view"), "\"shaded\"");
    EXPECT_EQ(value("a.jsonl", 6, "view"), "\"albedo\"");
    EXPECT_EQ(value("a.jsonl", 8, "widgets"), "{");  // to its end
    EXPECT_THAT(value("a.jsonl", 9, "widgets"), HasSubstr("hints"));
    EXPECT_THAT(value("a.jsonl", 11, "paused"), "true");
    EXPECT_THAT(value("a.jsonl", 12, "frame"), HasSubstr("no frame"));  // Escape ended it
    const std::string png = read("a.png");
    ASSERT_GT(png.size(), 24u);
    EXPECT_EQ(uint8_t(png[19]), 48);  // width and height of the header
    EXPECT_EQ(uint8_t(png[23]), 20);
}

TEST_F(View, GpuAMessageIsSeenForThreeSeconds) {
    write("v.jsonl", "{\"frame\": 1, \"key\": \"v\", \"down\": true}\n");
    const Outcome o = run("view pillar.kiln.json --size 16x9 --frames 190 --keys v.jsonl --ui-json a.jsonl");
    ASSERT_EQ(o.code, 0) << o.err;
    std::istringstream in(read("a.jsonl"));
    std::string line;
    for (int i = 0; std::getline(in, line); ++i)
        EXPECT_EQ(line.find("\"message\"") != std::string::npos, i >= 1 && i <= 180) << i;
}

TEST_F(View, GpuWalksJumpsLooksAndDigsWhereTheCrossIs) {
    write("walk.jsonl", R"({"frame": 0, "mouse": [1, 1]}
{"frame": 1, "key": "f", "down": true}
{"frame": 2, "key": "w", "down": true}
{"frame": 22, "key": "space", "down": true}
{"frame": 32, "key": "w", "down": false}
{"frame": 33, "button": "left", "down": true}
{"frame": 34, "button": "left", "down": false}
{"frame": 36, "key": "h", "down": true}
{"frame": 37, "key": "escape", "down": true}
{"frame": 38, "look": [100, 0]}
{"frame": 39, "key": "escape", "down": true}
{"frame": 41, "key": "escape", "down": true}
)");
    const Outcome o = run("view pillar.kiln.json --size 64x36 --frames 99 --keys walk.jsonl --ui-json a.jsonl");
    ASSERT_EQ(o.code, 0) << o.err;
    const auto feet = [&](int frame) {
        std::istringstream in(read("a.jsonl"));
        std::string line;
        for (int i = 0; i <= frame; ++i) std::getline(in, line);
        vec3 out{-99, -99, -99};
        if (const size_t at = line.find("\"walker\": ["); at != std::string::npos)
            (void)std::sscanf(line.c_str() + at, "\"walker\": [%f, %f, %f]", &out.x, &out.y, &out.z);
        return out;
    };
    EXPECT_EQ(value("a.jsonl", 0, "walker"), "null");
    EXPECT_NEAR(feet(2).y, 0, 0.03f) << "on the ground below the camera";
    EXPECT_NEAR(feet(20).z, 6 - 18 * 3 / 60.0f, 0.11f);
    EXPECT_GT(feet(30).y, 0.3f) << "it jumps";
    EXPECT_NEAR(feet(35).z, 6 - 30 * 3 / 60.0f, 0.11f);
    EXPECT_THAT(value("a.jsonl", 20, "widgets") + read("a.jsonl"), HasSubstr("\"aim\": ["));
    EXPECT_EQ(value("a.jsonl", 33, "undo_depth"), "0");
    EXPECT_EQ(value("a.jsonl", 35, "undo_depth"), "1") << "the cross is on the pillar, the mouse on the sky";
    EXPECT_NE(value("a.jsonl", 35, "world"), value("a.jsonl", 32, "world"));
    EXPECT_NE(feet(38).y, -99) << "Escape closed the keys";
    EXPECT_EQ(value("a.jsonl", 40, "walker"), "null") << "then it flies";
    EXPECT_THAT(value("a.jsonl", 43, "frame"), HasSubstr("no frame")) << "then it ends";
}

TEST_F(View, GpuAWindowShowsThePicturesOfAReplayWithoutOne) {
    const VirtualDisplay display;
    const std::string words =
        "view pillar.kiln.json --size 64x36 --frames 5 --keys dig.jsonl --validation --screenshot ";
    const Outcome shown = run(words + "a.png", "DISPLAY=" + display.name());
    ASSERT_EQ(shown.code, 0) << shown.err;
    std::filesystem::remove(folder_ / "pillar.kiln.json.journal");
    ASSERT_EQ(run(words + "b.png").code, 0);
    EXPECT_EQ(read("a.png"), read("b.png"));
    EXPECT_GT(read("a.png").size(), 100u);
}

TEST_F(View, GpuADisplayThatIsTakenAwayEndsWellAndTheJournalHasWhatWasDug) {
    VirtualDisplay display;
    const pid_t child = ::fork();
    if (child == 0) {
        const std::string command = "cd '" + folder_.string() +
                                    "' && exec '" KILN_PROGRAM
                                    "' view pillar.kiln.json --size 64x36 --keys dig.jsonl 2>.err";
        ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
        ::_exit(127);
    }
    // The journal grows when the stroke begins.
    const auto dug = [&] { return read("pillar.kiln.json.journal").find("dig2") != std::string::npos; };
    int status = 0;
    while (!dug() && ::waitpid(child, &status, WNOHANG) == 0) ::usleep(1000);
    EXPECT_TRUE(dug());
    display.take_away();
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) != 0) << status;
    EXPECT_THAT(read(".err"), HasSubstr("journal has what was changed"));
    const Outcome again = run("view pillar.kiln.json --size 64x36 --frames 1 --ui-json a.jsonl");
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_THAT(again.err, HasSubstr("pillar.kiln.json"));
}

TEST_F(View, GpuASceneThatAnotherProgramWritesIsSeenInTheWindow) {
    VirtualDisplay display;
    const pid_t child = ::fork();
    if (child == 0) {
        const std::string command =
            "cd '" + folder_.string() + "' && exec '" KILN_PROGRAM "' view pillar.kiln.json --size 64x36 2>.err";
        ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
        ::_exit(127);
    }
    int status = 0;
    bool ended = false;
    const auto wait_for = [&](const auto& what) {
        while (!ended && !what()) {
            ::usleep(1000);
            ended = ::waitpid(child, &status, WNOHANG) != 0;
        }
        return !ended;
    };
    const auto said = [&](const std::string& words) {
        return wait_for([&] { return read(".err").find(words) != std::string::npos; });
    };
    using Pixels = std::vector<std::array<uint8_t, 3>>;
    const auto differ_by_half_a_window = [&](const Pixels& a, const Pixels& b) {
        int count = 0;
        for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += a[i] != b[i];
        return count > 64 * 36 / 2;
    };
    const Pixels nothing = display.screen().rgb;
    Pixels before;
    ASSERT_TRUE(wait_for([&] { return differ_by_half_a_window(before = display.screen().rgb, nothing); }));
    write("pillar.kiln.json", "{\"format\": 1, ");
    EXPECT_TRUE(said("pillar.kiln.json:1:"));
    write("pillar.kiln.json", R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [{"id": "wall", "shape": "box",
      "half_extents": [9, 9, 1], "position": [0, 1, 0]}]})");
    EXPECT_TRUE(said("is loaded again"));
    EXPECT_TRUE(wait_for([&] { return differ_by_half_a_window(display.screen().rgb, before); }));
    display.take_away();
    if (!ended) {
        ASSERT_EQ(::waitpid(child, &status, 0), child);
    }
    EXPECT_TRUE(WIFEXITED(status)) << status;
    EXPECT_EQ(read("pillar.kiln.json").find("pillar\""), std::string::npos);
}

TEST_F(View, GpuADisplayThatIsNotThereEndsWellOrDrawsWithoutAWindow) {
    const std::string nowhere = "SDL_VIDEODRIVER=x11 DISPLAY=:32123";
    const Outcome without = run("view pillar.kiln.json", nowhere);
    EXPECT_EQ(without.code, 4) << without.err;
    EXPECT_THAT(without.err, HasSubstr("no display can be opened"));
    const Outcome o = run("view pillar.kiln.json --frames 1 --size 16x16 --screenshot a.png", nowhere);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.err, HasSubstr("without a window"));
    EXPECT_GT(read("a.png").size(), 60u);
}

}  // namespace
}  // namespace kiln::player
