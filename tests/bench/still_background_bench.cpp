// How fast backgrounds of plain video are, on one thread, frames in memory: frames of 640x480 a
// second of the processor's own time, and as ratios to a plain running mean that is timed in turn
// with them; and how much memory each takes beside the frames.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <fmt/format.h>

#include "lib/background/still.hpp"
#include "lib/base/parallel.hpp"

namespace {

using namespace stx;

constexpr glm::ivec2 kFrameSize(640, 480);
constexpr int kDifferent = 8, kTurns = 3;

/// A few frames, over and over.
class LoopedFrames : public StillFrames {
  public:
    LoopedFrames(glm::ivec2 size, int count) : size_(size), count_(count) {
        std::uint32_t seed = 1;
        const auto noise = [&] {
            seed = seed * 1664525u + 1013904223u;
            return static_cast<int>(seed >> 24 & 7) - 3;
        };
        for (int k = 0; k < kDifferent; ++k) {
            Rgba8Image image(size.x, size.y);
            for (int y = 0; y < size.y; ++y) {
                for (int x = 0; x < size.x; ++x) {
                    const int wall = (x / 3 + y / 5) % 200 + 20;
                    const bool passes = std::abs(x - size.x * k / kDifferent) < size.x / 16;
                    image.at(x, y) = passes ? glm::u8vec4(200 + noise(), 50, 50, 255)
                                            : glm::u8vec4(wall + noise(), wall / 2 + 30 + noise(),
                                                          220 - wall + noise(), 255);
                }
            }
            frames_.push_back(std::make_shared<const Rgba8Image>(std::move(image)));
        }
    }
    [[nodiscard]] glm::ivec2 size() const override { return size_; }
    [[nodiscard]] int count() const override { return count_; }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        return frames_[static_cast<std::size_t>(k % kDifferent)];
    }

  private:
    glm::ivec2 size_;
    int count_;
    std::vector<std::shared_ptr<const Rgba8Image>> frames_;
};

double processorSeconds() {
    timespec t{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// The yardstick: a running mean in floats.
void plainMean(StillFrames& frames, std::vector<glm::vec3>& mean) {
    mean.assign(static_cast<std::size_t>(frames.size().x) * frames.size().y, glm::vec3(0));
    for (int k = 0; k < frames.count(); ++k) {
        const auto frame = frames.frame(k);
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += 0.1f * (glm::vec3((*frame)->pixels()[i]) - mean[i]);
    }
}

StillSettings settingsOf(StillMethod method) {
    StillSettings s;
    s.method = method;
    return s;
}

/// The most memory that a process of its own ever held, bytes.
std::uint64_t peakOf(const std::function<void()>& work) {
    const pid_t child = ::fork();
    if (child == 0) {
        work();
        ::_exit(0);
    }
    int status = 0;
    rusage usage{};
    ::wait4(child, &status, 0, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) << 10;
}

}  // namespace

int main() {
    const ThreadLimit one(1);
    const std::pair<const char*, StillMethod> methods[] = {{"n2pg", StillMethod::n2pg},
                                                           {"select", StillMethod::select},
                                                           {"median", StillMethod::median}};
    // Large frames, so that the program itself does not count; first, while no threads are there
    // that a fork would lose.
    const glm::ivec2 large(2048, 1536);
    LoopedFrames few(large, 10);
    const double pixels = static_cast<double>(large.x) * large.y;
    const auto nothing = peakOf([] {});
    for (const auto& [name, method] : methods) {
        const auto peak = peakOf([&] {
            Job own;
            if (!stillBackground(few, settingsOf(method), own)) ::_exit(1);
        });
        fmt::print("{}: {:.1f} bytes a pixel of {}x{} beside the frames\n", name,
                   static_cast<double>(peak - nothing) / pixels, large.x, large.y);
    }
    LoopedFrames frames(kFrameSize, 40);
    std::vector<std::vector<double>> seconds(4);
    std::vector<glm::vec3> mean;
    Job job;
    for (int turn = 0; turn < kTurns; ++turn) {
        double start = processorSeconds();
        plainMean(frames, mean);
        seconds[3].push_back(processorSeconds() - start);
        for (std::size_t m = 0; m < 3; ++m) {
            start = processorSeconds();
            if (!stillBackground(frames, settingsOf(methods[m].second), job)) return 1;
            seconds[m].push_back(processorSeconds() - start);
        }
    }
    const auto median = [](std::vector<double> v) {
        std::sort(v.begin(), v.end());
        return v[v.size() / 2];
    };
    const double plain = median(seconds[3]);
    for (std::size_t m = 0; m < 3; ++m)
        fmt::print("{}: {:.0f} frames/s, {:.2f} times a plain mean's time\n", methods[m].first,
                   frames.count() / median(seconds[m]), median(seconds[m]) / plain);
    return 0;
}
