// How fast a background is remembered: frames of 640x480 with the noise of a sensor and something
// that moves, already in memory. Prints frames per second of processor time and of the clock, and
// their ratio to copying the same frames. Usage: bench_background [THREADS]

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "lib/background/temporal.hpp"
#include "lib/base/parallel.hpp"

namespace {

using namespace stx;

constexpr int kWidth = 640, kHeight = 480, kFrames = 12, kRounds = 5;

ReferenceView frameOf(int number) {
    ReferenceView view;
    view.name = "camera";
    view.camera =
        Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 0.8}, false, kWidth, kHeight);
    view.nearPlane = 0.5;
    view.farPlane = 8;
    view.depth = Image<float>(kWidth, kHeight);
    Rgba8Image colour(kWidth, kHeight);
    unsigned random = 12345u + static_cast<unsigned>(number) * 777u;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            random = random * 1664525u + 1013904223u;
            const int noise = static_cast<int>(random >> 28) - 8;
            const bool mover = x > 40 * number && x < 40 * number + 160 && y > 120;
            const float z = mover ? 2.0f : 3.0f + 0.002f * static_cast<float>(x);
            view.depth.at(x, y) = z * (1 + 0.0004f * static_cast<float>(noise));
            colour.at(x, y) = {(mover ? 200 : 60 + x / 8) + noise / 2, 90 + y / 8 + noise / 2, 120,
                               255};
        }
    }
    view.texture = std::move(colour);
    return view;
}

double processorSeconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

int run(int threads) {
    const ThreadLimit limit(threads);
    std::vector<ReferenceView> frames;
    for (int i = 0; i < kFrames; ++i) frames.push_back(frameOf(i));
    Job job;
    auto background = TemporalBackground::start(frames[0], {}, job);
    if (!background) return 4;
    const auto measured = [&](auto&& body) {
        const double before = processorSeconds();
        const auto start = std::chrono::steady_clock::now();
        for (int round = 0; round < kRounds; ++round)
            for (int i = 0; i < kFrames; ++i) body(round, i);
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return std::pair(seconds / (kRounds * kFrames),
                         (processorSeconds() - before) / (kRounds * kFrames));
    };
    const auto [clock, processor] = measured([&](int round, int i) {
        const auto ok =
            background->add(frames[static_cast<std::size_t>(i)], 0.04 * (round * kFrames + i), job);
        if (!ok) std::exit(4);
    });
    ReferenceView copy = frames[0];
    const auto [copyClock, copying] = measured([&](int, int i) {
        const ReferenceView& from = frames[static_cast<std::size_t>(i)];
        std::memcpy(copy.depth.data(), from.depth.data(), from.depth.count() * sizeof(float));
        std::memcpy(copy.texture.rgba8()->data(), from.texture.rgba8()->data(),
                    from.depth.count() * 4);
    });
    std::printf(
        "%d threads: %.1f frames/s; %.2f ms of processor time each, %.0f times a copy's %.3f ms\n",
        threadCount(), 1 / clock, 1e3 * processor, processor / copying, 1e3 * copyClock);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return run(argc > 1 ? std::atoi(argv[1]) : 0);
}
