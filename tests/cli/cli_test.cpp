// SPDX-License-Identifier: MIT
// The command line from outside: exit codes, where things are said, and that nothing is left behind.

#include "temp_folder.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

struct Outcome {
    int code = -1;
    std::string out, err;
};

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    return s.str();
}

// Every test works in a folder of its own.
class Cli : public testing::Test {
protected:
    /// Runs `kiln WORDS` by the shell, in the test's folder. `before`: shell words in front.
    Outcome run(const std::string& words, const std::string& before = "") {
        const std::string command =
            "cd '" + folder_.string() + "' && " + before + " '" KILN_PROGRAM "' " + words + " >.out 2>.err";
        const int status = std::system(command.c_str());
        Outcome o{WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), read(folder_ / ".out"),
                  read(folder_ / ".err")};
        fs::remove(folder_ / ".out");
        fs::remove(folder_ / ".err");
        return o;
    }
    void write(const std::string& name, const std::string& text) {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    std::vector<std::string> files() const {
        std::vector<std::string> out;
        for (const auto& entry : fs::directory_iterator(folder_.path())) out.push_back(entry.path().filename());
        std::sort(out.begin(), out.end());
        return out;
    }

    const kiln::TempFolder folder_;
};

void expect_one_line(const Outcome& o, const std::string& what) {
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << what << ": " << o.err;
}

constexpr const char* kNoVulkan = "VK_ICD_FILENAMES=/nonexistent VK_DRIVER_FILES=/nonexistent";
constexpr const char* kBall = "{\"format\": 1, \"edits\": [{\"id\": \"ball\", \"shape\": \"sphere\", \"radius\": 1}]}";

TEST_F(Cli, TheSampleOfAShapeOfItsOwnRuns) {
    const std::string command = "'" KILN_BINARY_DIR "/bin/sample_custom_shape' > '" + (folder_ / "said").string() + "'";
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read(folder_ / "said"), "distance at (0, 2, 0): 1.45 m\nof the one in the scene: 0.90 m\n");
}

TEST_F(Cli, WrongUsageIsTwo) {
    const std::pair<const char*, const char*> cases[] = {
        {"rendr x -o a.png", "did you mean `kiln render`?"},
        {"frobnicate", "`kiln --help` lists them"},
        {"diff potter", "required"},
        {"new a.json", "ends in .kiln.json"},
        {"render", "required"},
        {"render potter", "--output"},
        {"render potter -o a.jpg", "end the name in .png or .exr"},
        {"render potter -o -", "name a file"},
        {"render potter -o a.png --size 0x10", "WIDTHxHEIGHT"},
        {"render potter -o a.png --size big", "WIDTHxHEIGHT"},
        {"render potter -o a.png --size 99999x1", "WIDTHxHEIGHT"},
        {"render potter -o a.png --view nomal", "did you mean normal?"},
        {"render potter -o a.png --unpruned", "--analytic"},
        {"render potter -o a.png --frobnicate", "--help"},
        {"render potter -o a.png --path all", "--frames"},
        {"render potter -o a.png --frames 9", "--path"},
        {"render potter -o a.png --time -1", "0 or more"},
        {"render potter -o a.png --path all --frames 2 --camera main", "leave --camera"},
        {"render potter -o a.png --path main,maim --frames 2 --size 8x8", "did you mean \"main\"?"},
        {"render potter -o a.png --path main --frames 2 --size 8x8", "two cameras"},
        {"render potter -o a.png --camera maim --size 8x8", "did you mean \"main\"?"},
        {"demo potte", "did you mean potter?"},
        {"query potter", "--points"},
        {"export potter -o a.fbx", "end the name in .glb, .obj, .stl or .ply"},
        {"export potter -o a.glb --cell 0", "a length above 0"},
        {"export potter -o a.glb --cell 3parsec", "a length above 0"},
        {"export potter -o a.glb --simplify 2", "such as 0.25"},
        {"export potter -o a.glb --simplify 2m/s", "such as 0.25"},
        {"export potter -o -", "--format"},
        {"export potter -o - --format fbx", "no such format"},
        {"export potter -o a.glb --format stl", "leave --format out"},
        {"export potter -o a.glb --cell 9m", "choose smaller cells"},
        {"render potter -o a.png --reference 0", "above 0"},
        {"simulate tumble --seconds 1 --keep a.csv", ".kiln.json"},
        {"simulate tumble --seconds 1 --view depth", "--png"},
        {"import a.obj", "--output"},
        {"import a.obj -o b.kiln.json --unit ft", "mm, cm, m or in"},
        {"import a.obj -o b.kiln.json --up x", "y or z"},
        {"import a.obj -o b.kiln.json --resolution 4", "between 8 and 512"},
        {"import a.obj -o b.png", ".kiln.json"},
        {"import a.fbx -o b.kiln.json", ".glb"},
        {"import a.csg -o b.kiln.json", "later version"},
        {"query potter --points - --nearest --field", "leave it out"},
        {"query potter --points - --nearest --rays", "leave it out"},
        {"bench feild", "did you mean \"field\"?"},
        {"bench field/rais", "did you mean \"field/rays\"?"},
        {"bench juggling", "`kiln bench --list` names them"},
        {"bench field --kind 3", "there is no kind 3"},
        {"bench field --count 0", "--count: Value 0 not in range 1 to 1000000"},
        {"bench field --count -1", "--count: Value -1 not in range 1 to 1000000"},
        {"bench field --count 99999999999", "--count: Value 99999999999 not in range 1 to 1000000"},
        {"bench field --seed -1", "--seed = -1: not a value that it takes"},
        {"bench field --threads 0", "--threads"},
    };
    for (const auto& [words, says] : cases) {
        const Outcome o = run(words);
        EXPECT_EQ(o.code, 2) << words << o.err;
        EXPECT_THAT(o.err, HasSubstr(says)) << words;
        EXPECT_EQ(o.out, "") << words;
        expect_one_line(o, words);
        EXPECT_THAT(files(), testing::IsEmpty()) << words;
    }
    EXPECT_EQ(run("").code, 2);
}

