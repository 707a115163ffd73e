#include <algorithm>
#include <array>
#include <climits>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/panorama/footprints.hpp"
#include "lib/panorama/kernels.hpp"
#include "lib/panorama/panorama.hpp"
#include "lib/panorama/work_copy.hpp"

namespace stx {

using namespace panorama;

namespace {

/// A picture is reduced before it is drawn where so many of its pixels and more are one of the
/// panorama, and its filter is widened where they still are more than this.
constexpr double kReducedFrom = 1.5, kWidenedFrom = 1.05;
/// Cells around a footprint in which it is drawn, and with which rows are looked for: beyond the
/// two by which labels go on, for rounding.
constexpr int kAroundDrawn = 2, kAroundRows = 3;
/// Pixels that pictures cover by less than this stay empty.
constexpr float kLeastCoverage = 1e-3f;
/// A panorama of its natural width has at least so many pixels, and a multiple of these.
constexpr double kLeastWidth = 64;
constexpr int kWidthStep = 4;
/// The share of the memory that sums of a band of rows may take is one over this.
constexpr std::uint64_t kBandShare = 4;

/// A picture that is drawn with a cubic filter as wide as the distance of the panorama's pixels.
class Drawn {
  public:
    Drawn(Rgba8Image picture, const PanoramaCamera& camera, const TurnLens& lens, int width)
        : lens_(lens) {
        // Pixels of the picture for each of the panorama, in the middle.
        double scale = camera.focal * 2 * M_PI / width;
        const int less = std::max(1, static_cast<int>(scale / kReducedFrom));
        copy_ = makeWorkCopy(std::move(picture),
                             less > 1 ? std::max(1, std::max(camera.size.x, camera.size.y) / less)
                                      : std::max(camera.size.x, camera.size.y));
        const auto pixels = copy_.colour.pixels();
        if (!std::ranges::all_of(pixels, [](glm::u8vec4 p) { return p.a == 255; })) {
            shown_ = Image<float>(copy_.colour.width(), copy_.colour.height());
            std::ranges::transform(pixels, shown_.pixels().begin(),
                                   [](glm::u8vec4 p) { return static_cast<float>(p.a) / 255.0f; });
        }
        scale = std::max(1.0, scale * copy_.colour.width() / camera.size.x);
        wide_ = scale > kWidenedFrom ? static_cast<float>(scale) : 1.0f;
        worldFromCamera_ = glm::mat3_cast(camera.worldFromCamera);
    }

    /// Where pixels of a row of the panorama are in the picture (kNowhere: behind the camera). The
    /// camera of `row` comes from here.
    void positions(RowOfRays row, double* x, double* y) const {
        row.worldFromCamera = worldFromCamera_;
        row.lens = lens_;
        row.extent = copy_.extent();
        row.size = copy_.colour.size();
        positionsOf(row, x, y);
    }
    /// How much the picture covers of a pixel of the panorama there; 0 = nothing.
    [[nodiscard]] float coverage(double x, double y) const {
        const int width = copy_.colour.width(), height = copy_.colour.height();
        const double edge = std::min({x, y, width - x, height - y});
        if (edge <= -0.5) return 0;
        const auto covered = static_cast<float>(std::min(1.0, edge + 0.5));
        return shown_.empty() ? covered : covered * sampleLinear(shown_, x, y);
    }
    /// The square of a position's distance from the middle, halves of the diagonal.
    [[nodiscard]] double radius2(double x, double y) const {
        const glm::dvec2 p = copy_.position({x, y});
        return glm::dot(p, p);
    }
    /// sRGB-coded colours (0..1) at positions.
    void colours(const double* x, const double* y, std::size_t count, glm::vec4* out) const {
        if (wide_ <= 1) {
            cubicColours(copy_.colour, x, y, count, out);
            return;
        }
        for (std::size_t i = 0; i < count; ++i) out[i] = glm::vec4(wide({x[i], y[i]}), 1);
    }

