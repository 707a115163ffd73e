// Sizes that overflow 32 bits and numbers at the edge of floats, in files of a few bytes: an error
// or a sound result, and never the memory that the file asks for.

#include <gtest/gtest.h>

#include "formats/any/info.hpp"
#include "formats/any/open.hpp"
#include "formats/images/images.hpp"
#include "lib/base/job.hpp"
#include "lib/capture/capture.hpp"
#include "lib/render/factory.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/limits/peak_memory.hpp"

using namespace stx;

namespace {

std::string bigEndian(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i));
    return text;
}

std::string littleEndian(std::uint64_t value, int bytes) {
    std::string text = bigEndian(value, bytes);
    return {text.rbegin(), text.rend()};
}

class HugeClaims : public testing::Test {
  protected:
    /// Opens a file with this content; errors are expected, and little memory.
    Result<std::variant<Mesh, Bundle>> open(const std::string& name, const std::string& content) {
        EXPECT_TRUE(writeFile(folder_ / name, std::as_bytes(std::span(content))));
        Job job;
        (void)describe(folder_ / name, {}, job);
        return openRenderable(folder_ / name, {}, job);
    }
    void expectRefused(const std::string& name, const std::string& content) {
        const long before = peakMiB();
        const auto opened = open(name, content);
        ASSERT_FALSE(opened) << name;
        EXPECT_EQ(opened.error().code, ErrorCode::invalidInput) << opened.error().text();
        EXPECT_LT(peakMiB() - before, 200) << name << ": " << opened.error().text();
    }
    TemporaryFolder folder_;
};

TEST(Limits, AllocationsNeverOverflow) {
    Limits limits;
    limits.maxMemoryBytes = 1ull << 32;
    const std::uint64_t side = 65535, most = ~std::uint64_t{0};
    EXPECT_TRUE(limits.checkAllocation(side * side, 1, "bytes"));
    EXPECT_FALSE(limits.checkAllocation(side * side, 2, "pixels"));
    // 2^32 pixels of 2^32 bytes are 0 in 64 bits, and 2^31 points of 2 bytes are 0 in 32.
    EXPECT_FALSE(limits.checkAllocation(1ull << 32, 1ull << 32, "pixels"));
    EXPECT_FALSE(limits.checkAllocation(1ull << 31, 3, "points"));
    EXPECT_TRUE(limits.checkAllocation(1ull << 31, 2, "points"));
    EXPECT_FALSE(limits.checkAllocation(most, most, "everything"));
    EXPECT_FALSE(limits.checkAllocation(2, most, "everything"));
    EXPECT_TRUE(limits.checkAllocation(0, most, "nothing"));
    EXPECT_TRUE(limits.checkAllocation(most, 0, "nothing"));
    limits.maxMemoryBytes = 0;
    EXPECT_FALSE(limits.checkAllocation(1, 1, "a byte"));
}

TEST_F(HugeClaims, PlyOf31And32BitCounts) {
    for (const char* count : {"2147483647", "2147483648", "4294967295", "4294967296",
                              "18446744073709551615", "99999999999999999999", "-1"}) {
        for (const char* format : {"ascii", "binary_little_endian"}) {
            const std::string head = fmt::format(
                "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n",
                format, count);
            expectRefused("points.ply", head + "0 0 0\n");
            expectRefused(
                "faces.ply",
                fmt::format("ply\nformat {} 1.0\nelement vertex 1\nproperty float x\n"
                            "property float y\nproperty float z\nelement face {}\nproperty "
                            "list uint int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n",
                            format, count));
        }
    }
}

TEST_F(HugeClaims, StlOf32BitCount) {
    for (const std::uint64_t count : {0x7FFFFFFFull, 0x80000000ull, 0xFFFFFFFFull, 85899346ull}) {
        expectRefused("many.stl",
                      std::string(80, ' ') + littleEndian(count, 4) + std::string(50, '\1'));
    }
}

TEST_F(HugeClaims, GltfAccessorsAndBuffers) {
    for (const char* count : {"2147483647", "2147483648", "4294967295", "4294967297",
                              "9007199254740993", "1e300", "-1", "0.5"}) {
        for (const char* sparse : {"", R"(,"sparse":{"count":2,"indices":{"bufferView":0,)"
                                       R"("componentType":5125},"values":{"bufferView":0}})"}) {
            expectRefused(
                "many.gltf",
                fmt::format(
                    R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],)"
                    R"("nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":)"
                    R"({{"POSITION":0}}}}]}}],"buffers":[{{"byteLength":36,"uri":)"
                    R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAA)"
                    R"(AAAAAAAAAAgD8AAAAA"}}],"bufferViews":[{{"buffer":0,"byteLength":36)"
                    R"(}}],"accessors":[{{{}"componentType":5126,"count":{},"type":"VEC3"{})"
                    R"(}}]}})",
                    *sparse ? "" : R"("bufferView":0,)", count, sparse));
        }
    }
}

TEST_F(HugeClaims, ObjIndices) {
    for (const char* index : {"2147483648", "4294967297", "-2147483649", "18446744073709551617",
                              "99999999999999999999999"}) {
        const auto opened =
            open("far.obj", fmt::format("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {}\n", index));
        // The face may be left out; it must not wrap round to vertex 1.
        if (!opened) continue;
        EXPECT_TRUE(std::get<Mesh>(*opened).triangles.empty()) << index;
    }
}