TEST_F(Cli, ImportMakesASceneAndSaysWhatItFound) {
    write("tet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    const Outcome o = run("import tet.obj -o tet.kiln.json --unit cm --up z --resolution 24");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out, "");
    EXPECT_EQ(o.err, "tet.obj: closed manifold of 4 triangles\n");
    const std::string first = read(folder_ / "tet.kiln.json");
    EXPECT_THAT(first, HasSubstr("\"scale\": [0.01, 0.01, 0.01]"));
    const Outcome valid = run("validate tet.kiln.json");
    EXPECT_EQ(valid.code, 0) << valid.err;
    EXPECT_THAT(valid.out, HasSubstr("tet.obj: closed manifold of 4 triangles"));
    EXPECT_THAT(run("validate tet.kiln.json --json").out, HasSubstr("\"models\": [\"tet.obj: "));
    EXPECT_THAT(run("inspect tet.kiln.json --json").out, HasSubstr("\"sign\": \"closed manifold\""));
    // Nothing is written over unasked.
    const Outcome again = run("import tet.obj -o tet.kiln.json");
    EXPECT_EQ(again.code, 1);
    EXPECT_THAT(again.err, HasSubstr("--force"));
    EXPECT_EQ(read(folder_ / "tet.kiln.json"), first);
    EXPECT_EQ(run("import tet.obj -o tet.kiln.json --force").code, 0);
    EXPECT_NE(read(folder_ / "tet.kiln.json"), first);
    EXPECT_EQ(run("import tet.obj -o none/tet.kiln.json").code, 1);
    EXPECT_THAT(files(), testing::ElementsAre("tet.kiln.json", "tet.obj"));
}

// Results are written over, as compilers do; a scene is not, and never what is read.
TEST_F(Cli, NothingIsWrittenOverThatSomebodyMadeOrThatIsRead) {
    const std::string tet = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    write("tet.obj", tet);
    ASSERT_EQ(run("import tet.obj -o tet.kiln.json --resolution 8").code, 0);
    const std::string scene = read(folder_ / "tet.kiln.json");
    std::filesystem::create_symlink("tet.obj", folder_ / "link.obj");
    for (const char* words : {"export tet.kiln.json -o tet.obj", "export tet.kiln.json -o ./link.obj",
                              "simulate tet.kiln.json --seconds 0.1 --keep tet.kiln.json --force",
                              "view tet.kiln.json --frames 1 --ui-json tet.kiln.json"}) {
        const Outcome o = run(words);
        EXPECT_EQ(o.code, 2) << words << o.err;
        EXPECT_THAT(o.err, HasSubstr("the scene is read from it; choose another name")) << words;
        expect_one_line(o, words);
    }
    write("kept.kiln.json", "somebody's");
    const Outcome kept = run("simulate tet.kiln.json --seconds 0.1 --keep kept.kiln.json");
    EXPECT_EQ(kept.code, 1);
    EXPECT_THAT(kept.err, HasSubstr("kept.kiln.json: is there already; choose another name, or add --force"));
    EXPECT_EQ(read(folder_ / "kept.kiln.json"), "somebody's");
    EXPECT_EQ(run("simulate tet.kiln.json --seconds 0.1 --keep kept.kiln.json --force").code, 0);
    EXPECT_NE(read(folder_ / "kept.kiln.json"), "somebody's");
    write("out.obj", "old");
    EXPECT_EQ(run("export tet.kiln.json -o out.obj").code, 0);
    EXPECT_NE(read(folder_ / "out.obj"), "old");
    EXPECT_EQ(read(folder_ / "tet.obj"), tet);
    EXPECT_EQ(read(folder_ / "tet.kiln.json"), scene);
}

// The game without a window, as somebody would try it.
TEST_F(Cli, TheSampleOfAPlayTellsWhatTheBallHitsAndWhatFalls) {
    const std::string program = std::filesystem::path(KILN_PROGRAM).parent_path() / "sample_play";
    const int status = std::system(("'" + program + "' > '" + (folder_ / "said").string() + "'").c_str());
    EXPECT_EQ(status, 0);
    const std::string said = read(folder_ / "said");
    EXPECT_THAT(said, testing::ContainsRegex("s: (can1 meets thrown1|thrown1 meets can1)"));
    EXPECT_THAT(said, testing::Not(HasSubstr("world")));
    EXPECT_THAT(said, testing::ContainsRegex("\n[123] of 3 fell"));
    std::filesystem::remove(folder_ / "said");
}

TEST_F(Cli, HelpIsShortAndShowsExamplesFirst) {
    for (const char* verb : {"", "demo", "view", "render", "query", "import", "export", "inspect", "validate", "schema",
                             "doctor", "compare", "diff", "new", "bench"}) {
        const Outcome o = run(std::string(verb) + " --help");
        EXPECT_EQ(o.code, 0) << verb;
        EXPECT_LT(o.out.find("Examples:"), o.out.find("Options:")) << o.out;
        EXPECT_LE(std::count(o.out.begin(), o.out.end(), '\n'), 40) << o.out;
        EXPECT_EQ(o.err, "");
    }
    EXPECT_THAT(run("--version").out, StartsWith("kiln "));
}

TEST_F(Cli, BadInputIsThreeWithPlaceAndMend) {
    fs::create_directory(folder_ / "folder");
    const std::pair<const char*, const char*> scenes[] = {
        {"", "bad.kiln.json:1:1: "},
        {"{\"format\": 1,}", "bad.kiln.json:1:13: "},
        {"{\"format\": 1, \"edits\": [{\"shape\": \"sphere\", \"radius\": NaN}]}", "finite"},
        {"{\"format\": 1, \"edits\": [{\"shape\": \"spher\"}]}", "did you mean \"sphere\"?"},
        {"{\"format\": 1, \"edits\": [{\"shape\": \"sphere\", \"radius\": 0}]}",
         "bad.kiln.json:1:55: edits[0].radius: "},
        {"{\"format\": 1, \"edits\": [{\"shape\": \"sphere\", \"radius\": 1e30}]}", "at most"},
        {"{\"format\": 1, \"objects\": {\"a\": {\"object\": \"a\"}}, \"edits\": [{\"object\": \"a\"}]}",
         "contains itself"},
        {"{\"format\": 1, \"edits\": [{\"shape\": \"heightfield\", \"file\": \"none.png\"}]}", "none.png"},
        {"\x89PNG\r\n\x1a\n", "bad.kiln.json:1:1: "},
    };
    for (const auto& [text, says] : scenes) {
        write("bad.kiln.json", text);
        for (const std::string words : {"validate bad.kiln.json", "inspect bad.kiln.json",
                                        "render bad.kiln.json -o a.png", "query bad.kiln.json --points /dev/null"}) {
            const Outcome o = run(words);
            EXPECT_EQ(o.code, 3) << words << text << o.err;
            EXPECT_THAT(o.err, StartsWith("bad.kiln.json:1:")) << words;
            EXPECT_THAT(o.err, HasSubstr(says)) << words;
            expect_one_line(o, words);
            EXPECT_EQ(o.out, "");
            EXPECT_THAT(files(), testing::ElementsAre("bad.kiln.json", "folder"));
        }
    }
    for (const char* words :
         {"validate none.kiln.json", "validate folder", "validate potte", "query potter --points none.csv",
          "compare a.png b.png", "import none.obj -o a.kiln.json", "view potte --frames 1"}) {
        const Outcome o = run(words);
        EXPECT_EQ(o.code, 3) << words << o.err;
        expect_one_line(o, words);
    }
    EXPECT_THAT(run("view potte --frames 1").err, HasSubstr("did you mean \"potter\"?"));
    EXPECT_THAT(run("import none.obj -o a.kiln.json").err, testing::StartsWith("none.obj: cannot be read"));
    write("bad.kiln.json", "{\"format\": 3}");
    EXPECT_THAT(run("validate bad.kiln.json --json").out, HasSubstr("\"valid\": false"));
}

TEST_F(Cli, UnwritableOutputIsOneAndMakesNoFolder) {
    write("ball.kiln.json", kBall);
    fs::create_directory(folder_ / "taken.png");
    for (const std::string out : {"none/a.png", "ball.kiln.json/a.png", "taken.png"}) {
        const Outcome o = run("render ball.kiln.json --size 8x8 -o " + out);
        EXPECT_EQ(o.code, 1) << out << o.err;
        EXPECT_THAT(o.err, HasSubstr(out));
        expect_one_line(o, out);
    }
    EXPECT_THAT(files(), testing::ElementsAre("ball.kiln.json", "taken.png"));
    EXPECT_EQ(run("schema", "").code, 0);
    const std::string full = "cd '" + folder_.string() + "' && '" KILN_PROGRAM "' schema >/dev/full 2>.err";
    EXPECT_EQ(WEXITSTATUS(std::system(full.c_str())), 1);
}

TEST_F(Cli, WithoutVulkanQueriesWorkAndRenderIsFour) {
    write("ball.kiln.json", kBall);
    const Outcome render = run("render ball.kiln.json -o a.png", kNoVulkan);
    EXPECT_EQ(render.code, 4) << render.err;
    EXPECT_THAT(render.err, HasSubstr("kiln doctor"));
    expect_one_line(render, "render");
    EXPECT_THAT(files(), testing::ElementsAre("ball.kiln.json"));
    EXPECT_EQ(run("validate ball.kiln.json", kNoVulkan).code, 0);
    EXPECT_EQ(run("schema", kNoVulkan).code, 0);
    EXPECT_THAT(run("inspect ball.kiln.json --json", kNoVulkan).out, HasSubstr("\"edits\": 1"));
    EXPECT_THAT(run("query ball.kiln.json --points -", std::string("echo 0,2,0 | ") + kNoVulkan).out,
                HasSubstr("0,2,0,1,0,1,0,"));
    const Outcome doctor = run("doctor --json", kNoVulkan);
    EXPECT_EQ(doctor.code, 0);
    EXPECT_THAT(doctor.out, HasSubstr("\"devices\": []"));
    EXPECT_THAT(doctor.out, HasSubstr("mesa-vulkan-drivers"));
    EXPECT_THAT(doctor.out, testing::ContainsRegex(
                                "\"physics\": \\[(\"jolt\", )?\"bullet\"\\], \"default_physics\": \"(jolt|bullet)\""));
}

TEST_F(Cli, QueryAnswersInOrder) {
    write("two.kiln.json",
          "{\"format\": 1, \"materials\": {\"a,b\": {}}, \"edits\": [{\"id\": \"ball\", \"shape\": \"sphere\", "
          "\"radius\": 1, \"material\": \"a,b\"},"
          "{\"id\": \"floor\", \"shape\": \"plane\", \"position\": [0, -3, 0]}]}");
    write("p.csv", "x,y,z\r\n0, 3 ,0\r\n\r\n+2,0,0\n0,-4,1e-3\n");
    const Outcome o = run("query two.kiln.json --points p.csv");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out,
              "x,y,z,distance,nx,ny,nz,material\n0,3,0,2,0,1,0,\"a,b\"\n+2,0,0,1,1,0,0,\"a,b\"\n0,-4,1e-3,-1,0,1,0,\n");
    write("r.csv", "0,5,0,0,-2,0\n5,0,0,0,1,0\n");
    const Outcome rays = run("query two.kiln.json --rays --points r.csv");
    EXPECT_THAT(rays.out, StartsWith("hit,t,x,y,z,nx,ny,nz,edit\n1,4,0,1,0,0,1,0,ball\n0,,,,,,,,\n")) << rays.err;
    const Outcome bricks = run("query two.kiln.json --rays --field --points r.csv");
    float t = 0;
    char rest[64]{};
    ASSERT_EQ(std::sscanf(bricks.out.c_str(), "hit,t,x,y,z,nx,ny,nz,edit\n1,%f,%63s", &t, rest), 2) << bricks.out;
    EXPECT_NEAR(t, 4, 1e-4f);
    EXPECT_THAT(bricks.out, testing::EndsWith(",ball\n0,,,,,,,,\n"));
    EXPECT_EQ(run("query two.kiln.json --rays --nearest --points r.csv").code, 2);

    const std::pair<const char*, const char*> bad[] = {
        {"1,2\n", "bad.csv:1: "},        {"x,y,z\n1,2,3\n1,2,q\n", "bad.csv:3: "},
        {"1,2,3,4\n", "bad.csv:1: "},    {"1,nan,3\n", "bad.csv:1: "},
        {"nan,1,3\n", "bad.csv:1: "},    {"1,2,1e60\n", "bad.csv:1: "},
        {"1,2,3\n1,,3\n", "bad.csv:2: "}};
    for (const auto& [text, place] : bad) {
        write("bad.csv", text);
        const Outcome b = run("query two.kiln.json --points bad.csv");
        EXPECT_EQ(b.code, 3) << text;
        EXPECT_THAT(b.err, StartsWith(place)) << text;
        expect_one_line(b, text);
    }
    write("bad.csv", "0,0,0,0,0,0\n");
    EXPECT_EQ(run("query two.kiln.json --rays --points bad.csv").code, 3);
}

