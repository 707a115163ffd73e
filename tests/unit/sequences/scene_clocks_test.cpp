// When a film changes that commands, clocks and object descriptors change together, and to what.

#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/scene_films.hpp"

using namespace stx;
using namespace stx::mpeg4;
using namespace scenes;

TEST(SceneClocks, RunWhenCommandsStartThem) {
    const auto started = [] {
        return moved("cycleInterval 4 startTime 100", "AT 1000 { REPLACE TS.startTime BY 0 }");
    };
    expectPlaces(started(), {{0, -1}, {1, 0}, {2, 1}, {3, 2}, {4, 3}, {5, 4}});
    const auto sequence = opened(started());
    ASSERT_TRUE(sequence);
    EXPECT_EQ(sequence->timeline().count(), 102u) << "of the start that never comes, none";
    EXPECT_NEAR(sequence->timeline().times.back(), 5, 1e-9);

    expectPlaces(moved("cycleInterval 4 startTime 100",
                       "AT 1000 { REPLACE TS.startTime BY 0 } AT 3000 { REPLACE PI.key BY [0 1] }"),
                 {{0, -1}, {1, 0}, {2, 1}, {3, 2}, {4, 3}, {5, 4}});
    expectPlaces(moved("cycleInterval 4 enabled FALSE", "AT 2000 { REPLACE TS.enabled BY TRUE }"),
                 {{0, -1}, {2, 2}, {3, 3}, {4, 4}});
}

TEST(SceneClocks, RunAgainWhenCommandsRestartThem) {
    expectPlaces(moved("cycleInterval 4", "AT 6000 { REPLACE TS.startTime BY 0 }"),
                 {{0, 0}, {2, 2}, {4, 4}, {5, 4}, {6, 0}, {7, 1}, {8, 2}, {10, 4}});
    // At the very end, which doubles may miss: 1.1 + 4.3 is more than 5.4.
    expectPlaces(moved("cycleInterval 4.3 startTime 1.1", "AT 5400 { REPLACE TS.startTime BY 0 }"),
                 {{5.38, 4}, {5.4, 0}, {9.7, 4}}, 0.03);
}

