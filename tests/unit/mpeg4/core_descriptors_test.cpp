// Object descriptors against bytes written by hand by ISO/IEC 14496-1, 7.2.6.

#include <gtest/gtest.h>

#include "formats/mpeg4/bifs/descriptors.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

constexpr std::array<std::uint32_t, 2> kMpod = {10, 11};

std::uint32_t referenceOf(std::uint32_t id) {
    return id == 10 ? 1 : id == 11 ? 2 : 0;
}

TEST(Descriptors, TheObjectDescriptorFrameOfTheFactsIsReadAndWritten) {
    const Bytes frame = unhex("01 10 11 06 02 9f 0f 02 00 01 11 06 02 df 0f 02 00 02");
    const auto commands = decodeOdFrame(frame, {kMpod});
    ASSERT_TRUE(commands) << commands.error().text();
    const auto& update = std::get<UpdateObjectDescriptors>(commands->at(0));
    ASSERT_EQ(update.descriptors.size(), 2u);
    EXPECT_EQ(update.descriptors[0].id, 10);
    EXPECT_EQ(update.descriptors[0].streams.at(0).esId, 10u);
    EXPECT_EQ(update.descriptors[1].id, 11);
    EXPECT_EQ(update.descriptors[1].streams.at(0).esId, 11u);
    const auto bytes = encodeOdFrame(*commands, referenceOf);
    ASSERT_TRUE(bytes) << bytes.error().text();
    EXPECT_EQ(hex(*bytes), hex(frame));
}

TEST(Descriptors, TheInitialDescriptorOfTheFactsIsReadAndWritten) {
    const Bytes bytes = unhex("10 13 00 4f 01 fe 00 00 fe 0e 04 00 00 00 01 0e 04 00 00 00 02");
    const auto decoded = decodeIod(bytes, {});
    ASSERT_TRUE(decoded) << decoded.error().text();
    EXPECT_EQ(decoded->iod.id, 1);
    EXPECT_EQ(decoded->iod.odProfileLevel, 0x01);
    EXPECT_EQ(decoded->iod.sceneProfileLevel, 0xFE);
    EXPECT_EQ(decoded->iod.audioProfileLevel, 0x00);
    EXPECT_EQ(decoded->iod.graphicsProfileLevel, 0xFE);
    EXPECT_EQ(decoded->trackIds, (std::vector<std::uint32_t>{1, 2}));
    const auto again = encodeIod(decoded->iod, decoded->trackIds);
    ASSERT_TRUE(again);
    EXPECT_EQ(hex(*again), hex(bytes));
}

TEST(Descriptors, TheStreamDescriptorsOfTheFactsAreReadAndWritten) {
    for (const char* text :
         {"03 19 00 00 00 04 11 01 0d 00 00 1a 00 00 00 00 00 00 00 00 05 02 08 20 06 01 02",
          "03 1e 00 00 00 04 16 6c 11 00 02 d7 00 00 16 b8 00 00 16 b8 05 07 00 14 00 01 00 01 03 "
          "06 01 02"}) {
        const auto stream = decodeEsDescriptor(unhex(text));
        ASSERT_TRUE(stream) << stream.error().text();
        const auto bytes = encodeEsDescriptor(*stream);
        ASSERT_TRUE(bytes);
        EXPECT_EQ(hex(*bytes), text);
    }
}

TEST(Descriptors, EveryCommandComesBack) {
    ElementaryStream stream;
    stream.esId = 11;
    std::vector<OdCommand> commands;
    commands.push_back(UpdateObjectDescriptors{{{7, "http://example.org/x", {}}}});
    commands.push_back(RemoveObjectDescriptors{{1, 1022, 3}});
    commands.push_back(UpdateStreams{10, {stream}});
    commands.push_back(RemoveStreams{10, {11, 10}});
    commands.push_back(OtherOdCommand{5, unhex("0102")});
    const auto bytes = encodeOdFrame(commands, referenceOf);
    ASSERT_TRUE(bytes) << bytes.error().text();
    const auto again = decodeOdFrame(*bytes, {kMpod});
    ASSERT_TRUE(again) << again.error().text();
    ASSERT_EQ(again->size(), commands.size());
    EXPECT_EQ(std::get<UpdateObjectDescriptors>(again->at(0)).descriptors.at(0).url,
              "http://example.org/x");
    EXPECT_EQ(std::get<RemoveObjectDescriptors>(again->at(1)).ids, (std::vector<int>{1, 1022, 3}));
    EXPECT_EQ(std::get<UpdateStreams>(again->at(2)).streams.at(0).esId, 11u);
    EXPECT_EQ(std::get<RemoveStreams>(again->at(3)).esIds, (std::vector<std::uint32_t>{11, 10}));
    EXPECT_EQ(std::get<OtherOdCommand>(again->at(4)).tag, 5);
    EXPECT_EQ(hex(std::get<OtherOdCommand>(again->at(4)).body), "01 02");
}

TEST(Descriptors, UnknownOnesArePassedOverAndLongLengthsAreRead) {
    // ES_ID_Ref behind an unknown descriptor 0x55, with lengths of 4 bytes.
    const Bytes frame =
        unhex("01 80 80 80 13 11 80 80 80 0e 02 9f 55 80 80 80 01 00 0f 80 80 80 02 00 01");
    const auto commands = decodeOdFrame(frame, {kMpod});
    ASSERT_FALSE(commands) << "the lengths are one too small";
    const Bytes good =
        unhex("01 80 80 80 14 11 80 80 80 0f 02 9f 55 80 80 80 01 00 0f 80 80 80 02 00 01");
    const auto read = decodeOdFrame(good, {kMpod});
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(std::get<UpdateObjectDescriptors>(read->at(0)).descriptors.at(0).streams.at(0).esId,
              10u);
}

TEST(Descriptors, DamageIsToldWithItsByte) {
    const auto error = [](std::string_view text) {
        const auto commands = decodeOdFrame(unhex(text), {kMpod});
        return commands ? "read" : commands.error().text();
    };
    EXPECT_NE(error("01 10 11").find("descriptor 0x01 at byte 0"), std::string::npos)
        << error("01 10 11");
    EXPECT_NE(error("01 04 11 07 02 9f").find("descriptor 0x11 at byte 2"), std::string::npos);
    EXPECT_NE(error("01 ff ff ff ff 7f").find("more than 4 bytes"), std::string::npos);
    EXPECT_FALSE(decodeIod(unhex("11 02 00 4f"), {}));
    EXPECT_FALSE(decodeIod(unhex("10 02 00 4f"), {}));
    EXPECT_FALSE(decodeEsDescriptor(unhex("03 02 00 00")));
    // A reference that leads nowhere is a deviation, not an error.
    std::vector<Mp4Deviation> deviations;
    EXPECT_TRUE(decodeOdFrame(unhex("01 08 11 06 02 9f 0f 02 00 09"), {kMpod, &deviations}));
    ASSERT_EQ(deviations.size(), 1u);
    EXPECT_EQ(deviations[0].kind, Mp4Deviation::Kind::mpodMissing);
}

}  // namespace
}  // namespace stx::mpeg4
