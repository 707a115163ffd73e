#include "lib/render/surface/prepare/outline_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/cut_pixel.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/surface/prepare/constants.hpp"

namespace stx::surface {
namespace {

/// A line bears its surroundings out when what it covers of 3x3 pixels is what they are covered,
/// but for so much (root of the mean square). From 0.05 to 0.25 the means over 40 scenes of
/// tests/sweep change by no more than 0.1 dB.
constexpr float kMostMisfit = 0.1f;
/// Where alpha changes less across 3x3 pixels, of the 4 of an outline along rows or columns, there
/// is none.
constexpr float kLeastChange = 1.0f;

/// The outline through a pixel.
struct OutlineLine {
    int x;
    float below;    ///< covered is what is below it along `out`, from the pixel's middle on
    glm::vec2 out;  ///< out of the object, length 1
};

class Levels {
  public:
    Levels(const Texture& texture, bool findsLines)
        : texture_(texture),
          findsLines_(findsLines),
          lines_(static_cast<std::size_t>(texture.height())) {
        for (std::size_t a = 0; a < levelOfByte_.size(); ++a)
            levelOfByte_[a] = levelOf(static_cast<float>(a) * (1.0f / 255.0f));
    }

    Image<std::uint8_t> find() {
        Image<std::uint8_t> levels(width(), height());
        parallelForBlocks(0, height(), 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) findLines(y, levels);
        });
        parallelForBlocks(0, height(), 32, [&](std::int64_t from, std::int64_t to) {
            std::vector<glm::vec2> sums(static_cast<std::size_t>(width()), glm::vec2(0.0f));
            for (int y = static_cast<int>(from); y < to; ++y) continueLines(y, sums, levels);
        });
        return levels;
    }

  private:
    [[nodiscard]] int width() const { return texture_.width(); }
    [[nodiscard]] int height() const { return texture_.height(); }
    [[nodiscard]] float alpha(int x, int y) const {
        const int cx = std::clamp(x, 0, width() - 1), cy = std::clamp(y, 0, height() - 1);
        return texture_.alpha(static_cast<std::size_t>(cy) * width() + cx);
    }
    static std::uint8_t levelOf(float value) {
        return static_cast<std::uint8_t>(
            std::clamp(std::round(value / kLevelStep) + kLevelZero, 0.0f, 255.0f));
    }

    /// Sets the levels of a row, those of pixels that are covered in full or not at all to 1 or 0.
    void findLines(int y, Image<std::uint8_t>& levels) {
        const auto to = levels.row(y);
        if (const auto* bytes = texture_.rgba8())
            std::ranges::transform(bytes->row(y), to.begin(),
                                   [&](glm::u8vec4 p) { return levelOfByte_[p.a]; });
        else
            std::ranges::transform(texture_.rgbaFloat()->row(y), to.begin(),
                                   [](const glm::vec4& p) { return levelOf(p.a); });
        if (!findsLines_) return;
        texture_.forEachInPart(y, [&](int x) {
            OutlineLine line;
            if (!findLine(x, y, alpha(x, y), line)) return;
            to[static_cast<std::size_t>(x)] = levelOf(0.5f + line.below);
            lines_[static_cast<std::size_t>(y)].push_back(line);
        });
    }

    [[nodiscard]] bool findLine(int x, int y, float a, OutlineLine& line) const {
        float around[3][3];
        float least = 1, most = 0;
        glm::vec2 change(0.0f);
        for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
                const float there = around[j + 1][i + 1] = alpha(x + i, y + j);
                least = std::min(least, there);
                most = std::max(most, there);
                change += there * glm::vec2(i * (2 - std::abs(j)), j * (2 - std::abs(i)));
            }
        }
        const float length = glm::length(change);
        if (least > 0.0f || most < 1.0f || length < kLeastChange) return false;
        const glm::vec2 out = -change / length;
        line = {x, belowOfArea(a, out.x, out.y), out};
        float misfit = 0;
        for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
                const float below = line.below - glm::dot(out, glm::vec2(i, j));
                const float off = areaBelow(below, out.x, out.y) - around[j + 1][i + 1];
                misfit += off * off;
            }
        }
        return misfit <= 9 * kMostMisfit * kMostMisfit;
    }

    /// Sets the levels of the other pixels of a row beside outlines: the mean of what the lines
    /// around say. `sums`: room for a row, of zeros before and after.
    void continueLines(int y, std::vector<glm::vec2>& sums, Image<std::uint8_t>& levels) const {
        const auto forEach = [&](const auto& visit) {
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height() - 1); ++j)
                for (const OutlineLine& line : lines_[static_cast<std::size_t>(j)])
                    for (int x = std::max(line.x - 1, 0); x <= std::min(line.x + 1, width() - 1);
                         ++x)
                        visit(line, x, j, sums[static_cast<std::size_t>(x)]);
        };
        forEach([&](const OutlineLine& line, int x, int j, glm::vec2& sum) {
            sum += glm::vec2(0.5f + line.below - glm::dot(line.out, glm::vec2(x - line.x, y - j)),
                             1.0f);
        });
        forEach([&](const OutlineLine&, int x, int, glm::vec2& sum) {
            if (!(sum.y > 0.0f)) return;
            const float level = sum.x / sum.y, a = alpha(x, y);
            if (a >= 1.0f) levels.at(x, y) = levelOf(std::max(level, 1.0f));
            if (!(a > 0.0f)) levels.at(x, y) = levelOf(std::min(level, 0.0f));
            sum = glm::vec2(0.0f);
        });
    }

    const Texture& texture_;
    bool findsLines_;
    std::array<std::uint8_t, 256> levelOfByte_{};  ///< of alpha as a byte
    std::vector<std::vector<OutlineLine>> lines_;  ///< by row
};

}  // namespace

Image<std::uint8_t> outlineLevels(const Texture& texture, bool findsLines) {
    return Levels(texture, findsLines).find();
}

}  // namespace stx::surface