  private:
    /// Catmull and Rom's kernel.
    static float cubic(float t) {
        t = std::abs(t);
        if (t < 1) return (1.5f * t - 2.5f) * t * t + 1;
        if (t < 2) return ((-0.5f * t + 2.5f) * t - 4) * t + 2;
        return 0;
    }
    [[nodiscard]] glm::vec3 wide(glm::dvec2 pixel) const {
        const float px = static_cast<float>(pixel.x) - 0.5f;
        const float py = static_cast<float>(pixel.y) - 0.5f;
        const int w = copy_.colour.width(), h = copy_.colour.height();
        const int x0 = static_cast<int>(std::ceil(px - 2 * wide_));
        const int x1 = static_cast<int>(std::floor(px + 2 * wide_));
        const int y0 = static_cast<int>(std::ceil(py - 2 * wide_));
        const int y1 = static_cast<int>(std::floor(py + 2 * wide_));
        glm::vec4 sum(0);
        for (int y = y0; y <= y1; ++y) {
            const float wy = cubic((static_cast<float>(y) - py) / wide_);
            const auto row = copy_.colour.row(std::clamp(y, 0, h - 1));
            for (int x = x0; x <= x1; ++x) {
                const glm::u8vec4 c = row[std::clamp(x, 0, w - 1)];
                sum +=
                    wy * cubic((static_cast<float>(x) - px) / wide_) * glm::vec4(c.r, c.g, c.b, 1);
            }
        }
        return glm::clamp(glm::vec3(sum) / (255.0f * sum.a), 0.0f, 1.0f);
    }

    WorkCopy copy_;
    TurnLens lens_;
    glm::dmat3 worldFromCamera_{1.0};
    float wide_ = 1;
    Image<float> shown_;  ///< alpha, 0..1; empty: 1
};

/// Pixels of one row that show a picture.
struct RowPixels {
    std::size_t count = 0;
    std::vector<int> column;
    std::vector<double> sine, cosine, x, y;  ///< of the longitude; in the picture
    std::vector<float> weight;
    std::vector<glm::vec3> factor;
    std::vector<glm::vec4> colour;

    explicit RowPixels(std::size_t most)
        : column(most),
          sine(most),
          cosine(most),
          x(most),
          y(most),
          weight(most),
          factor(most),
          colour(most) {}
    void add(int c, glm::dvec2 turn, float w, glm::vec3 f) {
        column[count] = c;
        sine[count] = turn.x;
        cosine[count] = turn.y;
        weight[count] = w;
        factor[count++] = f;
    }
    /// Positions and colours in a picture. What it does not cover is left out; weights become those
    /// of what it does.
    void find(const Drawn& picture, double latitudeSine, double latitudeCosine) {
        picture.positions(
            {latitudeSine, latitudeCosine, sine.data(), cosine.data(), count, {}, {}, {}, {}},
            x.data(), y.data());
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const float covered = picture.coverage(x[i], y[i]);
            if (covered <= 0) continue;
            column[kept] = column[i];
            x[kept] = x[i];
            y[kept] = y[i];
            weight[kept] = weight[i] * covered;
            factor[kept++] = factor[i];
        }
        count = kept;
        picture.colours(x.data(), y.data(), count, colour.data());
    }
};

/// The four cells of the grid around pixels of a row: whether they show one picture, and how its
/// light is corrected there.
class CellsAround {
  public:
    CellsAround(const Footprint& print, int index, const Image<int>& labels,
                const Image<glm::vec3>& correction)
        : print_(print), index_(index), labels_(labels), correction_(correction) {}

    /// Of a row at `y`, cells from the grid's upper edge.
    void goToRow(double y) {
        const auto cy = static_cast<float>(y - 0.5);
        const int whole = static_cast<int>(std::floor(cy));
        ty_ = cy - static_cast<float>(whole);
        rows_ = {std::clamp(whole, 0, labels_.height() - 1),
                 std::clamp(whole + 1, 0, labels_.height() - 1)};
        at_ = INT_MIN;
    }
    /// Between columns `whole` and whole + 1; they go on across the grid's edge. False where none
    /// of the four shows the picture.
    bool goTo(int whole) {
        if (whole == at_) return some_;
        at_ = whole;
        const int width = labels_.width();
        const int x = (whole % width + width) % width;
        const std::array<int, 2> columns = {x, x + 1 < width ? x + 1 : 0};
        some_ = false;
        for (std::size_t c = 0; c < mine_.size(); ++c) {
            mine_[c] = labels_.at(columns[c & 1], rows_[c >> 1]) == index_;
            some_ = some_ || mine_[c];
        }
        for (std::size_t c = 0; c < corrections_.size() && some_; ++c) {
            const int column = print_.column(columns[c & 1], width);
            const int row = rows_[c >> 1] - print_.box.y;
            const bool inside = column >= 0 && row >= 0 && row < print_.box.height;
            corrections_[c] = inside ? &correction_.at(column, row) : nullptr;
        }
        return some_;
    }
    /// The share of what is shown that the picture has, `tx` of the way to the next column, and the
    /// factor for its light there.
    [[nodiscard]] std::pair<float, glm::vec3> at(float tx) const {
        const std::array<float, 4> shares = {(1 - tx) * (1 - ty_), tx * (1 - ty_), (1 - tx) * ty_,
                                             tx * ty_};
        float weight = 0;
        for (std::size_t c = 0; c < shares.size(); ++c)
            if (mine_[c]) weight += shares[c];
        glm::vec4 factor(0);
        for (std::size_t c = 0; c < shares.size(); ++c)
            if (corrections_[c]) factor += shares[c] * glm::vec4(*corrections_[c], 1);
        return {weight, factor.a > 0 ? glm::vec3(factor) / factor.a : glm::vec3(1)};
    }

