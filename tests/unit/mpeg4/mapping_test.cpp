#include "formats/mpeg4/mapping/mapping.hpp"

#include <algorithm>
#include <functional>
#include <random>

#include "formats/mpeg4/mapping/octree.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/scene/placement.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

TEST(Mapping, ABundleComesBackWithItsDepthCodes) {
    for (const int bits : {8, 16}) {
        Bundle bundle;
        bundle.title = "two views";
        bundle.views = {makeView(13, 9, bits, 1), makeView(8, 8, bits, 2)};
        bundle.views[1].camera =
            Camera::fromFieldOfView({0, 0, 5}, {1, 0, 0, 0}, {2.0, 1.0}, true, 8, 8);
        bundle.bounds = bundle.computeBounds();
        const Bundle back = bundleOf(sceneOf(bundle));
        ASSERT_EQ(back.views.size(), 2u);
        EXPECT_EQ(back.title, "two views");
        EXPECT_EQ(back.bounds, bundle.bounds);
        EXPECT_STREQ(back.nodeKind(), "SimpleTexture");
        for (std::size_t i = 0; i < 2; ++i) {
            expectSameCamera(back.views[i].camera, bundle.views[i].camera);
            EXPECT_EQ(back.views[i].name, bundle.views[i].name);
            EXPECT_EQ(back.views[i].depthBits, bits);
            EXPECT_EQ(back.views[i].nearPlane, bundle.views[i].nearPlane);
            EXPECT_EQ(back.views[i].depth, bundle.views[i].depth) << "depth codes are exact";
            EXPECT_EQ(back.views[i].texture, bundle.views[i].texture);
        }
        // And once more: what a file can hold does not change any further.
        const Bundle again = bundleOf(sceneOf(back));
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(again.views[i].camera, back.views[i].camera);
            EXPECT_EQ(again.views[i].depth, back.views[i].depth);
        }
    }
}

TEST(Mapping, FieldsThatAreTrapsAreAlwaysWritten) {
    Bundle bundle;
    bundle.views = {makeView(4, 4, 16)};
    for (const bool v2 : {false, true}) {
        SceneWriteOptions options;
        options.nodes = v2 ? SceneWriteOptions::Nodes::v2 : SceneWriteOptions::Nodes::v1;
        const Document document = sceneOf(bundle, options);
        const auto& scene = std::get<ReplaceScene>(document.frames[0].commands[0]);
        const NodePtr node = scene.root->get<NodeList>("children").at(1);
        EXPECT_TRUE(node->isSet("orthographic"));
        EXPECT_TRUE(node->isSet("fieldOfView"));
        EXPECT_EQ(node->is("DepthImageV2"), v2);
        const int splatMinMax = node->info->find("splatMinMax");
        EXPECT_EQ(v2, splatMinMax >= 0 && node->isSet(splatMinMax));
    }
}

TEST(Mapping, SoftCoverageSurvivesInPngAndIsSaidToBeLostInJpeg) {
    Bundle bundle;
    bundle.views = {makeView(16, 16, 16)};
    bundle.views[0].texture.rgba8()->at(3, 3).a = 100;
    EXPECT_EQ(bundleOf(sceneOf(bundle)).views[0].texture, bundle.views[0].texture);
    SceneWriteOptions options;
    options.texture = SceneWriteOptions::Texture::jpeg;
    Job job;
    const auto document = sceneFromBundle(bundle, options, job);
    ASSERT_TRUE(document);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[1].find("coverage"), std::string::npos) << notes[1];
    const Bundle back = bundleOf(*document);
    EXPECT_EQ(back.views[0].depth, bundle.views[0].depth) << "depth stays lossless";
    EXPECT_EQ(back.views[0].texture.rgba8()->at(3, 3).a, 255);
    EXPECT_EQ(back.views[0].texture.rgba8()->at(0, 0).a, 0) << "no point, no coverage";
}

TEST(Mapping, FloatDepthBecomes16BitsAndTheErrorIsSaid) {
    Bundle bundle;
    bundle.views = {makeView(16, 16, 32)};
    float& d = bundle.views[0].depth.at(1, 1);
    d = 3.00007f;
    Job job;
    const auto document = sceneFromBundle(bundle, {}, job);
    ASSERT_TRUE(document) << document.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("rounded to 16 bits: at most"), std::string::npos);
    const Bundle back = bundleOf(*document);
    EXPECT_EQ(back.views[0].depthBits, 16);
    EXPECT_NEAR(back.views[0].depth.at(1, 1), d, 10.5 / 65534 / 2 * 1.01);
    EXPECT_NE(back.views[0].depth.at(1, 1), d);
}

