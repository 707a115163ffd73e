#include "formats/atlas/atlas_files.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <set>

#include "formats/atlas/atlas_json.hpp"
#include "formats/atlas/atlas_textures.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/atlas/small_atlas.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

std::string get(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void put(const fs::path& path, std::string_view text) {
    std::ofstream(path, std::ios::binary) << text;
}

std::set<std::string> namesIn(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

Atlas writtenAndRead(const Atlas& atlas, const fs::path& path) {
    Job job;
    const auto written = writeAtlas(atlas, path, job);
    EXPECT_TRUE(written) << written.error().text();
    auto back = readAtlas(path, job);
    EXPECT_TRUE(back) << back.error().text();
    EXPECT_TRUE(job.takeNotes().empty());
    return back ? *back : Atlas();
}

double largestDifference(const Image<glm::vec3>& a, const Image<glm::vec3>& b) {
    if (a.size() != b.size()) return 1e9;
    double largest = 0;
    for (std::size_t i = 0; i < a.count(); ++i) {
        for (int c = 0; c < 3; ++c)
            largest = std::max<double>(largest, std::abs(a.pixels()[i][c] - b.pixels()[i][c]));
    }
    return largest;
}

class AtlasOfEachKind : public testing::TestWithParam<std::tuple<int, bool, bool>> {};

TEST_P(AtlasOfEachKind, FolderComesBack) {
    const auto [bits, v2, linear] = GetParam();
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(5, bits, v2, linear, v2 ? 1 : 2);
    ASSERT_TRUE(atlas.check()) << atlas.check().error().text();
    const Atlas back = writtenAndRead(atlas, folder / "set");
    EXPECT_EQ(headerDifference(atlas, back), "");
    ASSERT_EQ(back.pages.size(), atlas.pages.size());
    for (std::size_t i = 0; i < atlas.pages.size(); ++i) {
        const auto& a = atlas.pages[i];
        const auto& b = back.pages[i];
        EXPECT_EQ(a.depth, b.depth);
        if (!linear) {
            EXPECT_EQ(a.texture, b.texture);
        }
        if (bits == 32) {
            EXPECT_EQ(a.normal, b.normal);
            EXPECT_EQ(a.splatU, b.splatU);
            EXPECT_EQ(a.splatV, b.splatV);
        } else if (v2) {
            EXPECT_LT(largestDifference(a.normal, b.normal), 0.51 / 32767);
            EXPECT_LT(largestDifference(a.splatU, b.splatU), 0.02 * 0.51 / 32767);
            EXPECT_LT(largestDifference(a.splatV, b.splatV), 0.02 * 0.51 / 32767);
        }
    }
    // What came back is written as the same bytes: nothing drifts.
    const Atlas again = writtenAndRead(back, folder / "again");
    for (const auto& name : namesIn(folder / "set"))
        EXPECT_EQ(get(folder / "set" / name), get(folder / "again" / name)) << name;
}

TEST_P(AtlasOfEachKind, ExrComesBack) {
    const auto [bits, v2, linear] = GetParam();
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(5, bits, v2, linear, v2 ? 1 : 2);
    const Atlas back = writtenAndRead(atlas, folder / "a.exr");
    EXPECT_EQ(headerDifference(atlas, back), "");
    ASSERT_EQ(back.pages.size(), atlas.pages.size());
    for (std::size_t i = 0; i < atlas.pages.size(); ++i) {
        const auto& a = atlas.pages[i];
        const auto& b = back.pages[i];
        EXPECT_EQ(a.depth, b.depth);
        EXPECT_EQ(a.normal, b.normal);
        EXPECT_EQ(a.splatU, b.splatU);
        EXPECT_EQ(a.splatV, b.splatV);
        for (int y = 0; y < a.depth.height(); ++y) {
            for (int x = 0; x < a.depth.width(); ++x) {
                EXPECT_EQ(a.texture.at(x, y).a, b.texture.at(x, y).a);
                if (a.texture.at(x, y).a > 0) {
                    EXPECT_EQ(a.texture.at(x, y), b.texture.at(x, y));
                }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, AtlasOfEachKind,
                         testing::Combine(testing::Values(8, 16, 32), testing::Bool(),
                                          testing::Bool()));

TEST(AtlasFolder, HoldsAtMostFourImagesOfPlainKinds) {
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(3, 16, true, false);
    writtenAndRead(atlas, folder / "set");
    EXPECT_EQ(namesIn(folder / "set"),
              (std::set<std::string>{"atlas.json", "colour.png", "depth.png", "normal.png",
                                     "splat.png"}));
    const auto info = [&](const char* name) {
        const auto bytes = readFile(folder / "set" / name, Limits());
        return *probeImage(*bytes);
    };
    EXPECT_EQ(info("colour.png").channels, 4);
    EXPECT_EQ(info("colour.png").bits, 8);
    EXPECT_EQ(info("depth.png").channels, 1);
    EXPECT_EQ(info("depth.png").bits, 16);
    EXPECT_EQ(info("normal.png").bits, 16);
    EXPECT_EQ(info("splat.png").width * info("splat.png").height,
              2 * info("depth.png").width * info("depth.png").height);
    EXPECT_NE(get(folder / "set/colour.png").find("sRGB"), std::string::npos);
    EXPECT_EQ(get(folder / "set/depth.png").find("sRGB"), std::string::npos);
}

TEST(AtlasFolder, DepthHoldsTheCodesOfDepthImage) {
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(3, 16, false, false);
    writtenAndRead(atlas, folder / "set");
    const auto bytes = readFile(folder / "set/depth.png", Limits());
    const auto image = decodeImage(*bytes, "depth.png", Limits());
    const auto& codes = std::get<1>(image->values);
    for (const auto& r : atlas.rectangles) {
        const DepthCode code = atlas.views[r.view].depthCode();
        for (int y = 0; y < r.height; ++y) {
            for (int x = 0; x < r.width; ++x) {
                const auto p = r.atlasFromView(r.viewX + x, r.viewY + y);
                EXPECT_EQ(codes[static_cast<std::size_t>(p.y) * image->width + p.x],
                          code.encode(atlas.pages[0].depth.at(p.x, p.y)));
            }
        }
    }
}

TEST(AtlasFolder, EightBitsStayEightAndMixedViewsKeepTheirOwn) {
    const TemporaryFolder folder;
    Atlas atlas = smallAtlas(3, 8, false, false);
    writtenAndRead(atlas, folder / "eight");
    const auto bytes = readFile(folder / "eight/depth.png", Limits());
    EXPECT_EQ(probeImage(*bytes)->bits, 8);

    const Atlas sixteen = smallAtlas(3, 16, false, false);
    for (const auto& r : atlas.rectangles) {
        if (r.view != 1) continue;
        atlas.views[1].depthBits = 16;
        for (int y = -2; y < r.atlasHeight() + 2; ++y) {
            for (int x = -2; x < r.atlasWidth() + 2; ++x) {
                float& d = atlas.pages[0].depth.at(r.atlasX + x, r.atlasY + y);
                const DepthCode code = atlas.views[1].depthCode();
                if (hasPoint(d)) d = static_cast<float>(code.decode(code.encode(d)));
            }
        }
    }
    const Atlas back = writtenAndRead(atlas, folder / "mixed");
    EXPECT_EQ(back.pages[0].depth, atlas.pages[0].depth);
}

TEST(AtlasFolder, JpegLosesColourOnly) {
    for (const int bits : {8, 16}) {
        SCOPED_TRACE(bits);
        const TemporaryFolder folder;
        const Atlas atlas = smallAtlas(4, bits, true, false);
        Job job;
        writtenAndRead(atlas, folder / "set");  // PNG first: its colour.png must go
        ASSERT_TRUE(writeAtlas(atlas, folder / "set", job, {.jpegQuality = 95}));
        EXPECT_EQ(namesIn(folder / "set"),
                  (std::set<std::string>{"atlas.json", "colour.jpg", "depth.png", "normal.png",
                                         "splat.png"}));
        const auto back = readAtlas(folder / "set", job);
        ASSERT_TRUE(back) << back.error().text();
        EXPECT_EQ(headerDifference(atlas, *back), "");
        const auto& a = *atlas.pages[0].texture.rgba8();
        const auto& b = *back->pages[0].texture.rgba8();
        EXPECT_EQ(atlas.pages[0].depth, back->pages[0].depth);
        double squares = 0, count = 0;
        for (std::size_t i = 0; i < a.count(); ++i) {
            ASSERT_EQ(a.pixels()[i].a, b.pixels()[i].a) << i;
            if (a.pixels()[i].a == 0) continue;
            const glm::vec3 d = glm::vec3(a.pixels()[i]) - glm::vec3(b.pixels()[i]);
            squares += glm::dot(d, d);
            count += 3;
        }
        EXPECT_GT(count, 100);
        // The small bundle's colours are noise, the worst that JPEG can get.
        EXPECT_LT(std::sqrt(squares / count), 8.0);
    }
}

TEST(AtlasFolder, JpegIsRefusedWhereOpenExrIsNeeded) {
    const TemporaryFolder folder;
    Job job;
    const auto refused = [&](const Atlas& atlas, const char* name) {
        const auto done = writeAtlas(atlas, folder / name, job, {.jpegQuality = 90});
        EXPECT_FALSE(fs::exists(folder / name));
        return !done && done.error().code == ErrorCode::unsupported;
    };
    EXPECT_TRUE(refused(smallAtlas(2, 32, false, false), "deep"));
    EXPECT_TRUE(refused(smallAtlas(2, 16, false, true), "linear"));
    EXPECT_TRUE(refused(smallAtlas(2, 16, false, false), "a.exr"));
}

TEST(AtlasFolder, AlphaStandsInOnePlace) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(2, 16, false, false), folder / "set");
    std::string json = get(folder / "set/atlas.json");
    json.replace(json.find("\"sRGB8\""), 7, "\"sRGB8-opaque\"");
    const auto header = atlasFromJson(json, "'a'", Limits());
    ASSERT_FALSE(header);
    EXPECT_NE(header.error().text().find("not with both or none"), std::string::npos);
}

TEST(AtlasFolder, SaysWhatItDropsAndClamps) {
    const TemporaryFolder folder;
    Atlas atlas = smallAtlas(2, 16, false, false);
    const auto& r = atlas.rectangles[0];
    atlas.pages[0].depth.at(r.atlasX, r.atlasY) =
        static_cast<float>(atlas.views[0].farPlane * 2 + 1);
    atlas.pages[0].depth.at(atlas.width() - 1, atlas.height() - 1) = 1.0f;
    Job job;
    ASSERT_TRUE(writeAtlas(atlas, folder / "set", job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("outside"), std::string::npos);
    EXPECT_NE(notes[1].find("clamped"), std::string::npos);
}

TEST(AtlasHeaderOf, TellsAllWithoutPixels) {
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(4, 16, true, false);
    for (const char* name : {"set", "a.exr"}) {
        SCOPED_TRACE(name);
        Job job;
        ASSERT_TRUE(writeAtlas(atlas, folder / name, job));
        const auto header = readAtlasHeader(folder / name, Limits());
        ASSERT_TRUE(header) << header.error().text();
        EXPECT_EQ(headerDifference(atlas, header->atlas), "");
        EXPECT_EQ(header->pageWidth, atlas.width());
        EXPECT_EQ(header->pageHeight, atlas.height());
        EXPECT_DOUBLE_EQ(header->used(), atlas.used());
        ASSERT_EQ(header->textures.size(), 4u);
        EXPECT_EQ(header->textures[0].attribute, "colour");
        EXPECT_GT(header->textures[0].bytes, 100u);
    }
    EXPECT_TRUE(isAtlasFolder(folder / "set"));
    EXPECT_TRUE(isAtlasFolder(folder / "set/atlas.json"));
    EXPECT_FALSE(isAtlasFolder(folder / "a.exr"));
    EXPECT_FALSE(isAtlasFolder(folder.path()));
    EXPECT_TRUE(isExrAtlas(*ExrReader::open(folder / "a.exr", Limits())));
    EXPECT_TRUE(readAtlasHeader(folder / "set/atlas.json", Limits()));
}

TEST(AtlasFiles, KindsAreToldApart) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeAtlas(smallAtlas(2, 16, false, false), folder / "a.exr", job));
    ASSERT_TRUE(writeExrViews(*viewsOf(smallBundle(2, 16, false, false)), folder / "b.exr", job));
    EXPECT_FALSE(readExrBundle(folder / "a.exr", job));
    EXPECT_FALSE(readAtlas(folder / "b.exr", job));
    EXPECT_FALSE(isExrAtlas(*ExrReader::open(folder / "b.exr", Limits())));
}

TEST(AtlasFiles, SameBytesOnAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const Atlas atlas = smallAtlas(5, 16, true, false);
    Job job;
    ASSERT_TRUE(writeAtlas(atlas, folder / "many", job));
    ASSERT_TRUE(writeAtlas(atlas, folder / "many.exr", job));
    const ThreadLimit one(1);
    ASSERT_TRUE(writeAtlas(atlas, folder / "one", job));
    ASSERT_TRUE(writeAtlas(atlas, folder / "one.exr", job));
    for (const auto& name : namesIn(folder / "many"))
        EXPECT_EQ(get(folder / "many" / name), get(folder / "one" / name)) << name;
    EXPECT_EQ(get(folder / "many.exr"), get(folder / "one.exr"));
}

TEST(AtlasFolder, SaysWhatOneScaleIsTooCoarseFor) {
    const TemporaryFolder folder;
    Atlas atlas = smallAtlas(4, 16, true, false);
    atlas.objects.resize(2);
    for (int i = 0; i < 2; ++i) {
        atlas.objects[i].name = i == 0 ? "jug" : "cup";
        atlas.objects[i].firstView = 2 * i;
        atlas.objects[i].views = 2;
    }
    // Half axes of 0.02 at most in both; what is said when those of the jug are so many times as
    // long, and when it shines so brightly beside a cup of 0.2.
    const auto said = [&](float splats, float light, const char* name) {
        Atlas changed = atlas;
        AtlasPage& page = changed.pages[0];
        page.emissive = Image<glm::vec3>(page.depth.width(), page.depth.height(), glm::vec3(0));
        for (const AtlasRectangle& r : changed.rectangles) {
            const bool jug = r.view < 2;
            for (int y = r.atlasY; y < r.atlasY + r.atlasHeight(); ++y) {
                for (int x = r.atlasX; x < r.atlasX + r.atlasWidth(); ++x) {
                    page.splatU.at(x, y) *= jug ? splats : 1.0f;
                    page.splatV.at(x, y) *= jug ? splats : 1.0f;
                    page.emissive.at(x, y) = glm::vec3(jug ? light : 0.2f);
                }
            }
        }
        Job job;
        EXPECT_TRUE(writeAtlas(changed, folder / name, job));
        return job.takeNotes();
    };
    using Notes = std::vector<std::string>;
    const std::string splats =
        "splat axes of 'cup' are coded in steps of more than 1 % of their median: one scale, that "
        "of the longest axis, holds for a whole texture; an .exr atlas keeps them exactly";
    const std::string light =
        "emitted light of 'cup' is rounded by more than 2 %, even where it is brightest: one "
        "scale, that of the brightest object, holds for a whole texture; an .exr atlas keeps it "
        "exactly";
    EXPECT_EQ(said(100, 2, "set"), Notes());
    EXPECT_EQ(said(1000, 2, "set"), Notes{splats});
    EXPECT_EQ(said(100, 500, "set"), Notes{light});
    EXPECT_EQ(said(1000, 500, "set"), (Notes{splats, light}));
    EXPECT_EQ(said(1000, 500, "a.exr"), Notes());
    // One model whose own axes differ as much.
    atlas.objects.clear();
    EXPECT_EQ(said(1, 500, "set"), Notes());
    atlas.pages[0].splatU.at(atlas.rectangles[0].atlasX, atlas.rectangles[0].atlasY) = {100, 0, 0};
    const auto whole = said(1, 2, "set");
    ASSERT_EQ(whole.size(), 1u);
    EXPECT_EQ(whole[0].find("splat axes are coded in steps of more than 1 %"), 0u) << whole[0];
}

TEST(AtlasFiles, MaskedViewsComeBackAsSuch) {
    const TemporaryFolder folder;
    Atlas atlas = smallAtlas(3, 16, false, false);
    for (ReferenceView& view : atlas.views) view.noDepth = NoDepth::unknown;
    atlas.views[0].masked = true;
    atlas.views[1].masked = false;
    for (const char* name : {"set", "a.exr"}) {
        const Atlas back = writtenAndRead(atlas, folder / name);
        ASSERT_EQ(back.views.size(), 3u);
        EXPECT_EQ(back.views[0].masked, std::optional(true)) << name;
        EXPECT_EQ(back.views[1].masked, std::optional(false)) << name;
        EXPECT_FALSE(back.views[2].masked.has_value()) << name;
    }
}

TEST(AtlasFiles, AnAtlasReplacesAnAtlasOnly) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(3, 32, true, false), folder / "set");
    writtenAndRead(smallAtlas(3, 16, false, false, 2), folder / "set");
    EXPECT_EQ(namesIn(folder / "set"),
              (std::set<std::string>{"atlas.json", "colour.png", "depth.png", "colour_1.png",
                                     "depth_1.png"}));
    put(folder / "set/notes.txt", "mine");
    Job job;
    EXPECT_FALSE(writeAtlas(smallAtlas(3, 16, false, false), folder / "set", job));
    EXPECT_EQ(get(folder / "set/notes.txt"), "mine");
    EXPECT_FALSE(writeAtlas(smallAtlas(3, 16, false, false), folder / "set", job,
                            {.output = {.noClobber = true}}));
}