TEST_F(Cli, QueryOfBricksIsNearTheExactAnswer) {
    write("ball.kiln.json",
          "{\"format\": 1, \"materials\": {\"clay\": {}}, \"edits\": [{\"id\": \"ball\", \"shape\": \"sphere\", "
          "\"radius\": 1, \"material\": \"clay\"}]}");
    std::string points;
    for (int i = 0; i < 50; ++i) points += "0.001," + std::to_string(0.98 + 0.001 * i) + ",0.002\n";
    write("p.csv", points);
    std::istringstream exact(run("query ball.kiln.json --points p.csv").out),
        bricks(run("query ball.kiln.json --field --points p.csv").out);
    std::string a, b;
    int rows = 0;
    while (std::getline(exact, a) && std::getline(bricks, b)) {
        if (a[0] == 'x') continue;
        EXPECT_TRUE(a.ends_with(",clay")) << a;
        std::istringstream left(a), right(b);
        std::string exactly, stored;
        for (int column = 0; std::getline(left, exactly, ',') && std::getline(right, stored, ','); ++column) {
            if (column < 3 || column > 6) {
                EXPECT_EQ(exactly, stored) << a;  // the point asked, and the material's name
            } else {
                EXPECT_NEAR(std::stof(exactly), std::stof(stored), column == 3 ? 1e-4f : 1e-2f) << a;
            }
        }
        ++rows;
    }
    EXPECT_EQ(rows, 50);
}

