// Decoding in child processes: side by side, and never in the way of PNG and JPEG; and which
// libraries a process loads.

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <new>
#include <thread>

#include "formats/images/images.hpp"
#include "formats/images/isolated_decode.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// Counters that this process and its children see.
struct Shared {
    std::atomic<int> inside = 0;
    std::atomic<bool> open = false;
};

Shared& shared() {
    static Shared* made = new (::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                                      MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared;
    return *made;
}

/// Maps the counters before there is a child, and sets them to their start.
class Isolated : public testing::Test {
  protected:
    void SetUp() override {
        shared().inside = 0;
        shared().open = false;
    }
};

template <class Condition>
bool waitFor(const Condition& condition) {
    for (int i = 0; i < 20000 && !condition(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return condition();
}

/// Decodes a picture of one pixel, after `wait` (in the child) has come true.
template <class Wait>
codecs::Table decoderThatWaits(Wait) {
    codecs::Table table;
    table.decode = [](const codecs::DecodeRequest& request, codecs::Failure& failure) {
        codecs::Header header;
        header.width = header.height = header.channels = 1;
        header.bits = 8;
        const char* name = "Y";
        header.channelNames = &name;
        auto* values =
            static_cast<unsigned char*>(request.allocate(request.context, header, failure));
        ++shared().inside;
        if (!values || !Wait()()) return false;
        *values = 77;
        return true;
    };
    return table;
}

bool decodesPixel(const codecs::Table& table) {
    unsigned char pixel = 0;
    codecs::DecodeRequest request;
    request.context = &pixel;
    request.allocate = [](void* context, const codecs::Header&, codecs::Failure&) {
        return context;
    };
    codecs::Failure failure;
    return decodeIsolated(table, request, 1 << 20, failure) && pixel == 77;
}

TEST_F(Isolated, DecodingsRunSideBySide) {
    constexpr int kTogether = 4;
    const auto table = decoderThatWaits(
        [] { return waitFor([] { return shared().inside.load() >= kTogether; }); });
    std::vector<int> good(kTogether, 0);
    std::vector<std::thread> threads;
    for (int i = 0; i < kTogether; ++i)
        threads.emplace_back([&, i] { good[i] = decodesPixel(table); });
    for (auto& thread : threads) thread.join();
    for (const int ok : good) EXPECT_TRUE(ok);
}

TEST_F(Isolated, PngAndJpegDoNotWait) {
    const auto table =
        decoderThatWaits([] { return waitFor([] { return shared().open.load(); }); });
    bool good = false;
    std::thread isolated([&] { good = decodesPixel(table); });
    EXPECT_TRUE(waitFor([] { return shared().inside.load() > 0; }));
    const std::vector<std::uint8_t> values(8 * 8 * 3, 50);
    const auto png = encodePng(8, 8, 3, 8, values.data(), true);
    const auto jpeg = encodeJpeg(8, 8, 3, values.data(), 90);
    EXPECT_TRUE(png && decodeImage(*png, "a.png", Limits()));
    EXPECT_TRUE(jpeg && decodeImage(*jpeg, "a.jpg", Limits()));
    shared().open = true;
    isolated.join();
    EXPECT_TRUE(good);
}

TEST_F(Isolated, ACrashIsSeenWhileAnotherDecodes) {
    const auto slow = decoderThatWaits([] { return waitFor([] { return shared().open.load(); }); });
    codecs::Table crashing;
    crashing.decode = [](const codecs::DecodeRequest&, codecs::Failure&) -> bool { ::_exit(9); };
    bool good = false;
    std::thread isolated([&] { good = decodesPixel(slow); });
    EXPECT_TRUE(waitFor([] { return shared().inside.load() > 0; }));
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(decodesPixel(crashing));
    shared().open = true;
    isolated.join();
    EXPECT_TRUE(good);
}

bool isLoaded(std::string_view library) {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        if (line.find(library) != std::string::npos) return true;
    }
    return false;
}

/// In ctest each test is a process; run together, another test may have loaded the module before.
TEST(Codecs, PngAndJpegNeedNoModule) {
    if (isLoaded("stx_codecs")) GTEST_SKIP() << "another test has loaded the module";
    const TemporaryFolder folder;
    ::setenv("STX_CODECS", "/dev/null", 1);
    std::vector<std::uint8_t> values(64 * 64 * 4);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i * 7);
    const auto png = encodePng(64, 64, 4, 8, values.data(), true);
    const auto jpeg = encodeJpeg(64, 64, 3, values.data(), 92);
    ASSERT_TRUE(png && jpeg);
    ASSERT_TRUE(writeFile(folder / "a.png", *png));
    preloadCodecs(folder / "a.png");
    preloadCodecs(folder.path());
    EXPECT_TRUE(decodeImage(*png, "a.png", Limits()));
    EXPECT_TRUE(decodeImage(*jpeg, "a.jpg", Limits()));
    EXPECT_TRUE(decodeRgba8(*png, "a.png", Limits()));
    EXPECT_FALSE(isLoaded("libOpenImageIO"));
    EXPECT_FALSE(isLoaded("stx_codecs"));
    // What does need it says so here.
    const std::string bitmap = "BM";
    const auto other = decodeImage(std::as_bytes(std::span(bitmap)), "a.bmp", Limits());
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::unsupported);
    ::unsetenv("STX_CODECS");
}

}  // namespace
}  // namespace stx
