#include <algorithm>
#include <cmath>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/panorama/overlap.hpp"
#include "lib/panorama/small_solver.hpp"

namespace stx::panorama {
namespace {

/// So many means over squares, one after the other, are nearly a Gaussian.
constexpr int kBoxes = 3;
/// Added to linear light (0..1) before its logarithm is taken, so that differences in the dark,
/// which are mostly noise, stay small.
constexpr float kFloorOfLight = 0.01f;
/// The weight of the mean of all blocks in each, beside those that are near: it shows only where
/// none is.
constexpr float kMeanOfAll = 1e-3f;
/// Added to the share that a picture has of what is shown, so that each place has some picture.
constexpr float kLeastShown = 1e-3f;
/// Pictures that share fewer cells say nothing of their gains.
constexpr std::size_t kFewestShared = 30;
/// The weight of the assumption that a picture has no gain; pairs weigh the root of their cells.
constexpr double kNoGain = 0.05;
/// The largest gain that is believed, natural logarithm.
constexpr double kMostGain = 3;

/// The weighted mean of a square around each pixel, taken kBoxes times.
/// `around`: rows end where they begin.
void smooth(Image<glm::vec4>& image, int radius, bool around) {
    const int w = image.width(), h = image.height();
    std::vector<glm::vec4> line(static_cast<std::size_t>(std::max(w, h) + 2 * radius + 1));
    const auto run = [&](int count, bool closed, const auto& at) {
        for (int i = -radius; i <= count + radius; ++i) {
            const bool inside = i >= 0 && i < count;
            line[i + radius] = inside   ? at(i)
                               : closed ? at((i % count + count) % count)
                                        : glm::vec4(0);
        }
        glm::dvec4 sum(0);
        for (int i = 0; i < 2 * radius; ++i) sum += glm::dvec4(line[i]);
        for (int i = 0; i < count; ++i) {
            sum += glm::dvec4(line[i + 2 * radius]);
            at(i) = glm::vec4(sum / (2.0 * radius + 1));
            sum -= glm::dvec4(line[i]);
        }
    };
    for (int pass = 0; pass < kBoxes; ++pass) {
        for (int y = 0; y < h; ++y)
            run(w, around, [&](int i) -> glm::vec4& { return image.at(i, y); });
        for (int x = 0; x < w; ++x)
            run(h, false, [&](int i) -> glm::vec4& { return image.at(x, i); });
    }
}

/// Logarithms of a picture's linear light after its gain.
Image<glm::vec3> logsOf(const Footprint& f, glm::vec3 gain) {
    Image<glm::vec3> out(f.box.width, f.box.height);
    for (std::size_t i = 0; i < out.count(); ++i)
        if (f.inside.pixels()[i] > 0)
            out.pixels()[i] = glm::log(
                withGain(cleared(f.colour.pixels()[i], f.clearingAt(i)), gain) + kFloorOfLight);
    return out;
}

/// A smooth function over a picture's box, one value for each block of cells: values are summed up
/// by block, then each block gets the mean of those around it.
class SmoothBlocks {
  public:
    explicit SmoothBlocks(const GridBox& box, int gridWidth)
        : around_(box.width >= gridWidth),
          blocks_((box.width + kBlock - 1) / kBlock, (box.height + kBlock - 1) / kBlock,
                  glm::vec4(0)) {}
    void add(glm::ivec2 cell, glm::vec3 value) {
        blocks_.at(cell.x / kBlock, cell.y / kBlock) += glm::vec4(value, 1);
    }
    /// Means over `reach` blocks to either side, kBoxes times. Where nothing is near, the mean of
    /// all.
    void finish(int reach) {
        glm::vec4 all(0);
        for (const glm::vec4& block : blocks_.pixels()) all += block;
        if (all.a <= 0) return;
        for (glm::vec4& block : blocks_.pixels()) block += all * (kMeanOfAll / all.a);
        smooth(blocks_, reach, around_);
        for (glm::vec4& block : blocks_.pixels()) block /= block.a;
    }
    /// The value of a cell; 0 when nothing was added anywhere.
    [[nodiscard]] glm::vec3 at(glm::ivec2 cell) const {
        const glm::vec2 p = (glm::vec2(cell) + 0.5f) / static_cast<float>(kBlock) - 0.5f;
        const glm::vec2 floor = glm::floor(p), t = p - floor;
        const auto block = [&](int dx, int dy) {
            const int w = blocks_.width();
            int x = static_cast<int>(floor.x) + dx;
            x = around_ ? (x + w) % w : std::clamp(x, 0, w - 1);
            const int y = std::clamp(static_cast<int>(floor.y) + dy, 0, blocks_.height() - 1);
            return glm::vec3(blocks_.at(x, y));
        };
        return glm::mix(glm::mix(block(0, 0), block(1, 0), t.x),
                        glm::mix(block(0, 1), block(1, 1), t.x), t.y);
    }

