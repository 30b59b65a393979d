// SPDX-License-Identifier: MIT
// The tree keeps the rules of the house, and each rule fails on a file that breaks it.
#include "house/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace fs = std::filesystem;
using namespace kiln::house;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

namespace {

const fs::path kRoot = KILN_SOURCE_DIR;

std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    EXPECT_TRUE(in) << file;
    return {std::istreambuf_iterator<char>(in), {}};
}

// Files we write, under `folders`, in a fixed order.
std::vector<std::string> code_files(std::initializer_list<const char*> folders) {
    std::vector<std::string> out;
    for (const char* folder : folders) {
        if (!fs::exists(kRoot / folder)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
            const std::string extension = entry.path().extension();
            static const std::vector<std::string> ours{".h", ".cpp", ".inl", ".glsl", ".comp", ".vert", ".frag"};
            if (entry.is_regular_file() && std::ranges::count(ours, extension)) {
                out.push_back(fs::relative(entry.path(), kRoot).generic_string());
            }
        }
    }
    std::ranges::sort(out);
    return out;
}

template <typename Rule>
std::string all_faults(std::initializer_list<const char*> folders, Rule&& rule) {
    std::string out;
    const auto files = code_files(folders);
    EXPECT_FALSE(files.empty());
    for (const std::string& file : files) {
        for (const std::string& fault : rule(file, read(kRoot / file))) out += fault + "\n";
    }
    return out;
}

Modules modules() {
    Faults faults;
    Modules out = parse_modules(read(kRoot / "src/modules.txt"), faults);
    EXPECT_THAT(faults, IsEmpty());
    return out;
}

// ---- the tree

TEST(Layering, EveryIncludeFollowsAnArrow) {
    const Modules rows = modules();
    EXPECT_EQ(all_faults({"src"}, [&](const auto& file, const auto& text) { return module_faults(rows, file, text); }),
              "");
}

TEST(Layering, EachPhysicsEngineStaysInItsFolder) {
    for (const char* include :
         {"#include <Jolt/Jolt.h>", "#include <btBulletDynamicsCommon.h>", "#include <LinearMath/btVector3.h>"})
        EXPECT_THAT(module_faults(modules(), "src/physics/physics.cpp", include), testing::SizeIs(1)) << include;
    EXPECT_THAT(module_faults(modules(), "src/physics/jolt/a.cpp", "#include <Jolt/Jolt.h>"), IsEmpty());
    EXPECT_THAT(module_faults(modules(), "src/physics/bullet/a.cpp", "#include <btBulletDynamicsCommon.h>"), IsEmpty());
    EXPECT_THAT(module_faults(modules(), "src/physics/jolt/a.cpp", "#include <btBulletDynamicsCommon.h>"),
                testing::SizeIs(1));
}

TEST(Layering, EveryModuleFolderHasARowAndEveryRowAFolder) {
    std::vector<std::string> folders;
    for (const auto& entry : fs::directory_iterator(kRoot / "src")) {
        if (entry.is_directory()) folders.push_back(entry.path().filename());
    }
    EXPECT_THAT(modules().order, testing::UnorderedElementsAreArray(folders));
}

TEST(Layering, AppsAndSamplesSeeOnlyThePublicInterface) {
    EXPECT_EQ(all_faults({"apps", "samples"}, client_faults), "");
}

TEST(Layering, PublicHeadersAreFewAndNeedOnlyStd) {
    EXPECT_EQ(all_faults({"include"}, public_header_faults), "");
    std::vector<std::string> headers = code_files({"include"});
    headers.push_back("kiln/shapes.h, generated");
    EXPECT_TRUE(fs::exists(fs::path(KILN_BINARY_DIR) / "generated/include/kiln/shapes.h"));
    EXPECT_EQ(std::distance(fs::directory_iterator(fs::path(KILN_BINARY_DIR) / "generated/include/kiln"), {}), 1);
    EXPECT_LT(headers.size(), 10u);
}

TEST(Layering, GraphicsInterfacesStayInTheirBackend) {
    EXPECT_EQ(all_faults({"src", "include", "apps", "samples"}, token_faults), "");
}