  private:
    const Footprint& print_;
    int index_;
    const Image<int>& labels_;
    const Image<glm::vec3>& correction_;
    std::array<int, 2> rows_{};
    float ty_ = 0;  ///< how far the row is to the second of these
    int at_ = INT_MIN;
    bool some_ = false;
    std::array<bool, 4> mine_{};
    std::array<const glm::vec3*, 4> corrections_{};
};

/// Adds one picture to rows [top, top + sums.height()) of the panorama: linear light, weighted.
void draw(const Drawn& picture, const Footprint& print, int index, const Image<int>& labels,
          const glm::dvec3& gain, const Vignetting& vignetting, const Image<glm::vec3>& correction,
          int width, int top, Image<glm::vec4>& sums) {
    const int gridWidth = labels.width();
    const double cells = static_cast<double>(gridWidth) / width;
    const GridBox& box = print.box;
    const int first = std::max(top, static_cast<int>((box.y - kAroundDrawn) / cells));
    const int last = std::min(top + sums.height(),
                              static_cast<int>((box.y + box.height + kAroundDrawn) / cells) + 1);
    int left = 0, right = width;
    if (box.width < gridWidth) {
        left = static_cast<int>(std::floor((box.x - kAroundDrawn) / cells));
        right = std::min(left + width,
                         static_cast<int>(std::ceil((box.x + box.width + kAroundDrawn) / cells)));
    }
    // Sine and cosine of each column's longitude.
    std::vector<glm::dvec2> turns;
    for (int x = left; x < right; ++x) {
        const double longitude = M_PI * (1 - 2 * (x + 0.5) / width);
        turns.emplace_back(std::sin(longitude), std::cos(longitude));
    }
    const LinearTable& linear = linearTable();
    parallelForBlocks(first, last, 4, [&](std::int64_t begin, std::int64_t end) {
        RowPixels pixels(static_cast<std::size_t>(std::max(0, right - left)));
        CellsAround around(print, index, labels, correction);
        for (auto y = static_cast<int>(begin); y < end; ++y) {
            const double latitude = M_PI * (0.5 - 2 * (y + 0.5) / width);
            pixels.count = 0;
            around.goToRow((y + 0.5) * cells);
            for (int x = left; x < right; ++x) {
                const double cx = (x + 0.5) * cells - 0.5;
                int whole = static_cast<int>(cx);
                whole -= cx < whole;
                if (!around.goTo(whole)) {
                    // The step to the next cell of the grid; rounding may make it one pixel late.
                    x = std::max(x, static_cast<int>(std::floor((whole + 1.5) / cells - 0.5)) - 1);
                    continue;
                }
                const auto [weight, factor] = around.at(static_cast<float>(cx - whole));
                if (weight > 0) pixels.add(x, turns[x - left], weight, factor);
            }
            pixels.find(picture, std::sin(latitude), std::cos(latitude));
            const auto to = sums.row(y - top);
            for (std::size_t i = 0; i < pixels.count; ++i) {
                const glm::vec4 c = pixels.colour[i];
                glm::vec3 light{linear.linear(c.r), linear.linear(c.g), linear.linear(c.b)};
                if (!vignetting.none())
                    light = cleared(light,
                                    vignetting.clearing(picture.radius2(pixels.x[i], pixels.y[i])));
                light = withGain(light, gain) * pixels.factor[i];
                const int x = pixels.column[i];
                to[(x % width + width) % width] += pixels.weight[i] * glm::vec4(light, 1);
            }
        }
    });
}

}  // namespace