  private:
    static constexpr int kBlock = 4;  ///< cells

    bool around_;
    Image<glm::vec4> blocks_;
};

/// The logarithm of `b`'s light over `a`'s, where both pictures look. What the scene shows is in
/// both and cancels out; what is left is a change of the light, or the lens.
SmoothBlocks lightDifference(const Footprint& a, const Image<glm::vec3>& logsA, const Footprint& b,
                             const Image<glm::vec3>& logsB, int gridWidth) {
    // Natural logarithms of R, G and B: a larger difference is of another thing, not of the light.
    constexpr float kMost = 0.9f;
    // Blocks to either side: with kBoxes passes nearly a Gaussian of some 6 cells, a thirtieth of a
    // picture. Wider ones leave steps where a lens darkens the edges of pictures.
    constexpr int kReach = 1;
    SmoothBlocks out(a.box, gridWidth);
    shared(a, b, gridWidth, [&](glm::ivec2 pa, glm::ivec2 pb) {
        const glm::vec3 log = logsB.at(pb.x, pb.y) - logsA.at(pa.x, pa.y);
        if (glm::dot(log, log) <= kMost * kMost) out.add(pa, log);
    });
    out.finish(kReach);
    return out;
}

/// The weight of a picture in the mean light of each cell of its box: 1 where it is shown, falling
/// to 0 over an eighth of a picture beyond its seams, and 0 where it ends.
Image<float> weightsOf(const Footprint& f, int index, const Image<int>& labels) {
    constexpr int kReach = 3;  // blocks to either side
    const int gridWidth = labels.width();
    SmoothBlocks shown(f.box, gridWidth);
    for (int y = 0; y < f.box.height; ++y)
        for (int x = 0; x < f.box.width; ++x) {
            const int column = ((f.box.x + x) % gridWidth + gridWidth) % gridWidth;
            shown.add({x, y}, glm::vec3(labels.at(column, f.box.y + y) == index ? 1 : 0));
        }
    shown.finish(kReach);
    Image<float> out(f.box.width, f.box.height);
    for (int y = 0; y < f.box.height; ++y)
        for (int x = 0; x < f.box.width; ++x)
            if (const float inside = f.inside.at(x, y); inside > 0)
                out.at(x, y) = inside * (shown.at({x, y}).x + kLeastShown);
    return out;
}

}  // namespace

std::vector<glm::dvec3> findGains(const std::vector<Footprint>& prints, int gridWidth) {
    const std::size_t n = prints.size();
    struct Ratio {
        std::size_t a, b;
        glm::dvec3 log;  ///< of a's light over b's
        double weight;
    };
    std::vector<std::vector<Ratio>> rows(n);
    parallelFor(0, n, [&](std::size_t a) {
        for (std::size_t b = a + 1; b < n; ++b) {
            if (!boxesMeet(prints[a], prints[b], gridWidth)) continue;
            std::array<std::vector<float>, 3> logs;
            shared(prints[a], prints[b], gridWidth, [&](glm::ivec2 pa, glm::ivec2 pb) {
                const glm::vec3 ca = prints[a].colour.at(pa.x, pa.y);
                const glm::vec3 cb = prints[b].colour.at(pb.x, pb.y);
                const float clearing =
                    prints[a].clearing.empty()
                        ? 1.0f
                        : prints[a].clearing.at(pa.x, pa.y) / prints[b].clearing.at(pb.x, pb.y);
                for (int c = 0; c < 3; ++c)
                    if (std::min(ca[c], cb[c]) > kDarkest && std::max(ca[c], cb[c]) < kLightest)
                        logs[c].push_back(std::log(ca[c] / cb[c] * clearing));
            });
            if (std::min({logs[0].size(), logs[1].size(), logs[2].size()}) < kFewestShared)
                continue;
            Ratio ratio{a, b, {}, std::sqrt(static_cast<double>(logs[1].size()))};
            for (int c = 0; c < 3; ++c) ratio.log[c] = medianOf(std::move(logs[c]));
            rows[a].push_back(ratio);
        }
    });
    std::vector<glm::dvec3> gains(n, glm::dvec3(1));
    for (int c = 0; c < 3; ++c) {
        std::vector<double> matrix(n * n, 0.0), right(n, 0.0);
        for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] += kNoGain;
        for (const auto& row : rows)
            for (const Ratio& r : row) {
                matrix[r.a * n + r.a] += r.weight;
                matrix[r.b * n + r.b] += r.weight;
                matrix[r.a * n + r.b] -= r.weight;
                matrix[r.b * n + r.a] -= r.weight;
                right[r.a] -= r.weight * r.log[c];
                right[r.b] += r.weight * r.log[c];
            }
        if (!solveSymmetric(matrix, right)) continue;
        for (std::size_t i = 0; i < n; ++i)
            gains[i][c] = std::exp(std::clamp(right[i], -kMostGain, kMostGain));
    }
    return gains;
}