TEST(Mapping, NormalsAndSplatsComeBack) {
    Bundle bundle;
    bundle.views = {makeView(12, 10, 16)};
    addVectors(bundle.views[0]);
    bundle.views[0].normal.at(1, 0) = glm::vec3(0);  // a point without a normal
    for (const int bits : {8, 16}) {
        SceneWriteOptions options;
        options.normalBits = bits;
        const Document document = sceneOf(bundle, options);
        const Bundle back = bundleOf(document);
        EXPECT_STREQ(back.nodeKind(), "SimpleTextureV2");
        const float tolerance = bits == 8 ? 0.008f : 4e-5f;
        const ReferenceView& a = bundle.views[0];
        const ReferenceView& b = back.views[0];
        ASSERT_EQ(b.normal.size(), a.normal.size());
        ASSERT_EQ(b.splatU.size(), a.splatU.size());
        const float longest = std::max(largestComponent(a.splatU), largestComponent(a.splatV));
        for (std::size_t i = 0; i < a.normal.count(); ++i) {
            EXPECT_LT(glm::length(a.normal.pixels()[i] - b.normal.pixels()[i]), tolerance) << i;
            EXPECT_LT(glm::length(a.splatU.pixels()[i] - b.splatU.pixels()[i]), tolerance * longest)
                << i;
            EXPECT_LT(glm::length(a.splatV.pixels()[i] - b.splatV.pixels()[i]), tolerance * longest)
                << i;
        }
        EXPECT_EQ(b.normal.at(1, 0), glm::vec3(0));
    }
    SceneWriteOptions options;
    options.nodes = SceneWriteOptions::Nodes::v1;
    Job job;
    ASSERT_TRUE(sceneFromBundle(bundle, options, job));
    EXPECT_NE(job.takeNotes().at(0).find("left out"), std::string::npos);
}

TEST(Mapping, SplatsThatTheirCodesAreTooCoarseForAreSaid) {
    Bundle bundle;
    bundle.views = {makeView(12, 10, 16)};
    addVectors(bundle.views[0]);  // half axes of about 0.02
    const std::string coarse =
        "splat axes of a view are coded in steps of more than 1 % of their median: its codes reach "
        "to the longest axis; .exr keeps them exactly";
    const auto isSaid = [&] {
        Job job;
        EXPECT_TRUE(sceneFromBundle(bundle, {}, job));
        return std::ranges::count(job.takeNotes(), coarse) > 0;
    };
    EXPECT_FALSE(isSaid());
    const auto depth = bundle.views[0].depth.pixels();
    const auto point = std::ranges::find_if(depth, hasPoint) - depth.begin();
    bundle.views[0].splatU.pixels()[static_cast<std::size_t>(point)] = {0, 50, 0};
    EXPECT_TRUE(isSaid());
}

TEST(Mapping, SplatMinMaxOfPositiveRangeScalesLengths) {
    DecodedImage image;
    image.width = 1;
    image.height = 1;
    image.channels = 3;
    image.values = std::vector<std::uint8_t>{255, 128, 128};
    const Image<float> depth(1, 1, 1.0f);
    const auto u = splatsFromImage(image, {0.25f, 0.75f}, depth);
    ASSERT_TRUE(u);
    EXPECT_NEAR(u->at(0, 0).x, 0.75f, 1e-4f);
    EXPECT_NEAR(u->at(0, 0).y, 0.0f, 0.005f);
    const auto s = splatsFromImage(image, {-0.5f, 0.5f}, depth);
    EXPECT_NEAR(s->at(0, 0).x, 0.5f, 1e-6f);
    EXPECT_NEAR(s->at(0, 0).y, 0.5f * (2 * 128 / 255.0f - 1), 1e-6f);
}