TEST_F(Cli, DemoListsScenes) {
    const Outcome o = run("demo --list");
    EXPECT_EQ(o.code, 0);
    for (const char* name : {"archipelago", "orbit", "potter", "quarry", "tumble", "workbench"})
        EXPECT_THAT(o.out, HasSubstr(name));
    EXPECT_EQ(std::count(o.out.begin(), o.out.end(), '\n'), 6);
}

TEST_F(Cli, APathIsASequenceAndLevelsFollowIt) {
    write("way.kiln.json",
          "{\"format\": 1, \"field\": {\"voxel_size\": 0.05, \"levels\": 3, \"cells\": 32},"
          "\"edits\": [{\"shape\": \"plane\"}, {\"shape\": \"sphere\", \"radius\": 1}],"
          "\"cameras\": {\"a\": {\"position\": [0, 2, 6], \"target\": [0, 0, 0]}, \"b\": {\"position\": [9, 2, 6], "
          "\"target\": "
          "[5, 0, 0]}}}");
    const Outcome o = run("render way.kiln.json -o way.png --path a,b --frames 3 --size 32x18 --budget 400 --json -q");
    if (o.code == 4) GTEST_SKIP() << o.err;
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(files(), testing::ElementsAre("way.kiln.json", "way_0000.png", "way_0001.png", "way_0002.png"));
    for (const char* key : {"\"frames\"", "\"bake_ms\"", "\"levels\"", "\"queued\"", "\"evicted\"", "\"refused\""})
        EXPECT_THAT(o.out, HasSubstr(key));
    write("few.kiln.json", "{\"format\": 1, \"field\": {\"levels\": 3, \"cells\": 16}, \"edits\": []}");
    const Outcome few = run("render few.kiln.json -o few.png");
    EXPECT_EQ(few.code, 3);
    EXPECT_THAT(few.err, HasSubstr("few.kiln.json:1:"));
    EXPECT_THAT(few.err, HasSubstr("field.cells: 16 cells a side; several levels have 32 to 128 each"));
}

TEST_F(Cli, ReferenceNeedsNoDevice) {
    write("ball.kiln.json", kBall);
    const Outcome o = run("render ball.kiln.json -o a.png --size 16x12 --reference 2 --json", kNoVulkan);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.out, HasSubstr("\"size\": [16, 12]"));
    EXPECT_THAT(files(), testing::ElementsAre("a.png", "ball.kiln.json"));
    EXPECT_THAT(run("compare a.png a.png --json").out, HasSubstr("\"equal\": true"));
}

TEST_F(Cli, InterruptedIs130AndLeavesNothing) {
    write("ball.kiln.json", kBall);
    // Long enough to be interrupted: a path-traced picture.
    const std::string command = "cd '" + folder_.string() +
                                "' && timeout --preserve-status -s INT 1 '" KILN_PROGRAM
                                "' render ball.kiln.json -o a.png --size 4096x4096 --reference 4096 >/dev/null 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 130);
    EXPECT_THAT(files(), testing::ElementsAre("ball.kiln.json"));
}