TEST(Layering, EveryFileNamesItsLicenceAndEveryTodoItsIssue) {
    EXPECT_EQ(all_faults({"src", "include", "apps", "samples", "tests", "bench"},
                         [](const std::string& file, const std::string& text) {
                             return file.starts_with("tests/house/rules") ? Faults{} : text_faults(file, text);
                         }),
              "");
}

TEST(Layering, TheFirstSampleHasAtMostFortyLines) {
    const std::string text = read(kRoot / "samples/hello.cpp");
    EXPECT_LE(std::ranges::count(text, '\n'), 40);
}

// Through the compiler, each alone, with the installed include roots only.
TEST(Layering, EveryPublicHeaderStandsAlone) {
    std::vector<fs::path> headers{fs::path(KILN_BINARY_DIR) / "generated/include/kiln/shapes.h"};
    for (const auto& entry : fs::directory_iterator(kRoot / "include/kiln")) headers.push_back(entry.path());
    for (const fs::path& header : headers) {
        const std::string command =
            std::string(KILN_CXX) + " -std=c++20 -fsyntax-only -Wall -Wextra -Wconversion -Wshadow -Werror -I '" +
            (kRoot / "include").string() + "' -I '" + KILN_BINARY_DIR +
            "/generated/include' -x c++ - <<< '#include <kiln/" + header.filename().string() + ">'";
        EXPECT_EQ(std::system(("bash -c \"" + command + "\"").c_str()), 0) << header;
    }
}

// ---- the rules

Modules example() {
    Faults faults;
    return parse_modules("base: | spdlog/\nrhi: base | vulkan/@vulkan\nfield: base\nrender: base rhi field | png.h\n",
                         faults);
}

TEST(LayeringRules, ARowMayOnlyNameRowsAboveIt) {
    Faults faults;
    parse_modules("a: b\nb: a\nnot a row\n", faults);
    EXPECT_THAT(faults, ElementsAre(HasSubstr("a may not include b"), HasSubstr("not a row")));
}

TEST(LayeringRules, AnIncludeAgainstTheArrowsIsAFault) {
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "#include \"field/a.h\"\n#include \"base/b.h\"\n"),
                IsEmpty());
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "\n#include \"render/graph.h\"\n"),
                ElementsAre("src/field/a.cpp:2: field may not include render (\"render/graph.h\")"));
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "  # include \"rhi/device.h\"  // why\n").size(), 1u);
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "#include \"a.h\"\n"),
                ElementsAre(HasSubstr("module's folder")));
    EXPECT_THAT(module_faults(example(), "src/new/a.cpp", ""), ElementsAre(HasSubstr("no row")));
    EXPECT_THAT(
        module_faults(example(), "src/field/a.cpp", "// #include \"render/graph.h\"\n/*\n#include \"rhi/x.h\"\n*/"),
        IsEmpty());
}

TEST(LayeringRules, AThirdPartyHeaderHasOneHome) {
    EXPECT_THAT(module_faults(example(), "src/rhi/vulkan/a.cpp", "#include <vulkan/vulkan.h>"), IsEmpty());
    EXPECT_THAT(module_faults(example(), "src/rhi/null/a.cpp", "#include <vulkan/vulkan.h>"),
                ElementsAre(HasSubstr("under src/rhi/vulkan/ only")));
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "#include \"png.h\""),
                ElementsAre(HasSubstr("under src/render/ only")));
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "#include <imgui.h>"),
                ElementsAre(HasSubstr("pinned to no module")));
    EXPECT_THAT(module_faults(example(), "src/field/a.cpp", "#include <vector>\n#include <sys/stat.h>"), IsEmpty());
}

