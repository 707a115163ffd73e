#include "lib/refine/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/refine/local_plane.hpp"

namespace stx {
namespace {

// Where no source is named the value was chosen by trial on the sets of tests/bench/pictures.md
// with noise added.

/// One in twenty pixels has a smaller one, where the smallest of the four second differences
/// through a pixel is taken, of independent normal noise of standard deviation 1 (by simulation).
/// On smooth surfaces the median would do; among leaves most differences are not noise.
constexpr float kSmallestOfFour = 0.0416f;
/// The same of the largest of the four.
constexpr float kLargestOfFour = 1.206f;
/// The same of bendWithoutCurve().
constexpr float kSmallestOfTwo = 0.1905f;
/// What does not bend evenly is noise up to so many times what it tells: noise is in both measures,
/// each off by some tenths of it.
constexpr float kMoreThanCurves = 1.5f;
/// Rows that are looked at, about, and every how many columns of large views; the fewest pixels
/// that tell: of fewer, one in twenty is what two or three happen to have.
constexpr int kNoiseRows = 64, kNoiseColumns = 3;
constexpr std::size_t kFewestBends = 100;
/// Depth is in steps where so many pixels have each of its values in the mean.
constexpr std::size_t kPixelsOfValue = 3;
/// Values that so many times more pixels have are other steps; fewer have those of mixed pixels.
constexpr std::size_t kUnusual = 4;
/// What second differences of depth in steps must be, times those that its steps make alone, both
/// the smallest and the largest: views of exact oaktree in 8 bits come to 1.3 to 4.3, of Kinect's
/// disparities with 1.65 % of noise in steps of 0.8 % to 4.8 to 5.5, of Open3D's recording to 1.5.
constexpr float kAboveSteps = 4.5f;
/// Less noise than this share of q is left as it is: what codes and small shapes look like.
constexpr float kLeastNoise = 0.001f;
/// And than this share of a pixel's width: exact tori whose tubes are six pixels wide have up to
/// 0.1, statue with 0.5 % noise has 3.5. A torus of 34 pixels with 0.5 % has 0.2: with 0.25 here
/// votes tear its surface, 18.2 dB instead of 25.3. Bars of five pixels with 0.2 % are measured to
/// have 0.09 to 0.16: with 0.15 here four of six views stay as they are, 20.8 dB instead of 33.5.
/// Of 300 noisy cases of 44x40 the mean rises by 0.15 dB (-4.6 to 6.9), and no exact view of 650
/// cases is taken for noisy.
constexpr float kLeastOfPixel = 0.11f;
/// Radii of the windows that are tried, pixels.
constexpr int kRadii[] = {1, 2, 4, 6, 8};
/// Windows larger than one that leaves this share of q are not needed.
constexpr float kAim = 0.001f;
/// The window grows while all estimates so far agree within so many of their standard deviations.
constexpr float kAgree = 2.0f;
/// A point is the mean of what its own plane and those of every second of the points up to so many
/// pixels away say of it, where these agree within so many standard deviations of both; in clutter
/// within as much less as the bands are narrower. 167 noisy cases of tests/sweep (seeds 4401 and
/// 4402) gain 0.36 dB in the mean (splats 0.58), the statue 0.19 and 0.54 with 0.5 and 2 %. All
/// points instead: 0.42 and 0.50, for twice the time; every fourth: 0.20 and 0.49. 4 instead of 8:
/// two thirds of it; 12: -0.4 on the oak tree. Up to 6 pixels away: no more.
constexpr int kShared = 4;
constexpr float kSharedAgree = 8.0f;
/// Rows that are smoothed at once, so that few of the planes are in memory.
constexpr int kRowsAtOnce = 128;
/// Wide bands leave surfaces as they are, narrow ones keep leaves apart that are no further from
/// each other than the noise.
constexpr SmoothSurface::Bands kWideBands{4.0f, 3.0f}, kNarrowBands{1.7f, 1.2f};
/// The nine points around a pixel are one surface, however steep, where they are apart from a plane
/// by less than so many standard deviations. 107 noisy cases of tests/sweep (seeds 700 and 701)
/// +0.26 dB in the mean; 1.8 gives +0.36, and takes 0.1 from the statue with 0.5 %.
constexpr float kOnePlane = 1.45f;
/// A view is clutter, or not at all, where this share of the points around a point is beside its
/// surface, but not by more than so many wide bands.
constexpr float kClutter = 0.12f, kNoClutter = 0.06f, kNotFar = 3.0f;
/// Points that tell it: every how many columns and rows, and how far around them, pixels.
constexpr int kClutterColumns = 3, kClutterRows = 5, kClutterRadius = 2;
/// The q around a pixel.
struct Around {
    const Image<float>& q;
    int x, y;