TEST_F(Cli, NewMakesASceneAndDiffTellsHowTwoDiffer) {
    EXPECT_EQ(run("new a.kiln.json").code, 0);
    EXPECT_EQ(run("validate a.kiln.json").code, 0);
    const Outcome again = run("new a.kiln.json");
    EXPECT_EQ(again.code, 1);
    EXPECT_THAT(again.err, HasSubstr("--force"));
    EXPECT_EQ(run("new b.kiln.json --from a.kiln.json").code, 0);
    EXPECT_EQ(run("new none/b.kiln.json").code, 1);
    EXPECT_EQ(run("new c.kiln.json --from none.kiln.json").code, 3);
    const Outcome same = run("diff a.kiln.json b.kiln.json");
    EXPECT_EQ(same.code, 0) << same.err;
    EXPECT_EQ(same.out, "");
    write("b.kiln.json", kBall);
    const Outcome differ = run("diff a.kiln.json b.kiln.json");
    EXPECT_EQ(differ.code, 1) << differ.err;
    EXPECT_THAT(differ.out, HasSubstr("edits\n  - ground\n  ~ ball: "));
    EXPECT_EQ(differ.err, "");
    const Outcome json = run("diff a.kiln.json b.kiln.json --json");
    EXPECT_EQ(json.code, 1);
    EXPECT_THAT(json.out, HasSubstr("\"equal\": false"));
    EXPECT_EQ(run("diff a.kiln.json none.kiln.json").code, 3);
    EXPECT_THAT(files(), testing::ElementsAre("a.kiln.json", "b.kiln.json"));
}

TEST_F(Cli, ASceneIsSeenWithItsJournal) {
    write("s.kiln.json", kBall);
    const std::string scene = (folder_ / "s.kiln.json").string();
    {
        auto world = kiln::World::open(scene);
        ASSERT_TRUE(world) << world.error().message;
        ASSERT_TRUE(world->apply(
            "{\"add\": {\"id\": \"top\", \"shape\": \"sphere\", \"radius\": 1, \"position\": [0, 5, 0]}}"));
        world->history().begin_group("stroke");
        ASSERT_TRUE(world->apply("{\"change\": {\"id\": \"top\", \"position\": [0, 6, 0]}}"));
        ASSERT_TRUE(world->apply("{\"change\": {\"id\": \"ball\", \"radius\": 2}}"));
        ASSERT_TRUE(world->history().end_group());
        ASSERT_TRUE(world->history().undo());
    }
    const Outcome query = run("query s.kiln.json --points -", "echo 0,8,0 |");
    EXPECT_EQ(query.code, 0);
    EXPECT_THAT(query.out, HasSubstr("0,8,0,2,0,1,0,")) << "the ball that only the journal has";
    EXPECT_EQ(query.err, "s.kiln.json.journal: 4 commands applied\n");
    EXPECT_THAT(run("inspect s.kiln.json --json").out, HasSubstr("\"commands\": 4"));
    EXPECT_THAT(run("validate s.kiln.json --json").out, HasSubstr("\"journal\": {\"file\": \"s.kiln.json.journal\""));
    const Outcome history = run("inspect s.kiln.json --history");
    EXPECT_EQ(history.out,
              "journal s.kiln.json.journal: 4 commands applied\n> 1  add top\n  2  stroke (2 changes)  undone\n");
    EXPECT_EQ(history.err, "");
    EXPECT_THAT(run("inspect s.kiln.json --history --json").out,
                HasSubstr("\"title\": \"stroke\",\n      \"done\": false"));
    write("plain.kiln.json", kBall);
    EXPECT_EQ(run("diff plain.kiln.json s.kiln.json").out, "edits\n  + top\n");
    // Saved, it is as it was.
    write("saved.kiln.json", kBall);
    {
        auto world = kiln::World::open((folder_ / "saved.kiln.json").string());
        ASSERT_TRUE(world && world->remove(*world->find_edit("ball")) &&
                    world->save((folder_ / "saved.kiln.json").string()));
    }
    EXPECT_EQ(run("inspect saved.kiln.json --history").out, "> 1  remove ball\n");
    EXPECT_EQ(run("diff plain.kiln.json saved.kiln.json").out, "edits\n  - ball\n");
    EXPECT_EQ(run("inspect plain.kiln.json --history").out, "no steps: the scene file holds all\n");
    // Broken: what is good is used, the rest is told and left alone.
    const std::string journal = read(folder_ / "s.kiln.json.journal");
    write("s.kiln.json.journal", journal.substr(0, journal.size() - 3));
    const Outcome broken = run("validate s.kiln.json");
    EXPECT_EQ(broken.code, 0);
    EXPECT_THAT(broken.err, HasSubstr("bytes of the journal left out: record 6 is cut short"));
    expect_one_line(broken, "broken");
    EXPECT_EQ(read(folder_ / "s.kiln.json.journal").size(), journal.size() - 3);
    EXPECT_EQ(run("new s.kiln.json --force").code, 0);
}

// On a device (the CPU renderer of the gate).
class CliGpu : public Cli {
protected:
    void SetUp() override {
        Cli::SetUp();
        if (run("doctor --json").out.find("\"usable\": true") == std::string::npos) {
            if (std::getenv("REQUIRE_VULKAN")) FAIL() << "no usable device";
            GTEST_SKIP() << "no usable device";
        }
    }
};

TEST_F(CliGpu, RenderWritesThePictureAndItsCost) {
    write("ball.kiln.json", kBall);
    const Outcome o = run("render ball.kiln.json -o a.png --size 64x48 --json");
    ASSERT_EQ(o.code, 0) << o.err;
    for (const char* key : {"\"device\": ", "\"size\": [64, 48]", "\"edits\": 1",
                            "\"bricks\": ", "\"frame_ms\": ", "\"passes\": {", "\"evaluations\": "})
        EXPECT_THAT(o.out, HasSubstr(key));
    EXPECT_EQ(std::count(o.out.begin(), o.out.end(), '\n'), 1);
    EXPECT_THAT(o.err, testing::Not(HasSubstr("\r"))) << "progress is for terminals";
    EXPECT_EQ(read(folder_ / "a.png").substr(1, 3), "PNG");
    EXPECT_THAT(files(), testing::ElementsAre("a.png", "ball.kiln.json"));
    const Outcome depth = run("render ball.kiln.json -o a.exr --size 64x48 --view depth");
    EXPECT_EQ(depth.code, 0) << depth.err;
    EXPECT_EQ(run("render ball.kiln.json -o b.png --size 64x48 --device nosuchdevice").code, 4);
    EXPECT_FALSE(fs::exists(folder_ / "b.png"));
}