TEST(SceneClocks, LoopAsLongAsElseSomethingLasts) {
    expectPlaces(moved("cycleInterval 4 loop TRUE", "AT 9000 { REPLACE PI.key BY [0 1] }"),
                 {{1, 1}, {3, 3}, {5, 1}, {6, 2}, {7, 3}, {9, 1}, {9.8, 1.8}, {11.96, 3.96}});
    expectPlaces(moved("cycleInterval 2 loop TRUE stopTime 5"),
                 {{1, 2}, {3, 2}, {4.52, 1.04}, {5, 2}});
    // Another clock, and the cycle that is under way at its end.
    const auto sequence = opened(moved("cycleInterval 4 loop TRUE", "", R"(
DEF T2 TimeSensor { cycleInterval 9 } DEF P2 PositionInterpolator { } )"));
    ASSERT_TRUE(sequence);
    EXPECT_NEAR(sequence->timeline().end, 4, 1e-9) << "no route leaves the other";
    Document both =
        moved("cycleInterval 4 loop TRUE", "ROUTE T2.fraction_changed TO P2.set_fraction",
              "DEF T2 TimeSensor { cycleInterval 9 } DEF P2 PositionInterpolator { }");
    EXPECT_NEAR(opened(std::move(both))->timeline().end, 12, 1e-9);
}

TEST(SceneClocks, LeaveTheirLastValueBehind) {
    const std::string clock = "cycleInterval 4";
    expectPlaces(moved(clock, "AT 5000 { REPLACE TR.translation BY 9 0 0 }"),
                 {{0, 0}, {2, 2}, {4, 4}, {5, 9}, {6, 9}});
    // A command at the end comes after the clock's last value.
    expectPlaces(moved(clock, "AT 4000 { REPLACE TR.translation BY 9 0 0 }"), {{3, 3}, {4, 9}});
    for (const char* command : {"DELETE ROUTE RR", "REPLACE TS.enabled BY FALSE", "DELETE TS",
                                "REPLACE TS.stopTime BY 0"})
        expectPlaces(moved(clock, "AT 2000 { " + std::string(command) +
                                      " } AT 3500 { REPLACE TR.rotation BY 0 0 1 0 }"),
                     {{0, 0}, {1, 1}, {1.96, 1.96}, {2, 2}, {3, 2}, {3.6, 2}});
    // While it runs, it sends on.
    expectPlaces(moved(clock, "AT 2000 { REPLACE TR.translation BY 9 0 0 }"),
                 {{1, 1}, {2.04, 2.04}});
}

TEST(SceneClocks, OneAfterTheOtherDriveTheSame) {
    expectPlaces(moved("cycleInterval 2", "ROUTE T2.fraction_changed TO PI.set_fraction",
                       "DEF T2 TimeSensor { cycleInterval 4 startTime 3 }"),
                 {{1, 2}, {2, 4}, {2.96, 4}, {4, 1}, {5, 2}, {7, 4}});
}

TEST(SceneClocks, KeepTheirStartAndCycleWhileActive) {
    for (const char* command : {"REPLACE TS.startTime BY 0", "REPLACE TS.cycleInterval BY 8"})
        expectPlaces(moved("cycleInterval 4", "AT 2000 { " + std::string(command) + " }"),
                     {{1, 1}, {1.96, 1.96}, {2, 2}, {3, 3}, {4, 4}});
    // Not when a command before, of the same time, has stopped them.
    expectPlaces(
        moved("cycleInterval 4", "AT 2000 { REPLACE TS.stopTime BY 0 REPLACE TS.startTime BY 0 }"),
        {{1, 1}, {2, 0}, {3, 1}, {6, 4}});
    // Nor when one of the same time would start them.
    expectPlaces(moved("cycleInterval 4",
                       "AT 6000 { REPLACE TS.cycleInterval BY 8 REPLACE TS.startTime BY 0 }"),
                 {{4, 4}, {5, 4}, {6, 0}, {8, 1}, {14, 4}});
}

TEST(SceneClocks, MoviesRunWhenCommandsStartThem) {
    const auto started = [] {
        return film("startTime 100", "AT 1000 { REPLACE MT.startTime BY 0 }");
    };
    expectPictures(started(), {{.6, 0}, {1.1, 0}, {1.6, 1}, {2.1, 2}, {2.6, 3}, {3.6, 5}});
    EXPECT_NEAR(opened(started())->timeline().end, 4, 1e-9);
}

TEST(SceneClocks, MoviesLoopAsLongAsElseSomethingLasts) {
    expectPictures(film("loop TRUE", "AT 7000 { REPLACE TR.rotation BY 0 0 1 0.0001 }"),
                   {{.6, 1}, {2.6, 5}, {3.1, 0}, {3.6, 1}, {4.6, 3}, {6.6, 1}, {7.1, 2}, {8.1, 4}});
    EXPECT_NEAR(opened(film("loop TRUE"))->timeline().end, 3, 1e-9);
}

TEST(SceneClocks, MoviesKeepTheirStartAndSpeedWhileActive) {
    const Shown asBefore = {{.6, 1}, {1.1, 2}, {1.6, 3}, {2.1, 4}, {2.6, 5}};
    expectPictures(film("", "AT 1000 { REPLACE MT.speed BY 2 }"), asBefore);
    expectPictures(film("", "AT 1200 { REPLACE MT.startTime BY 0 }"), asBefore);
    expectPictures(film("", "AT 3000 { REPLACE MT.speed BY 2 REPLACE MT.startTime BY 0 }"),
                   {{2.6, 5}, {3.1, 0}, {3.3, 1}, {4.4, 5}});
}

TEST(SceneClocks, MoviesRunBackToTheirFirstPicture) {
    for (const float speed : {1.0f, 2.0f}) {
        const auto at = [&](double seconds) { return seconds / speed; };
        expectPictures(film("speed -" + std::to_string(speed)), {{at(.1), 5},
                                                                 {at(.6), 4},
                                                                 {at(1.1), 3},
                                                                 {at(1.6), 2},
                                                                 {at(2.1), 1},
                                                                 {at(2.6), 0},
                                                                 {at(2.9), 0},
                                                                 {at(3.5), 0}});
    }
}

TEST(SceneClocks, ObjectDescriptorsActAtTheirTime) {
    for (const char* commands : {"", "AT 2000 { REPLACE TR.rotation BY 0 0 1 0.0001 }"}) {
        Document document = film("", commands);
        document.odFrames.clear();
        addStream(document, 0, pictures({40}));
        addStream(document, 1, pictures({80}));
        const auto count = document.frames.size() + 1;
        document.odFrames[1].commands.insert(document.odFrames[1].commands.begin(),
                                             RemoveObjectDescriptors{{10}});
        expectPictures(document, {{.5, 1}, {1.5, 2}, {2.5, 2}, {.5, 1}});
        EXPECT_EQ(opened(document)->timeline().count(), count);
    }
    // One that no texture has changes nothing.
    Document document = film("");
    document.odFrames.clear();
    addStream(document, 0, pictures({40}));
    addStream(document, 1, pictures({80}));
    std::get<UpdateObjectDescriptors>(document.odFrames[1].commands[0]).descriptors[0].id = 11;
    EXPECT_EQ(opened(document)->timeline().count(), 1u);
}

TEST(SceneClocks, MoviesComeAndGoWithTheirNodes) {
    Document document = readText(R"(DEF G Group { children [ Group { } ] }
AT 500 { APPEND TO G.children Group { } }
AT 1000 { APPEND TO G.children DEF V DepthImage { diTexture SimpleTexture {
    depth DEF MT MovieTexture { url [od:10] } } } }
AT 2000 { DELETE V }
)");
    addStream(document, 0, pictures({0, 40, 80, 120, 160, 200}));
    Job job;
    const auto images = StreamImages::make(document, {}, job.limits);
    ASSERT_TRUE(images);
    const auto line = timelineOf(document, *images);
    ASSERT_TRUE(line) << line.error().text();
    EXPECT_EQ(line->times, (std::vector<double>{0, 0.5, 1, 1.5, 2}));
}

TEST(SceneClocks, RunBetweenPicturesAndOn) {
    // A picture less than a step away shows what has moved, too.
    Document document = moved("cycleInterval 4", "", R"(
DepthImage { orthographic FALSE diTexture SimpleTexture { depth PixelTexture { image 1 1 1 200 }
    texture MovieTexture { url [od:10] } } } )");
    addStream(document, 0, pictures({0, 40, 80, 120, 160, 200}));
    const auto sequence = opened(document);
    ASSERT_TRUE(sequence);
    const Timeline& line = sequence->timeline();
    EXPECT_EQ(line.count(), 101u - 6u + 3u) << "three pictures are between two steps";
    EXPECT_NEAR(line.times.back(), 4, 1e-9);
    for (std::size_t i = 1; i < line.count(); ++i)
        EXPECT_LT(line.times[i] - line.times[i - 1], 0.0601) << line.times[i];
}

TEST(SceneClocks, SendOneAtTheEndOfEachCycle) {
    expectPlaces(moved("cycleInterval 1 loop TRUE stopTime 2.5"),
                 {{0, 0}, {.96, 3.84}, {1, 4}, {1.04, .16}, {2, 4}, {2.04, .16}, {2.52, 2}});
    // Doubles of the times may be beside it.
    expectPlaces(moved("cycleInterval 0.2 loop TRUE startTime 1.1 stopTime 2.1"),
                 {{1.1, 0}, {1.3, 4}, {1.5, 4}, {1.7, 4}, {1.9, 4}, {2.1, 4}}, 1e-3);
}

TEST(SceneClocks, EndTheirCycleWhenTheyLoopNoMore) {
    const std::string off = "AT 2500 { REPLACE TS.loop BY FALSE }";
    expectPlaces(moved("cycleInterval 1 loop TRUE", off),
                 {{2.48, 1.92}, {2.5, 2}, {2.52, 2.08}, {2.96, 3.84}, {3, 4}});
    EXPECT_NEAR(opened(moved("cycleInterval 1 loop TRUE", off))->timeline().times.back(), 3, 1e-9);
    // Where they stop before, and where they begin after it.
    expectPlaces(moved("cycleInterval 1 loop TRUE stopTime 2.75", off), {{2.72, 2.88}, {2.76, 3}});
    expectPlaces(moved("cycleInterval 1 loop TRUE startTime 4", off), {{4.48, 1.92}, {5, 4}});
    // At a cycle's end, of which doubles are off; and anew by a later start.
    expectPlaces(
        moved("cycleInterval 0.1 loop TRUE",
              "AT 1100 { REPLACE TS.loop BY FALSE } AT 2000 { REPLACE TS.startTime BY 0 }"),
        {{1.1, 4}, {1.9, 4}, {2, 0}, {2.04, 1.6}, {2.12, 4}});
    // Of one that loops again, the next end counts.
    expectPlaces(moved("cycleInterval 1 loop TRUE", off + " AT 2700 { REPLACE TS.loop BY TRUE } "
                                                          "AT 3500 { REPLACE TS.loop BY FALSE }"),
                 {{2.62, 2.4}, {3.22, .8}, {3.5, 2}, {4, 4}});
    expectPictures(film("loop TRUE", "AT 4200 { REPLACE MT.loop BY FALSE }"),
                   {{3.1, 0}, {4.1, 2}, {4.6, 3}, {5.6, 5}, {6.1, 5}});
    // One that stops at the end of a cycle shows its last picture from then on.
    expectPictures(film("loop TRUE stopTime 3", "AT 4000 { REPLACE TR.rotation BY 0 0 1 0.1 }"),
                   {{2.6, 5}, {3.1, 5}, {4.1, 5}});
}

TEST(SceneClocks, CountFromTheAccessUnitThatBringsThem) {
    for (const char* start : {"", "startTime 0"}) {
        const std::string clock =
            "DEF T2 TimeSensor { cycleInterval 2 " + std::string(start) + " }";
        expectPlaces(moved("enabled FALSE",
                           "AT 1000 { APPEND TO G.children " + clock +
                               " INSERT ROUTE T2.fraction_changed TO "
                               "PI.set_fraction }",
                           "DEF G Group { }"),
                     {{0, -1}, {1, 0}, {2, 2}, {3, 4}});
    }
    // The movies in a PROTO, too, by themselves and by its fields.
    for (const char* start : {"startTime 0", "", "startTime IS begin"}) {
        Document document = readText(std::string(R"(
PROTO V [ field SFTime begin 0 ] { DepthImage { orthographic FALSE position 0 0 0
    diTexture SimpleTexture { depth PixelTexture { image 1 1 1 200 }
        texture MovieTexture { url [od:10] )") +
                                     start + R"( } } } }
DEF G Group { children [ DepthImage { orthographic FALSE diTexture SimpleTexture {
    depth PixelTexture { image 1 1 1 200 } texture PixelTexture { image 1 1 3 0 } } } ] }
AT 1000 { REPLACE G.children[0] BY V { } }
)");
        addStream(document, 0, pictures({0, 40, 80, 120, 160, 200}));
        expectPictures(document, {{.5, 0}, {1.1, 0}, {1.6, 1}, {2.1, 2}, {3.6, 5}});
    }
}

TEST(SceneClocks, MoviesRunInPROTOs) {
    const auto with = [](const std::string& protos, const std::string& view,
                         const std::string& commands = "") {
        Document document = readText(protos + "Group { children [ " + view + " ] }\n" + commands);
        addStream(document, 0, pictures({0, 40, 80, 120, 160, 200}));
        addStream(document, 0, pictures({200}));
        std::get<UpdateObjectDescriptors>(document.odFrames[1].commands[0]).descriptors[0].id = 11;
        return document;
    };
    const std::string depth = "depth PixelTexture { image 1 1 1 200 }";
    const std::string place = "orthographic FALSE position 0 0 0 ";
    const std::string simple =
        "SimpleTexture { " + depth + " texture MovieTexture { url [od:10] } }";
    const std::string view = "DepthImage { " + place + "diTexture " + simple + " }";
    const Shown shown = {{.1, 0}, {.6, 1}, {1.1, 2}, {2.6, 5}};
    expectPictures(with("PROTO V [ ] { " + view + " }", "V { }"), shown);
    expectPictures(with("PROTO V [ ] { " + view + " } PROTO W [ ] { V { } }", "W { }"), shown);
    expectPictures(
        with("PROTO T [ ] { " + simple + " }", "DepthImage { " + place + "diTexture T { } }"),
        shown);
    const std::string movie =
        "PROTO M [ exposedField MFURL url [] ] { MovieTexture { url IS url } }";
    const std::string ofMovie = "DepthImage { " + place + "diTexture SimpleTexture { " + depth +
                                " texture DEF M M { url [od:10] } } }";
    expectPictures(with(movie, ofMovie), shown);
    expectPictures(with(movie, ofMovie, "AT 1000 { REPLACE M.url BY [od:11] }"),
                   {{.6, 1}, {1.1, 5}, {2.6, 5}});
    // A field of a PROTO may be called as one of a view.
    expectPictures(with("PROTO V [ field SFInt32 diTexture 3 ] { " + view + " }", "V { }"), shown);
}

TEST(SceneClocks, ViewsRefuseWhatMayNotBeThere) {
    const auto errorOf = [](const std::string& text) {
        Job job;
        const auto bundle = bundleFromScene(readText(text), {}, job);
        return bundle ? std::string() : bundle.error().text();
    };
    const std::string wrong =
        "a PROTO brings Group into DepthImage.diTexture, where it is not allowed; put another node "
        "there";
    EXPECT_EQ(
        errorOf("PROTO T [ ] { Group { } } Group { children [ DepthImage { diTexture T { } } ] }"),
        wrong);
    EXPECT_EQ(errorOf("PROTO V [ field SFNode t NULL ] { DepthImage { diTexture IS t } } "
                      "Group { children [ V { t Group { } } ] }"),
              wrong);
}

TEST(SceneClocks, RoutesTakeWhatCommandsSend) {
    const auto with = [](const std::string& routes, const std::string& command) {
        return readText(R"(Group { children [ DEF TR Transform { children [
DepthImage { orthographic FALSE position 0 0 0 diTexture SimpleTexture {
    depth PixelTexture { image 1 1 1 200 } } } ] } DEF B Transform { } DEF C Transform { }
DEF V Valuator { } DEF N Conditional { }
DEF PI PositionInterpolator { key [0 1] keyValue [0 0 0, 4 0 0] } ] }
)" + routes + " AT 1000 { " +
                        command + " }");
    };
    expectPlaces(with("ROUTE PI.value_changed TO TR.translation", "REPLACE PI.set_fraction BY 0.5"),
                 {{.5, 0}, {1, 2}});
    expectPlaces(with("ROUTE B.translation TO TR.translation", "REPLACE B.translation BY 3 0 0"),
                 {{.5, 0}, {1, 3}});
    // In turn, in a circle, by a route that comes with it.
    expectPlaces(with("ROUTE B.translation TO C.translation ROUTE C.translation TO B.translation "
                      "ROUTE C.translation TO TR.translation",
                      "REPLACE B.translation BY 3 0 0"),
                 {{.5, 0}, {1, 3}});
    expectPlaces(with("",
                      "INSERT ROUTE B.translation TO TR.translation REPLACE B.translation BY "
                      "3 0 0 REPLACE C.translation BY 1 0 0 INSERT ROUTE C.translation TO "
                      "TR.translation REPLACE C.translation BY 5 0 0"),
                 {{.5, 0}, {1, 5}});
    const auto noteOf = [](Document document) {
        Job job;
        EXPECT_TRUE(sequenceFromScene(std::move(document), {}, job));
        const auto notes = job.takeNotes();
        return notes.empty() ? std::string() : notes.front();
    };
    const std::string start = "commands move nothing through these, which are not followed: ";
    EXPECT_EQ(noteOf(with("", "REPLACE N.activate BY TRUE")), start + "Conditional.activate");
    EXPECT_EQ(noteOf(with("ROUTE B.translation TO V.inSFVec3f", "REPLACE B.translation BY 1 0 0")),
              start + "Transform.translation TO Valuator.inSFVec3f");
    EXPECT_EQ(
        noteOf(with("ROUTE B.translation TO TR.translation", "REPLACE B.translation BY 1 0 0")),
        "");
}

TEST(SceneClocks, BrokenKeysAreNoted) {
    const auto noteOf = [](const std::string& keys) {
        Job job;
        Document document =
            moved("cycleInterval 4", "", "DEF P2 ScalarInterpolator { " + keys + " }");
        EXPECT_TRUE(sequenceFromScene(std::move(document), {}, job));
        const auto notes = job.takeNotes();
        return notes.empty() ? std::string() : notes.front();
    };
    const std::string expected =
        "; a key for each keyValue, in ascending order, is expected: its motion may stop or "
        "jump";
    EXPECT_EQ(noteOf("key [0 0.5 0.5 1] keyValue [1 2 3 4]"), "");
    EXPECT_EQ(noteOf("key [0 1] keyValue [1 2 3]"),
              "ScalarInterpolator 'P2' has 2 keys and 3 keyValues" + expected);
    EXPECT_EQ(noteOf("key [0 0.5 0.2] keyValue [1 2 3]"),
              "ScalarInterpolator 'P2' has the key 0.2 after 0.5" + expected);
}

TEST(SceneClocks, WhatTheyDoNotMoveIsNoted) {
    const auto noteOf = [](const Document& document) {
        Job job;
        EXPECT_TRUE(bundleFromScene(document, {}, job));
        for (const std::string& note : job.takeNotes())
            if (note.find("not followed") != std::string::npos) return note;
        return std::string();
    };
    EXPECT_EQ(noteOf(moved("cycleInterval 4")), "");
    const std::string start = "clocks move nothing through these, which are not followed: ";
    const auto with = [](const std::string& nodes, const std::string& routes,
                         const std::string& protos = "") {
        return readText(protos + R"(Group { children [ DEF TR Transform { children [
DepthImage { diTexture SimpleTexture { depth PixelTexture { image 1 1 1 200 } } } ] }
DEF TS TimeSensor { } DEF PI PositionInterpolator { } )" +
                        nodes + " ] }\n" + routes);
    };
    EXPECT_EQ(noteOf(with("DEF V Valuator { }",
                          "ROUTE TS.fraction_changed TO V.inSFFloat "
                          "ROUTE V.outSFVec3f TO TR.translation")),
              start + "TimeSensor.fraction_changed TO Valuator.inSFFloat");
    EXPECT_EQ(noteOf(with("DEF T2 TimeSensor { }", "ROUTE T2.cycleTime TO TS.startTime")),
              start + "TimeSensor.cycleTime TO TimeSensor.startTime");
    // At the end of a chain.
    EXPECT_EQ(noteOf(with("DEF N Transform { } DEF V Valuator { }",
                          "ROUTE TS.fraction_changed TO PI.set_fraction "
                          "ROUTE PI.value_changed TO N.translation "
                          "ROUTE N.translation TO V.inSFVec3f")),
              start + "Transform.translation TO Valuator.inSFVec3f");
    // What no clock reaches.
    EXPECT_EQ(noteOf(with("DEF V Valuator { }", "ROUTE V.outSFVec3f TO TR.translation")), "");

    const std::string mover = R"(PROTO Mover [ eventIn SFFloat fr exposedField SFVec3f at 0 0 0 ] {
    Transform { translation IS at children [ PositionInterpolator { set_fraction IS fr } ] } }
)";
    EXPECT_EQ(noteOf(with("DEF M Mover { }", "ROUTE TS.fraction_changed TO M.fr", mover)),
              start + "TimeSensor.fraction_changed TO Mover.fr");
    EXPECT_EQ(noteOf(with("DEF M Mover { }",
                          "ROUTE TS.fraction_changed TO PI.set_fraction "
                          "ROUTE PI.value_changed TO M.at",
                          mover)),
              "");
    const std::string clock = "PROTO Clock [ ] { Group { children [ TimeSensor { } ] } }\n";
    EXPECT_EQ(noteOf(with("Clock { }", "", clock)), start + "TimeSensor inside of PROTO Clock");
    EXPECT_EQ(noteOf(with("Outer { }", "",
                          clock + "PROTO Outer [ ] { Group { children [ Clock { } ] } }\n")),
              start + "TimeSensor inside of PROTO Clock, TimeSensor inside of PROTO Outer");
    EXPECT_EQ(noteOf(with("", "", clock)), "") << "no instance";
}