    /// Empty where there is no point.
    [[nodiscard]] std::optional<float> at(int dx, int dy) const {
        if (!q.contains(x + dx, y + dy)) return std::nullopt;
        const float there = q.at(x + dx, y + dy);
        return there > 0.0f ? std::optional(there) : std::nullopt;
    }
    /// The smallest and the largest of the four second differences through the pixel. At edges and
    /// creases one of them runs along the edge; noise is in all.
    struct Bends {
        float least = std::numeric_limits<float>::max(), most = 0;
    };
    [[nodiscard]] std::optional<Bends> bends() const {
        Bends bends;
        for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}, {1, 1}, {1, -1}}) {
            const auto a = at(-dx, -dy), b = at(dx, dy);
            if (!a || !b) return std::nullopt;
            const float bend = std::abs(*a - 2.0f * q.at(x, y) + *b);
            bends = {std::min(bends.least, bend), std::max(bends.most, bend)};
        }
        return bends;
    }
    /// What second differences have of their own second differences across them, the smaller of
    /// two pairs of directions: nothing of what bends evenly (the mask of Immerkaer 1996, and the
    /// same turned by 45 degrees).
    [[nodiscard]] std::optional<float> bendWithoutCurve() const {
        std::optional<float> least;
        for (const auto& [ax, ay, bx, by] : {std::array{1, 0, 0, 1}, std::array{1, 1, -1, 1}}) {
            float sum = 0;
            for (int i = -1; i <= 1; ++i) {
                for (int j = -1; j <= 1; ++j) {
                    const auto there = at(i * ax + j * bx, i * ay + j * by);
                    if (!there) return least;
                    sum += *there * (i ? 1.0f : -2.0f) * (j ? 1.0f : -2.0f);
                }
            }
            least = std::min(least.value_or(std::abs(sum)), std::abs(sum));
        }
        return least;
    }
};

/// The value that one in twenty is below; 0 of none.
float oneInTwenty(std::vector<float>& values) {
    if (values.empty()) return 0.0f;
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 20);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

/// Rows and columns of a view that are looked at for noise.
struct NoiseGrid {
    static NoiseGrid of(const Image<float>& q) {
        const int rows = std::max(1, q.height() / kNoiseRows);
        return {std::max(1, rows / 2), rows, std::clamp(q.width() / kNoiseRows, 1, kNoiseColumns)};
    }
    /// Calls for each of its pixels that has a point and is not at the border.
    template <class Call>
    void forEach(const Image<float>& q, const Call& call) const {
        for (int y = first; y + 1 < q.height(); y += rows)
            for (int x = 1; x + 1 < q.width(); x += columns)
                if (q.at(x, y) > 0.0f) call(x, y);
    }
    int first, rows, columns;
};

/// What is measured of noise, as shares of q.
struct Measured {
    float noise = 0;       ///< where the shape allows it
    float everywhere = 0;  ///< of pixels that have it in all directions: nothing of clutter
};

/// Noise of `values`, as a share of `q`, which has points in the same places.
Measured measure(const Image<float>& values, const Image<float>& q, const NoiseGrid& grid,
                 const DepthAxis& axis) {
    std::vector<float> bends, most, withoutCurve;
    grid.forEach(q, [&](int x, int y) {
        const Around around{values, x, y};
        const float scale = axis.relativeScale(q.at(x, y));
        if (const auto of = around.bends()) {
            bends.push_back(of->least / scale);
            most.push_back(of->most / scale);
        }
        if (const auto bend = around.bendWithoutCurve()) withoutCurve.push_back(*bend / scale);
    });
    if (bends.size() < kFewestBends) return {};
    Measured out{oneInTwenty(bends) / kSmallestOfFour, oneInTwenty(most) / kLargestOfFour};
    // Among leaves nine pixels in a square are hardly ever on one surface; a ball of few pixels
    // bends everywhere.
    if (withoutCurve.size() >= bends.size() / 20)
        out.noise =
            std::min(out.noise, kMoreThanCurves * oneInTwenty(withoutCurve) / kSmallestOfTwo);
    return out;
}

