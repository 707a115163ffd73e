// What a scene says beside its views, and views whose pixels are not read.
#include "tests/unit/images/png_builder.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

const std::string kBounds = "WorldInfo { info [\"made by stx\" \"bounds 1 0 0 2 1 0.5\"] } ";
/// Of a depthImage(kSeesBounds) that has them between its planes.
const std::string kSeesBounds = "position 1.5 0.5 9";

void expectNear(glm::dvec3 a, glm::dvec3 b) {
    EXPECT_LT(glm::length(a - b), 1e-6) << a.x << " " << a.y << " " << a.z;
}

TEST(StatedBounds, FollowTheTransformsAboveThem) {
    const std::string object = kBounds + depthImage(kSeesBounds);
    const Bundle plain = mustRead(object);
    ASSERT_TRUE(plain.bounds);
    EXPECT_EQ(plain.bounds->min, glm::dvec3(1, 0, 0));
    EXPECT_EQ(plain.bounds->max, glm::dvec3(2, 1, 0.5));

    const Bundle moved =
        mustRead("Transform { translation 10 0 0 scale 2 2 2 children [ " + object + " ] }");
    ASSERT_TRUE(moved.bounds);
    expectNear(moved.bounds->min, {12, 0, 0});
    expectNear(moved.bounds->max, {14, 2, 1});

    // A quarter turn about z: x becomes y, y becomes -x.
    const Bundle turned =
        mustRead("Transform { rotation 0 0 1 1.5707963268 children [ " + object + " ] }");
    ASSERT_TRUE(turned.bounds);
    expectNear(turned.bounds->min, {-1, 1, 0});
    expectNear(turned.bounds->max, {0, 2, 0.5});
}

TEST(StatedBounds, OfTwoObjectsAreUnited) {
    const Bundle two =
        mustRead("Transform { translation 10 0 0 children [ " + kBounds + depthImage(kSeesBounds) +
                 " ] } " + kBounds + depthImage(kSeesBounds));
    ASSERT_TRUE(two.bounds);
    expectNear(two.bounds->min, {1, 0, 0});
    expectNear(two.bounds->max, {12, 1, 0.5});
}

/// What is read of nodes, and the notes.
std::pair<Bundle, std::vector<std::string>> readWithNotes(const std::string& nodes, bool pixels) {
    Job job;
    const auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
    EXPECT_TRUE(document);
    SceneReadOptions options;
    options.pixels = pixels;
    auto bundle = bundleFromScene(*document, options, job);
    if (!bundle) ADD_FAILURE() << bundle.error().text();
    return {bundle ? std::move(*bundle) : Bundle(), job.takeNotes()};
}

/// Text is edited by hand: positions, and the WorldInfo stays as it was.
TEST(StatedBounds, AreNotBelievedWhereAViewSeesNothingOfThem) {
    for (const bool pixels : {true, false}) {
        for (const char* position : {"position 101.5 0.5 9", "position 1.5 -20 9",
                                     "position 1.5 0.5 0.6", "position 1.5 0.5 30"}) {
            const auto [bundle, notes] = readWithNotes(
                kBounds + depthImage(kSeesBounds) + " DEF Moved " + depthImage(position), pixels);
            EXPECT_FALSE(bundle.bounds) << position;
            ASSERT_EQ(notes.size(), 1u) << position;
            EXPECT_EQ(notes[0],
                      "the bounds that WorldInfo states are left out: view 'Moved' sees nothing of "
                      "them between its planes");
        }
    }
}

/// The planes of a view without a point are those that the fields have by themselves.
TEST(StatedBounds, AreBelievedBesideAViewWhosePlanesSayNothing) {
    const auto [bundle, notes] = readWithNotes(
        kBounds + depthImage(kSeesBounds) +
            " DEF Empty DepthImage { orthographic FALSE fieldOfView 0.5 0.5 position 0 0 500 "
            "diTexture " +
            kPixels + " }",
        true);
    EXPECT_TRUE(bundle.bounds);
    EXPECT_TRUE(notes.empty()) << notes[0];
}

