#include <cstdlib>
#include <fstream>

#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/media_files.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/same_scenes.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

namespace fs = std::filesystem;

Bundle twoViews() {
    Bundle bundle;
    bundle.title = "files";
    bundle.views = {makeView(13, 9, 16, 1), makeView(8, 8, 8, 2)};
    addVectors(bundle.views[1]);
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

void mustWrite(const Result<void>& result) {
    ASSERT_TRUE(result) << result.error().text();
}

TEST(Mpeg4Files, ABundleIsTheSameFromEveryContainer) {
    const TemporaryFolder folder("containers");
    const Bundle bundle = twoViews();
    Job job;
    std::vector<Bundle> read;
    for (const char* name : {"a.mp4", "a.bt", "a.xmt"}) {
        mustWrite(writeMpeg4Views(*viewsOf(bundle), folder / name, job));
        auto back = readMpeg4Bundle(folder / name, job);
        ASSERT_TRUE(back) << name << ": " << back.error().text();
        read.push_back(std::move(*back));
    }
    for (const Bundle& back : read) {
        ASSERT_EQ(back.views.size(), 2u);
        EXPECT_EQ(back.title, "files");
        EXPECT_EQ(back.bounds, bundle.bounds);
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(back.views[i].camera, read[0].views[i].camera);
            EXPECT_EQ(back.views[i].depth, bundle.views[i].depth);
            EXPECT_EQ(back.views[i].texture, bundle.views[i].texture);
            EXPECT_EQ(back.views[i].name, bundle.views[i].name);
            EXPECT_EQ(back.views[i].normal, read[0].views[i].normal);
        }
    }
    EXPECT_TRUE(fs::exists(folder / "a_images" / "view1_texture.png"));
}

/// Readers of names in texts know `%d`, `FILE.mp4#TRACK` and URLs.
TEST(Mpeg4Files, TextsOfAnyNameAreReadBack) {
    const TemporaryFolder folder("stems");
    Job job;
    for (const std::string stem : {"100%done", "50%", "a#1", "run1:take2", "q\"<&>'", "b\\s",
                                   "e=23", "nl\n\x01", "\xc3\xbc", "\xff"})
        for (const char* ending : {".bt", ".xmt"}) {
            const auto path = folder / (stem + ending);
            mustWrite(writeMpeg4Views(*viewsOf(twoViews()), path, job));
            const auto back = readMpeg4Bundle(path, job);
            EXPECT_TRUE(back) << back.error().text();
            fs::remove_all(folder / mediaFolderName(path));
        }
}

TEST(Mpeg4Files, FoldersOfImagesDifferWhereTextsDo) {
    EXPECT_EQ(mediaFolderName("c/a.v2.bt"), "a.v2_images_bt");
    EXPECT_EQ(mediaFolderName("t=0.5 \xc3\xbc.bt"), "t=0.5 \xc3\xbc_images_bt");
    EXPECT_EQ(mediaFolderName("a#1.bt"), "a=231_images_bt");
    EXPECT_EQ(mediaFolderName("a=231.bt"), "a=3D231_images_bt");
    EXPECT_EQ(mediaFolderName("50%.bt"), "50=25_images_bt");
    EXPECT_EQ(mediaFolderName("a:\n\xff.bt"), "a=3A=0A=FF_images_bt");
    // Two texts of one name, and names that end like another's folder.
    EXPECT_EQ(mediaFolderName("a.xmt"), "a_images");
    EXPECT_EQ(mediaFolderName("a.XMT"), "a_images");
    EXPECT_EQ(mediaFolderName("a.xmta"), "a_images_xmta");
    EXPECT_EQ(mediaFolderName("a_images_bt.xmt"), "a_images_bt_images");
}

TEST(Mpeg4Files, Mp4ThroughATextIsTheSameFile) {
    const TemporaryFolder folder("roundtrip");
    Job job;
    mustWrite(writeMpeg4Views(*viewsOf(twoViews()), folder / "a.mp4", job));
    const Bytes original = bytesOfFile(folder / "a.mp4");
    for (const char* name : {"b.bt", "c.xmt"}) {
        auto document = readMpeg4(folder / "a.mp4", job);
        ASSERT_TRUE(document) << document.error().text();
        mustWrite(writeMpeg4(*document, folder / name, job));
        auto text = readMpeg4(folder / name, job);
        ASSERT_TRUE(text) << text.error().text();
        mustWrite(writeMpeg4(*text, folder / "d.mp4", job));
        EXPECT_EQ(bytesOfFile(folder / "d.mp4"), original) << name;
    }
}