/// The steps of depth that is stored in few values.
class DepthSteps {
  public:
    DepthSteps(const Image<float>& q, const NoiseGrid& grid) {
        std::vector<float> all;
        grid.forEach(q, [&](int x, int y) { all.push_back(q.at(x, y)); });
        std::ranges::sort(all);
        std::vector<std::size_t> pixels;
        for (const float value : all) {
            if (values_.empty() || values_.back() != value) {
                values_.push_back(value);
                pixels.push_back(0);
            }
            ++pixels.back();
        }
        if (values_.size() < 2 || all.size() < kPixelsOfValue * values_.size()) {
            values_.clear();
            return;
        }
        for (std::size_t i = 0; i < values_.size(); ++i) {
            const auto usual = [&](std::size_t k) { return kUnusual * pixels[k] >= pixels[i]; };
            std::size_t below = i, above = i + 1;
            while (below > 0 && !usual(below - 1)) --below;
            while (above < values_.size() && !usual(above)) ++above;
            float width = std::numeric_limits<float>::max();
            if (below > 0) width = values_[i] - values_[below - 1];
            if (above < values_.size()) width = std::min(width, values_[above] - values_[i]);
            widths_.push_back(below > 0 || above < values_.size() ? width : 0.0f);
        }
    }
    [[nodiscard]] bool none() const { return values_.empty(); }
    [[nodiscard]] float widest() const { return *std::ranges::max_element(widths_); }
    /// The step at a value.
    [[nodiscard]] float at(float q) const {
        const auto next = std::ranges::lower_bound(values_, q) - values_.begin();
        return widths_[std::min(static_cast<std::size_t>(next), widths_.size() - 1)];
    }

  private:
    std::vector<float> values_, widths_;
};

/// Number `i` of a sequence that looks evenly spread from -0.5 to 0.5 (splitmix64; Steele et al.
/// 2014).
float evenlySpread(std::uint64_t i) {
    std::uint64_t z = (i + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return static_cast<float>(z >> 40) * 0x1p-24f - 0.5f;
}

/// The plane of the nine points around a pixel, if they are one within noise of `sigma`.
std::optional<LocalPlane> planeOfNine(const Image<float>& q, int x, int y, float sigma) {
    constexpr float kFar = 1e6f;  // all weigh the same but for how near they are
    const LocalPlane plane = fitAround(q, x, y, 1, {q.at(x, y)}, kFar * q.at(x, y));
    float squares = 0;
    for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
            const float there = q.contains(x + i, y + j) ? q.at(x + i, y + j) : 0.0f;
            if (!(there > 0.0f)) return {};
            const float off = there - plane.q0 - plane.gx * static_cast<float>(i) -
                              plane.gy * static_cast<float>(j);
            squares += off * off;
        }
    }
    // Nine values less three that were fitted.
    if (squares > 6.0f * kOnePlane * kOnePlane * sigma * sigma) return {};
    return plane;
}

/// The plane to begin with at a pixel.
LocalPlane planeAt(const Image<float>& q, int x, int y, float sigma) {
    return planeOfNine(q, x, y, sigma).value_or(LocalPlane{q.at(x, y)});
}

