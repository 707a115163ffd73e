// What MovieTextures show when commands and routes change how they run (ISO/IEC 14772-1, 6.28).

#include "tests/unit/sequences/scene_films.hpp"

using namespace stx;
using namespace stx::mpeg4;
using namespace scenes;

namespace {

/// A picture of film() at each half second, while it runs from 0 at its usual speed.
const Shown kPlain = {{.1, 0}, {.6, 1}, {1.1, 2}, {1.6, 3}, {2.1, 4}, {2.6, 5}, {3.6, 5}};

}  // namespace

TEST(SceneMovies, TakeNoSpeedFromRoutesWhileActive) {
    const std::string routes = R"(
AT 0 { APPEND TO G.children DEF TS TimeSensor { cycleInterval 2 }
    APPEND TO G.children DEF SI ScalarInterpolator { key [0 1] keyValue [1 3] }
    INSERT ROUTE TS.fraction_changed TO SI.set_fraction
    INSERT ROUTE SI.value_changed TO MT.speed }
)";
    expectPictures(film("", "AT 0 { APPEND TO TR.children DEF G Group { } }" + routes), kPlain);
    // One that has not begun takes it: three times as fast.
    expectPictures(film("startTime 4", "AT 0 { APPEND TO TR.children DEF G Group { } }" + routes +
                                           "AT 6000 { REPLACE TR.rotation BY 0 0 1 0.0001 }"),
                   {{1, 0}, {4.1, 0}, {4.6, 3}, {5.1, 5}});
}

TEST(SceneMovies, KeepTheirLastPictureUntilTheyStartAnew) {
    // A start that is still to come.
    expectPictures(film("", "AT 4000 { REPLACE MT.startTime BY 2 }"),
                   {{2.6, 5}, {3.5, 5}, {4.1, 5}, {5.9, 5}, {6.1, 0}, {6.6, 1}, {8.6, 5}});
    expectPictures(film("stopTime 1.25", "AT 2000 { REPLACE MT.startTime BY 2 }"),
                   {{1.1, 2}, {1.5, 2}, {2.1, 2}, {3.9, 2}, {4.1, 0}, {4.6, 1}});
    // And how it shall run then.
    expectPictures(
        film("", R"(AT 4000 { REPLACE MT.speed BY -1 } AT 4500 { REPLACE MT.stopTime BY 1 }
AT 5000 { REPLACE MT.startTime BY 1 } AT 9000 { REPLACE TR.rotation BY 0 0 1 0.0001 })"),
        {{3.5, 5}, {4.1, 5}, {4.6, 5}, {5.1, 5}, {6.1, 5}, {6.6, 4}, {9, 0}});
    expectPictures(film("stopTime 1.25",
                        "AT 2000 { REPLACE MT.speed BY 2 }"
                        "AT 3000 { REPLACE MT.startTime BY 0 }"),
                   {{1.1, 2}, {2.1, 2}, {2.9, 2}, {3.1, 0}, {3.3, 1}, {4.4, 5}});
    // Any order of asking.
    const auto sequence = opened(film("", "AT 4000 { REPLACE MT.startTime BY 2 }"));
    ASSERT_TRUE(sequence);
    for (const auto& [time, number] : Shown{{6.6, 1}, {4.1, 5}, {1.1, 2}, {6.1, 0}, {4.1, 5}})
        EXPECT_EQ(frameAt(*sequence, time).views.at(0).texture.rgba8()->at(0, 0).r, 40 * number)
            << time;
}

TEST(SceneMovies, RunOnWhereTheyLoopAgain) {
    // Their loop may end, begin and end again; then the last picture of that cycle stays.
    expectPictures(
        film("", R"(AT 4000 { REPLACE MT.loop BY TRUE } AT 7000 { REPLACE MT.loop BY FALSE }
AT 10000 { REPLACE TR.rotation BY 0 0 1 0.0001 })"),
        {{2.6, 5}, {3.5, 5}, {4.1, 2}, {6.1, 0}, {8.6, 5}, {10, 5}});
}

TEST(SceneMovies, AStopAtABoundaryShowsTheNextPicture) {
    for (const char* command : {"", "AT 1700 { REPLACE TR.rotation BY 0 0 1 0.0001 }"}) {
        expectPictures(film("stopTime 1.5", command), {{1.1, 2}, {1.4, 2}, {1.5, 3}, {1.8, 3}});
        expectPictures(film("loop TRUE stopTime 4.5", command),
                       {{4.1, 2}, {4.4, 2}, {4.5, 3}, {5, 3}});
        expectPictures(film("speed -1 stopTime 1.5", command),
                       {{1.1, 3}, {1.4, 3}, {1.5, 2}, {1.8, 2}});
    }
    // Amid a picture, and at the end of a cycle, nothing changes.
    EXPECT_EQ(opened(film("stopTime 1.25"))->timeline().count(), 3u);
    EXPECT_EQ(opened(film("loop TRUE stopTime 3"))->timeline().count(), 6u);
}

TEST(SceneMovies, RemovedObjectDescriptorsShowNothing) {
    Document document = film("");
    document.odFrames.clear();
    addStream(document, 0, pictures({40}));
    OdFrame removal;
    removal.time = ticksAt(1, document.odStream.timescale);
    removal.commands.push_back(RemoveObjectDescriptors{{10}});
    document.odFrames.push_back(removal);
    const auto sequence = opened(document);
    ASSERT_TRUE(sequence);
    ASSERT_EQ(sequence->timeline().count(), 2u);
    Job job;
    EXPECT_TRUE(sequence->frame(0, job));
    const auto after = sequence->frame(1, job);
    ASSERT_FALSE(after);
    EXPECT_EQ(after.error().code, ErrorCode::invalidInput);
    EXPECT_NE(after.error().text().find("object descriptor 10 is named, which a command has "
                                        "removed before"),
              std::string::npos)
        << after.error().text();
    // Back at the start it is there, and where it comes again.
    EXPECT_TRUE(sequence->frame(0, job));
    addStream(document, 2, pictures({80}));
    expectPictures(document, {{.5, 1}, {2.5, 2}, {.5, 1}});
}