TEST(Mpeg4Files, ImagesOfAnMp4AreNamedByWhatTheyAreFor) {
    const TemporaryFolder folder("names");
    Job job;
    mustWrite(writeMpeg4Views(*viewsOf(twoViews()), folder / "a.mp4", job));
    const auto document = readMpeg4(folder / "a.mp4", job);
    ASSERT_TRUE(document) << document.error().text();
    EXPECT_EQ(mediaFileNames(*document),
              (std::vector<std::string>{"view1_texture.png", "view1_depth.png", "view2_texture.png",
                                        "view2_depth.png", "view2_normal.png", "view2_splatU.png",
                                        "view2_splatV.png"}));
}

TEST(Mpeg4Files, StreamsOfSeveralPicturesSurviveTheTexts) {
    const TemporaryFolder folder("movie");
    Job job;
    Bundle bundle;
    bundle.views = {makeView(8, 6, 8, 1)};
    auto scene = sceneFromBundle(bundle, {}, job);
    ASSERT_TRUE(scene);
    auto& ods = std::get<UpdateObjectDescriptors>(scene->odFrames[0].commands[0]).descriptors;
    ElementaryStream& stream = ods[0].streams[0];
    stream.timescale = 90000;
    const Sample first = stream.samples[0];
    stream.samples.clear();
    for (int i = 0; i < 3; ++i) {
        Sample sample = first;
        sample.time = 3000ull * static_cast<unsigned>(i);
        sample.duration = 3000;
        stream.samples.push_back(sample);
    }
    const auto straight = writeMp4(*scene, job);
    ASSERT_TRUE(straight) << straight.error().text();
    for (const char* name : {"a.bt", "a.xmt"}) {
        mustWrite(writeMpeg4(*scene, folder / name, job));
        // Named as other programs name a track, too.
        const Bytes text = bytesOfFile(folder / name);
        EXPECT_NE(std::string_view(reinterpret_cast<const char*>(text.data()), text.size())
                      .find(mediaFolderName(name) + "/view1_texture.mp4#1\""),
                  std::string_view::npos);
        EXPECT_TRUE(fs::exists(folder / mediaFolderName(name) / "view1_texture.mp4"));
        const auto back = readMpeg4(folder / name, job);
        ASSERT_TRUE(back) << back.error().text();
        const auto& again = back->findObjectDescriptor(ods[0].id)->streams.at(0);
        ASSERT_EQ(again.samples.size(), 3u);
        EXPECT_EQ(again.samples[2].time, 6000u);
        EXPECT_EQ(again.samples[2].duration, 3000u);
        const auto bytes = writeMp4(*back, job);
        ASSERT_TRUE(bytes) << bytes.error().text();
        EXPECT_EQ(*bytes, *straight);
    }
    // Times that a rate cannot say go into a track of their own.
    stream.samples[1].duration = 3001;
    stream.samples[2].time = 6001;
    mustWrite(writeMpeg4(*scene, folder / "b.bt", job));
    EXPECT_TRUE(fs::exists(folder / "b_images_bt" / "view1_texture.mp4"));
    const auto back = readMpeg4(folder / "b.bt", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(back->findObjectDescriptor(ods[0].id)->streams.at(0).samples.at(2).time, 6001u);
}

/// Another program's dump names the file as it was seen from where the program ran.
TEST(Mpeg4Files, TracksAreFoundBesideTheTextWhereTheirPathIsNone) {
    const TemporaryFolder folder("dump");
    Job job;
    mustWrite(writeMpeg4(sceneOf(twoViews()), folder / "a.mp4", job));
    const auto direct = readMpeg4Bundle(folder / "a.mp4", job);
    ASSERT_TRUE(direct) << direct.error().text();
    auto document = readMpeg4(folder / "a.mp4", job);
    ASSERT_TRUE(document);
    std::size_t files = 0;
    for (OdFrame& frame : document->odFrames)
        for (ObjectDescriptor& od :
             std::get<UpdateObjectDescriptors>(frame.commands.at(0)).descriptors)
            for (ElementaryStream& stream : od.streams) {
                const char* where = files++ % 2 == 0 ? "elsewhere/run/" : "C:\\run\\";
                stream.fileName = fmt::format("{}a.mp4#{}", where, stream.esId);
            }
    ASSERT_GE(files, 4u);
    const auto text = writeBt(*document, job);
    ASSERT_TRUE(text) << text.error().text();
    ASSERT_TRUE(writeFile(folder / "dump.bt", std::as_bytes(std::span(*text))));
    const auto dumped = readMpeg4Bundle(folder / "dump.bt", job);
    ASSERT_TRUE(dumped) << dumped.error().text();
    ASSERT_EQ(dumped->views.size(), direct->views.size());
    for (std::size_t i = 0; i < dumped->views.size(); ++i) {
        EXPECT_EQ(dumped->views[i].depth, direct->views[i].depth);
        EXPECT_EQ(dumped->views[i].texture, direct->views[i].texture);
    }
}

/// Dumps of the reference files, each beside its .mp4.
TEST(Mpeg4Files, DumpsOfAnotherProgramAreReadBesideTheirFile) {
    REQUIRE_SHARED(reference, "reference");
    for (const char* name : {"01_depthimage_simpletexture", "08_use_names", "14_movietexture"}) {
        SCOPED_TRACE(name);
        const TemporaryFolder folder("reference_dump");
        const std::string bt = std::string(name) + ".bt", mp4 = std::string(name) + ".mp4";
        fs::copy_file(reference / "dumps/v26.02.0" / bt, folder / bt);
        fs::copy_file(reference / "mp4" / mp4, folder / mp4);
        Job job;
        const auto direct = readMpeg4Bundle(folder / mp4, job);
        const auto dumped = readMpeg4Bundle(folder / bt, job);
        ASSERT_TRUE(direct) << direct.error().text();
        ASSERT_TRUE(dumped) << dumped.error().text();
        ASSERT_EQ(dumped->views.size(), direct->views.size());
        for (std::size_t i = 0; i < dumped->views.size(); ++i)
            EXPECT_EQ(dumped->views[i].depth, direct->views[i].depth);
    }
}

/// A reader may take a disabled track as absent, and plays one of an alternate group only (ISO/IEC
/// 14496-12, 8.3.2): a scene needs all of its pictures. Players that know no scenes take every
/// track in the movie for a video, which only colour is.
TEST(Mpeg4Files, AllTracksOfAnOwnSceneAreEnabledAndColourAloneIsInTheMovie) {
    const TemporaryFolder folder("enabled");
    Job job;
    Bundle bundle = twoViews();
    Environment environment;
    environment.pictures.assign(6, Texture(Rgba8Image(8, 8, glm::u8vec4(40, 50, 60, 255))));
    bundle.environment = std::make_shared<const Environment>(environment);
    const Document scene = sceneOf(bundle);
    mustWrite(writeMpeg4(scene, folder / "a.mp4", job));
    const Bytes bytes = bytesOfFile(folder / "a.mp4");
    const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    int inMovie = 0, others = 0;
    for (std::size_t at = file.find("tkhd"); at != std::string_view::npos;
         at = file.find("tkhd", at + 1)) {
        const std::string_view tail = file.substr(file.find("hdlr", at) + 28);
        const std::string_view name = tail.substr(0, tail.find('\0'));
        const int flags = file[at + 7], group = file[at + 4 + 4 + 20 + 8 + 3];
        EXPECT_EQ(group, 0) << name;
        const bool colour = name.ends_with(" texture");
        EXPECT_EQ(flags, colour ? 7 : 1) << name;
        ++(colour ? inMovie : others);
    }
    EXPECT_EQ(inMovie, 2);
    EXPECT_EQ(others, 2 + 5 + 6) << "scene and descriptors, depth and vectors, Background";
    // Files of before had 6 for the others, and one group: they are read as ever.
    Bytes before = bytes;
    for (std::size_t at = file.find("tkhd"); at != std::string_view::npos;
         at = file.find("tkhd", at + 1)) {
        if (before[at + 7] == std::byte{1}) before[at + 7] = std::byte{6};
        before[at + 4 + 4 + 20 + 8 + 3] = std::byte{1};
    }
    mustWrite(writeFile(folder / "before.mp4", before));
    const auto now = readMpeg4Bundle(folder / "a.mp4", job);
    const auto old = readMpeg4Bundle(folder / "before.mp4", job);
    ASSERT_TRUE(now && old);
    ASSERT_EQ(old->views.size(), now->views.size());
    for (std::size_t i = 0; i < old->views.size(); ++i)
        EXPECT_EQ(old->views[i].depth, now->views[i].depth);
    EXPECT_EQ(old->environment->pictureCount(), 6);
    // Through a text the same; a scene of others stays as it is.
    mustWrite(writeMpeg4(scene, folder / "a.bt", job));
    const auto text = readMpeg4(folder / "a.bt", job);
    ASSERT_TRUE(text);
    mustWrite(writeMpeg4(*text, folder / "b.mp4", job));
    EXPECT_EQ(bytesOfFile(folder / "b.mp4"), bytes);
    Document foreign = scene;
    for (CommandFrame& frame : foreign.frames)
        for (Command& command : frame.commands)
            forEachNode(command, [](const NodePtr& node) {
                if (node->is("WorldInfo")) node->set("info", std::vector<std::string>());
            });
    mustWrite(writeMpeg4(foreign, folder / "c.mp4", job));
    const auto plain = writeMp4(foreign, job);
    ASSERT_TRUE(plain);
    EXPECT_EQ(bytesOfFile(folder / "c.mp4"), *plain);
}

TEST(Mpeg4Files, NothingIsReplacedWithNoClobber) {
    Job job;
    const auto document = sceneOf(twoViews());
    const TemporaryFolder folder("clobber");
    mustWrite(writeMpeg4(document, folder / "a.xmt", job));
    Mpeg4WriteOptions options;
    options.output.noClobber = true;
    EXPECT_FALSE(writeMpeg4(document, folder / "a.xmt", job, options));
    fs::remove(folder / "a.xmt");
    EXPECT_FALSE(writeMpeg4(document, folder / "a.xmt", job, options))
        << "the folder of images is there";
    EXPECT_FALSE(fs::exists(folder / "a.xmt"));
}

TEST(Mpeg4Files, WritingTwiceReplacesTextAndImages) {
    const TemporaryFolder folder("twice");
    Job job;
    Bundle bundle = twoViews();
    mustWrite(writeMpeg4Views(*viewsOf(bundle), folder / "a.bt", job));
    bundle.views.pop_back();
    bundle.views[0].name = "other";
    mustWrite(writeMpeg4Views(*viewsOf(bundle), folder / "a.bt", job));
    EXPECT_FALSE(fs::exists(folder / "a_images_bt" / "view2_texture.png"));
    EXPECT_TRUE(fs::exists(folder / "a_images_bt" / "other_texture.png"));
    // A stranger's file in that folder is not an image of ours.
    std::ofstream(folder / "a_images_bt" / "letter.txt") << "dear";
    const auto refused = writeMpeg4Views(*viewsOf(bundle), folder / "a.bt", job);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("letter.txt"), std::string::npos);
    EXPECT_TRUE(fs::exists(folder / "a_images_bt" / "letter.txt"));
}