TEST(Mapping, OffCentreCamerasArePaddedAndComeBack) {
    Bundle bundle;
    bundle.views = {makeView(20, 16, 16, 1), makeView(20, 16, 16, 2), makeView(20, 16, 16, 3)};
    bundle.views[0].camera.cx = 12.3;  // 4.6 pixels to the right of... the centre is at 10
    bundle.views[0].camera.cy = 6.9;
    bundle.views[1].camera.cx = 9.5;  // half a pixel: one pixel of padding, no rest
    Camera& parallel = bundle.views[2].camera;
    parallel =
        Camera::fromFieldOfView(parallel.position, parallel.orientation, {4, 3}, true, 20, 16);
    parallel.cx = 3.25;
    Job job;
    const auto document = sceneFromBundle(bundle, {}, job);
    ASSERT_TRUE(document) << document.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("padded by 0 2 5 0 pixels"), std::string::npos) << notes[0];
    EXPECT_NE(notes[0].find("the rest of 0.224 pixels"), std::string::npos) << notes[0];
    EXPECT_NE(notes[1].find("padded by 1 0 0 0 pixels"), std::string::npos) << notes[1];

    const Bundle back = bundleOf(*document);
    for (std::size_t i = 0; i < 2; ++i) {
        expectSameCamera(back.views[i].camera, bundle.views[i].camera);
        EXPECT_EQ(back.views[i].depth, bundle.views[i].depth);
        EXPECT_EQ(back.views[i].texture, bundle.views[i].texture);
    }
    // Orthographic: the same rays, though the viewpoint has moved.
    const Camera& moved = back.views[2].camera;
    const glm::dvec3 a = bundle.views[2].worldPoint(7, 4), b = back.views[2].worldPoint(7, 4);
    EXPECT_LT(glm::length(a - b), 1e-5);
    EXPECT_TRUE(moved.centred());

    // A reader that does not know our notes sees the padded image: points keep their places to the
    // rest of a pixel.
    Document plain = *document;
    auto& scene = std::get<ReplaceScene>(plain.frames[0].commands[0]);
    scene.root->get<NodeList>("children")[0]->set("info", std::vector<std::string>());
    const Bundle wide = bundleOf(plain);
    EXPECT_EQ(wide.views[0].camera.width, 25);
    EXPECT_EQ(wide.views[0].camera.height, 18);
    EXPECT_EQ(wide.views[0].pointCount(), bundle.views[0].pointCount());
    const glm::dvec3 before = bundle.views[0].worldPoint(6, 3),
                     after = wide.views[0].worldPoint(6, 5);
    const double pixel = bundle.views[0].camera.sampleSpacing(bundle.views[0].depth.at(6, 3)).x;
    EXPECT_LT(glm::length(before - after), 0.36 * pixel);
    EXPECT_EQ(wide.views[1].worldPoint(1, 1), back.views[1].worldPoint(0, 1)) << "no rest: exact";
}

TEST(Mapping, PrincipalPointsFarOutAreRefused) {
    Bundle bundle;
    bundle.views = {makeView(4, 4, 16)};
    bundle.views[0].camera.cx = 1e6;
    Job job;
    const auto document = sceneFromBundle(bundle, {}, job);
    ASSERT_FALSE(document);
    EXPECT_EQ(document.error().code, ErrorCode::unsupported);
}

TEST(Mapping, MoreImagesThanObjectDescriptorsAreRefused) {
    Bundle bundle;
    for (int i = 0; i < 511; ++i) bundle.views.push_back(makeView(1, 2, 8, i));
    Job job;
    const auto document = sceneFromBundle(bundle, {}, job);
    ASSERT_FALSE(document);
    EXPECT_NE(document.error().text().find("1021"), std::string::npos) << document.error().text();
    bundle.views.pop_back();
    EXPECT_TRUE(sceneFromBundle(bundle, {}, job));
}

TEST(Mapping, NamesThatTextsCannotHoldComeBack) {
    Bundle bundle;
    for (const char* name :
         {"image 001.png", "N7", "view", "image_001_png", "\xC3\xA9t\xC3\xA9", "7", ""}) {
        bundle.views.push_back(makeView(2, 2, 8));
        bundle.views.back().name = name;
    }
    const Bundle back = bundleOf(sceneOf(bundle));
    for (const std::size_t i : {0u, 1u, 2u, 3u, 4u, 5u})
        EXPECT_EQ(back.views[i].name, bundle.views[i].name);
}

