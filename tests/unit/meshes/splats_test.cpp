#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <zstd.h>

#include "formats/files/deflate.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/meshes/models.hpp"
#include "tests/unit/splats/random_cloud.hpp"

namespace stx {
namespace {

std::string written(const SplatCloud& cloud, const std::string& name,
                    std::string* notes = nullptr) {
    const TemporaryFolder folder("splats");
    Job job;
    const auto done = writeSplats(folder / name, cloud, {}, job);
    EXPECT_TRUE(done) << done.error().text();
    if (notes)
        for (const auto& note : job.takeNotes()) *notes += note + "\n";
    const auto bytes = readFile(folder / name, Limits());
    return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

SplatCloud readBack(const std::string& bytes, const std::string& name) {
    const ReadModel model = readGoodText(bytes, name);
    EXPECT_TRUE(model.mesh.splats);
    EXPECT_TRUE(model.mesh.check());
    return model.mesh.splats ? *model.mesh.splats : SplatCloud();
}

/// Covariances do not hang on the order and signs of axes.
glm::dmat3 covarianceOf(const SplatCloud& cloud, std::size_t i) {
    const glm::dvec4 q(cloud.rotations[i]);
    glm::dmat3 m = glm::mat3_cast(glm::normalize(glm::dquat(q.w, q.x, q.y, q.z)));
    for (int k = 0; k < 3; ++k) m[k] *= static_cast<double>(cloud.scales[i][k]);
    return m * glm::transpose(m);
}

void expectAlike(const SplatCloud& a, const SplatCloud& b, double place, double size,
                 double colour) {
    ASSERT_EQ(a.positions.size(), b.positions.size());
    for (std::size_t i = 0; i < a.positions.size(); ++i) {
        const glm::dmat3 x = covarianceOf(a, i), y = covarianceOf(b, i);
        const double scale = x[0][0] + x[1][1] + x[2][2];
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(a.positions[i][k], b.positions[i][k], place);
            EXPECT_NEAR(a.colours[i][k], b.colours[i][k], colour);
            for (int l = 0; l < 3; ++l) EXPECT_NEAR(x[k][l], y[k][l], size * scale);
        }
        EXPECT_NEAR(a.opacities[i], b.opacities[i], colour);
    }
}

/// The cloud as a PLY file shows it: turned by half around X.
SplatCloud turned(SplatCloud cloud) {
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        glm::vec3& p = cloud.positions[i];
        p = {p.x, -p.y, -p.z};
        const glm::vec4 q = cloud.rotations[i];
        const glm::quat r = glm::quat(0, 1, 0, 0) * glm::quat(q.w, q.x, q.y, q.z);
        cloud.rotations[i] = {r.x, r.y, r.z, r.w};
    }
    return cloud;
}

TEST(Splats, PlyIsReadAsItIsWritten) {
    const SplatCloud cloud = randomCloud(300, 0, 1);
    const std::string bytes = written(cloud, "a.ply");
    EXPECT_EQ(bytes, written(cloud, "a.ply"));
    const SplatCloud back = readBack(bytes, "a.ply");
    expectAlike(turned(cloud), back, 0, 1e-5, 2e-6);
    EXPECT_EQ(back.up, glm::vec3(0, -1, 0));
}

TEST(Splats, GlbIsReadAsItIsWritten) {
    SplatCloud cloud = randomCloud(300, 0, 2);
    cloud.linear = true;
    const SplatCloud back = readBack(written(cloud, "a.glb"), "a.glb");
    expectAlike(cloud, back, 0, 1e-5, 2e-6);
    EXPECT_TRUE(back.linear);
    EXPECT_EQ(back.up, glm::vec3(0, 1, 0));
}

TEST(Splats, WhatIsUpInACloudIsUpInItsFile) {
    SplatCloud cloud = randomCloud(300, 0, 2);
    // A cloud whose up is as that of the file's kind stays as it is.
    cloud.up = {0, -1, 0};
    std::string notes;
    expectAlike(cloud, readBack(written(cloud, "a.ply", &notes), "a.ply"), 0, 1e-5, 2e-6);
    EXPECT_EQ(notes, "");
    expectAlike(turned(cloud), readBack(written(cloud, "a.glb", &notes), "a.glb"), 0, 1e-5, 2e-6);
    EXPECT_EQ(notes,
              "the splats are turned, x y z to x -y -z, so that +Y is up, as it is in such "
              "files\n");
    cloud.up = {0, 0, 1};
    for (const auto& [name, y] : {std::pair{"a.ply", -1.0f}, {"a.glb", 1.0f}}) {
        const SplatCloud back = readBack(written(cloud, name), name);
        for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
            EXPECT_EQ(back.positions[i].y, y * cloud.positions[i].z);
            EXPECT_EQ(back.positions[i].x, cloud.positions[i].x);
        }
    }
}

