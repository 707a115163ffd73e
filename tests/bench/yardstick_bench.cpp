// Prints million points a second of the yardstick (yardstick.hpp) for each line that it reads: a
// script that measures something else asks for one before and after.

#include <algorithm>
#include <cstdio>

#include "tests/bench/yardstick.hpp"

int main() {
    constexpr int kFrames = 4;
    stx::bench::Yardstick yardstick;
    char line[16];
    while (std::fgets(line, sizeof(line), stdin)) {
        double best = 1e300;
        for (int i = 0; i < kFrames; ++i) best = std::min(best, yardstick.draw());
        std::printf("%.2f\n", yardstick.points() / best / 1e6);
        std::fflush(stdout);
    }
    return 0;
}
