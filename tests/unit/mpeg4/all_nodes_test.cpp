// Every node of the table through every form, and what a scene with many kinds of nodes shows.

#include <gtest/gtest.h>

#include "formats/mpeg4/text/bt.hpp"
#include "formats/mpeg4/text/xmt.hpp"
#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

/// A value that is not the default of any field.
FieldValue someValue(FieldType type) {
    FieldValue value = emptyValue(type);
    const auto fill = [](auto& v) {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::int32_t>) v = 5;
        if constexpr (std::is_same_v<T, bool>) v = true;
        if constexpr (std::is_same_v<T, float>) v = 0.7f;
        if constexpr (std::is_same_v<T, double>) v = 1.25;
        if constexpr (std::is_same_v<T, std::string>) v = "a \"b\" c";
        if constexpr (std::is_same_v<T, Url>) v.text = "http://example.org/x";
        if constexpr (std::is_same_v<T, glm::vec2>) v = {0.3f, 0.4f};
        if constexpr (std::is_same_v<T, glm::vec3>) v = {0.3f, 0.4f, 0.5f};
        if constexpr (std::is_same_v<T, glm::vec4>) v = {0.3f, 0.4f, 0.5f, 0.6f};
        if constexpr (std::is_same_v<T, Color>) v = {0.1f, 0.2f, 0.3f};
        if constexpr (std::is_same_v<T, Rotation>) v = {{0, 1, 0}, 0.5f};
        if constexpr (std::is_same_v<T, PixelImage>) v = {2, 1, 3, {1, 2, 3, 4, 5, 6}};
    };
    std::visit(
        [&](auto& v) {
            using T = std::decay_t<decltype(v)>;
            if constexpr (kIsList<T>) {
                typename T::value_type item{};
                fill(item);
                v.assign(3, item);
            } else {
                fill(v);
            }
        },
        value);
    return value;
}

bool isPlain(FieldType type) {
    const FieldType item = itemType(type);
    return item != FieldType::SFNode && item != FieldType::SFScript &&
           item != FieldType::SFAttrRef && item != FieldType::SFCommandBuffer;
}

/// A node of each type, with all its fields set; a field of nodes holds the first that may be
/// there.
NodePtr fullNode(const NodeInfo& info, bool withNodes) {
    NodePtr node = makeNode(info);
    for (const FieldInfo& field : info.fields) {
        if (!field.hasValue()) continue;
        if (isPlain(field.type)) node->set(field.index, someValue(field.type));
        if (itemType(field.type) != FieldType::SFNode || !withNodes) continue;
        for (const NodeInfo& other : allNodes()) {
            if (other.codeIn(field.nodeType) == nullptr) continue;
            const NodePtr child = fullNode(other, false);
            node->set(field.index, field.type == FieldType::SFNode ? FieldValue(child)
                                                                   : FieldValue(NodeList{child}));
            break;
        }
    }
    return node;
}

/// A scene in which each node of the table replaces the one before.
std::vector<CommandFrame> oneOfEach() {
    const NodePtr root = makeNode("Group");
    const NodePtr target = makeNode("Group");
    root->set("children", NodeList{target});
    std::vector<CommandFrame> frames{{0, {ReplaceScene{false, root, {}}}}};
    for (const NodeInfo& info : allNodes())
        frames.push_back({frames.size(), {ReplaceNode{target, fullNode(info, true)}}});
    return frames;
}

std::string problemOf(const std::vector<CommandFrame>& a, const std::vector<CommandFrame>& b) {
    if (a.size() != b.size()) return "another number of frames";
    for (std::size_t i = 1; i < a.size(); ++i)
        if (!sameNode(std::get<ReplaceNode>(a[i].commands.at(0)).replacement,
                      std::get<ReplaceNode>(b[i].commands.at(0)).replacement, {.ids = false}))
            return allNodes()[i - 1].name;
    return "";
}