int naturalWidth(const PanoramaAlignment& alignment) {
    double focal = 0;
    for (const PanoramaCamera& camera : alignment.cameras)
        if (camera.used) focal = std::max(focal, camera.focal);
    const double width = std::clamp(2 * M_PI * focal, kLeastWidth, double{kMaxPanoramaWidth});
    return static_cast<int>(width) / kWidthStep * kWidthStep;
}

Result<PanoramaImage> composePanorama(PictureSource& source, PanoramaAlignment& alignment,
                                      const ComposeSettings& settings, Job& job) {
    const int width = settings.width > 0 ? settings.width : naturalWidth(alignment);
    if (width < 2 || width % 2 != 0)
        return fail(ErrorCode::usage,
                    "a panorama of {} pixels in width; an even number is expected", width);
    const int height = width / 2;
    const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    STX_CHECK(job.limits.checkAllocation(pixels, 2 * sizeof(glm::u8vec4), "the panorama"));
    const int gridWidth = gridWidthFor(alignment, width);
    STX_TRY(auto prints, footprintsOf(source, alignment, gridWidth, job));
    alignment.vignetting = findVignetting(prints, gridWidth);
    clearVignetting(prints, alignment.vignetting);
    const auto gains = findGains(prints, gridWidth);
    for (std::size_t i = 0; i < prints.size(); ++i)
        alignment.cameras[prints[i].picture].gain = gains[i];
    STX_TRY(const auto labels, findSeams(prints, gains, gridWidth, settings.hideSeams, job));
    const auto corrections = findCorrections(prints, gains, labels);

    PanoramaImage out{Rgba8Image(width, height)};
    const auto rowBytes = static_cast<std::uint64_t>(width) * sizeof(glm::vec4);
    const int band = static_cast<int>(std::clamp<std::uint64_t>(
        job.limits.maxMemoryBytes / kBandShare / rowBytes, 1, static_cast<std::uint64_t>(height)));
    // Rows that some picture reaches.
    const double cells = static_cast<double>(gridWidth) / width;
    int first = height, last = 0;
    for (const Footprint& f : prints) {
        first = std::min(first, static_cast<int>((f.box.y - kAroundRows) / cells));
        last = std::max(last, static_cast<int>((f.box.y + f.box.height + kAroundRows) / cells) + 1);
    }
    first = std::max(first, 0);
    last = std::min(last, height);
    const std::int64_t bands = std::max(1, (last - first + band - 1) / band);
    std::int64_t done = 0;
    for (int top = first; top < last; top += band) {
        Image<glm::vec4> sums(width, std::min(band, last - top), glm::vec4(0));
        const double from = static_cast<double>(top) * gridWidth / width - kAroundRows;
        const double to =
            static_cast<double>(top + sums.height()) * gridWidth / width + kAroundRows;
        for (std::size_t k = 0; k < prints.size(); ++k) {
            STX_CHECK(job.checkCancelled());
            job.progress(++done, bands * static_cast<std::int64_t>(prints.size()), "drawing");
            const GridBox& box = prints[k].box;
            if (box.y + box.height < from || box.y > to) continue;
            STX_TRY(auto picture, source.picture(prints[k].picture));
            const auto& camera = alignment.cameras[prints[k].picture];
            if (picture.size() != camera.size)
                return fail(ErrorCode::io, "'{}' changed while it was read",
                            source.name(prints[k].picture));
            draw(Drawn(std::move(picture), camera, lensOf(alignment, camera), width), prints[k],
                 static_cast<int>(k), labels, camera.gain, alignment.vignetting, corrections[k],
                 width, top, sums);
        }
        const Srgb8Tables& tables = srgb8Tables();
        parallelFor(0, sums.height(), [&](int y) {
            const auto fromRow = sums.row(y);
            const auto toRow = out.pixels.row(top + y);
            for (std::size_t x = 0; x < toRow.size(); ++x) {
                const glm::vec4 s = fromRow[x];
                if (s.a <= kLeastCoverage) continue;
                const glm::vec3 c = glm::vec3(s) / s.a;
                toRow[x] = {tables.code(c.r), tables.code(c.g), tables.code(c.b),
                            static_cast<std::uint8_t>(std::min(1.0f, s.a) * 255.0f + 0.5f)};
            }
        });
    }
    return out;
}

}  // namespace stx
