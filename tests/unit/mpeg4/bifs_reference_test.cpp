// BIFS against the access units of another implementation.

#include <gtest/gtest.h>

#include "tests/same_scenes.hpp"
#include "tests/unit/mpeg4/core_fixtures.hpp"

namespace stx::mpeg4 {
namespace {

Result<Document> readFile(const std::filesystem::path& path) {
    Job job;
    return readMp4(openSource(path), job);
}

/// Encodes the frames of a document again and compares each with the bytes in the file.
void expectSameUnits(const std::filesystem::path& path, BifsStyle style) {
    const auto document = readFile(path);
    ASSERT_TRUE(document) << document.error().text();
    BifsEncoder encoder(document->bifsConfig, style, assignNodeIds(document->frames));
    ASSERT_EQ(document->frames.size(), document->sceneStream.samples.size());
    for (std::size_t i = 0; i < document->frames.size(); ++i) {
        const auto bytes = encoder.encode(document->frames[i].commands);
        ASSERT_TRUE(bytes) << path << ": " << bytes.error().text();
        const auto original = document->sceneStream.samples[i].data.load(Limits());
        ASSERT_TRUE(original);
        EXPECT_EQ(hex(*bytes), hex(*original)) << path << " access unit " << i + 1;
    }
}

TEST(BifsReference, MaskAndVectorFormIsReproducedByteForByte) {
    REQUIRE_SHARED(file, "reference/handmade/a_base_mask_vec.mp4");
    expectSameUnits(file, BifsStyle::maskAndVector());
}

TEST(BifsReference, ShortestFormIsReproducedByteForByte) {
    REQUIRE_SHARED(folder, "reference/mp4");
    const auto files = mp4FilesIn(folder);
    EXPECT_GE(files.size(), 20u);
    for (const auto& file : files) {
        SCOPED_TRACE(file.filename().string());
        expectSameUnits(file, BifsStyle::shortest());
    }
}

TEST(BifsReference, WhatIsEncodedDecodesToTheSameScene) {
    for (const char* folder : {"reference/mp4", "reference/handmade"}) {
        REQUIRE_SHARED(path, folder);
        for (const auto& file : mp4FilesIn(path)) {
            SCOPED_TRACE(file.filename().string());
            const auto document = readFile(file);
            ASSERT_TRUE(document) << document.error().text();
            for (const BifsStyle style : {BifsStyle::maskAndVector(), BifsStyle::shortest()})
                for (const int version : {1, 2}) {
                    const NodeIds ids = assignNodeIds(document->frames);
                    BifsConfig config = fitBifsConfig(document->bifsConfig, ids);
                    config.version = version;
                    config.usePredictiveMFField = version == 2;  // only the flag: never coded so
                    BifsEncoder encoder(config, style, ids);
                    BifsDecoder decoder(config, Limits());
                    std::vector<CommandFrame> frames;
                    for (const CommandFrame& frame : document->frames) {
                        const auto bytes = encoder.encode(frame.commands);
                        ASSERT_TRUE(bytes) << bytes.error().text();
                        auto commands = decoder.decode(*bytes);
                        ASSERT_TRUE(commands) << commands.error().text();
                        EXPECT_LT(decoder.bitsLeft(), 8u);
                        frames.push_back({frame.time, std::move(*commands)});
                    }
                    EXPECT_TRUE(sameFrames(frames, document->frames));
                }
        }
    }
}

TEST(BifsReference, QuantisedValuesAreThoseOfTheOtherDecoder) {
    REQUIRE_SHARED(file, "reference/mp4/10_quantized.mp4");
    const auto document = readFile(file);
    ASSERT_TRUE(document) << document.error().text();
    NodePtr transform;
    NodePtr octree;
    NodePtr points;
    forEachNode(document->frames[0].commands[0], [&](const NodePtr& node) {
        if (node->is("Transform")) transform = node;
        if (node->is("OctreeImage")) octree = node;
        if (node->is("PointTexture")) points = node;
    });
    ASSERT_TRUE(transform && octree && points);
    // Six digits, as the other decoder prints them.
    const auto translation = transform->get<glm::vec3>("translation");
    EXPECT_NEAR(translation.x, 0.996338, 2e-6);
    EXPECT_NEAR(translation.y, 1.99658, 2e-6);
    EXPECT_NEAR(translation.z, 2.99683, 2e-5);
    const auto rotation = transform->get<Rotation>("rotation");
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(rotation.axis[i], 0.57735, 1e-5);
    EXPECT_NEAR(rotation.angle, 2.0944, 1e-4);
    EXPECT_EQ(points->get<std::int32_t>("depthNbBits"), 8);
    EXPECT_EQ(octree->get<std::vector<std::int32_t>>("octree"), std::vector<std::int32_t>{129});
    EXPECT_EQ(octree->get<std::vector<std::int32_t>>("voxelImageIndex"),
              std::vector<std::int32_t>{0});
}

TEST(BifsReference, EfficientFloatsAreThoseOfTheOtherDecoder) {
    REQUIRE_SHARED(file, "reference/mp4/11_efficient_float.mp4");
    const auto document = readFile(file);
    ASSERT_TRUE(document) << document.error().text();
    NodePtr view;
    forEachNode(document->frames[0].commands[0], [&](const NodePtr& node) {
        if (node->is("DepthImage")) view = node;
    });
    ASSERT_TRUE(view);
    EXPECT_EQ(view->get<float>("farPlane"), 1000.0f);
    EXPECT_NEAR(view->get<float>("nearPlane"), 0.0999985, 5e-8);
    EXPECT_EQ(view->get<glm::vec2>("fieldOfView").x, 0.5f);
    EXPECT_NEAR(view->get<glm::vec2>("fieldOfView").y, 0.599976, 5e-7);
    EXPECT_EQ(view->get<glm::vec3>("position"), glm::vec3(1, 2, 3));
}

TEST(BifsReference, CommandsComposeToTheSceneThatTheyDescribe) {
    REQUIRE_SHARED(file, "reference/mp4/16_commands.mp4");
    const auto document = readFile(file);
    ASSERT_TRUE(document) << document.error().text();
    ASSERT_EQ(document->frames.size(), 3u);
    EXPECT_EQ(document->frames[1].time, 1000u);
    EXPECT_EQ(document->frames[2].time, 2000u);

    const auto start = composeScene(document->frames, 0);
    const auto middle = composeScene(document->frames, 1000);
    const auto end = composeScene(document->frames);
    ASSERT_TRUE(start && middle && end);
    const auto transform = [](const Scene& scene) {
        return scene.root->get<NodeList>("children").at(0);
    };
    EXPECT_EQ(transform(*start)->get<glm::vec3>("translation"), glm::vec3(0));
    EXPECT_EQ(transform(*middle)->get<glm::vec3>("translation"), glm::vec3(1, 2, 3));
    // REPLACE TX.url, then APPEND a DepthImage and DELETE the first.
    const auto urlOf = [](const NodePtr& view) {
        return view->get<NodePtr>("diTexture")
            ->get<NodePtr>("texture")
            ->get<std::vector<Url>>("url")
            .at(0);
    };
    EXPECT_EQ(urlOf(transform(*start)->get<NodeList>("children").at(0)).objectDescriptorId, 10);
    EXPECT_EQ(urlOf(transform(*middle)->get<NodeList>("children").at(0)).objectDescriptorId, 12);
    ASSERT_EQ(transform(*end)->get<NodeList>("children").size(), 1u);
    EXPECT_EQ(transform(*end)->get<NodeList>("children").at(0)->get<glm::vec3>("position"),
              glm::vec3(0, 0, 5));

    // The document itself is untouched, and OD 12 came at 500.
    EXPECT_EQ(document->objectDescriptors(0).size(), 2u);
    EXPECT_EQ(document->objectDescriptors(500).size(), 3u);
}

}  // namespace
}  // namespace stx::mpeg4