/// The bands for a view with so much noise, by how much clutter there is in it.
SmoothSurface::Bands bandsFor(const Image<float>& q, const DepthAxis& axis, float noise) {
    double beside = 0;
    std::int64_t points = 0;
    for (int y = 1; y < q.height(); y += kClutterRows) {
        for (int x = 1; x < q.width(); x += kClutterColumns) {
            const float here = q.at(x, y);
            if (!(here > 0.0f)) continue;
            const float sigma = noise * axis.relativeScale(here), band = kWideBands.then * sigma;
            const LocalPlane plane =
                fitAround(q, x, y, 1, planeAt(q, x, y, sigma), kWideBands.first * sigma);
            float near = 0, off = 0;
            for (int j = -kClutterRadius; j <= kClutterRadius; ++j) {
                for (int i = -kClutterRadius; i <= kClutterRadius; ++i) {
                    const float there = q.contains(x + i, y + j) ? q.at(x + i, y + j) : 0.0f;
                    if (!(there > 0.0f)) continue;
                    const float distance =
                        std::abs(there - plane.q0 - plane.gx * static_cast<float>(i) -
                                 plane.gy * static_cast<float>(j));
                    if (distance > kNotFar * band) continue;
                    constexpr auto kReach =
                        static_cast<float>((kClutterRadius + 1) * (kClutterRadius + 1));
                    const float weight =
                        std::max(1.0f - static_cast<float>(i * i + j * j) / kReach, 0.0f);
                    near += weight;
                    if (distance > band) off += weight;
                }
            }
            if (!(near > 0.0f)) continue;
            beside += off / near;
            ++points;
        }
    }
    if (points == 0) return kWideBands;
    const auto share = static_cast<float>(beside / static_cast<double>(points));
    const float t = std::clamp((share - kNoClutter) / (kClutter - kNoClutter), 0.0f, 1.0f);
    return {std::lerp(kWideBands.first, kNarrowBands.first, t),
            std::lerp(kWideBands.then, kNarrowBands.then, t)};
}

}  // namespace

std::optional<double> meanOfRows(const std::vector<double>& sums,
                                 const std::vector<std::int64_t>& counts) {
    double sum = 0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        sum += sums[i];
        count += counts[i];
    }
    if (count == 0) return std::nullopt;
    return sum / static_cast<double>(count);
}

float depthNoise(const Image<float>& q, const DepthAxis& axis) {
    const NoiseGrid grid = NoiseGrid::of(q);
    const float plain = measure(q, q, grid, axis).noise;
    const DepthSteps steps(q, grid);
    if (steps.none()) return plain;
    // In steps, one in twenty bends is 0 or a whole step whatever the noise. So each value is
    // spread evenly over its step, and what steps alone would give then is measured, too: the
    // rounding of depth and the spread, each even over a step, on a plane.
    const float plane = 4.0f * steps.widest();
    // Only the rows that are looked at, each between the two above and the two below it, as far as
    // Around looks.
    constexpr int kReach = 2, kGroup = 2 * kReach + 1;
    const int looked = (q.height() - 2 - grid.first) / grid.rows + 1;
    const NoiseGrid ofRows{kReach, kGroup, grid.columns};
    Image<float> rows(q.width(), kGroup * looked), spread = rows, rounding = rows;
    for (int row = 0; row < rows.height(); ++row) {
        const int y = grid.first + row / kGroup * grid.rows + row % kGroup - kReach;
        if (y < 0 || y >= q.height()) continue;
        for (int x = 0; x < q.width(); ++x) {
            const float here = q.at(x, y);
            if (!(here > 0.0f)) continue;
            const auto pixel = static_cast<std::uint64_t>(y) * q.width() + x;
            const float width = steps.at(here), added = width * evenlySpread(2 * pixel);
            rows.at(x, row) = here;
            spread.at(x, row) = here + added;
            rounding.at(x, row) = plane + added + width * evenlySpread(2 * pixel + 1);
        }
    }
    const Measured all = measure(spread, rows, ofRows, axis),
                   ofSteps = measure(rounding, rows, ofRows, axis);
    if (all.noise < kAboveSteps * ofSteps.noise ||
        all.everywhere < kAboveSteps * ofSteps.everywhere)
        return plain;
    // What was added is taken away again; the rounding of the depth is part of its noise.
    return std::max(plain, std::sqrt(all.noise * all.noise - 0.5f * ofSteps.noise * ofSteps.noise));
}

bool isNoisy(float noise, const DepthAxis& axis) {
    return noise >= kLeastNoise && noise >= kLeastOfPixel * axis.pixelShare();
}

SmoothSurface::SmoothSurface(const Image<float>& q, const DepthAxis& axis, float noise)
    : q_(q), axis_(axis), noise_(noise), bands_(bandsFor(q, axis, noise)) {}

SmoothSurface::Point SmoothSurface::at(int x, int y) const {
    const float here = q_.at(x, y), scale = axis_.relativeScale(here), sigma = noise_ * scale;
    LocalPlane plane = planeAt(q_, x, y, sigma);
    float least = here - kAgree * sigma, most = here + kAgree * sigma;
    Point point{here, glm::vec2(0.0f), sigma};
    for (const int radius : kRadii) {
        plane = fitAround(q_, x, y, radius, plane,
                          (radius == kRadii[0] ? bands_.first : bands_.then) * sigma);
        const float deviation = sigma / std::sqrt(std::max(plane.alike, 1.0f));
        least = std::max(least, plane.q0 - kAgree * deviation);
        most = std::min(most, plane.q0 + kAgree * deviation);
        if (least > most) break;  // the surface bends
        point = {plane.q0, {plane.gx, plane.gy}, deviation};
        if (deviation < kAim * scale) break;
    }
    return point;
}

