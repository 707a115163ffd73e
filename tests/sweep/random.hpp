#pragma once

#include <cmath>
#include <cstdint>

/// Random numbers that are the same on every machine and with every library (splitmix64, Steele,
/// Lea & Flood 2014): the number of a case is all that is needed to repeat it.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    [[nodiscard]] std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
        return z ^ (z >> 31);
    }
    /// In [0, 1).
    [[nodiscard]] double unit() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
    /// In [low, high).
    [[nodiscard]] double between(double low, double high) { return low + (high - low) * unit(); }
    /// In [low, high), as many between 1 and 2 as between 2 and 4.
    [[nodiscard]] double logBetween(double low, double high) {
        return low * std::pow(high / low, unit());
    }
    /// In [low, high].
    [[nodiscard]] int whole(int low, int high) {
        return low + static_cast<int>(next() % static_cast<std::uint64_t>(high - low + 1));
    }
    [[nodiscard]] bool chance(double share) { return unit() < share; }

  private:
    std::uint64_t state_;
};