// Every device has the compute tier; one that doctor does not list for it is refused, and no file is left.
TEST_F(CliGpu, ATierIsDrawnByOrRefusedInOneLine) {
    write("ball.kiln.json", kBall);
    const Outcome compute = run("render ball.kiln.json -o a.png --size 32x24 --tier compute --json");
    ASSERT_EQ(compute.code, 0) << compute.err;
    EXPECT_THAT(compute.out, HasSubstr("\"march_tier\": \"compute\""));
    const std::string doctor = run("doctor --json").out;
    EXPECT_THAT(doctor, HasSubstr("\"tiers\": [\"compute\""));
    if (doctor.find("\"rt\"") == std::string::npos) {
        const Outcome rt = run("render ball.kiln.json -o b.png --size 32x24 --tier rt");
        EXPECT_EQ(rt.code, 4);
        EXPECT_THAT(rt.err, HasSubstr("has no ray-tracing pipelines; the compute tier draws the same picture"));
        expect_one_line(rt, "tier rt");
        EXPECT_THAT(files(), testing::ElementsAre("a.png", "ball.kiln.json"));
    }
    const Outcome typo = run("render ball.kiln.json -o b.png --tier mseh");
    EXPECT_EQ(typo.code, 2);
    EXPECT_THAT(typo.err, HasSubstr("--tier mseh: there is no such tier; did you mean mesh?"));
}

TEST_F(CliGpu, SimulateDrawsAPictureAFrame) {
    write(
        "s.kiln.json",
        R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}, {"id": "e", "shape": "sphere", "position": [0, 1.5, 0]}],
  "bodies": [{"id": "ball", "edits": ["e"]}]})");
    fs::create_directory(folder_ / "p");
    const std::string words = "simulate s.kiln.json --seconds 0.5 --every 0.25 --png --size 24x16 ";
    for (const char* view : {"contacts", "depth"}) {
        const Outcome o = run(words + "--out p --json --view " + view);
        EXPECT_EQ(o.code, 0) << o.err;
        EXPECT_THAT(o.out, HasSubstr("\"frames\": ["));
        for (const char* name : {"p/frame_00000.png", "p/frame_00001.png", "p/frame_00002.png"})
            EXPECT_TRUE(fs::remove(folder_ / name)) << view << name;
        EXPECT_TRUE(fs::is_empty(folder_ / "p")) << view;
    }
    EXPECT_EQ(run(words + "--out p --camera nobody").code, 2);
    const Outcome near = run(words + "--out p --view contact");
    EXPECT_EQ(near.code, 2);
    EXPECT_THAT(near.err, HasSubstr("did you mean contacts?"));
    const Outcome away = run(words + "--out nowhere");
    EXPECT_EQ(away.code, 1);
    EXPECT_THAT(away.err, HasSubstr("nowhere"));
    EXPECT_EQ(run(words).code, 2) << "no folder";
    EXPECT_EQ(run("simulate s.kiln.json --seconds 1 --out p").code, 2) << "no pictures";
    EXPECT_EQ(run(words + "--out p", kNoVulkan).code, 4);
    EXPECT_TRUE(fs::is_empty(folder_ / "p"));
}

// Techniques that may be chosen: each tells what it was, and a word that is none what it could be.
TEST_F(CliGpu, ShadowsLightingAndScaleAreChosenOrRefusedInOneLine) {
    write("ball.kiln.json", kBall);
    write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("lit.kiln.json",
          "{\"format\": 1, \"meshes\": [{\"id\": \"t\", \"file\": \"t.obj\"}], \"edits\": [{\"shape\": \"sphere\"}], "
          "\"lights\": [{\"type\": \"directional\"}, {\"type\": \"point\", \"position\": [0, 3, 0]}]}");
    const Outcome o = run(
        "render lit.kiln.json -o a.png --size 32x24 --shadows cascades --lighting volumes --taa --scale 0.5 --json");
    ASSERT_EQ(o.code, 0) << o.err;
    for (const char* said :
         {"\"mesh_shadows\": \"cascades\"", "\"lighting\": \"volumes\"", "\"rays\": [16, 12]", "\"size\": [32, 24]"})
        EXPECT_THAT(o.out, HasSubstr(said));
    const std::pair<const char*, const char*> wrong[] = {
        {"--shadows cascade", "--shadows cascade: there are no such shadows; did you mean cascades?"},
        {"--outlines hulks", "--outlines hulks: there are no such outlines; did you mean hulls?"},
        {"--lighting volume", "--lighting volume: there is no such lighting; did you mean volumes?"},
        {"--taa --scale 0.1", "--scale wants a number from 0.25 to 1"},
        {"--scale 0.5", "--scale works with --taa, or with --quality ultra; add one of them"},
    };
    for (const auto& [flags, sentence] : wrong) {
        const Outcome refused = run(std::string("render ball.kiln.json -o b.png --size 32x24 ") + flags);
        EXPECT_EQ(refused.code, 2) << flags;
        EXPECT_THAT(refused.err, HasSubstr(sentence));
        EXPECT_FALSE(fs::exists(folder_ / "b.png"));
    }
}

TEST_F(CliGpu, SectionsNotDrawnAreToldOnce) {
    write("later.kiln.json",
          "{\"format\": 1, \"cloths\": [{\"id\": \"flag\", \"size\": [1, 1]}], \"edits\": [{\"shape\": \"sphere\"}]}");
    const Outcome o = run("render later.kiln.json -o a.png --size 16x16");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.err, HasSubstr("does not draw: cloths"));
}