TEST(Mpeg4Files, ImageNamesStayInsideTheFolder) {
    const TemporaryFolder folder("inside");
    Job job;
    fs::create_directories(folder / "sub");
    const auto write = [&](const std::string& name) {
        std::ofstream(folder / "sub" / "a.bt")
            << "Group { children [ DepthImage { diTexture SimpleTexture { texture ImageTexture { "
               "url [od:5] } } } ] }\n"
               "AT 0 { UPDATE OD [ ObjectDescriptor { objectDescriptorID 5 esDescr [ ES_Descriptor "
               "{ muxInfo MuxInfo "
               "{ fileName \""
            << name << "\" } } ] } ] }";
    };
    std::ofstream(folder / "secret.png") << "x";
    std::error_code error;
    fs::create_symlink("../secret.png", folder / "sub" / "link.png", error);
    for (const std::string& name :
         {std::string("../secret.png"), (folder / "secret.png").string(),
          std::string("http://example.com/a.png"), std::string("link.png")}) {
        write(name);
        const auto document = readMpeg4(folder / "sub" / "a.bt", job);
        ASSERT_FALSE(document) << name;
        EXPECT_EQ(document.error().code, ErrorCode::invalidInput) << document.error().text();
    }
    write("missing.png");
    EXPECT_EQ(readMpeg4(folder / "sub" / "a.bt", job).error().code, ErrorCode::io);
}

