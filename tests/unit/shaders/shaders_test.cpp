// Every variant of every shader, through the reference compiler: drivers compile only those that a
// device needs, and 64-bit atomics never met one here.

#include <cstdlib>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>

#ifdef STX_WITH_GPU
#include "lib/render/splat/gpu/splat_shaders.hpp"
#include "lib/render/surface/gpu/surface_shaders.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

int run(const std::string& command) {
    return std::system(command.c_str());
}

/// Compiles texts, returns what the compiler says of those that it does not take.
std::string complaints(const std::vector<gpu::ShaderText>& shaders) {
    const TemporaryFolder folder;
    std::string files;
    for (std::size_t i = 0; i < shaders.size(); ++i) {
        const auto name = fmt::format("s{}.{}", i, shaders[i].ending);
        std::ofstream(folder.path() / name) << shaders[i].text;
        files += name + "\n";
    }
    std::ofstream(folder.path() / "list") << files;
    const auto in = folder.path().string();
    if (run(fmt::format("cd '{}' && xargs glslangValidator < list > log 2>&1", in)) == 0) return {};
    std::ifstream log(folder.path() / "log");
    std::string out, line, name;
    while (std::getline(log, line) && out.size() < 4000) {
        if (line.rfind("ERROR", 0) == 0) {
            out += std::exchange(name, "") + line + "\n";
        } else if (line.size() > 1 && line[0] == 's') {
            const auto index = static_cast<std::size_t>(std::atoi(line.c_str() + 1));
            if (index < shaders.size()) name = shaders[index].name + ":\n";
        }
    }
    return out.empty() ? "glslangValidator failed" : out;
}

#define REQUIRE_GLSLANG()                                        \
    if (run("glslangValidator --version > /dev/null 2>&1") != 0) \
    GTEST_SKIP() << "glslangValidator (Debian's glslang-tools) is not installed"

TEST(Shaders, OfSplatModeAreValidInEveryVariant) {
    REQUIRE_GLSLANG();
    auto shaders = gpu::allSplatShaders();
    bool int64 = false, old = false;
    for (auto& s : shaders) {
        // The reference compiler knows this extension by the name that came later.
        const std::string_view nv = "GL_NV_shader_atomic_float";
        if (const auto at = s.text.find(nv); at != std::string::npos)
            s.text.replace(at, nv.size(), "GL_EXT_shader_atomic_float");
        int64 = int64 || s.text.find("GL_NV_shader_atomic_int64") != std::string::npos;
        old = old || s.text.find("#version 330") == 0;
    }
    EXPECT_TRUE(int64 && old);
    EXPECT_GT(shaders.size(), 200u);
    EXPECT_EQ(complaints(shaders), "");
}

TEST(Shaders, OfSurfaceModeAreValidInEveryVariant) {
    REQUIRE_GLSLANG();
    EXPECT_EQ(complaints(gpu::allSurfaceShaders()), "");
}

TEST(Shaders, AMistakeIsFound) {
    REQUIRE_GLSLANG();
    auto shaders = gpu::allSurfaceShaders();
    shaders.resize(2);
    shaders[1].text += "void broken() { undeclared = 1; }\n";
    EXPECT_NE(complaints(shaders).find("undeclared"), std::string::npos);
}

}  // namespace
}  // namespace stx
#endif
