// Prints million points a second of both yardsticks (yardstick.hpp), the plain one and the one in
// vectors on all threads, for each line that it reads: a script that measures something else asks
// for them before and after.

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
        double plain = 1e300, vectors = 1e300;
        for (int i = 0; i < kFrames; ++i) {
            plain = std::min(plain, yardstick.draw());
            vectors = std::min(vectors, yardstick.drawInVectors());
        }
        std::printf("%.2f %.2f\n", yardstick.points() / plain / 1e6,
                    yardstick.points() / vectors / 1e6);
        std::fflush(stdout);
    }
    return 0;
}