TEST_F(HugeClaims, PicturesOf65535Squared) {
    // A PNG and a GLB-less OBJ that wears it: the header alone tells the size.
    const auto chunk = [](const std::string& kind, const std::string& body) {
        return bigEndian(body.size(), 4) + kind + body + std::string(4, '\0');
    };
    for (const std::uint64_t side : {65535u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
        const std::string png = "\x89PNG\r\n\x1a\n" +
                                chunk("IHDR", bigEndian(side, 4) + bigEndian(side, 4) +
                                                  std::string("\x08\x06\0\0\0", 5)) +
                                chunk("IDAT", "x") + chunk("IEND", "");
        const long before = peakMiB();
        const auto image = decodeImage(std::as_bytes(std::span(png)), "vast.png", Limits());
        EXPECT_FALSE(image) << side;
        EXPECT_LT(peakMiB() - before, 200) << side;
    }
}

TEST_F(HugeClaims, ExrOf65535Squared) {
    const auto attribute = [](const std::string& name, const std::string& type,
                              const std::string& value) {
        return name + '\0' + type + '\0' + littleEndian(value.size(), 4) + value;
    };
    for (const std::uint64_t corner : {65534ull, 0x7FFFFFFFull, 0x7FFFFFFEull}) {
        const std::string box = littleEndian(0, 4) + littleEndian(0, 4) + littleEndian(corner, 4) +
                                littleEndian(corner, 4);
        const std::string zeroes = littleEndian(0, 4);
        std::string exr = std::string("\x76\x2f\x31\x01\x02\0\0\0", 8);
        exr += attribute("channels", "chlist",
                         std::string("R\0", 2) + littleEndian(2, 4) + zeroes + littleEndian(1, 4) +
                             littleEndian(1, 4) + '\0');
        exr += attribute("compression", "compression", std::string(1, '\0'));
        exr += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box);
        exr += attribute("lineOrder", "lineOrder", std::string(1, '\0'));
        exr += attribute("pixelAspectRatio", "float", littleEndian(0x3F800000, 4));
        exr += attribute("screenWindowCenter", "v2f", zeroes + zeroes);
        exr += attribute("screenWindowWidth", "float", littleEndian(0x3F800000, 4)) + '\0';
        expectRefused("vast.exr", exr);
    }
}

TEST(Limits, CaptureAndRenderingOf65535SquaredAreRefused) {
    Job job;
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangleMaterial = {0};
    mesh.materials.emplace_back();
    auto camera =
        Camera::fromFieldOfView({0, 0, 3}, glm::dquat(1, 0, 0, 0), {0.7, 0.7}, false, 65535, 65535);
    const long before = peakMiB();
    // Their pixels are 1 in 32 bits.
    const auto captured = captureBundle(mesh, {camera}, {}, job);
    ASSERT_FALSE(captured);
    EXPECT_NE(captured.error().text().find("--max-memory"), std::string::npos)
        << captured.error().text();
    for (const auto mode : {RenderMode::splat, RenderMode::surface}) {
        RenderSettings settings;
        settings.mode = mode;
        auto renderer =
            makeRenderer(Backend::cpu, smallBundle(2, 16, false, false), settings, 0, job);
        ASSERT_TRUE(renderer) << renderer.error().text();
        const auto frame = (*renderer)->render(camera);
        ASSERT_FALSE(frame);
        EXPECT_NE(frame.error().text().find("--max-memory"), std::string::npos);
    }
    EXPECT_LT(peakMiB() - before, 200);
}

TEST_F(HugeClaims, NumbersAtTheEdgeOfFloats) {
    for (const char* number : {"nan",
                               "-nan",
                               "inf",
                               "-inf",
                               "infinity",
                               "1e39",
                               "-1e39",
                               "3.4028235e38",
                               "1e400",
                               "-1e400",
                               "1e99999999999",
                               "1e-46",
                               "1e-400",
                               "4.9e-324",
                               "1.17549435e-38",
                               "0x1p3",
                               "1,5",
                               "1.5.5",
                               "--1",
                               "1e",
                               "",
                               "\xd9\xa1"}) {
        const std::string obj =
            fmt::format("v {} 0 0\nv 1 {} 0\nv 0 1 {}\nf 1 2 3\n", number, number, number);
        const std::string ply = fmt::format(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
            "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
            "end_header\n{} 0 0\n1 {} 0\n0 1 {}\n3 0 1 2\n",
            number, number, number);
        const std::string stl = fmt::format(
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex {} 0 0\nvertex 1 {} 0\nvertex 0 1 "
            "{}\nendloop\nendfacet\nendsolid a\n",
            number, number, number);
        for (const auto& [name, text] :
             {std::pair{"a.obj", obj}, std::pair{"a.ply", ply}, std::pair{"a.stl", stl}}) {
            const auto opened = open(name, text);
            if (!opened) {
                EXPECT_EQ(opened.error().code, ErrorCode::invalidInput) << name << number;
                continue;
            }
            const auto& mesh = std::get<Mesh>(*opened);
            EXPECT_TRUE(mesh.check()) << name << " " << number;
            for (const auto& p : mesh.positions)
                EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
                    << name << " " << number;
        }
    }
}

}  // namespace