TEST_F(CliGpu, AMeshThatCannotBeReadIsToldAndTheRestIsDrawn) {
    write("m.kiln.json",
          "{\"format\": 1, \"meshes\": [{\"id\": \"m\", \"file\": \"m.glb\"}, {\"id\": \"t\", \"file\": \"t.obj\"}], "
          "\"edits\": "
          "[{\"shape\": \"sphere\"}]}");
    write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Outcome o = run("render m.kiln.json -o a.png --size 16x16 --json");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.err, HasSubstr("fault    m.kiln.json:1:46: meshes[0].file: m.glb: cannot be read"));
    EXPECT_THAT(o.out, HasSubstr("\"triangles\": 1, \"triangles_drawn\": 1, \"triangles_culled\": 0"));
    EXPECT_THAT(o.out,
                HasSubstr("\"mesh_clusters\": {\"in_sight\": 1, \"early\": 1, \"late\": 0, \"culled_percent\": 0}"));
    EXPECT_THAT(o.out, HasSubstr("\"faults\": [\"m.kiln.json:1:46: "));
    const Outcome all =
        run("render m.kiln.json -o a.png --size 16x16 --json --no-cull --outlines hulls --transparent-layers 0");
    EXPECT_EQ(all.code, 0) << all.err;
    EXPECT_THAT(all.out,
                HasSubstr("\"mesh_clusters\": {\"in_sight\": 1, \"early\": 0, \"late\": 1, \"culled_percent\": 0}"));
    const Outcome ao = run("render m.kiln.json -o a.png --ao haft");
    EXPECT_EQ(ao.code, 2);
    EXPECT_THAT(ao.err, HasSubstr("--ao haft: there is no such ambient occlusion; use off, half or full"));
    for (const std::string how :
         {"--ao off", "--ao half", "--ao full --view ao", "--quality low --ao half", "--outlines hidden"})
        EXPECT_EQ(run("render m.kiln.json -o a.png --size 16x16 -q " + how).code, 0) << how;
    const Outcome many = run("render m.kiln.json -o a.png --transparent-layers 17");
    EXPECT_EQ(many.code, 2);
    EXPECT_THAT(many.err, HasSubstr("--transparent-layers 17: it is 0 to 16"));
    EXPECT_EQ(run("validate m.kiln.json").code, 3);
}

TEST_F(Cli, ExportWritesWholeFilesOrNone) {
    write("ball.kiln.json", kBall);
    const Outcome o = run("export ball.kiln.json -o ball.glb --cell 5cm --json", kNoVulkan);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.out, HasSubstr("\"open_edges\": 0, \"non_manifold_edges\": 0, \"volume\": 4.1"));
    EXPECT_THAT(o.err, HasSubstr("closed"));
    EXPECT_THAT(files(), testing::ElementsAre("ball.glb", "ball.kiln.json"));
    EXPECT_THAT(read(folder_ / "ball.glb"), StartsWith("glTF"));

    const Outcome piped = run("export ball.kiln.json -o - --format stl --cell 0.05 -q");
    EXPECT_EQ(piped.code, 0) << piped.err;
    EXPECT_EQ(piped.err, "");
    EXPECT_EQ(run("export ball.kiln.json -o ball.stl --cell 0.05 -q").code, 0);
    EXPECT_EQ(piped.out, read(folder_ / "ball.stl"));

    EXPECT_EQ(run("export ball.kiln.json -o none/ball.glb").code, 1);
    EXPECT_EQ(run("export none.kiln.json -o a.glb").code, 3);
    EXPECT_EQ(run("export ball.kiln.json -o a.glb --cell 1e-5").code, 5);
    write("empty.kiln.json", "{\"format\": 1}");
    const Outcome empty = run("export empty.kiln.json -o a.glb");
    EXPECT_EQ(empty.code, 1);
    EXPECT_THAT(empty.err, HasSubstr("nothing to mesh"));
    expect_one_line(empty, "empty");
    EXPECT_FALSE(fs::exists(folder_ / "a.glb"));
    EXPECT_EQ(run("export ball.kiln.json -o - --format ply --cell 0.1 >/dev/full || cp ball.stl failed").code, 0);
    EXPECT_TRUE(fs::exists(folder_ / "failed")) << "a full disk behind the pipe";
}

TEST_F(Cli, NearestIsTheTrueDistanceAlsoWhereTheEditsOnlyBoundIt) {
    write("two.kiln.json",
          "{\"format\": 1, \"edits\": [{\"shape\": \"sphere\", \"radius\": 1, \"position\": [-0.6, 0, 0]}, "
          "{\"shape\": \"sphere\", \"radius\": 1, \"position\": [0.6, 0, 0]}]}");
    write("p.csv", "x,y,z\n0,0,0\n0,2,0\n");
    const Outcome o = run("query two.kiln.json --points p.csv --nearest");
    EXPECT_EQ(o.code, 0) << o.err;
    std::stringstream lines(o.out);
    std::string header, inside, outside;
    std::getline(lines, header);
    std::getline(lines, inside);
    std::getline(lines, outside);
    EXPECT_EQ(header, "x,y,z,distance,nx,ny,nz,material");
    EXPECT_THAT(inside, StartsWith("0,0,0,-0.8"));
    EXPECT_NEAR(std::stod(inside.substr(6)), -0.8, 1e-4);
    EXPECT_NEAR(std::stod(outside.substr(6)), std::hypot(2, 0.6) - 1, 1e-4);
    // No surface, no distance; no rows, a header.
    write("none.kiln.json", "{\"format\": 1, \"edits\": []}");
    EXPECT_THAT(run("query none.kiln.json --points p.csv --nearest").out, HasSubstr("0,0,0,inf,0,0,0,"));
    write("empty.csv", "");
    for (const char* how : {"", "--nearest", "--field"})
        EXPECT_EQ(run(std::string("query two.kiln.json --points empty.csv ") + how).out, header + "\n");
    EXPECT_EQ(run("query two.kiln.json --points empty.csv --rays").out, "hit,t,x,y,z,nx,ny,nz,edit\n");
}

