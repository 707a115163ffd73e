// Prints million points a second of the plain yardstick (yardstick.hpp) for each line that it
// reads: a script that measures something else asks for one before and after. Fails when the one in
// vectors draws another picture.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/bench/yardstick.hpp"

namespace {

/// Both draw the same but for rounding, which may move a point into the next pixel.
bool drawTheSame(stx::bench::Yardstick& yardstick) {
    yardstick.draw();
    const auto plain = yardstick.drawn().depth;
    yardstick.drawInVectors();
    const auto& vectors = yardstick.drawn().depth;
    std::size_t differing = 0;
    for (std::size_t i = 0; i < plain.size(); ++i)
        differing +=
            plain[i] != vectors[i] && !(std::abs(plain[i] - vectors[i]) < 1e-4f * plain[i]);
    return differing < plain.size() / 1000;
}

}  // namespace

int main() {
    constexpr int kFrames = 4;
    stx::bench::Yardstick yardstick;
    if (!drawTheSame(yardstick)) {
        std::fputs(
            "bench_yardstick: the plain loop and the one in vectors draw different pictures\n",
            stderr);
        return 1;
    }
    char line[16];
    while (std::fgets(line, sizeof(line), stdin)) {
        double best = 1e300;
        for (int i = 0; i < kFrames; ++i) best = std::min(best, yardstick.draw());
        std::printf("%.2f\n", yardstick.points() / best / 1e6);
        std::fflush(stdout);
    }
    return 0;
}