TEST(Splats, SpzRoundsAsItSays) {
    const SplatCloud cloud = randomCloud(300, 0, 3);
    std::string notes;
    const SplatCloud back = readBack(written(cloud, "a.spz", &notes), "a.spz");
    expectAlike(cloud, back, std::ldexp(0.5, -23) * 1.01, 0.1, 0.005);
    EXPECT_NE(notes.find("SPZ rounds positions by 6e-08 at most"), std::string::npos) << notes;
}

TEST(Splats, SpzSaysWhatItsBitsDoNotHold) {
    SplatCloud cloud = randomCloud(3, 0, 3);
    cloud.positions[1].z = -9e6f;
    const TemporaryFolder folder("splats");
    Job job;
    const auto done = writeSplats(folder / "a.spz", cloud, {}, job);
    ASSERT_FALSE(done);
    EXPECT_NE(done.error().message.find("24 bits"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.spz"));
}

/// What an SPZ file of version 2 with two splats of degree 1 packs, by hand.
std::string contentOfSpz(std::uint32_t version = 2) {
    std::string s("NGSP", 4);
    const auto word = [&](std::uint32_t v, int n) {
        for (int i = 0; i < n; ++i) s += static_cast<char>(v >> (8 * i) & 255);
    };
    word(version, 4);
    word(2, 4);
    s += std::string("\x01\x0c\0\0", 4);  // degree 1, 12 bits of fraction
    for (const int v : {4096, -2048, 0, 1, -1, 8192}) word(static_cast<std::uint32_t>(v), 3);
    s += "\xff\x80";
    s += std::string("\x80\x80\x80\xff\x00\x80", 6);
    s += std::string("\xa0\xa0\x90\xa0\xa0\xa0", 6);
    // x y z of (0, 0, 0, 1) and of (1, 0, 0, 0).
    s += "\x80\x80\x80\xff\x80\x80";
    for (int i = 0; i < 18; ++i) s += static_cast<char>(128 + 4 * i);
    return s;
}

std::string handmadeSpz(std::uint32_t version = 2) {
    const std::string s = contentOfSpz(version);
    const auto packed = compressGzip(std::as_bytes(std::span(s)), 6);
    return {reinterpret_cast<const char*>(packed.data()), packed.size()};
}

TEST(Splats, SpzOfVersion2) {
    const SplatCloud cloud = readBack(handmadeSpz(), "a.spz");
    ASSERT_EQ(cloud.positions.size(), 2u);
    EXPECT_EQ(cloud.positions[0], glm::vec3(1, -0.5f, 0));
    EXPECT_EQ(cloud.positions[1], glm::vec3(1 / 4096.0f, -1 / 4096.0f, 2));
    EXPECT_EQ(cloud.opacities[0], 1.0f);
    EXPECT_NEAR(cloud.scales[0].x, 1.0f, 1e-6f);  // 160 / 16 - 10 = 0
    EXPECT_NEAR(cloud.scales[0].z, std::exp(-1.0f), 1e-6f);
    EXPECT_NEAR(cloud.rotations[0].w, 1.0f, 1e-3f);
    EXPECT_NEAR(cloud.rotations[1].x, 1.0f, 1e-3f);
    EXPECT_NEAR(cloud.colours[1].x, 0.5f + 0.2820948f * 0.5f / 0.15f, 1e-4f);
    ASSERT_EQ(cloud.degree, 1);
    // Red of the first coefficient, then green, then blue; of one splat after the other.
    SplatCloud wanted;
    ASSERT_TRUE(wanted.resize(2, 1, Limits()));
    for (int i = 0; i < 18; ++i)
        wanted.setHarmonic(static_cast<std::size_t>(i / 9), i % 9 / 3, i % 3,
                           (4.0f * static_cast<float>(i)) / 128.0f);
    EXPECT_EQ(cloud.harmonics, wanted.harmonics);
}

TEST(Splats, DamagedSpzIsAnError) {
    EXPECT_EQ(readBadText(handmadeSpz(4), "a.spz").code, ErrorCode::unsupported);
    const std::string good = handmadeSpz();
    for (std::size_t i = 0; i < good.size(); ++i) (void)readBadText(good.substr(0, i), "a.spz");
    EXPECT_EQ(readBadText("NGS", "a.spz").code, ErrorCode::invalidInput);
}

void appendWord(std::string& to, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> (8 * i) & 255);
}

/// Version 4 of a cloud, which is version 3 in other wrapping; `room` bytes of an extension lie
/// before the table.
std::string longSpz(const std::string& version3, std::size_t room) {
    const auto gzip = std::as_bytes(std::span(version3));
    const auto unpacked = gunzip(gzip, Limits());
    EXPECT_TRUE(unpacked);
    std::string s(reinterpret_cast<const char*>(unpacked->data()), unpacked->size());
    const std::size_t count =
        static_cast<unsigned char>(s[8]) + 256u * static_cast<unsigned char>(s[9]);
    std::string table, streams, head = s.substr(0, 4);
    std::size_t at = 16;
    for (const std::size_t each : {9, 1, 3, 3, 4}) {
        std::string packed(ZSTD_compressBound(each * count), '\0');
        packed.resize(ZSTD_compress(packed.data(), packed.size(), s.data() + at, each * count, 3));
        appendWord(table, packed.size(), 8);
        appendWord(table, each * count, 8);
        streams += packed;
        at += each * count;
    }
    appendWord(head, 4, 4);
    head += s.substr(8, 7) + '\5';
    appendWord(head, 32 + room, 4);
    return head + std::string(12 + room, '\0') + table + streams;
}

TEST(Splats, SpzOfVersion4) {
    const SplatCloud cloud = randomCloud(300, 0, 3);
    const std::string version3 = written(cloud, "a.spz");
    const SplatCloud wanted = readBack(version3, "a.spz");
    const std::string good = longSpz(version3, 0);
    for (const std::size_t room : {0, 24}) {
        const SplatCloud back = readBack(longSpz(version3, room), "a.spz");
        EXPECT_EQ(back.positions, wanted.positions);
        EXPECT_EQ(back.scales, wanted.scales);
        EXPECT_EQ(back.rotations, wanted.rotations);
        EXPECT_EQ(back.opacities, wanted.opacities);
        EXPECT_EQ(back.colours, wanted.colours);
    }
    for (std::size_t i = 0; i < good.size(); i += 7) (void)readBadText(good.substr(0, i), "a.spz");
    // More splats than the streams hold, and a stream that claims more than zstd can pack.
    std::string bad = good;
    bad[10] = 1;
    EXPECT_EQ(readBadText(bad, "a.spz").code, ErrorCode::invalidInput);
    bad[15] = 6;
    EXPECT_EQ(readBadText(bad, "a.spz").code, ErrorCode::invalidInput);
}

/// What a PLY file of floats says as text.
std::string asText(const std::string& binary) {
    const std::size_t end = binary.find("end_header\n") + 11;
    std::string text = binary.substr(0, end);
    text.replace(text.find("binary_little_endian"), 20, "ascii");
    std::size_t each = 0;
    for (std::size_t at = 0; (at = text.find("property", at)) != std::string::npos; ++at) ++each;
    for (std::size_t i = 0; end + 4 * i < binary.size(); ++i) {
        float value = 0;
        std::memcpy(&value, binary.data() + end + 4 * i, 4);
        text += fmt::format("{}{}", static_cast<double>(value), (i + 1) % each == 0 ? "\n" : " ");
    }
    return text;
}

TEST(Splats, PlyAsTextIsReadLikeBinary) {
    const std::string binary = written(randomCloud(50, 0, 4), "a.ply");
    const std::string text = asText(binary);
    const SplatCloud wanted = readBack(binary, "a.ply"), back = readBack(text, "a.ply");
    EXPECT_EQ(back.positions, wanted.positions);
    EXPECT_EQ(back.scales, wanted.scales);
    EXPECT_EQ(back.rotations, wanted.rotations);
    EXPECT_EQ(back.opacities, wanted.opacities);
    EXPECT_EQ(back.colours, wanted.colours);
    EXPECT_EQ(back.up, glm::vec3(0, -1, 0));
    // Cut in its last line, and with a word among its numbers.
    EXPECT_EQ(readBadText(text.substr(0, text.size() - 60), "a.ply").code, ErrorCode::invalidInput);
    std::string bad = text;
    bad.replace(bad.rfind(' '), 2, " x");
    EXPECT_EQ(readBadText(bad, "a.ply").code, ErrorCode::invalidInput);
}

std::string splatPly(const std::string& more, std::size_t count, std::size_t values) {
    std::string s =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) + "\n";
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
        s += std::string("property float ") + name + "\n";
    s += more;
    for (const char* name :
         {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        s += std::string("property float ") + name + "\n";
    s += "end_header\n";
    for (std::size_t i = 0; i < values; ++i) {
        const float v = 0.125f * static_cast<float>(i % 32) - 1.0f;
        s.append(reinterpret_cast<const char*>(&v), 4);
    }
    return s;
}

std::string restOf(int count) {
    std::string s;
    for (int i = 0; i < count; ++i) s += "property float f_rest_" + std::to_string(i) + "\n";
    return s;
}

TEST(Splats, HarmonicsOfPlyAreChannelByChannel) {
    const SplatCloud cloud = readBack(splatPly(restOf(9), 1, 26), "a.ply");
    ASSERT_EQ(cloud.degree, 1);
    SplatCloud wanted;
    ASSERT_TRUE(wanted.resize(1, 1, Limits()));
    for (int k = 0; k < 9; ++k)
        wanted.setHarmonic(0, k % 3, k / 3, 0.125f * static_cast<float>(9 + k) - 1.0f);
    EXPECT_EQ(cloud.harmonics, wanted.harmonics);
}

TEST(Splats, WhatAPlyHasBesideSplatsIsSaidToBeDropped) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n";
    for (const char* name :
         {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
          "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        text += fmt::format("property float {}\n", name);
    const std::string values = "0 0 0 0 0 0 1 1 1 0 -3 -3 -3 1 0 0 0";
    EXPECT_TRUE(readGoodText(text + "end_header\n" + values + "\n", "a.ply").notes.empty());
    const auto model = readGoodText(text +
                                        "property float filter_3D\nelement face 1\n"
                                        "property list uchar int vertex_indices\nend_header\n" +
                                        values + " 0.1\n3 0 0 0\n",
                                    "a.ply");
    EXPECT_TRUE(model.mesh.splats);
    EXPECT_EQ(model.notes,
              (std::vector<std::string>{"dropped: PLY properties of vertices (filter_3D)",
                                        "dropped: PLY elements 'face' (1)"}));
}

/// A PLY file of splats, as text, of which each line has x, the logit of the opacity and w.
std::string textOfSplats(const std::string& lines) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex ";
    text += std::to_string(std::ranges::count(lines, '\n')) + "\n";
    for (const char* name : {"x", "opacity", "rot_0", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2",
                             "scale_0", "scale_1", "scale_2", "rot_1", "rot_2", "rot_3"})
        text += fmt::format("property double {}\n", name);
    text += "end_header\n";
    for (const char c : lines)
        text += c == '\n' ? " 0.25 0.25 1 1 1 -3 -3 -3 0 0 0\n" : std::string(1, c);
    return text;
}

TEST(Splats, FarFromZeroTheyCountFromAnOrigin) {
    // The broken one and the one that is hardly seen tell nothing of the origin.
    const auto model = readGoodText(
        textOfSplats("5000000.125 3 1\n9 3 0\n4999999.75 3 1\n-7000000 -4 1\n"), "a.ply");
    EXPECT_EQ(model.mesh.origin, glm::dvec3(5000000, 0, 0));
    EXPECT_TRUE(model.hasNote("1 of 4 splats left out"));
    EXPECT_TRUE(model.hasNote("the origin 5000000 0 0 is subtracted"));
    ASSERT_EQ(model.mesh.positions.size(), 3u);
    EXPECT_EQ(model.mesh.positions[0], glm::vec3(0.125f, 0.25f, 0.25f));
    EXPECT_EQ(model.mesh.positions[1], glm::vec3(-0.25f, 0.25f, 0.25f));
    EXPECT_EQ(model.mesh.positions[2], glm::vec3(-12000000, 0.25f, 0.25f));
    EXPECT_EQ(model.mesh.splats->positions, model.mesh.positions);
    // A single one, too: its size tells what floats lose.
    EXPECT_EQ(readGoodText(textOfSplats("5000000.125 3 1\n"), "a.ply").mesh.positions[0].x, 0.125f);
    // Exact in floats, and near enough to 0.
    EXPECT_EQ(readGoodText(textOfSplats("0.125 3 1\n"), "a.ply").mesh.origin, glm::dvec3(0.0));
}

TEST(Splats, ThoseThatHideMostFrameACloud) {
    const auto framing = [](const std::string& lines) {
        return readGoodText(textOfSplats(lines), "a.ply").mesh.points;
    };
    using Points = std::vector<std::uint32_t>;
    EXPECT_EQ(framing("0 3 1\n1 -0.2 1\n2 0.1 1\n"), (Points{0, 2}));
    // Opacities of 0.45, 0.02 and 0.27.
    EXPECT_EQ(framing("0 -0.2 1\n1 -4 1\n2 -1 1\n"), (Points{0, 2}));
}

TEST(Splats, WhatPlayCanvasPacksIsNotRead) {
    const Error error = readBadText(
        "ply\nformat ascii 1.0\nelement chunk 1\nproperty float min_x\nelement vertex 1\n"
        "property uint packed_position\nend_header\n0\n0\n",
        "a.ply");
    EXPECT_EQ(error.code, ErrorCode::unsupported);
    EXPECT_NE(error.message.find("splat-transform"), std::string::npos);
}

TEST(Splats, HarmonicsOfPlyHaveNoGap) {
    std::string rest = restOf(9);
    rest.replace(rest.find("f_rest_3"), 8, "f_rest_9");
    EXPECT_NE(readBadText(splatPly(rest, 1, 26), "a.ply").message.find("no f_rest_3"),
              std::string::npos);
}

TEST(Splats, FlagsOfSpzAreSaid) {
    const auto notesOf = [](char flags) {
        std::string content = contentOfSpz();
        content[14] = flags;
        const auto packed = compressGzip(std::as_bytes(std::span(content)), 6);
        return readGoodText({reinterpret_cast<const char*>(packed.data()), packed.size()}, "a.spz")
            .notes;
    };
    EXPECT_EQ(notesOf(0), std::vector<std::string>());
    EXPECT_NE(notesOf(1).at(0).find("antialiased"), std::string::npos);
    EXPECT_NE(notesOf(2).at(0).find("extensions"), std::string::npos);
    EXPECT_NE(notesOf(-128).at(0).find("ignored: 0x80"), std::string::npos);
}

TEST(Splats, HostilePlyIsAnErrorOrLeftOut) {
    EXPECT_NE(readBadText(splatPly(restOf(7), 1, 24), "a.ply").message.find("f_rest_"),
              std::string::npos);
    EXPECT_EQ(readBadText(splatPly("", 3000000000u, 17), "a.ply").code, ErrorCode::invalidInput);
    Limits little;
    little.maxMemoryBytes = 1 << 16;
    EXPECT_EQ(readBadText(splatPly("", 2000, 2000 * 17), "a.ply", little).code,
              ErrorCode::invalidInput);
    std::string broken = splatPly("", 2, 34);
    const float infinite = INFINITY, e80 = 80.0f;
    std::memcpy(broken.data() + broken.size() - 4 * 34, &infinite, 4);
    const ReadModel model = readGoodText(broken, "a.ply");
    EXPECT_TRUE(
        model.hasNote("1 of 2 splats left out: a value is not finite, a size is below 0 or "
                      "above 1e+15, an opacity is below 0 or a rotation has no length"));
    std::memcpy(broken.data() + broken.size() - 4 * 7, &e80, 4);
    EXPECT_NE(readBadText(broken, "a.ply").message.find("none of the 2 splats"), std::string::npos);
    EXPECT_EQ(readBadText(splatPly("", 0, 0), "a.ply").message,
              "there are no splats; at least one is expected");
}

TEST(Splats, WhatFollowsThoseThatThePlyHeaderCountsIsSaid) {
    // One splat more than it says, and two letters.
    const ReadModel more = readGoodText(splatPly("", 2, 3 * 17) + "ab", "a.ply");
    ASSERT_TRUE(more.mesh.splats);
    EXPECT_EQ(more.mesh.splats->positions.size(), 2u);
    EXPECT_TRUE(more.hasNote("the header says 2 splats: what follows them is ignored (70 bytes)"));
    EXPECT_FALSE(readGoodText(splatPly("", 2, 2 * 17), "a.ply").hasNote("follows"));
    std::string text = asText(written(randomCloud(5, 0, 4), "a.ply"));
    EXPECT_FALSE(readGoodText(text + "\n\n", "a.ply").hasNote("follows"));
    text.replace(text.find("vertex 5"), 8, "vertex 4");
    EXPECT_TRUE(readGoodText(text, "a.ply").hasNote("the header says 4 splats: what follows"));
}

TEST(Splats, APlyWithoutTheirPropertiesIsAPointCloud) {
    std::string text = splatPly("", 2, 34);
    text.replace(text.find("rot_3"), 5, "rat_3");
    const ReadModel model = readGoodText(text, "a.ply");
    EXPECT_FALSE(model.mesh.splats);
    EXPECT_EQ(model.mesh.points.size(), 2u);
}

TEST(Splats, NodesOfGltfTurnAndScaleThem) {
    const SplatCloud cloud = randomCloud(20, 0, 5);
    std::string glb = written(cloud, "a.glb");
    // The node's name makes room for a transform of the same length.
    const std::string name = R"({"name":"splats","mesh":0})",
                      other = R"({"scale":[2,2,2],"mesh":0})";
    const auto at = glb.find(name);
    ASSERT_NE(at, std::string::npos);
    ASSERT_EQ(name.size(), other.size());
    glb.replace(at, name.size(), other);
    SplatCloud twice = cloud;
    for (std::size_t i = 0; i < 20; ++i) {
        twice.positions[i] *= 2.0f;
        twice.scales[i] *= 2.0f;
    }
    expectAlike(twice, readBack(glb, "a.glb"), 1e-6, 1e-5, 2e-6);
}

TEST(Splats, GltfThatLacksAnAttributeIsAnError) {
    std::string glb = written(randomCloud(4, 0, 5), "a.glb");
    glb.replace(glb.find("splatting:SCALE"), 15, "splatting:SCALF");
    EXPECT_NE(readBadText(glb, "a.glb").message.find("KHR_gaussian_splatting:SCALE"),
              std::string::npos);
}

}  // namespace
}  // namespace stx