namespace {

/// The points of some rows of a SmoothSurface.
class SmoothRows {
  public:
    SmoothRows(const SmoothSurface& smooth, const Image<float>& q, int first, int last)
        : first_(std::max(first, 0)),
          band_(kSharedAgree * smooth.bands().then / kWideBands.then),
          points_(q.width(), std::min(last, q.height()) - first_, {}) {
        for (int y = 0; y < points_.height(); ++y) {
            for (int x = 0; x < q.width(); ++x) {
                const float here = q.at(x, first_ + y);
                if (!(here > 0.0f)) continue;
                SmoothSurface::Point& point = points_.at(x, y);
                point = smooth.at(x, first_ + y);
                if (!(point.q > 0.0f)) point.q = here;
            }
        }
    }
    /// What the planes of a point and of those around it say of it, those with less doubt more.
    /// Its doubt is its own: neighbours share much of their windows.
    [[nodiscard]] SmoothSurface::Point mean(int x, int row) const {
        const int y = row - first_;
        const SmoothSurface::Point here = points_.at(x, y);
        float off = 0, weights = 0;
        glm::vec2 slopes(0.0f);
        for (int dy = -kShared; dy <= kShared; ++dy) {
            if (y + dy < 0 || y + dy >= points_.height()) continue;
            const auto there = points_.row(y + dy);
            for (int dx = -kShared + (dy & 1); dx <= kShared; dx += 2) {
                if (x + dx < 0 || x + dx >= points_.width()) continue;
                const SmoothSurface::Point& other = there[x + dx];
                if (!(other.q > 0.0f)) continue;
                const float above = other.q - other.slope.x * static_cast<float>(dx) -
                                    other.slope.y * static_cast<float>(dy) - here.q;
                const float variance = other.doubt * other.doubt;
                const float agree =
                    1.0f - above * above / (band_ * band_ * (here.doubt * here.doubt + variance));
                constexpr auto kReach = static_cast<float>((kShared + 1) * (kShared + 1));
                const float close = 1.0f - static_cast<float>(dx * dx + dy * dy) / kReach;
                if (!(agree > 0.0f) || !(close > 0.0f)) continue;
                const float weight = agree * agree * close / variance;
                off += weight * above;
                slopes += weight * other.slope;
                weights += weight;
            }
        }
        return {here.q + off / weights, slopes / weights, here.doubt};
    }

  private:
    int first_;
    float band_;
    Image<SmoothSurface::Point> points_;
};

}  // namespace

float smoothDepth(Image<float>& q, const DepthAxis& axis, float noise, Image<glm::vec3>* surface) {
    if (!isNoisy(noise, axis)) return 0.0f;
    const Image<float> from = q;
    const SmoothSurface smooth(from, axis, noise);
    if (surface) *surface = Image<glm::vec3>(q.width(), q.height(), glm::vec3(0.0f));
    std::vector<double> left(static_cast<std::size_t>(q.height()), 0.0);
    std::vector<std::int64_t> points(left.size(), 0);
    parallelForBlocks(0, q.height(), kRowsAtOnce, [&](std::int64_t first, std::int64_t last) {
        const int begin = static_cast<int>(first), end = static_cast<int>(last);
        const SmoothRows rows(smooth, from, begin - kShared, end + kShared);
        for (int y = begin; y < end; ++y) {
            for (int x = 0; x < q.width(); ++x) {
                const float here = from.at(x, y);
                if (!(here > 0.0f)) continue;
                const SmoothSurface::Point point = rows.mean(x, y);
                if (point.q > 0.0f) q.at(x, y) = point.q;
                if (surface) surface->at(x, y) = glm::vec3(point.slope, point.doubt);
                left[y] += point.doubt / axis.relativeScale(here);
                ++points[y];
            }
        }
    });
    return kDoubt * static_cast<float>(meanOfRows(left, points).value_or(0));
}

}  // namespace stx