TEST(AtlasFiles, NamesStayInsideTheFolder) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(2, 16, false, false), folder / "set");
    fs::copy_file(folder / "set/colour.png", folder / "secret.png");
    const std::string json = get(folder / "set/atlas.json");
    const auto withName = [&](const std::string& name) {
        std::string changed = json;
        changed.replace(changed.find("colour.png"), 10, name);
        put(folder / "set/atlas.json", changed);
        Job job;
        return readAtlas(folder / "set", job);
    };
    EXPECT_TRUE(withName("colour.png"));
    for (const std::string& name : {std::string("../secret.png"), (folder / "secret.png").string(),
                                    std::string("link.png")}) {
        fs::remove(folder / "set/link.png");
        fs::create_symlink("../secret.png", folder / "set/link.png");
        const auto atlas = withName(name);
        ASSERT_FALSE(atlas) << name;
        EXPECT_EQ(atlas.error().code, ErrorCode::invalidInput);
    }
}

TEST(AtlasFiles, ErrorsNameThePlaceInTheDocument) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(2, 16, true, false), folder / "set");
    const std::string json = get(folder / "set/atlas.json");
    const auto errorOf = [&](const std::string& from, const std::string& to) {
        std::string changed = json;
        const auto at = changed.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        changed.replace(at, from.size(), to);
        const auto header = atlasFromJson(changed, "'a'", Limits());
        return header ? std::string("no error") : header.error().text();
    };
    EXPECT_EQ(errorOf("\"nearPlane\":", "\"nearPlane\":-1,\"x\":"),
              "'a': views[0].nearPlane is -1; 0 to 1e+300 is possible");
    EXPECT_EQ(errorOf("\"fx\":", "\"fx\":\"a\",\"x\":"), "'a': views[0].fx must be a number");
    EXPECT_EQ(errorOf("\"turned\":false", "\"turned\":0"),
              "'a': rectangles[0].turned must be true or false");
    EXPECT_EQ(errorOf("\"viewX\":0", "\"viewX\":0.5"),
              "'a': rectangles[0].viewX must be a whole number");
    EXPECT_EQ(errorOf("\"pages\": 1", "\"pages\": 3"), "'a': pages is 3; 1 to 2 is possible");
    EXPECT_EQ(errorOf("\"version\": 2", "\"version\": 4"),
              "'a': it was written by a newer stx (version 4; this one knows 1 to 3)");
    EXPECT_EQ(errorOf("{", "{,"), "'a': it is not valid JSON at byte 2");
    EXPECT_EQ(atlasFromJson(std::string(100000, '['), "'a'", Limits()).error().text(),
              "'a': the JSON is nested more than 16 deep at byte 16");
    EXPECT_FALSE(atlasFromJson("[]", "'a'", Limits()));
    EXPECT_FALSE(atlasFromJson("", "'a'", Limits()));
}