TEST(MediaClock, DwellsOnAPicture) {
    // media_rate 0: ISO/IEC 14496-12, 8.6.6.
    ElementaryStream stream = pictures({0, 40, 80, 120, 160, 200});
    stream.edits = {1000, {{1000, 1000, 0}, {1000, 0, 0x10000}}};
    const Presentation shown = presentationOf(stream);
    std::vector<std::size_t> samples;
    for (const double time : {.1, .4, .6, .9, 1.1, 1.6})
        samples.push_back(shown.sampleAt(time, 1e-6));
    EXPECT_EQ(samples, (std::vector<std::size_t>{2, 2, 2, 2, 0, 1}));
    EXPECT_NEAR(shown.duration, 2, 1e-9);
}

TEST(SceneClocks, MoveTheMomentAtWhichAStillIsRead) {
    for (const auto& [clock, x] : {std::pair{"cycleInterval 4", 0.0},
                                   {"cycleInterval 4 startTime -2 stopTime -3", 2.0},
                                   {"cycleInterval 4 startTime -9", -1.0},
                                   {"cycleInterval 4 startTime 1", -1.0}}) {
        SCOPED_TRACE(clock);
        const Document document = moved(clock);
        expectPlaces(document, {{0, x}});
        Job job;
        const auto still = bundleFromScene(document, {}, job);
        ASSERT_TRUE(still) << still.error().text();
        EXPECT_NEAR(still->views.at(0).camera.position.x, x, 1e-5);
        const auto table = viewsFromScene(std::make_shared<const Document>(document), {}, job);
        ASSERT_TRUE(table) << table.error().text();
        EXPECT_NEAR(std::as_const(**table).about().views.at(0).camera.position.x, x, 1e-5);
    }
}