TEST(StatedBounds, AreNotBelievedWhereViewsWereMovedWithoutThem) {
    Job job;
    const auto document =
        readBt("Group { children [ " + kBounds + "Transform { translation 10 0 0 children " +
                   depthImage() + " } ] }",
               "test.bt", job);
    ASSERT_TRUE(document) << document.error().text();
    const auto bundle = bundleFromScene(*document, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    EXPECT_FALSE(bundle->bounds);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("bounds"), std::string::npos) << notes[0];
}

std::string withOrigin(const std::string& origin, const std::string& more = "") {
    return "Group { children [ WorldInfo { info [\"made by stx\" \"origin " + origin + "\" " +
           more + "] } " + depthImage(kSeesBounds) + " ] } ";
}

TEST(StatedOrigins, FollowTheTransformsAboveThem) {
    const std::string object = withOrigin("1000 20 3");
    EXPECT_EQ(mustRead(object).origin, glm::dvec3(1000, 20, 3));
    const Bundle scaled =
        mustRead("Transform { translation 10 0 0 scale 2 2 2 children [ " + object + " ] }");
    expectNear(scaled.origin, {2000, 40, 6});
    expectNear(scaled.views.at(0).camera.position, {13, 1, 18});
    const Bundle turned =
        mustRead("Transform { rotation 0 0 1 1.5707963268 children [ " + object + " ] }");
    EXPECT_LT(glm::length(turned.origin - glm::dvec3(-20, 1000, 3)), 1e-3);
}

/// All count from the first: what is beside another is moved.
TEST(StatedOrigins, OfTwoObjectsBecomeOne) {
    const std::string bounds = "\"bounds 1 0 0 2 1 0.5\" ";
    const Bundle two = mustRead(withOrigin("1000000 0 0", bounds) +
                                withOrigin("1000100 5 0", bounds) + depthImage(kSeesBounds));
    EXPECT_EQ(two.origin, glm::dvec3(1000000, 0, 0));
    ASSERT_EQ(two.views.size(), 3u);
    expectNear(two.views[0].camera.position, {1.5, 0.5, 9});
    expectNear(two.views[1].camera.position, {101.5, 5.5, 9});
    expectNear(two.views[2].camera.position, {1.5, 0.5, 9});
    EXPECT_EQ(mustRead(withOrigin("0 0 0") + withOrigin("7 0 0")).origin, glm::dvec3(0.0));
    const auto [both, notes] =
        readWithNotes(withOrigin("1000000 0 0", bounds) + withOrigin("1000001 0 0", bounds), true);
    ASSERT_TRUE(both.bounds) << notes.at(0);
    expectNear(both.bounds->min, {1, 0, 0});
    expectNear(both.bounds->max, {3, 1, 0.5});
}

TEST(StatedOrigins, ComeBackFromAnOctreeImage) {
    Bundle bundle;
    bundle.views = {makeView(9, 7, 16)};
    bundle.origin = {500000.1, 4000000.7, 0.3};
    SceneWriteOptions options;
    options.octreeLevels = 3;
    const Bundle back = bundleOf(sceneOf(bundle, options));
    EXPECT_EQ(back.origin, bundle.origin);
    EXPECT_TRUE(back.bounds);
}

Bundle headersOf(const std::string& nodes) {
    Job job;
    const auto document = readBt("Group { children [ " + nodes + " ] }", "test.bt", job);
    EXPECT_TRUE(document);
    SceneReadOptions options;
    options.pixels = false;
    options.mayBeEmpty = true;
    auto bundle = bundleFromScene(*document, options, job);
    if (!bundle) ADD_FAILURE() << bundle.error().text();
    return bundle ? std::move(*bundle) : Bundle();
}

TEST(SceneHeaders, PointTexturesHaveTheBitsAndLayersThatTheirPixelsHave) {
    for (const auto& [bits, expected] : {std::pair(7, 8), std::pair(8, 16), std::pair(15, 16)}) {
        const std::string nodes =
            "DEF P DepthImage { nearPlane 1 farPlane 9 orthographic FALSE fieldOfView 0.5 0.5 "
            "diTexture PointTexture { width 2 height 1 depthNbBits " +
            std::to_string(bits) + " depth [ 2 9 3 1 7 ] color [ 1 0 0 0 1 0 0 0 1 ] } }";
        const Bundle headers = headersOf(nodes), whole = mustRead(nodes);
        ASSERT_EQ(headers.views.size(), 2u);
        ASSERT_EQ(whole.views.size(), 2u);
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(headers.views[i].depthBits, expected);
            EXPECT_EQ(whole.views[i].depthBits, expected);
            EXPECT_EQ(headers.views[i].name, whole.views[i].name);
            EXPECT_EQ(headers.views[i].camera, whole.views[i].camera);
        }
    }
}

