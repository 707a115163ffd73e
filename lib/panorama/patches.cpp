#include "lib/panorama/patches.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace stx::panorama {
namespace {

/// A patch: pixels of a level of the pyramid to each side of its middle, and along each side.
constexpr int kRadius = 7;
constexpr int kSide = 2 * kRadius + 1;
/// A patch moves in so many steps at most, and is in its place after one that is shorter than this,
/// pixels of the level; one that is longer than the most has lost its way.
constexpr int kPatchSteps = 10;
constexpr double kInPlace = 0.004, kMostStep = 4;
/// Pixels from the middle of a patch within which all of it must be in the other picture: where the
/// model stretches it more, the model is wrong.
constexpr double kMostReach = 40;
/// Standard deviations of luma (codes of 8 bits) below which a patch is flat: in the picture that
/// it comes from, and in the other one.
constexpr float kFlat = 1.5f, kFlatInOther = 1.0f;
/// The smaller eigenvalue of a patch's structure tensor must be at least this share of the sum of
/// both: an edge does not say where along it the patch is.
constexpr float kLeastCorner = 0.02f;
/// The correlation from which on a coarse level's move is believed.
constexpr double kAlikeOnCoarse = 0.6;
/// The coarsest level is passed over when the model is off by less than this, pixels of the work
/// copy.
constexpr double kNeedsCoarsest = 5;
/// Patches around features nearer to each other than this, pixels, would be nearly the same.
constexpr double kSamePlace = 3;
/// The share of all places by which the order in which they are tried jumps on: the smaller part of
/// the golden section, after which any number of them is spread over the picture.
constexpr std::size_t kJumpPerMille = 382;

/// 1 2 1 in both directions: what lies between pixels is then better known.
Image<float> smoothed(const Image<float>& image) {
    const int w = image.width(), h = image.height();
    Image<float> rows(w, h), out(w, h);
    for (int y = 0; y < h; ++y) {
        const auto a = image.row(std::max(0, y - 1)), b = image.row(y),
                   c = image.row(std::min(h - 1, y + 1));
        const auto to = rows.row(y);
        for (std::size_t x = 0; x < to.size(); ++x) to[x] = 0.25f * (a[x] + c[x]) + 0.5f * b[x];
    }
    for (int y = 0; y < h; ++y) {
        const auto from = rows.row(y);
        const auto to = out.row(y);
        for (std::size_t x = 0; x < to.size(); ++x)
            to[x] = 0.25f * (from[x > 0 ? x - 1 : 0] + from[std::min(x + 1, to.size() - 1)]) +
                    0.5f * from[x];
    }
    return out;
}

struct Window {
    std::array<float, kSide * kSide> values{};
    float mean = 0, deviation = 0;

