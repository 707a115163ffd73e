// What WorldInfo says of views: it survives programs that write a scene anew without DEF names.

#include "formats/mpeg4/mapping/view_notes.hpp"

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

/// An ordinary view, one off centre, one that was pruned, one of unknown depth, a background.
Bundle markedViews() {
    Bundle bundle;
    for (int i = 1; i <= 5; ++i) bundle.views.push_back(makeView(9, 7, 16, i));
    bundle.views[1].camera.cx = 3.75;
    bundle.views[2].pruned = true;
    bundle.views[3].noDepth = NoDepth::unknown;
    bundle.views[4].background = true;
    bundle.views[0].refined = {"edges", 0};
    bundle.views[3].refined = {"edges", 0.00125f};
    for (std::size_t i = 2; i < 4; ++i) {
        bundle.views[i].depth.at(2, 3) = kNoDepth;
        bundle.views[i].texture.rgba8()->at(2, 3).a = 255;
    }
    return bundle;
}

/// What a document's WorldInfo says, and its views.
struct Written {
    Document document;
    NodePtr info;
    NodeList views;

    explicit Written(const Bundle& bundle) : document(sceneOf(bundle)) {
        for (const CommandFrame& frame : document.frames)
            for (const Command& command : frame.commands)
                forEachNode(command, [&](const NodePtr& node) {
                    if (node->is("WorldInfo")) info = node;
                    if (node->is("DepthImage")) views.push_back(node);
                });
    }
    [[nodiscard]] std::vector<std::string> text() const {
        return info->get<std::vector<std::string>>("info");
    }
};

void expectMarks(const Bundle& back, const Bundle& bundle) {
    ASSERT_EQ(back.views.size(), bundle.views.size());
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView &is = back.views[i], &was = bundle.views[i];
        EXPECT_EQ(is.depth, was.depth) << i;
        EXPECT_NEAR(is.camera.cx, was.camera.cx, 1e-6) << i;
        EXPECT_EQ(is.pruned, was.pruned) << i;
        EXPECT_EQ(is.noDepth, was.noDepth) << i;
        EXPECT_EQ(is.background, was.background) << i;
        EXPECT_EQ(is.refined, was.refined) << i;
    }
}

TEST(ViewNotes, DoNotNeedDefNames) {
    const Bundle bundle = markedViews();
    Written written(bundle);
    ASSERT_EQ(written.views.size(), 5u);
    for (const NodePtr& view : written.views) view->defName.clear();
    expectMarks(bundleOf(written.document), bundle);
}

TEST(ViewNotes, AreReadByTheNamesOfBefore) {
    const Bundle bundle = markedViews();
    Written written(bundle);
    std::vector<std::string> before;
    for (std::string line : written.text()) {
        if (line.starts_with("views ")) continue;
        const auto at = line.find(" #");
        if (at != std::string::npos)
            line.replace(at + 1, 2,
                         written.views[static_cast<std::size_t>(line[at + 2] - '0')]->defName);
        before.push_back(line);
    }
    ASSERT_NE(before, written.text());
    written.info->set("info", before);
    expectMarks(bundleOf(written.document), bundle);
}

TEST(ViewNotes, ThatMeanNoViewAreTold) {
    const Bundle bundle = markedViews();
    Written written(bundle);
    Job job;
    ASSERT_TRUE(bundleFromScene(written.document, {}, job));
    EXPECT_TRUE(job.takeNotes().empty());
    // A program took the last view away: numbers mean nothing any more.
    std::vector<std::string> text = written.text();
    for (std::string& line : text)
        if (line.starts_with("views ")) line = "views 6";
    written.info->set("info", text);
    const auto less = bundleFromScene(written.document, {}, job);
    ASSERT_TRUE(less);
    EXPECT_FALSE(less->views[4].background);
    auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("of 5 view(s)"), std::string::npos) << notes[0];

    written.info->set("info", std::vector<std::string>{kMadeByUs, "background gone 0"});
    ASSERT_TRUE(bundleFromScene(written.document, {}, job));
    notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("'gone'"), std::string::npos) << notes[0];
}

// A museum may write "start 2" about its opening hours.
TEST(ViewNotes, OfOthersAreWords) {
    const std::vector<std::string> words{"start 2",        "duration 3",    "origin 5 5 5",
                                         "views 1",        "name #0 other", "bounds 0 0 0 1 1 1",
                                         "pruned #0 0 all"};
    const ViewNotes theirs = ViewNotes::parse(words);
    EXPECT_FALSE(theirs.start || theirs.duration || theirs.origin || theirs.bounds || theirs.count);
    EXPECT_TRUE(theirs.views.empty());
    // Others may have added words of their own to ours.
    for (const bool front : {true, false}) {
        std::vector<std::string> ours = words;
        ours.insert(front ? ours.begin() : ours.end(), kMadeByUs);
        EXPECT_EQ(ViewNotes::parse(ours).start, 2.0);
        EXPECT_EQ(ViewNotes::parse(ours).origin, glm::dvec3(5));
        EXPECT_EQ(ViewNotes::parse(ours).views.size(), 1u);
    }
}

}  // namespace
}  // namespace stx::mpeg4