TEST(Mapping, PixelTexturesRunFromTheBottomUp) {
    const Bundle bundle = mustRead(depthImage());
    ASSERT_EQ(bundle.views.size(), 1u);
    const ReferenceView& view = bundle.views[0];
    EXPECT_FALSE(hasPoint(view.depth.at(0, 1))) << "the first pixel is the lower left one";
    EXPECT_EQ(view.depth.at(1, 0), 1.0f);
    EXPECT_EQ(view.texture.rgba8()->at(0, 1), glm::u8vec4(255, 0, 0, 0));
    EXPECT_EQ(view.texture.rgba8()->at(1, 1), glm::u8vec4(0, 255, 0, 255));
    EXPECT_EQ(view.texture.rgba8()->at(1, 0), glm::u8vec4(255, 255, 255, 255));
}

TEST(Mapping, AlphaIsDepthWhereThereIsNoDepthImage) {
    const Bundle bundle = mustRead(
        "DepthImage { nearPlane 1 farPlane 9 diTexture SimpleTexture { texture PixelTexture { "
        "image 2 1 4 "
        "0x10203000 0x405060FF } } }");
    const ReferenceView& view = bundle.views[0];
    EXPECT_FALSE(hasPoint(view.depth.at(0, 0)));
    EXPECT_EQ(view.depth.at(1, 0), 1.0f);
    EXPECT_EQ(view.texture.rgba8()->at(1, 0), glm::u8vec4(0x40, 0x50, 0x60, 255));
    EXPECT_EQ(view.texture.rgba8()->at(0, 0).a, 0);
    EXPECT_NE(
        errorOf("DepthImage { diTexture SimpleTexture { texture PixelTexture { image 1 1 3 1 } } }")
            .find("the depth image is NULL"),
        std::string::npos);
}

TEST(Mapping, TransformsAreFoldedIntoTheCamera) {
    // The same point through the matrices, and through the folded camera.
    const std::string inner = depthImage("position 0.5 1 -2 orientation 0 1 0 0.7");
    const Bundle local = mustRead(inner);
    const Bundle world = mustRead(
        "Transform { translation 1 2 3 rotation 1 1 0 0.5 scale 2 2 2 center 0.5 0 1 "
        "scaleOrientation 0 0 1 0.3 children Transform { translation -1 0 2 children " +
        inner + " } }");
    const glm::dmat4 m =
        transformMatrix({0.5, 0, 1}, {1, 1, 0, 0.5}, {2, 2, 2}, {0, 0, 1, 0.3}, {1, 2, 3}) *
        transformMatrix({0, 0, 0}, {0, 0, 1, 0}, {1, 1, 1}, {0, 0, 1, 0}, {-1, 0, 2});
    for (const auto& [x, y] : {std::pair(1, 0), std::pair(0, 0), std::pair(1, 1)}) {
        const glm::dvec3 expected(m * glm::dvec4(local.views[0].worldPoint(x, y), 1.0));
        EXPECT_LT(glm::length(world.views[0].worldPoint(x, y) - expected), 1e-5);
    }
    EXPECT_NEAR(world.views[0].nearPlane, 2.0, 1e-6);
    EXPECT_NEAR(world.views[0].farPlane, 18.0, 1e-6);

    for (const char* bad : {"scale 1 2 1", "scale -1 1 1", "scale 0 1 1", "scale 1 1 1.01"})
        EXPECT_NE(errorOf(std::string("Transform { ") + bad + " children " + inner + " }")
                      .find("Transforms above"),
                  std::string::npos)
            << bad;
}

TEST(Mapping, TransformMatrixIsThatOfVrml) {
    // Scaling along a turned axis around a centre: done by hand.
    const glm::dmat4 m =
        transformMatrix({1, 0, 0}, {0, 0, 1, std::acos(0.0)}, {2, 1, 1}, {0, 0, 1, 0}, {0, 0, 5});
    const glm::dvec4 p =
        m * glm::dvec4(2, 0, 0, 1);  // 1 from the centre, scaled to 2, turned to +y
    EXPECT_NEAR(p.x, 1.0, 1e-12);
    EXPECT_NEAR(p.y, 2.0, 1e-12);
    EXPECT_NEAR(p.z, 5.0, 1e-12);
}

TEST(Mapping, SwitchShowsOnlyItsChoiceAndUsesCountEach) {
    const std::string two =
        "DEF A " + depthImage("position 1 0 0") + " DEF B " + depthImage("position 2 0 0");
    const Bundle one = mustRead("Switch { whichChoice 1 choice [ " + two + " ] }");
    ASSERT_EQ(one.views.size(), 1u);
    EXPECT_EQ(one.views[0].name, "B");
    EXPECT_NE(errorOf("Switch { choice [ " + two + " ] }")
                  .find("with a texture; at least one is expected"),
              std::string::npos);
    const Bundle used = mustRead(two + " Transform { translation 5 0 0 children USE A }");
    ASSERT_EQ(used.views.size(), 3u);
    EXPECT_EQ(used.views[2].name, "A_1");
    EXPECT_EQ(used.views[2].camera.position.x, 6.0);
}

