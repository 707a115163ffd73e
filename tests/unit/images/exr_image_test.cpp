// Which part and which channels of an OpenEXR file are its picture.

#include "formats/images/exr_image.hpp"

#include <gtest/gtest.h>

#include "formats/exr/exr_file.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// Channels of one value each.
using Channels = std::vector<std::pair<std::string, float>>;

/// A file of 3x2 pixels whose parts have these channels.
Bytes exrOf(const std::vector<Channels>& channels) {
    const TemporaryFolder folder;
    std::vector<ExrPart> parts;
    for (const Channels& each : channels) {
        ExrPart part;
        part.name = fmt::format("part {}", parts.size());
        part.width = part.displayWidth = 3;
        part.height = part.displayHeight = 2;
        for (const auto& [name, value] : each)
            part.channels.push_back({name, ExrChannel::Type::float32});
        parts.push_back(std::move(part));
    }
    auto file = OutputFile::create(folder / "a.exr", {});
    EXPECT_TRUE(file);
    auto writer = ExrWriter::create(*file, parts);
    EXPECT_TRUE(writer) << writer.error().text();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        std::vector<std::vector<float>> values;
        for (const auto& [name, value] : channels[i]) values.emplace_back(6, value);
        std::vector<ExrConstPixels> pixels;
        for (std::size_t c = 0; c < values.size(); ++c)
            pixels.push_back({channels[i][c].first, values[c].data(), 1});
        EXPECT_TRUE(writer->writePart(static_cast<int>(i), pixels));
    }
    EXPECT_TRUE(writer->finish());
    EXPECT_TRUE(file->commit());
    return readFile(folder / "a.exr", Limits()).value();
}

/// The picture's colour, which is the same everywhere.
glm::vec4 colourOf(const std::vector<Channels>& channels) {
    const auto image = decodeImage(exrOf(channels), "a.exr", Limits());
    EXPECT_TRUE(image) << image.error().text();
    return image ? rgbaFloatFrom(*image).at(2, 1) : glm::vec4(-1);
}

TEST(ExrImage, GreyIsYWhateverIsBesideIt) {
    EXPECT_EQ(colourOf({{{"Y", 0.5f}}}), glm::vec4(0.5f, 0.5f, 0.5f, 1));
    EXPECT_EQ(colourOf({{{"A", 1.0f}, {"Y", 0.5f}}}), glm::vec4(0.5f, 0.5f, 0.5f, 1));
    EXPECT_EQ(colourOf({{{"A", 0.5f}, {"Y", 0.25f}, {"Z", 7.0f}}}),
              glm::vec4(0.5f, 0.5f, 0.5f, 0.5f));
    EXPECT_EQ(colourOf({{{"mask", 0.5f}}}), glm::vec4(0.5f, 0.5f, 0.5f, 1));
}

TEST(ExrImage, ColoursOfALayerAreTakenByName) {
    const auto layer = [](const std::string& name, float red) {
        return Channels{
            {name + ".A", 0.5f}, {name + ".B", 0}, {name + ".G", 0.25f}, {name + ".R", red}};
    };
    const auto joined = [](Channels a, const Channels& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
    };
    EXPECT_EQ(colourOf({layer("ViewLayer.Combined", 0.5f)}), glm::vec4(1, 0.5f, 0, 0.5f));
    EXPECT_EQ(colourOf({joined(layer("ViewLayer.AO", 0.25f), layer("ViewLayer.Combined", 0.5f))}),
              glm::vec4(1, 0.5f, 0, 0.5f));
    EXPECT_EQ(colourOf({joined(layer("left.diffuse", 0.25f), layer("left", 0.5f))}),
              glm::vec4(1, 0.5f, 0, 0.5f));
    // A file's own colours come before those of layers.
    EXPECT_EQ(colourOf({joined(layer("albedo", 0.25f), {{"B", 0}, {"G", 0}, {"R", 0.125f}})}),
              glm::vec4(0.125f, 0, 0, 1));
}

TEST(ExrImage, TheFirstPartThatIsAPictureIsTaken) {
    const std::vector<Channels> parts = {
        {{"Z", 5.0f}}, {{"id", 3.0f}}, {{"B", 0}, {"G", 0.25f}, {"R", 0.5f}}, {{"Y", 0.75f}}};
    EXPECT_EQ(colourOf(parts), glm::vec4(0.5f, 0.25f, 0, 1));
    const Bytes file = exrOf(parts);
    EXPECT_EQ(decodeImage(file, "a.exr", Limits())->pictures, 2);
    const auto depth = decodeDepthImage(file, "a.exr", Limits());
    ASSERT_TRUE(depth) << depth.error().text();
    EXPECT_EQ(depth->channelNames, std::vector<std::string>{"Z"});
    EXPECT_EQ(std::get<2>(depth->values)[5], 5.0f);
    // Depth as grey, in a part that no name tells.
    EXPECT_EQ(decodeDepthImage(exrOf({parts[2]}), "a.exr", Limits())->channels, 3);
}

TEST(ExrImage, ThreeChannelsThatAreNoColoursAreNoPicture) {
    const Bytes file = exrOf({{{"N.X", 0}, {"N.Y", 0}, {"N.Z", 1}}});
    const auto image = decodeImage(file, "a.exr", Limits());
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().text(), "'a.exr': there are no channels R, G, B or Y in it");
    EXPECT_TRUE(decodeDepthImage(file, "a.exr", Limits()));
}

}  // namespace
}  // namespace stx