TEST(SceneHeaders, ASceneThatShowsNothingMayBeDescribed) {
    const Bundle nothing = headersOf("WorldInfo { title \"empty\" }");
    EXPECT_TRUE(nothing.views.empty());
    EXPECT_EQ(nothing.title, "empty");
    EXPECT_NE(
        errorOf("WorldInfo { title \"empty\" }").find("with a texture; at least one is expected"),
        std::string::npos);
}

/// A player that opens our file sees the whole object, from the side of the first view.
TEST(WrittenScenes, HaveAViewpointWithTheBoundsInSight) {
    Bundle bundle;
    bundle.views = {makeView(8, 6, 16, 1)};
    bundle.bounds.emplace();
    bundle.bounds->add({-1, 2, 3});
    bundle.bounds->add({4, 5, 9});
    const Document document = sceneOf(bundle);
    NodePtr viewpoint, navigation;
    for (const Command& command : document.frames[0].commands)
        forEachNode(command, [&](const NodePtr& node) {
            if (node->is("Viewpoint")) viewpoint = node;
            if (node->is("NavigationInfo")) navigation = node;
        });
    ASSERT_TRUE(viewpoint && navigation);
    EXPECT_EQ(navigation->get<std::vector<std::string>>("type").at(0), "EXAMINE");
    const auto turn = viewpoint->get<Rotation>("orientation");
    const glm::dquat orientation = quatFromAxisAngle({glm::dvec3(turn.axis), turn.angle});
    EXPECT_GT(std::abs(glm::dot(orientation, bundle.views[0].camera.orientation)), 1 - 1e-6);
    const double half = viewpoint->get<float>("fieldOfView") / 2;
    for (int corner = 0; corner < 8; ++corner) {
        const Bounds& b = *bundle.bounds;
        const glm::dvec3 p(corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                           corner & 4 ? b.max.z : b.min.z);
        const glm::dvec3 seen =
            glm::inverse(orientation) * (p - glm::dvec3(viewpoint->get<glm::vec3>("position")));
        EXPECT_LT(std::atan2(std::hypot(seen.x, seen.y), -seen.z), half + 1e-6) << corner;
    }
}

/// ISO/IEC 14496-16: d of a grey image with b bits runs to dmax = 2^b - 1.
TEST(DepthOfFewBits, RunsToTheLargestCodeOfItsOwnBits) {
    for (const int bits : {1, 2, 4}) {
        const auto dmax = static_cast<std::uint16_t>((1 << bits) - 1);
        const TemporaryFolder folder("few_bits");
        const auto write = [&](const char* name, const std::string& bytes) {
            ASSERT_TRUE(writeFile(folder / name, std::as_bytes(std::span(bytes))));
        };
        png::Picture picture;
        picture.width = 3;
        picture.height = 1;
        picture.bits = bits;
        picture.samples = {0, 1, dmax};
        write("depth.png", png::build(picture));
        picture.bits = 8;
        picture.samples = {10, 20, 30};
        write("colour.png", png::build(picture));
        Job job;
        const auto document = readBt(
            "Group { children DepthImage { nearPlane 1 farPlane 9 orthographic FALSE "
            "fieldOfView 0.5 0.5 diTexture SimpleTexture { texture ImageTexture { url "
            "\"colour.png\" } depth ImageTexture { url \"depth.png\" } } } }",
            "test.bt", job);
        ASSERT_TRUE(document) << document.error().text();
        SceneReadOptions options;
        options.folder = folder.path();
        const auto bundle = bundleFromScene(*document, options, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        const Image<float>& depth = bundle->views[0].depth;
        EXPECT_FALSE(hasPoint(depth.at(0, 0)));
        EXPECT_EQ(depth.at(1, 0), 9.0f) << bits << " bits: code 1 is farPlane";
        if (bits > 1) {
            EXPECT_EQ(depth.at(2, 0), 1.0f) << bits << " bits: dmax is nearPlane";
        }
    }
}

}  // namespace
}  // namespace stx::mpeg4
