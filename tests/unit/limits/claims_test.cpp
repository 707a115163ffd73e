// Sizes in scenes, atlases and image sets that are 0, 1 or negative in 32 bits: refused, without
// the memory that they ask for.

#include <cstring>

#include <gtest/gtest.h>

#include "formats/any/info.hpp"
#include "formats/any/open.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/pictures.hpp"
#include "lib/packing/packing.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/limits/peak_memory.hpp"

using namespace stx;

namespace {

/// 65,535 squared is 4,294,836,225, negative as an int; 65,536 squared is 0; 46,341 squared is the
/// first above 2^31; 2^31 and 2^32 + 1 are themselves no int.
const char* const kSides[] = {"46341", "65535", "65536", "2147483647", "2147483648", "4294967297"};

class Claims : public testing::Test {
  protected:
    void SetUp() override { before_ = peakMiB(); }
    void TearDown() override { EXPECT_LT(peakMiB() - before_, 200); }

    [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& content) {
        std::filesystem::create_directories((folder_ / name).parent_path());
        EXPECT_TRUE(writeFile(folder_ / name, std::as_bytes(std::span(content))));
        return folder_ / name;
    }
    TemporaryFolder folder_;

  private:
    long before_ = 0;
};

template <class T>
void expectRefused(const Result<T>& result, const std::string& what) {
    ASSERT_FALSE(result) << what;
    EXPECT_TRUE(result.error().code == ErrorCode::invalidInput ||
                result.error().code == ErrorCode::usage)
        << what << ": " << result.error().text();
}

TEST_F(Claims, RawDepthMaps) {
    const Limits limits;
    for (const char* side : kSides) {
        const std::string pfm = fmt::format("Pf\n{0} {0}\n-1.0\nabcd", side);
        expectRefused(imagesets::parsePfm(std::as_bytes(std::span(pfm)), "a.pfm", limits), pfm);
        const std::string map = fmt::format("{0}&{0}&1&abcd", side);
        expectRefused(imagesets::parseColmapDepth(std::as_bytes(std::span(map)), "a", limits), map);
        const std::string channels = fmt::format("2&2&{}&abcd", side);
        expectRefused(imagesets::parseColmapDepth(std::as_bytes(std::span(channels)), "a", limits),
                      channels);
    }
}

TEST_F(Claims, TexturesInScenes) {
    for (const char* side : kSides) {
        for (const std::string& texture :
             {fmt::format("SimpleTexture {{ texture PixelTexture {{ image {0} {0} 4 0x01 }} }}",
                          side),
              fmt::format("PointTexture {{ width {0} height {0} depth [1 5] color [1 0 0] }}",
                          side),
              fmt::format("PointTexture {{ width {0} height {0} }}", side),
              fmt::format("PointTexture {{ width 1 height 1 depth [{} 5] color [1 0 0] }}",
                          side)}) {
            const auto path =
                write("a.bt", "Group { children [ DepthImage { diTexture " + texture + " } ] }\n");
            Job job;
            job.limits.maxMemoryBytes = 1u << 30;
            (void)describe(path, {}, job);
            expectRefused(openRenderable(path, {}, job), texture);
        }
        const auto path = write(
            "b.bt", fmt::format("Group {{ children [ OctreeImage {{ octreeResolution {} octree "
                                "[255 255 255] images [ ] }} ] }}\n",
                                side));
        Job job;
        expectRefused(openRenderable(path, {}, job), side);
    }
}

TEST_F(Claims, PagesAndRectanglesOfAtlases) {
    Job job;
    const auto atlas = pack(smallBundle(2, 16, false, false), {}, job);
    ASSERT_TRUE(atlas);
    ASSERT_TRUE(writeAtlas(*atlas, folder_ / "set", job));
    const auto bytes = readFile(folder_ / "set/atlas.json", Limits());
    ASSERT_TRUE(bytes);
    const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto open = [&](const std::string& changed) -> Result<Bundle> {
        (void)write("set/atlas.json", changed);
        STX_TRY(const auto read, readAtlas(folder_ / "set", job));
        return unpack(read, job);
    };
    ASSERT_TRUE(open(text));
    // Each number of each key, one after the other. A view may be long and narrow.
    for (const char* key : {"\"width\":", "\"height\":", "\"viewX\":", "\"atlasX\":", "\"atlasY\":",
                            "\"padding\":", "\"page\":", "\"view\":"}) {
        // The first is of the page or a texture, the last of a rectangle.
        for (const auto at : {text.find(key), text.rfind(key)}) {
            for (const char* side : kSides) {
                const auto from = text.find_first_of("0123456789-", at + std::strlen(key));
                const auto to = text.find_first_not_of("0123456789", from);
                std::string changed = text;
                changed.replace(from, to - from, side);
                const auto opened = open(changed);
                if (opened) {
                    EXPECT_TRUE(opened->check()) << key << side;
                }
            }
        }
    }
    for (const char* side : kSides) {
        // The first view, which is 17x23, as a square.
        std::string changed = text;
        const auto at = changed.find("\"width\":17,\"height\":23");
        ASSERT_NE(at, changed.npos);
        changed.replace(at, 22, fmt::format("\"width\":{0},\"height\":{0}", side));
        expectRefused(open(changed), side);
    }
}

TEST_F(Claims, ImageSets) {
    for (const char* side : kSides) {
        const auto transforms = write(
            "nerf/transforms.json",
            fmt::format(R"({{"w":{0},"h":{0},"fl_x":9,"fl_y":9,"frames":[{{"file_path":"a.png",)"
                        R"("depth_file_path":"d.png","transform_matrix":[[1,0,0,0],[0,1,0,0],)"
                        R"([0,0,1,0],[0,0,0,1]]}}]}})",
                        side));
        (void)write("nerf/a.png", "no picture");
        (void)write("nerf/d.png", "no picture");
        const auto miv =
            write("miv/list.json",
                  fmt::format(R"({{"cameras":[{{"Name":"a","Position":[0,0,0],"Rotation":[0,0,0],)"
                              R"("Depth_range":[1,9],"Resolution":[{0},{0}],"BitDepthColor":8,)"
                              R"("BitDepthDepth":16,"Projection":"Perspective","Focal":[9,9],)"
                              R"("Principle_point":[1,1]}}]}})",
                              side));
        (void)write(fmt::format("miv/a_texture_{0}x{0}_yuv420p.yuv", side), "abcdef");
        (void)write(fmt::format("miv/a_depth_{0}x{0}_yuv420p16le.yuv", side), "abcdef");
        (void)write("colmap/sparse/cameras.txt",
                    fmt::format("1 PINHOLE {0} {0} 9 9 {0} {0}\n", side));
        (void)write("colmap/sparse/images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
        (void)write("colmap/images/a.png", "no picture");
        (void)write("colmap/stereo/depth_maps/a.png.geometric.bin",
                    fmt::format("{0}&{0}&1&abcd", side));
        for (const auto& path : {transforms, miv, folder_ / "colmap"}) {
            Job job;
            const auto read = readImageSet(path, {}, job);
            ASSERT_FALSE(read) << path << " " << side;
        }
        std::filesystem::remove_all(folder_ / "miv");
    }
}

TEST_F(Claims, BinaryCountsOfColmap) {
    const auto little = [](std::uint64_t value, int bytes) {
        std::string text;
        for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
        return text;
    };
    for (const std::uint64_t count : {0x7FFFFFFFull, 0x80000000ull, 0xFFFFFFFFull, 0x100000001ull,
                                      0x2000000000000001ull, ~0ull}) {
        (void)write("set/sparse/cameras.bin", little(count, 8) + std::string(48, '\1'));
        (void)write("set/sparse/images.bin", little(count, 8) + std::string(64, '\1'));
        Job job;
        ASSERT_FALSE(readImageSet(folder_ / "set", {}, job)) << count;
        // An image that says to have that many points of 24 bytes.
        (void)write("set/sparse/cameras.bin", little(1, 8) + little(1, 4) + little(1, 4) +
                                                  little(4, 8) + little(4, 8) +
                                                  std::string(32, '\0'));
        (void)write("set/sparse/images.bin", little(1, 8) + std::string(64, '\0') +
                                                 std::string("a\0", 2) + little(count, 8));
        ASSERT_FALSE(readImageSet(folder_ / "set", {}, job)) << count;
    }
}

}  // namespace