TEST(AllNodes, EveryNodeWithAllItsFieldsComesBackFromBifs) {
    const auto frames = oneOfEach();
    ASSERT_GT(frames.size(), 190u);
    const NodeIds ids = assignNodeIds(frames);
    for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()}) {
        const BifsConfig config = fitBifsConfig({}, ids);
        BifsEncoder encoder(config, style, ids);
        BifsDecoder decoder(config, Limits());
        std::vector<CommandFrame> again;
        for (const CommandFrame& frame : frames) {
            const auto bytes = encoder.encode(frame.commands);
            ASSERT_TRUE(bytes) << bytes.error().text();
            auto decoded = decoder.decode(*bytes);
            ASSERT_TRUE(decoded) << decoded.error().text();
            EXPECT_LT(decoder.bitsLeft(), 8u);
            again.push_back({frame.time, std::move(*decoded)});
        }
        EXPECT_EQ(problemOf(frames, again), "");
    }
}

TEST(AllNodes, EveryNodeWithAllItsFieldsComesBackFromTexts) {
    Document document;
    document.frames = oneOfEach();
    Job job;
    const auto bt = writeBt(document, job);
    ASSERT_TRUE(bt) << bt.error().text();
    const auto fromBt = readBt(*bt, "test.bt", job);
    ASSERT_TRUE(fromBt) << fromBt.error().text();
    EXPECT_EQ(problemOf(document.frames, fromBt->frames), "");
    const auto xmt = writeXmt(document, job);
    ASSERT_TRUE(xmt) << xmt.error().text();
    const auto fromXmt = readXmt(*xmt, "test.xmt", job);
    ASSERT_TRUE(fromXmt) << fromXmt.error().text();
    EXPECT_EQ(problemOf(document.frames, fromXmt->frames), "");
}

TEST(AllNodes, IndicesAreQuantisedByTheirCoordinates) {
    const NodePtr root = makeNode("Group");
    const NodePtr quantisation = makeNode("QuantizationParameter");
    const NodePtr shape = makeNode("Shape");
    const NodePtr faces = makeNode("IndexedFaceSet");
    const NodePtr points = makeNode("Coordinate");
    points->set("point", std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
    faces->set("coord", points);
    faces->set("coordIndex", std::vector<std::int32_t>{0, 1, 2, -1, 1, 3, 2, -1});
    shape->set("geometry", faces);
    root->set("children", NodeList{quantisation, shape});
    const std::vector<CommandFrame> frames{{0, {ReplaceScene{false, root, {}}}}};
    const BifsConfig config = fitBifsConfig({}, {});
    std::size_t quantised = 0;
    for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()}) {
        const auto bytes = BifsEncoder(config, style, {}).encode(frames[0].commands);
        ASSERT_TRUE(bytes) << bytes.error().text();
        quantised = bytes->size();
        auto decoded = BifsDecoder(config, Limits()).decode(*bytes);
        ASSERT_TRUE(decoded) << decoded.error().text();
        EXPECT_TRUE(sameFrames(frames, {{0, std::move(*decoded)}}));
    }
    root->set("children", NodeList{shape});
    const auto plain = BifsEncoder(config, BifsStyle::shortest(), {}).encode(frames[0].commands);
    ASSERT_TRUE(plain);
    // Eight indices of 3 bits for 32, and a node of its own.
    EXPECT_LT(quantised + 20, plain->size());

    faces->clear(faces->info->find("coord"));
    root->set("children", NodeList{quantisation, shape});
    const auto none = BifsEncoder(config, {}, {}).encode(frames[0].commands);
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().text().find("number of coordinates"), std::string::npos);
}

/// The kinds of nodes that stand beside a DepthImage in scenes that people make.
constexpr const char* kManyKinds = R"(
  Background2D { backColor 0.1 0.2 0.3 }
  SpotLight { location 0 2 0 }
  Shape { appearance Appearance { material Material { } } geometry Sphere { radius 2 } }
  Shape { geometry Text { string ["a" "b"] fontStyle FontStyle { size 2 } } }
  DEF TOUCH TouchSensor { }
  Inline { url ["other.mp4"] }
  Sound2D { source AudioSource { url [od:99] } }
  Anchor { url ["http://example.org"] children [ %s ] }
  Collision { proxy Group { } children [ ] }
  Billboard { axisOfRotation 0 1 0 children [ Transform { translation 3 0 0 children [ USE VIEW ] } ] }
  LOD { level [ Transform { translation 0 4 0 children [ USE VIEW ] } Group { } ] range [10] }
)";