TEST(Mapping, ManyUsesOfUsesAreRefused) {
    std::string nodes = "DEF A0 " + depthImage();
    for (int i = 1; i < 40; ++i)
        nodes += " DEF A" + std::to_string(i) + " Group { children [ USE A" +
                 std::to_string(i - 1) + " USE A" + std::to_string(i - 1) + " ] }";
    EXPECT_NE(errorOf(nodes).find("views"), std::string::npos) << errorOf(nodes);
}

TEST(Mapping, BadCamerasAreNamed) {
    const auto with = [](const std::string& fields) {
        return std::string("DEF CAM DepthImage { ") + fields + " diTexture " + kPixels + " }";
    };
    EXPECT_NE(
        errorOf(with("nearPlane 5 farPlane 2")).find("view 0 'CAM': nearPlane is 5 and farPlane 2"),
        std::string::npos);
    EXPECT_NE(errorOf(with("orthographic FALSE fieldOfView 7 7")).find("fieldOfView is 7 7"),
              std::string::npos);
    EXPECT_NE(errorOf(with("fieldOfView 0 1")).find("fieldOfView"), std::string::npos);
    EXPECT_NE(errorOf(with("position nan 0 0")).find("not finite"), std::string::npos);
    EXPECT_NE(
        errorOf(
            "DepthImage { diTexture SimpleTexture { texture PixelTexture { image 2 1 3 1 2 } depth "
            "PixelTexture { image 1 2 1 1 2 } } }")
            .find("depth is 1x2 but texture is 2x1"),
        std::string::npos);
    EXPECT_NE(
        errorOf("DepthImage { diTexture SimpleTexture { texture ImageTexture { url [od:9] } } }")
            .find("object descriptor 9 is named"),
        std::string::npos);
}

TEST(PointTexture, LayersComeFromTheLowerLeft) {
    REQUIRE_SHARED(path, "reference/bt/04_pointtexture.bt");
    Job job;
    const auto bundle = readMpeg4Bundle(path, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 2u);
    const ReferenceView& first = bundle->views[0];
    EXPECT_EQ(first.camera.width, 4);
    // depth [0, 1 255, 2 10 200, 0 | 1 128, 0, 0, 1 7], 9 bits, planes 5..15
    const DepthCode code{5, 15, 511};
    EXPECT_FALSE(hasPoint(first.depth.at(0, 1)));
    EXPECT_FLOAT_EQ(first.depth.at(1, 1), static_cast<float>(code.decode(255)));
    EXPECT_FLOAT_EQ(first.depth.at(2, 1), static_cast<float>(code.decode(10)));
    EXPECT_FLOAT_EQ(bundle->views[1].depth.at(2, 1), static_cast<float>(code.decode(200)));
    EXPECT_FLOAT_EQ(first.depth.at(0, 0), static_cast<float>(code.decode(128)));
    EXPECT_FLOAT_EQ(first.depth.at(3, 0), static_cast<float>(code.decode(7)));
    EXPECT_EQ(bundle->views[1].pointCount(), 1);
    EXPECT_EQ(first.texture.rgba8()->at(2, 1), glm::u8vec4(0, 255, 0, 255));
    EXPECT_EQ(bundle->views[1].texture.rgba8()->at(2, 1), glm::u8vec4(0, 0, 255, 255));
}