// A stream that several textures name behind files of their own is the picture of none of these.
TEST(SceneStreams, StandBehindFilesThatAreNamedFirst) {
    const TemporaryFolder folder;
    for (const int grey : {40, 120}) {
        const auto bytes =
            pictures({static_cast<std::uint8_t>(grey)}).samples[0].data.load(Limits());
        ASSERT_TRUE(bytes);
        ASSERT_TRUE(writeFile(folder / fmt::format("{}.png", grey), *bytes));
    }
    std::string views;
    for (const char* name : {"40", "none", "120"})
        views += fmt::format(
            "DepthImage {{ orthographic FALSE diTexture SimpleTexture {{ depth PixelTexture {{ "
            "image 1 1 1 200 }} texture ImageTexture {{ url [\"{}.png\" od:10] }} }} }} ",
            name);
    Document document = readText("Group { children [ DEF T Transform { children [ " + views +
                                 "] } ] } AT 1000 { REPLACE T.translation BY 1 0 0 }");
    addStream(document, 0, pictures({200}));
    SceneReadOptions options;
    options.folder = folder.path();
    const auto sequence = opened(std::move(document), options);
    ASSERT_TRUE(sequence);
    for (const double time : {0, 1, 0}) {
        const Bundle frame = frameAt(*sequence, time);
        ASSERT_EQ(frame.views.size(), 3u);
        for (const auto& [view, grey] : {std::pair<std::size_t, int>{0, 40}, {1, 200}, {2, 120}})
            EXPECT_EQ(frame.views[view].texture.rgba8()->at(0, 0).r, grey) << view;
    }
}