    void measure() {
        double sum = 0, squares = 0;
        for (const float v : values) sum += v;
        mean = static_cast<float>(sum / static_cast<double>(values.size()));
        for (const float v : values) squares += (v - mean) * (v - mean);
        deviation = static_cast<float>(std::sqrt(squares / static_cast<double>(values.size())));
    }
};

/// A patch's place in both pictures.
struct PatchMove {
    glm::dvec2 from, to;  ///< pixels of the work copies
    glm::dmat2 toFromFrom;
    /// Second derivatives by x and x, x and y, y and y: without them, patches away from the middle
    /// are aligned with a small bias, always to one side.
    glm::vec2 xx, xy, yy;
};

/// A value between pixels that are all in the image; one pixel of margin.
inline float between(const Image<float>& image, float x, float y) {
    const int x0 = static_cast<int>(x - 0.5f), y0 = static_cast<int>(y - 0.5f);
    const float tx = x - 0.5f - static_cast<float>(x0), ty = y - 0.5f - static_cast<float>(y0);
    const float* a = image.data() + static_cast<std::size_t>(y0) * image.width() + x0;
    const float* b = a + image.width();
    const float top = a[0] + (a[1] - a[0]) * tx, bottom = b[0] + (b[1] - b[0]) * tx;
    return top + (bottom - top) * ty;
}

bool insideOf(const Image<float>& image, glm::dvec2 pixel, double margin) {
    return pixel.x >= margin && pixel.y >= margin && pixel.x <= image.width() - margin &&
           pixel.y <= image.height() - margin;
}

/// Moves `to` until the patches agree on one level; their correlation, 0 when they do not.
double moveOnLevel(const Image<float>& a, const Image<float>& b, double scale, PatchMove& move) {
    const glm::vec2 xx = move.xx * static_cast<float>(0.5 / scale),
                    xy = move.xy * static_cast<float>(1 / scale),
                    yy = move.yy * static_cast<float>(0.5 / scale);
    // Where the patch reaches in the other picture, at most; wide lenses bend it a lot.
    constexpr double kFarthest = kRadius + 1;
    const double reach =
        kFarthest * (glm::length(move.toFromFrom[0]) + glm::length(move.toFromFrom[1])) +
        kFarthest * kFarthest * (glm::length(xx) + glm::length(xy) + glm::length(yy)) + 2;
    const glm::dvec2 from = move.from * scale;
    if (!(reach < kMostReach) || !insideOf(a, from, kRadius + 2)) return 0;
    Window target;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            target.values[y * kSide + x] =
                between(a, static_cast<float>(from.x) + static_cast<float>(x - kRadius),
                        static_cast<float>(from.y) + static_cast<float>(y - kRadius));
    target.measure();
    if (target.deviation < kFlat) return 0;
    glm::dvec2 to = move.to * scale;
    double correlation = 0;
    constexpr int kWide = kSide + 2;
    std::array<float, kWide * kWide> wide;
    for (int step = 0; step < kPatchSteps; ++step) {
        if (!insideOf(b, to, reach)) return 0;
        const glm::vec2 right(move.toFromFrom[0]), down(move.toFromFrom[1]);
        for (int y = 0; y < kWide; ++y) {
            const auto dy = static_cast<float>(y - kRadius - 1);
            for (int x = 0; x < kWide; ++x) {
                const auto dx = static_cast<float>(x - kRadius - 1);
                const glm::vec2 p =
                    glm::vec2(to) + dx * (right + dx * xx + dy * xy) + dy * (down + dy * yy);
                wide[y * kWide + x] = between(b, p.x, p.y);
            }
        }
        const auto at = [&](int x, int y) { return wide[(y + 1) * kWide + x + 1]; };
        Window seen;
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) seen.values[y * kSide + x] = at(x, y);
        seen.measure();
        if (seen.deviation < kFlatInOther) return 0;
        const float gain = target.deviation / seen.deviation;
        float gxx = 0, gxy = 0, gyy = 0, ex = 0, ey = 0, product = 0;
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                const auto i = static_cast<std::size_t>(y * kSide + x);
                const float gx = 0.5f * (at(x + 1, y) - at(x - 1, y)) * gain;
                const float gy = 0.5f * (at(x, y + 1) - at(x, y - 1)) * gain;
                const float t = target.values[i] - target.mean;
                const float v = (seen.values[i] - seen.mean) * gain;
                gxx += gx * gx;
                gxy += gx * gy;
                gyy += gy * gy;
                ex += gx * (t - v);
                ey += gy * (t - v);
                product += t * v;
            }
        }
        correlation = product / (kSide * kSide * target.deviation * target.deviation);
        const float det = gxx * gyy - gxy * gxy;
        const float least = 0.5f * (gxx + gyy - std::hypot(gxx - gyy, 2 * gxy));
        if (least < kLeastCorner * (gxx + gyy) || det <= 0) return 0;
        const glm::dvec2 turn((gyy * ex - gxy * ey) / det, (gxx * ey - gxy * ex) / det);
        if (glm::length(turn) > kMostStep) return 0;
        to += move.toFromFrom * turn;
        if (glm::length(turn) < kInPlace) break;
    }
    move.to = to / scale;
    return correlation;
}