TEST(AllNodes, ASceneWithManyKindsOfNodesShowsItsDepthImages) {
    Bundle bundle;
    bundle.views.push_back(makeView(16, 12, 8));
    bundle.views[0].name = "VIEW";
    Document document = sceneOf(bundle);
    Job job;
    auto bt = writeBt(document, job);
    ASSERT_TRUE(bt) << bt.error().text();
    // The DepthImage goes into the Anchor.
    const auto begin = bt->find("DEF VIEW DepthImage");
    ASSERT_NE(begin, std::string::npos);
    std::size_t end = bt->find('{', begin) + 1;
    for (int depth = 1; depth > 0; ++end) depth += ((*bt)[end] == '{') - ((*bt)[end] == '}');
    std::string many = kManyKinds;
    const auto hole = many.find("%s");
    many.replace(hole, 2, bt->substr(begin, end - begin));
    bt->replace(begin, end - begin, many);

    auto read = readBt(*bt, "test.bt", job);
    ASSERT_TRUE(read) << read.error().text();
    read->odFrames = document.odFrames;  // with the images
    // The same from an .mp4.
    const auto mp4 = writeMp4(*read, job);
    ASSERT_TRUE(mp4) << mp4.error().text();
    const auto back = readMp4(ByteSource::fromBytes(*mp4), job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_TRUE(sameFrames(read->frames, back->frames, {.ids = false}));

    for (const auto& scene : {*read, *back}) {
        (void)job.takeNotes();
        const auto shown = bundleFromScene(scene, {}, job);
        ASSERT_TRUE(shown) << shown.error().text();
        ASSERT_EQ(shown->views.size(), 3u);
        const glm::dvec3 at = shown->views[0].camera.position;
        EXPECT_LT(glm::length(shown->views[1].camera.position - at - glm::dvec3(3, 0, 0)), 1e-5);
        EXPECT_LT(glm::length(shown->views[2].camera.position - at - glm::dvec3(0, 4, 0)), 1e-5);
        const auto notes = job.takeNotes();
        // The third: Transforms move views away from the stated bounds.
        ASSERT_EQ(notes.size(), 3u) << fmt::format("{}", fmt::join(notes, "\n"));
        EXPECT_EQ(notes[0],
                  "the scene has nodes that are no views; they are left out: Background2D, Inline, "
                  "Shape, Sound2D, Sphere, SpotLight, Text, TouchSensor");
        EXPECT_EQ(notes[1],
                  "nodes that place or choose their children by themselves are read as Group: "
                  "Billboard, LOD");
    }
}

TEST(MotionNotes, RoutesAndPicturesInTimeAreSaid) {
    Bundle bundle;
    bundle.views = {makeView(8, 6, 8, 1)};
    Document document = sceneOf(bundle);
    auto& scene = std::get<ReplaceScene>(document.frames[0].commands[0]);
    const auto notesOf = [&] {
        Job job;
        const auto read = bundleFromScene(document, {}, job);
        EXPECT_TRUE(read);
        return fmt::format("{}", fmt::join(job.takeNotes(), "|"));
    };
    const std::string still = notesOf();
    EXPECT_EQ(still.find("in time"), std::string::npos) << still;

    // The view goes into a Transform that an interpolator moves; a Viewpoint may move as it likes.
    const NodePtr transform = makeNode("Transform");
    const NodePtr path = makeNode("PositionInterpolator");
    const NodePtr eye = makeNode("Viewpoint");
    auto& children = scene.root->edit<NodeList>("children");
    ASSERT_TRUE(children.at(1)->is("DepthImage"));
    transform->set("children", NodeList{children[1]});
    children[1] = transform;
    children.push_back(path);
    children.push_back(eye);
    const auto route = [&](const NodePtr& to, const char* field) {
        return Route{0, "", path, path->info->find("value_changed"), to, to->info->find(field)};
    };
    scene.routes = {route(eye, "position")};
    EXPECT_EQ(notesOf(), still);
    scene.routes.push_back(route(transform, "translation"));
    EXPECT_NE(notesOf().find("1 ROUTE(s) change the views in time"), std::string::npos)
        << notesOf();
    scene.routes.clear();

    auto& ods = std::get<UpdateObjectDescriptors>(document.odFrames[0].commands[0]).descriptors;
    auto& samples = ods[0].streams[0].samples;
    samples.push_back(samples[0]);
    samples[1].time = 1000;
    EXPECT_NE(notesOf().find("1 image(s) of the views have several pictures in time"),
              std::string::npos)
        << notesOf();
}

}  // namespace
}  // namespace stx::mpeg4
