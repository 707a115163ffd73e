#pragma once

#include <bit>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/exr/exr_file.hpp"
#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "tests/temporary_folder.hpp"

/// Exact sets made from a scene of formulas, written as other programs would write them. Nothing
/// here is shared with the readers.
namespace sets {

using namespace stx;

/// Views of the room at a small size with an off-centre principal point and unlike focal lengths.
inline std::vector<ReferenceView> roomViews(int count = 2, int width = 96, int height = 64) {
    std::vector<ReferenceView> views;
    for (int i = 0; i < count; ++i) {
        Camera camera = analyticCamera(AnalyticScene::room, i, count).resized(width, height);
        camera.cx += 3.25;
        camera.cy -= 1.75;
        camera.fy *= 1.05;
        camera.orientation =
            glm::normalize(camera.orientation * quatFromAxisAngle({0.3, 0.4, 0.8, 0.1 + 0.05 * i}));
        ReferenceView view = viewOfAnalyticScene(AnalyticScene::room, camera, 1);
        view.name = "v" + std::to_string(i);
        views.push_back(std::move(view));
    }
    return views;
}

inline void writeText(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
}

inline void writeBytes(const std::filesystem::path& file, const Bytes& bytes) {
    writeText(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

inline void writeColour(const std::filesystem::path& file, const ReferenceView& view) {
    std::vector<std::uint8_t> rgb;
    for (int y = 0; y < view.texture.height(); ++y)
        for (int x = 0; x < view.texture.width(); ++x)
            for (int k = 0; k < 3; ++k)
                rgb.push_back(static_cast<std::uint8_t>(view.texture.at(x, y)[k] * 255.0f + 0.5f));
    const auto png = encodePng(view.texture.width(), view.texture.height(), 3, 8, rgb.data(), true);
    ASSERT_TRUE(png);
    writeBytes(file, *png);
}

/// 16-bit (or 8-bit) PNG of code(x, y).
template <class Code>
void writeCodes(const std::filesystem::path& file, int width, int height, int bits,
                const Code& code) {
    std::vector<std::uint16_t> words;
    std::vector<std::uint8_t> bytes;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            words.push_back(static_cast<std::uint16_t>(code(x, y)));
            bytes.push_back(static_cast<std::uint8_t>(words.back()));
        }
    const auto png = bits == 16 ? encodePng(width, height, 1, 16, words.data(), false)
                                : encodePng(width, height, 1, 8, bytes.data(), false);
    ASSERT_TRUE(png);
    writeBytes(file, *png);
}

inline std::string floatBytes(float value, bool little = true) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    std::string out;
    for (int i = 0; i < 4; ++i)
        out += static_cast<char>(bits >> (little ? 8 * i : 24 - 8 * i) & 255);
    return out;
}

/// Cameras agree, and so do the points of all pixels: each within 1e-5 of its distance plus
/// `allowed(truth distance)`.
template <class Allowed>
void expectSame(const ReferenceView& truth, const ReferenceView& read, const Allowed& allowed,
                bool mirrored = false) {
    ASSERT_EQ(truth.depth.size(), read.depth.size());
    const Camera &a = truth.camera, &b = read.camera;
    EXPECT_NEAR(a.fx, b.fx, 1e-5);
    EXPECT_NEAR(a.fy, b.fy, 1e-5);
    EXPECT_NEAR(a.cx, b.cx, 1e-5);
    EXPECT_NEAR(a.cy, b.cy, 1e-5);
    EXPECT_EQ(a.orthographic, b.orthographic);
    int missing = 0, checked = 0;
    for (int y = 0; y < truth.depth.height(); ++y) {
        for (int x = 0; x < truth.depth.width(); ++x) {
            const float d = truth.depth.at(x, y);
            if (hasPoint(d) != hasPoint(read.depth.at(x, y))) {
                ++missing;
                continue;
            }
            if (!hasPoint(d)) continue;
            glm::dvec3 q = read.worldPoint(x, y);
            if (mirrored) q.z = -q.z;
            const double error = glm::length(q - truth.worldPoint(x, y));
            ASSERT_LE(error, 1e-5 * d + 2 * allowed(d)) << "at " << x << "," << y << " depth " << d;
            ++checked;
        }
    }
    EXPECT_EQ(missing, 0);
    EXPECT_GT(checked, 1000);
}
inline void expectSame(const ReferenceView& truth, const ReferenceView& read) {
    expectSame(truth, read, [](double) { return 0.0; });
}

inline Result<Bundle> readSet(const std::filesystem::path& path, ImageSetOptions options = {}) {
    Job job;
    options.depthBits = 32;
    return readImageSet(path, options, job);
}

/// The error of a set that must fail, its parts all there.
inline void expectError(const Result<Bundle>& result, std::initializer_list<const char*> parts) {
    ASSERT_FALSE(result);
    const std::string text = result.error().text();
    for (const char* part : parts)
        EXPECT_NE(text.find(part), std::string::npos) << part << " is missing in: " << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

using Planes = std::vector<std::pair<std::string, Image<float>>>;

/// A single-part OpenEXR file of 32-bit floats.
inline void writeExr(const std::filesystem::path& path, const Planes& planes) {
    std::filesystem::create_directories(path.parent_path());
    ExrPart part;
    part.width = part.displayWidth = planes[0].second.width();
    part.height = part.displayHeight = planes[0].second.height();
    for (const auto& [name, image] : planes) part.channels.push_back({name});
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file);
    auto writer = ExrWriter::create(*file, {part});
    ASSERT_TRUE(writer) << writer.error().text();
    std::vector<ExrConstPixels> pixels;
    for (const auto& [name, image] : planes) pixels.push_back({name, image.data(), 1});
    ASSERT_TRUE(writer->writePart(0, pixels));
    ASSERT_TRUE(writer->finish());
    ASSERT_TRUE(file->commit());
}

template <class Value>
Image<float> plane(int w, int h, const Value& value) {
    Image<float> out(w, h);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) out.at(x, y) = static_cast<float>(value(x, y));
    return out;
}