/// The place that the model expects, and how the surroundings are turned there.
std::optional<PatchMove> expected(const WorkCopy& a, const WorkCopy& b, const TurnModel& model,
                                  int ia, int ib, glm::dvec2 pixel) {
    constexpr double kStep = 6;  // pixels; derivatives are by differences over them
    std::array<glm::dvec2, 9> seen;
    for (int i = 0; i < 9; ++i) {
        const glm::dvec2 p = pixel + kStep * glm::dvec2(i % 3 - 1, i / 3 - 1);
        const auto s = seenBy(model, ia, ib, a.position(p));
        if (!s) return std::nullopt;
        seen[i] = b.pixel(*s);
    }
    const double square = kStep * kStep;
    return PatchMove{
        pixel,
        seen[4],
        glm::dmat2((seen[5] - seen[3]) / (2 * kStep), (seen[7] - seen[1]) / (2 * kStep)),
        (seen[5] + seen[3] - 2.0 * seen[4]) / square,
        (seen[8] + seen[0] - seen[2] - seen[6]) / (4 * square),
        (seen[7] + seen[1] - 2.0 * seen[4]) / square};
}

}  // namespace

Pyramid pyramidOf(const Image<std::uint8_t>& grey) {
    Image<float> image(grey.width(), grey.height());
    for (std::size_t i = 0; i < image.count(); ++i) image.pixels()[i] = grey.pixels()[i];
    Pyramid out;
    out[1] = halved(image);
    out[2] = halved(out[1]);
    out[0] = smoothed(smoothed(image));
    return out;
}

std::vector<Match> alignPatches(const std::vector<WorkCopy>& copies,
                                const std::vector<Pyramid>& pyramids,
                                const std::vector<Features>& features, const TurnModel& model,
                                int a, int b, const PatchSettings& s) {
    std::vector<Match> out;
    for (const bool swapped : {false, true}) {
        const int from = swapped ? b : a, to = swapped ? a : b;
        const auto f = static_cast<std::size_t>(from), t = static_cast<std::size_t>(to);
        // Features that the other picture should show, spread over what both share.
        std::vector<glm::dvec2> places;
        glm::dvec2 last(-1e9);
        for (const Feature& feature : features[f].points) {
            // A pixel's centre: the patch is then taken as it is.
            const glm::dvec2 pixel = glm::floor(glm::dvec2(feature.pixel)) + 0.5;
            if (glm::distance(pixel, last) < kSamePlace) continue;
            last = pixel;
            const auto there = seenBy(model, from, to, copies[f].position(pixel));
            if (there && insideOf(pyramids[t][0], copies[t].pixel(*there), kRadius + 2))
                places.push_back(pixel);
        }
        // Until there are enough.
        std::size_t step = std::max<std::size_t>(1, places.size() * kJumpPerMille / 1000);
        while (std::gcd(step, places.size()) > 1) ++step;
        const std::size_t enough = out.size() + static_cast<std::size_t>(s.most) / 2;
        for (std::size_t n = 0; n < places.size() && out.size() < enough; ++n) {
            const auto place =
                expected(copies[f], copies[t], model, from, to, places[n * step % places.size()]);
            if (!place) continue;
            PatchMove move = *place;
            double correlation = 1;
            for (int level = 2; level >= 0 && correlation > 0; --level) {
                if (level == 2 && s.reach < kNeedsCoarsest) continue;
                const double scale = std::ldexp(1.0, -level);
                PatchMove tried = move;
                correlation = moveOnLevel(pyramids[f][level], pyramids[t][level], scale, tried);
                // Coarse levels may see nothing where fine ones do.
                if (correlation > kAlikeOnCoarse) move = tried;
                if (level > 0) correlation = 1;
            }
            if (correlation < s.alike || glm::distance(move.to, place->to) > s.reach) continue;
            const glm::dvec2 pf = copies[f].position(move.from), pt = copies[t].position(move.to);
            out.push_back(swapped ? Match{pt, pf} : Match{pf, pt});
        }
    }
    return out;
}

}  // namespace stx::panorama