std::vector<Image<glm::vec3>> findCorrections(const std::vector<Footprint>& prints,
                                              const std::vector<glm::dvec3>& gains,
                                              const Image<int>& labels) {
    const std::size_t n = prints.size();
    const int gridWidth = labels.width();
    std::vector<Image<glm::vec3>> logs(n), out(n);
    std::vector<Image<float>> weights(n);
    parallelFor(0, n, [&](std::size_t k) {
        logs[k] = logsOf(prints[k], gains[k]);
        weights[k] = weightsOf(prints[k], static_cast<int>(k), labels);
    });
    // At each place every picture is brought to the mean light of all pictures that look there. A
    // picture weighs more the nearer the place is to the part of it that is shown. Differences
    // are smoothed before they are weighed, so that all pictures come to the same light and no
    // step is seen where one of them ends.
    parallelFor(0, n, [&](std::size_t k) {
        const Footprint& f = prints[k];
        Image<glm::vec4> sums(f.box.width, f.box.height);
        for (std::size_t p = 0; p < sums.count(); ++p)
            sums.pixels()[p] = glm::vec4(0, 0, 0, weights[k].pixels()[p]);
        for (std::size_t other = 0; other < n; ++other) {
            if (other == k || !boxesMeet(f, prints[other], gridWidth)) continue;
            // The same from both sides.
            const bool first = k < other;
            const std::size_t a = first ? k : other, b = first ? other : k;
            const SmoothBlocks difference =
                lightDifference(prints[a], logs[a], prints[b], logs[b], gridWidth);
            shared(prints[a], prints[b], gridWidth, [&](glm::ivec2 pa, glm::ivec2 pb) {
                const glm::ivec2 own = first ? pa : pb, there = first ? pb : pa;
                const float weight = weights[other].at(there.x, there.y);
                const glm::vec3 log = difference.at(pa) * (first ? 1.0f : -1.0f);
                sums.at(own.x, own.y) += weight * glm::vec4(log, 1);
            });
        }
        out[k] = Image<glm::vec3>(f.box.width, f.box.height, glm::vec3(1));
        for (std::size_t p = 0; p < sums.count(); ++p)
            if (const glm::vec4 s = sums.pixels()[p]; s.a > 0)
                out[k].pixels()[p] = glm::exp(glm::vec3(s) / s.a);
    });
    return out;
}

}  // namespace stx::panorama