TEST(Mpeg4Files, EndingsAreChecked) {
    const TemporaryFolder folder("endings");
    Job job;
    const auto refused = writeMpeg4Views(*viewsOf(twoViews()), folder / "a.avi", job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    std::ofstream(folder / "x.dat") << "nothing";
    EXPECT_FALSE(readMpeg4(folder / "x.dat", job));
}

class ReferenceMp4 : public testing::TestWithParam<const char*> {};

TEST_P(ReferenceMp4, IsTheSceneOfItsBtAndSurvivesTheTexts) {
    REQUIRE_SHARED(reference, "reference");
    const std::string name = GetParam();
    Job job;
    job.limits.allowOutside = true;  // its images are in ../images
    const auto mp4 = readMpeg4(reference / "mp4" / (name + ".mp4"), job);
    ASSERT_TRUE(mp4) << mp4.error().text();
    const auto bt = readMpeg4(name == "xmt_01_depthimage_simpletexture"
                                  ? reference / "xmt" / "01_depthimage_simpletexture.xmt"
                                  : reference / "bt" / (name + ".bt"),
                              job);
    ASSERT_TRUE(bt) << bt.error().text();
    const bool rounded = name == "10_quantized" || name == "11_efficient_float";
    if (!rounded) {
        ASSERT_EQ(mp4->frames.size(), bt->frames.size());
        for (std::size_t i = 0; i < bt->frames.size(); ++i) {
            EXPECT_EQ(mp4->frames[i].time, bt->frames[i].time);
            EXPECT_TRUE(
                sameFrames({mp4->frames[i]}, {bt->frames[i]}, {.ids = false, .names = false}))
                << i;
        }
    }
    const auto ods = mp4->objectDescriptors();
    ASSERT_EQ(ods.size(), bt->objectDescriptors().size());
    for (const ObjectDescriptor* od : ods) {
        const ObjectDescriptor* other = bt->findObjectDescriptor(od->id);
        ASSERT_TRUE(other);
        EXPECT_EQ(*od->streams.at(0).samples.at(0).data.load(Limits()),
                  *other->streams.at(0).samples.at(0).data.load(Limits()));
    }

    // What we write of it is the same, straight and through each text.
    const TemporaryFolder folder("reference");
    const auto straight = writeMp4(*mp4, job);
    ASSERT_TRUE(straight) << straight.error().text();
    for (const char* text : {"a.bt", "a.xmt"}) {
        mustWrite(writeMpeg4(*mp4, folder / text, job));
        const auto back = readMpeg4(folder / text, job);
        ASSERT_TRUE(back) << back.error().text();
        const auto bytes = writeMp4(*back, job);
        ASSERT_TRUE(bytes) << bytes.error().text();
        EXPECT_EQ(*bytes, *straight) << text;
    }
}

INSTANTIATE_TEST_SUITE_P(All, ReferenceMp4,
                         testing::Values("01_depthimage_simpletexture", "02_all_defaults",
                                         "03_v2_nodes", "04_pointtexture", "05_octreeimage",
                                         "06_multiview_transform_hierarchy", "07_url_strings",
                                         "08_use_names", "09_routes", "10_quantized",
                                         "11_efficient_float", "12_ordered_group_root",
                                         "14_movietexture", "15_bifs_v2_config", "16_commands",
                                         "17_background", "18_long_mf_vector", "19_png16_rgba",
                                         "20_minimal", "xmt_01_depthimage_simpletexture"),
                         [](const auto& param) { return std::string(param.param); });

TEST(ReferenceBundles, ReadAsTheirTextsSay) {
    REQUIRE_SHARED(reference, "reference/mp4");
    Job job;
    const auto one = readMpeg4Bundle(reference / "01_depthimage_simpletexture.mp4", job);
    ASSERT_TRUE(one) << one.error().text();
    ASSERT_EQ(one->views.size(), 1u);
    EXPECT_EQ(one->title, "DIBR simple");
    const ReferenceView& view = one->views[0];
    EXPECT_EQ(view.camera.width, 16);
    EXPECT_EQ(view.camera.height, 12);
    EXPECT_FALSE(view.camera.orthographic);
    EXPECT_NEAR(view.camera.fieldOfView().x, 0.6, 1e-6);
    const glm::dvec3 expected =
        quatFromAxisAngle({0, 1, 0, 0.5}) * glm::dvec3(0.5, 0.25, 12) + glm::dvec3(1, 2, 3);
    EXPECT_LT(glm::length(view.camera.position - expected), 1e-5);
    EXPECT_GT(view.pointCount(), 0);

    const auto rgba = readMpeg4Bundle(reference / "19_png16_rgba.mp4", job);
    ASSERT_TRUE(rgba) << rgba.error().text();
    EXPECT_EQ(rgba->views[0].depthBits, 16);

    const auto octree = readMpeg4Bundle(reference / "05_octreeimage.mp4", job);
    ASSERT_TRUE(octree) << octree.error().text();
    EXPECT_EQ(octree->views.size(), 2u);
    EXPECT_GT(octree->pointCount(), 0);

    const auto uneven = readMpeg4Bundle(reference / "06_multiview_transform_hierarchy.mp4", job);
    ASSERT_FALSE(uneven);
    EXPECT_NE(uneven.error().text().find("only one scale for all axes"), std::string::npos)
        << uneven.error().text();
}

}  // namespace
}  // namespace stx::mpeg4