TEST(AtlasFiles, ManyFlipsEndCleanly) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(3, 16, true, false), folder / "set");
    const std::string json = get(folder / "set/atlas.json");
    std::mt19937 random(11);
    const char* pieces[] = {"-1", "1e9", "99999999999999999999", "null", "\"", "[", "}", "0"};
    for (int i = 0; i < 300; ++i) {
        std::string changed = json;
        changed.replace(random() % changed.size(), random() % 4, pieces[random() % 8]);
        put(folder / "set/atlas.json", changed);
        Job job;
        (void)readAtlas(folder / "set", job);
    }
}

TEST(AtlasFiles, WrongImagesAreErrors) {
    const TemporaryFolder folder;
    writtenAndRead(smallAtlas(2, 16, true, false), folder / "set");
    fs::copy_file(folder / "set/normal.png", folder / "set/depth.png",
                  fs::copy_options::overwrite_existing);
    Job job;
    const auto atlas = readAtlas(folder / "set", job);
    ASSERT_FALSE(atlas);
    EXPECT_NE(atlas.error().message.find("atlas.json says"), std::string::npos);
    fs::remove(folder / "set/depth.png");
    EXPECT_EQ(readAtlas(folder / "set", job).error().code, ErrorCode::io);
}

TEST(AtlasSchema, HoldsForWhatIsWritten) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(writeAtlas(smallAtlas(3, 16, true, false), folder / "v2", job));
    ASSERT_TRUE(writeAtlas(smallAtlas(3, 8, false, true, 2), folder / "linear", job));
    // The newest version is that of atlases with objects, others stay at version 2.
    Atlas sheet = smallAtlas(3, 16, true, false);
    sheet.objects.resize(2);
    sheet.objects[0].name = "jug";
    sheet.objects[0].views = 1;
    sheet.objects[1].name = "cup";
    sheet.objects[1].firstView = 1;
    sheet.objects[1].views = 2;
    sheet.views[0].noDepth = NoDepth::unknown;
    sheet.views[0].masked = true;
    ASSERT_TRUE(writeAtlas(sheet, folder / "sheet", job));
    const std::string schema = STX_SOURCE_DIR "/formats/atlas/atlas.schema.json";
    const std::string script =
        "import json,sys,jsonschema\n"
        "s=json.load(open(sys.argv[1]))\n"
        "named=[json.load(open(f))['$schema'] for f in sys.argv[2:]]\n"
        "assert s['$id']==named[0]\n"
        "assert named[1:]==['urn:stx:schema:atlas:2']*2\n"
        "for f in sys.argv[2:]: jsonschema.validate(json.load(open(f)),s)\n";
    put(folder / "check.py", script);
    if (std::system("python3 -c 'import jsonschema' 2>/dev/null") != 0)
        GTEST_SKIP() << "python3-jsonschema is not installed";
    const std::string command = "python3 " + (folder / "check.py").string() + " " + schema + " " +
                                (folder / "sheet/atlas.json").string() + " " +
                                (folder / "v2/atlas.json").string() + " " +
                                (folder / "linear/atlas.json").string();
    EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace stx