/// Red and green of each pixel are its own position: interpolation keeps that exactly.
inline void writePositions(const std::filesystem::path& path, int w, int h) {
    writeExr(path, {{"R", plane(w, h, [](int x, int) { return x + 0.5; })},
                    {"G", plane(w, h, [](int, int y) { return y + 0.5; })},
                    {"B", plane(w, h, [](int, int) { return 1; })}});
}

inline std::string rowsOf(const glm::dmat4& m) {
    std::string rows;
    for (int r = 0; r < 4; ++r)
        rows += fmt::format("{}[{},{},{},{}]", r ? "," : "", m[0][r], m[1][r], m[2][r], m[3][r]);
    return "[" + rows + "]";
}

inline std::string transformsFrame(const glm::dmat4& pose, const std::string& more) {
    return fmt::format("{{\"file_path\":\"a.png\",\"transform_matrix\":{}{}}}", rowsOf(pose), more);
}

inline std::string mivJson(int w, int h, const std::string& range, int colourBits = 8) {
    return fmt::format(
        R"({{"cameras":[{{"Name":"a","Position":[0,0,0],"Rotation":[0,0,0],"Depth_range":{},)"
        R"("Resolution":[{},{}],"BitDepthColor":{},"BitDepthDepth":16,)"
        R"("Projection":"Perspective","Focal":[33,35],"Principle_point":[19,16]}}]}})",
        range, w, h, colourBits);
}

/// Computer vision's camera axes from ours: y down, z forward.
inline glm::dmat3 visionRotation(const stx::Camera& c) {
    const glm::dmat3 r = glm::mat3_cast(c.orientation);
    return {r[0], -r[1], -r[2]};
}

}  // namespace sets