TEST(PointTexture, IsWrittenWithItsLayers) {
    Bundle bundle;
    bundle.views = {makeView(9, 7, 16, 1), makeView(9, 7, 16, 1), makeView(5, 4, 8, 3)};
    addVectors(bundle.views[2]);
    bundle.views[1].name = "view1_1";
    // The second layer lies behind the first, and only where there is a first.
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 9; ++x)
            if (x > 4) bundle.views[1].depth.at(x, y) = kNoDepth;
    for (auto& p : bundle.views[1].texture.rgba8()->pixels()) p.a = 0;
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 9; ++x)
            bundle.views[1].texture.rgba8()->at(x, y).a =
                hasPoint(bundle.views[1].depth.at(x, y)) ? 255 : 0;
    bundle.views[2].camera.cx = 4.5;  // needs padding
    SceneWriteOptions options;
    options.pointTexture = true;
    const Document document = sceneOf(bundle, options);
    EXPECT_TRUE(document.odFrames.empty());
    const Bundle back = bundleOf(document);
    ASSERT_EQ(back.views.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        expectSameCamera(back.views[i].camera, bundle.views[i].camera);
        EXPECT_EQ(back.views[i].depth, bundle.views[i].depth) << i;
        for (std::size_t p = 0; p < back.views[i].depth.count(); ++p)
            if (hasPoint(back.views[i].depth.pixels()[p])) {
                EXPECT_EQ(back.views[i].texture.rgba8()->pixels()[p],
                          bundle.views[i].texture.rgba8()->pixels()[p]);
            }
    }
    EXPECT_EQ(back.views[2].splatU, bundle.views[2].splatU);
    for (std::size_t p = 0; p < back.views[2].normal.count(); ++p)
        EXPECT_LT(
            glm::length(back.views[2].normal.pixels()[p] - bundle.views[2].normal.pixels()[p]),
            1e-6f);
}

TEST(PointTexture, HasLayersOfWhichAllIsTheSame) {
    const auto nodesOf = [](const std::function<void(ReferenceView&)>& change) {
        Bundle bundle;
        bundle.views = {makeView(9, 7, 16), makeView(9, 7, 16)};
        bundle.views[1].name = "view1_1";
        change(bundle.views[1]);
        SceneWriteOptions options;
        options.pointTexture = true;
        int count = 0;
        forEachNode(sceneOf(bundle, options).frames,
                    [&](const NodePtr& node) { count += node->is("PointTexture"); });
        return count;
    };
    EXPECT_EQ(nodesOf([](ReferenceView&) {}), 1);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.name = "behind"; }), 2);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.depthBits = 8; }), 2);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.background = true; }), 2);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.noDepth = NoDepth::unknown; }), 2);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.pruned = true; }), 2);
    EXPECT_EQ(nodesOf([](ReferenceView& view) { view.refined.steps = "noise"; }), 2);
}

TEST(PointTexture, ListsThatDoNotFitAreRefused) {
    const auto with = [](const std::string& fields) {
        return "DepthImage { diTexture PointTexture { " + fields + " } }";
    };
    for (const auto& [fields, message] :
         {std::pair("width 2 height 1 depth [1 5]", "depth ends at pixel 1"),
          std::pair("width 2 height 1 depth [1 5 3 1] color [1 1 1 1 1 1]", "says 3 depths"),
          std::pair("width 1 height 1 depth [1 5]", "0 colours"),
          std::pair("width 1 height 1 depth [1 5 7] color [1 1 1]", "behind the last pixel"),
          std::pair("width 1 height 1 depth [1 300] color [1 1 1]", "8 bits allow"),
          std::pair("width 100000 height 100000 depth [1]", "pixels on a side"),
          std::pair("width 60000 height 60000 depth [1]", "each pixel needs one"),
          std::pair("width 1 height 1 depth [-1]", "says -1")})
        EXPECT_NE(errorOf(with(fields)).find(message), std::string::npos) << errorOf(with(fields));
}

TEST(OctreeImage, VoxelsGiveTheDepthOfItsImages) {
    // One of eight octants is there: the one at -x -y -z. Seen from +z, its front is at z = 0.
    const Bundle bundle = mustRead(
        "OctreeImage { octreeResolution 2 octree [1] images [ DEF FRONT DepthImage { position 0 0 "
        "10 fieldOfView 1 1 "
        "diTexture SimpleTexture { texture PixelTexture { image 2 2 3 0xFF0000 2 3 4 } } } ] }");
    ASSERT_EQ(bundle.views.size(), 1u);
    const ReferenceView& view = bundle.views[0];
    EXPECT_EQ(view.pointCount(), 1);
    EXPECT_TRUE(hasPoint(view.depth.at(0, 1))) << "the lower left pixel";
    const glm::dvec3 p = view.worldPoint(0, 1);
    EXPECT_NEAR(p.x, -0.25, 1e-6);
    EXPECT_NEAR(p.y, -0.25, 1e-6);
    EXPECT_NEAR(p.z, 0.0, 1e-5);
    EXPECT_EQ(view.texture.rgba8()->at(0, 1), glm::u8vec4(255, 0, 0, 255));
}

