// Pixels in a file: they are what they were, and pictures drawn from them are the same to the bit.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <thread>

#include "formats/files/file_spool.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/factory.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// One that gives memory back whenever it looks.
std::unique_ptr<FileSpool> smallSpool(const TemporaryFolder& folder) {
    auto spool = FileSpool::create(folder.path(), 0);
    EXPECT_TRUE(spool);
    return std::move(*spool);
}

TEST(FileSpool, PixelsStayWhatTheyAre) {
    const TemporaryFolder folder;
    const auto spool = smallSpool(folder);
    Image<float> image(1000, 300, 1.0f);
    image.moveTo(spool.get());
    ASSERT_EQ(image.size(), glm::ivec2(1000, 300));
    for (int round = 0; round < 3; ++round) {
        for (std::size_t i = 0; i < image.count(); ++i)
            image.data()[i] += static_cast<float>(i % 7);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    for (std::size_t i = 0; i < image.count(); ++i)
        ASSERT_EQ(image.data()[i], 1.0f + 3.0f * static_cast<float>(i % 7));
    Image<float> copy = image;
    EXPECT_EQ(copy, image);
    copy.at(2, 1) = -1;
    EXPECT_NE(copy, image);
    image = std::move(copy);
    EXPECT_EQ(image.at(2, 1), -1);
    EXPECT_EQ(image.at(3, 1), 1.0f + 3.0f * static_cast<float>(1003 % 7));
}

TEST(FileSpool, CostsLittleOnADiskWithRoom) {
    const TemporaryFolder folder;
    EXPECT_TRUE(FileSpool::create(folder.path(), 0, 1 << 20));
    EXPECT_FALSE(FileSpool::create(folder.path(), 0, std::uint64_t{1} << 60)) << "it is full";
    EXPECT_FALSE(FileSpool::costsLittle(folder / "not there"));
    EXPECT_FALSE(FileSpool::costsLittle("/dev/shm")) << "in memory, or not there";
}

TEST(FileSpool, ServesManyThreads) {
    const TemporaryFolder folder;
    const auto spool = smallSpool(folder);
    parallelFor(0, 64, [&](std::int64_t i) {
        const auto value = static_cast<int>(i);
        Image<int> image(100 + value, 64, value);
        image.moveTo(spool.get());
        EXPECT_EQ(std::ranges::count(image.pixels(), value), (100 + value) * 64);
    });
}

/// Bytes of the open files in a folder that have no name any more.
std::uint64_t bytesWithoutName(const std::filesystem::path& folder) {
    std::uint64_t bytes = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code error;
        const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
        if (error || !target.starts_with(folder.string()) || !target.ends_with(" (deleted)"))
            continue;
        struct stat status {};
        if (::stat(entry.path().c_str(), &status) == 0)
            bytes += static_cast<std::uint64_t>(status.st_size);
    }
    return bytes;
}

TEST(FileSpool, TakesRoomThatWasGivenBack) {
    const TemporaryFolder folder;
    const auto spool = smallSpool(folder);
    constexpr int kImages = 3;
    const Image<float> image(1024, 64, 2.0f);
    const std::uint64_t all = kImages * image.count() * sizeof(float);
    for (int round = 0; round < 5; ++round) {
        std::vector<Image<float>> kept(kImages, image);
        for (auto& one : kept) one.moveTo(spool.get());
        for (auto& one : kept) one.at(round, round) = static_cast<float>(round);
        EXPECT_EQ(bytesWithoutName(folder.path()), all);
        for (const auto& one : kept) {
            EXPECT_EQ(one.at(round, round), static_cast<float>(round));
            EXPECT_EQ(one.at(1000, 60), 2.0f);
        }
    }
    Image<float> larger(2048, 64, 1.0f);
    larger.moveTo(spool.get());
    EXPECT_EQ(bytesWithoutName(folder.path()), all + larger.count() * sizeof(float));
}

TEST(FileSpool, LeavesNoFile) {
    const TemporaryFolder folder;
    const auto spool = smallSpool(folder);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    EXPECT_FALSE(FileSpool::create(folder / "none", 0));
}

Bundle inSpool(Bundle bundle, PixelSpool& spool) {
    for (ReferenceView& view : bundle.views) view.moveTo(&spool);
    return bundle;
}

void expectSame(const Bundle& bundle, const RenderSettings& settings) {
    const TemporaryFolder folder;
    const auto spool = smallSpool(folder);
    const Bundle kept = inSpool(bundle, *spool);
    Job job;
    const auto inMemory = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    const auto fromSpool = makeRenderer(Backend::cpu, kept, *spool, settings, -1, job);
    ASSERT_TRUE(inMemory && fromSpool);
    Camera camera = bundle.views[0].camera;
    camera.orientation = glm::slerp(camera.orientation, bundle.views[1].camera.orientation, 0.4);
    camera.position = glm::mix(camera.position, bundle.views[1].camera.position, 0.4);
    for (const Camera& c : {camera, bundle.views[3].camera}) {
        const auto a = (*inMemory)->render(c), b = (*fromSpool)->render(c);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->colour, b->colour);
        EXPECT_EQ(a->depth, b->depth);
        EXPECT_EQ(a->normal, b->normal);
    }
}

TEST(FileSpool, PicturesAreTheSame) {
    const Bundle bundle = torusViews(96);
    for (const auto mode : {RenderMode::surface, RenderMode::splat})
        for (const bool normals : {false, true}) {
            RenderSettings settings;
            settings.mode = mode;
            settings.normals = normals;
            expectSame(bundle, settings);
        }
    RenderSettings best;
    best.quality = Quality::best;
    expectSame(bundle, best);
}

TEST(FileSpool, PicturesOfRefinedAndTranslucentViewsAreTheSame) {
    Bundle bundle = torusViews(96);
    // Depth with noise, one exposure of its own, glass.
    std::uint32_t seed = 1;
    for (ReferenceView& view : bundle.views)
        for (float& depth : view.depth.pixels()) {
            seed = seed * 1664525u + 1013904223u;
            if (hasPoint(depth))
                depth *= 1 + 0.01f * (static_cast<float>(seed >> 8) * 0x1p-24f - 0.5f);
        }
    for (glm::u8vec4& c : bundle.views[2].texture.rgba8()->pixels())
        c = glm::u8vec4(glm::vec3(c) * 0.7f, c.a);
    for (glm::u8vec4& c : bundle.views[1].texture.rgba8()->pixels()) c.a /= 2;
    bundle.views[4].background = true;
    for (const auto mode : {RenderMode::surface, RenderMode::splat}) {
        RenderSettings settings;
        settings.mode = mode;
        expectSame(bundle, settings);
    }
}

}  // namespace
}  // namespace stx