TEST(LayeringRules, AppsAndSamplesMayNotReachIntoSrc) {
    EXPECT_THAT(
        client_faults("apps/cli/main.cpp",
                      "#include \"cli/verbs.h\"\n#include <kiln/world.h>\n#include <CLI/CLI.hpp>\n#include <string>"),
        IsEmpty());
    EXPECT_THAT(client_faults("apps/cli/main.cpp", "#include \"scene/world.h\""), testing::SizeIs(1));
    EXPECT_THAT(client_faults("apps/cli/main.cpp", "#include \"../../src/scene/world.h\""), testing::SizeIs(1));
    EXPECT_THAT(client_faults("samples/hello.cpp", "#include <CLI/CLI.hpp>"), testing::SizeIs(1));
    // The window system is the player's, and the player is the command line's.
    EXPECT_THAT(client_faults("apps/player/window.cpp", "#include <SDL2/SDL.h>"), IsEmpty());
    EXPECT_THAT(client_faults("apps/cli/view.cpp", "#include <SDL2/SDL.h>"), testing::SizeIs(1));
    EXPECT_THAT(client_faults("apps/cli/view.cpp", "#include \"player/player.h\""), IsEmpty());
    EXPECT_THAT(client_faults("apps/player/player.cpp", "#include \"cli/talk.h\""), testing::SizeIs(1));
    EXPECT_THAT(client_faults("samples/hello.cpp", "#include \"player/player.h\""), testing::SizeIs(1));
    EXPECT_THAT(module_faults(modules(), "src/render/presenter.cpp", "#include <SDL2/SDL.h>"), testing::SizeIs(1));
    EXPECT_THAT(client_faults("samples/hello.cpp", "#include \"base/log.h\""), testing::SizeIs(1));
    EXPECT_THAT(client_faults("samples/hello.cpp", "#include <nlohmann/json.hpp>"), testing::SizeIs(1));
}

TEST(LayeringRules, APublicHeaderMayNotShowAnInnerOne) {
    EXPECT_THAT(public_header_faults("include/kiln/world.h", "#include <kiln/edit.h>\n#include <vector>"), IsEmpty());
    EXPECT_THAT(public_header_faults("include/kiln/world.h", "#include \"base/log.h\""), testing::SizeIs(1));
    EXPECT_THAT(public_header_faults("include/kiln/world.h", "#include <glm/glm.hpp>"), testing::SizeIs(1));
}

TEST(LayeringRules, ABackendTokenOutsideItsFolderIsAFault) {
    for (const char* token : {"VkImage image;", "vkCmdDraw(c);", "x = VK_SUCCESS;", "WGPUDevice d;", "ID3D12Device* d;",
                              "volkInitialize();"}) {
        EXPECT_THAT(token_faults("src/render/a.cpp", token), testing::SizeIs(1)) << token;
    }
    EXPECT_THAT(token_faults("src/rhi/vulkan/a.cpp", "VkImage image;"), IsEmpty());
    EXPECT_THAT(token_faults("src/rhi/null/a.cpp", "VkImage image;"), testing::SizeIs(1));
    EXPECT_THAT(token_faults("src/rhi/a.cpp", "auto s = R\"(\"//)\"; VkImage i;"), testing::SizeIs(1));
    EXPECT_THAT(token_faults("src/rhi/a.h", "// VkImage is what the vulkan backend makes of it\nint revoke_key;"),
                IsEmpty());
}

TEST(LayeringRules, OnlyTheGraphPlacesBarriers) {
    EXPECT_THAT(token_faults("src/render/march.cpp", "e->barrier(key, all);"), testing::SizeIs(1));
    EXPECT_THAT(token_faults("src/render/graph.cpp", "e->barrier(key, all);"), IsEmpty());
    EXPECT_THAT(token_faults("src/render/march.comp", "barrier();"), IsEmpty());
}

TEST(LayeringRules, AFileWithoutLicenceOrWithALooseNoteIsAFault) {
    EXPECT_THAT(text_faults("a.h", "// SPDX-License-Identifier: MIT\n"), IsEmpty());
    EXPECT_THAT(text_faults("a.h", "#version 460\n// SPDX-License-Identifier: MIT\nint x;\n"), IsEmpty());
    EXPECT_THAT(text_faults("a.h", "int x;\n\n// SPDX-License-Identifier: MIT\n"), testing::SizeIs(1));
    EXPECT_THAT(text_faults("a.h",
                            "// SPDX-License-Identifier: MIT\n// TO"
                            "DO later\n"),
                testing::SizeIs(1));
    EXPECT_THAT(text_faults("a.h",
                            "// SPDX-License-Identifier: MIT\n// TO"
                            "DO(issue 7): later\n"),
                IsEmpty());
}

}  // namespace