TEST(OctreeImage, EveryPointLiesOnTheHullOfItsVoxels) {
    // Levels of 4^3 voxels from random bytes; all six sides are compared with a brute-force search.
    std::mt19937 random(7);
    std::vector<std::int32_t> bytes;
    std::size_t nodes = 1;
    for (int level = 0; level < 3; ++level) {
        std::size_t next = 0;
        for (std::size_t i = 0; i < nodes; ++i) {
            bytes.push_back(static_cast<std::int32_t>(random() & 255));
            next += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(bytes.back())));
        }
        nodes = next;
    }
    const auto tree = Octree::parse(bytes, 8, Limits());
    ASSERT_TRUE(tree) << tree.error().text();
    EXPECT_EQ(tree->levels(), 3);
    EXPECT_EQ(static_cast<std::size_t>(tree->voxelCount()), nodes);
    // Which voxels exist, walked breadth first in the plainest way.
    struct Cell {
        int x, y, z;
    };
    std::vector<Cell> cells = {{0, 0, 0}};
    std::size_t at = 0;
    for (int level = 0; level < 3; ++level) {
        std::vector<Cell> below;
        for (const Cell c : cells) {
            const int byte = bytes[at++];
            for (int i = 0; i < 8; ++i)
                if (byte >> i & 1)
                    below.push_back(
                        {c.x * 2 + (i & 1), c.y * 2 + (i >> 1 & 1), c.z * 2 + (i >> 2)});
        }
        cells = below;
    }
    bool full[8][8][8] = {};
    for (const Cell c : cells) full[c.x][c.y][c.z] = true;
    for (int axis = 0; axis < 3; ++axis) {
        for (const int sign : {1, -1}) {
            for (int a = 0; a < 8; ++a) {
                for (int b = 0; b < 8; ++b) {
                    glm::dvec3 origin, direction(0);
                    direction[axis] = -sign;
                    origin[axis] = sign * 3.0;
                    origin[(axis + 1) % 3] = (a + 0.5) / 8 - 0.5;
                    origin[(axis + 2) % 3] = (b + 0.5) / 8 - 0.5;
                    double expected = kNoDepth;
                    for (int step = 0; step < 8 && !(expected < kNoDepth); ++step) {
                        const int layer = sign > 0 ? 7 - step : step;
                        int index[3];
                        index[axis] = layer;
                        index[(axis + 1) % 3] = a;
                        index[(axis + 2) % 3] = b;
                        if (full[index[0]][index[1]][index[2]]) expected = 2.5 + step / 8.0;
                    }
                    const double found = tree->firstHit(origin, direction);
                    if (expected < kNoDepth) {
                        EXPECT_NEAR(found, expected, 1e-12);
                    } else {
                        EXPECT_EQ(found, expected);
                    }
                }
            }
        }
    }
}

TEST(OctreeImage, PlanesOfItsImagesAreNotUsed) {
    const auto octree = [](const std::string& planes) {
        return "OctreeImage { octreeResolution 2 octree [1] images [ DepthImage { position 0 0 10 "
               "fieldOfView 1 1 " +
               planes +
               " diTexture SimpleTexture { texture PixelTexture { image 2 2 3 1 2 3 4 } } } ] }";
    };
    const Bundle bundle = mustRead(octree("")), other = mustRead(octree("nearPlane 5 farPlane 5"));
    ASSERT_EQ(other.views.size(), 1u);
    EXPECT_EQ(other.views[0].nearPlane, bundle.views.at(0).nearPlane);
    EXPECT_EQ(other.views[0].depth, bundle.views[0].depth);
}

TEST(OctreeImage, DamagedTreesAreRefused) {
    EXPECT_FALSE(Octree::parse(std::vector<std::int32_t>{255, 1}, 4, Limits()));
    EXPECT_FALSE(Octree::parse(std::vector<std::int32_t>{256}, 2, Limits()));
    EXPECT_FALSE(Octree::parse(std::vector<std::int32_t>{1}, 0, Limits()));
    EXPECT_FALSE(Octree::parse(std::vector<std::int32_t>{1}, 1 << 30, Limits()));
    const auto rest = Octree::parse(std::vector<std::int32_t>{0, 5, 5}, 2, Limits());
    ASSERT_TRUE(rest);
    EXPECT_EQ(rest->unusedBytes(), 2u);
}

}  // namespace
}  // namespace stx::mpeg4