TEST_F(Cli, BenchNamesItsRowsAndAnswersOneObject) {
    const Outcome list = run("bench --list");
    EXPECT_EQ(list.code, 0);
    for (const char* row :
         {"field/bake", "field/edit.mean", "field/edit.worst", "field/undo", "field/memory.per_voxel"})
        EXPECT_THAT(list.out, HasSubstr(row));
    const Outcome o = run("bench field/memory.per_voxel --count 20 --seed 3 --kind 1 --json");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.err, "");  // no bar where nobody looks
    EXPECT_EQ(std::count(o.out.begin(), o.out.end(), '\n'), 1);
    for (const char* key : {"\"machine\": ", "\"load\": ", "\"rows\": [", "\"name\": \"memory.per_voxel\"",
                            "\"value\": ", "\"unit\": ", "\"threads\": 1",
                            "\"peer\": ", "\"peer_value\": ", "\"ratio\": ", "\"roof_ratio\": ", "\"checksum\": \""})
        EXPECT_THAT(o.out, HasSubstr(key));
    EXPECT_THAT(run("bench field/memory.per_voxel --count 20").out, HasSubstr("of roof"));
    write("ball.kiln.json", kBall);
    EXPECT_THAT(run("bench field/memory.per_voxel --scene ball.kiln.json").out, HasSubstr("ball.kiln.json, 1 edits\n"));
    EXPECT_EQ(run("bench field/memory.per_voxel --scene ball.kiln.json --kind 1").code, 2);
    EXPECT_EQ(run("bench field/edit.add --scene ball.kiln.json").code, 2);
}

TEST_F(Cli, SimulateTellsWaysAndFaults) {
    write(
        "s.kiln.json",
        R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}, {"id": "e", "shape": "sphere", "position": [0, 2, 0]}],
  "bodies": [{"id": "ball", "edits": ["e"]}]})");
    const Outcome ways = run("simulate s.kiln.json --seconds 0.5 --every 0.25 --json");
    EXPECT_EQ(ways.code, 0) << ways.err;
    EXPECT_THAT(ways.out, HasSubstr("\"frames\": ["));
    EXPECT_THAT(ways.out, HasSubstr("\"time\": 0.25"));
    EXPECT_EQ(run("simulate s.kiln.json --seconds 0.5 --json --threads 1").out,
              run("simulate s.kiln.json --seconds 0.5 --json --threads 2").out);
    EXPECT_EQ(run("simulate s.kiln.json --seconds 1 --json --backend bullet --field-bodies").code, 0);
    // A box that tumbles: a ball on a plane is the same on both.
    write(
        "box.kiln.json",
        R"({"format": 1, "edits": [{"id": "ground", "shape": "plane"}, {"id": "e", "shape": "box", "half_extents": [0.4, 0.4, 0.4], "position": [0, 2, 0],
  "rotation": [0.1305262, 0, 0, 0.9914449]}], "bodies": [{"id": "box", "edits": ["e"]}]})");
    for (const kiln::PhysicsBackend& b : kiln::physics_backends()) {
        if (!b.why_not.empty()) continue;
        const std::string words = "simulate box.kiln.json --seconds 2 --json --backend " + std::string(b.name);
        const Outcome meshed = run(words + " --ground mesh");
        EXPECT_EQ(meshed.code, 0) << meshed.err;
        EXPECT_EQ(meshed.out, run(words + " --ground mesh --threads 1").out) << b.name;
        EXPECT_NE(meshed.out, run(words + " --ground field").out) << b.name;
    }
    EXPECT_EQ(run("simulate s.kiln.json --seconds 1 --ground sand").code, 2);
    EXPECT_EQ(run("simulate s.kiln.json").code, 2);
    EXPECT_EQ(run("simulate s.kiln.json --seconds 1 --backend none").code, 2);
    EXPECT_EQ(run("simulate nowhere.kiln.json --seconds 1").code, 3);
    write("s.kiln.json",
          R"({"format": 1, "edits": [{"id": "e", "shape": "plane"}], "bodies": [{"id": "ball", "edits": ["e"]}]})");
    const Outcome endless = run("simulate s.kiln.json --seconds 1 --json");
    EXPECT_EQ(endless.code, 3);
    EXPECT_THAT(endless.err, HasSubstr("s.kiln.json:1:"));
    EXPECT_THAT(endless.err, HasSubstr("without end"));
    EXPECT_EQ(endless.out, "");
}

TEST_F(Cli, SimulateTakesEditsFromAFileAndWhatIsDugUnderFallsWithTheNextStep) {
    write("s.kiln.json", R"({"format": 1, "edits": [
  {"id": "block", "shape": "box", "half_extents": [2, 1, 2], "position": [0, -1, 0]},
  {"id": "e", "shape": "sphere", "radius": 0.5, "position": [0, 0.5, 0]}],
  "bodies": [{"id": "ball", "edits": ["e"]}]})");
    const std::string dig =
        R"({"time": 1, "command": {"add": {"id": "hole", "shape": "box", "half_extents": [1, 3, 1], "op": "subtract"}}})";
    write("dig.jsonl", dig + "\n");
    for (const kiln::PhysicsBackend& b : kiln::physics_backends()) {
        if (!b.why_not.empty()) continue;
        const std::string engine(b.name);
        const std::string words = "simulate s.kiln.json --seconds 1.1 --json --edits dig.jsonl --backend " + engine;
        const Outcome o = run(words);
        ASSERT_EQ(o.code, 0) << o.err;
        // Its speed along y in the frames of a second and of a step later.
        const auto fall = [&](const char* time) {
            const size_t frame = o.out.find(std::string("\"time\": ") + time);
            const size_t at = o.out.find("\"linear_velocity\": [", frame), first = o.out.find(',', at);
            return frame < at && first != std::string::npos ? std::stod(o.out.substr(first + 1)) : 1e9;
        };
        EXPECT_NEAR(fall("1,"), 0, 1e-3) << engine;
        EXPECT_NEAR(fall("1.016667,"), -9.81 / 60, 0.01 * 9.81 / 60) << engine;
        EXPECT_EQ(run(words + " --threads 1").out, o.out) << engine;
    }
    write("dig.jsonl", dig + "\n" + R"({"time": 1, "command": {"remove": "nobody"}})" + "\n");
    const Outcome wrong = run("simulate s.kiln.json --seconds 1.1 --json --edits dig.jsonl");
    EXPECT_EQ(wrong.code, 3);
    EXPECT_THAT(wrong.err, HasSubstr("dig.jsonl:2"));
    EXPECT_EQ(wrong.out, "");
}

}  // namespace
