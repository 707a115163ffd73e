#include "lib/metrics/compare.hpp"

#include <cmath>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/metrics/background_colour.hpp"
#include "lib/metrics/seen_pixel.hpp"
#include "lib/metrics/ssim.hpp"

namespace stx {
namespace {

using metrics::seenPixel;

constexpr int kRowsPerTask = 16;

double luma(glm::vec3 c) {
    return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
}

double peakOf(const Image<glm::u8vec4>&, const CompareSettings&) {
    return 255.0;
}
double peakOf(const Image<glm::vec4>&, const CompareSettings& s) {
    return s.peak;
}

Result<void> checkFinite(const Image<glm::u8vec4>&, const CompareSettings&, const char*) {
    return {};
}
Result<void> checkFinite(const Image<glm::vec4>& image, const CompareSettings& settings,
                         const char* name) {
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            const auto& c = image.at(x, y);
            if (!settings.counts(x, y)) continue;
            if (std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b) &&
                std::isfinite(c.a))
                continue;
            return fail(
                ErrorCode::invalidInput,
                "the {} picture holds a value that is not finite at ({}, {}); mask it out or "
                "replace it before comparing",
                name, x, y);
        }
    }
    return {};
}

template <class P>
Result<void> checkInputs(const Image<P>& a, const Image<P>& b, const CompareSettings& settings) {
    if (a.size() != b.size())
        return fail(ErrorCode::invalidInput, "the pictures are {}x{} and {}x{}; both must match",
                    a.width(), a.height(), b.width(), b.height());
    if (a.empty()) return fail(ErrorCode::invalidInput, "the pictures are empty");
    if (settings.mask && settings.mask->size() != a.size())
        return fail(ErrorCode::invalidInput,
                    "the mask is {}x{} but the pictures are {}x{}; all must match",
                    settings.mask->width(), settings.mask->height(), a.width(), a.height());
    if (!(peakOf(a, settings) > 0) || !std::isfinite(peakOf(a, settings)))
        return fail(ErrorCode::usage, "the peak is {:g}; it must be above 0", settings.peak);
    STX_CHECK(metrics::checkBackground(settings.background));
    STX_CHECK(checkFinite(a, settings, "first"));
    STX_CHECK(checkFinite(b, settings, "second"));
    return {};
}

struct RowSums {
    double rgb = 0, y = 0;
    std::int64_t pixels = 0, different = 0;
    WorstPixel worst{-1, -1, -1.0};
};

std::optional<double> decibels(double squaredSum, double values, double peak) {
    if (squaredSum <= 0) return std::nullopt;
    return 10.0 * std::log10(peak * peak * values / squaredSum);
}

template <class P>
Result<Comparison> compareImages(const Image<P>& a, const Image<P>& b,
                                 const CompareSettings& settings, const Job* job) {
    STX_CHECK(checkInputs(a, b, settings));
    const auto checkStopped = [job] { return job ? job->checkCancelled() : Result<void>(); };
    const double peak = peakOf(a, settings);
    Image<float> lumaA(a.width(), a.height()), lumaB(a.width(), a.height());
    std::vector<RowSums> rows(a.height());
    parallelFor(0, a.height(), kRowsPerTask, [&](int y) {
        if (!checkStopped()) return;
        RowSums& sums = rows[y];
        for (int x = 0; x < a.width(); ++x) {
            const glm::vec3 ca = seenPixel(a.at(x, y), settings.background);
            const glm::vec3 cb = seenPixel(b.at(x, y), settings.background);
            const double ya = luma(ca), yb = luma(cb);
            lumaA.at(x, y) = static_cast<float>(ya);
            lumaB.at(x, y) = static_cast<float>(yb);
            if (!settings.counts(x, y)) continue;
            ++sums.pixels;
            const glm::dvec3 d = glm::abs(glm::dvec3(ca) - glm::dvec3(cb));
            const double largest = std::max({d.r, d.g, d.b});
            if (largest > sums.worst.difference) sums.worst = {x, y, largest};
            if (largest > 0) ++sums.different;
            sums.rgb += d.r * d.r + d.g * d.g + d.b * d.b;
            sums.y += (ya - yb) * (ya - yb);
        }
    });
    STX_CHECK(checkStopped());
    RowSums all;
    for (const auto& r : rows) {
        all.rgb += r.rgb;
        all.y += r.y;
        all.pixels += r.pixels;
        all.different += r.different;
        if (r.worst.difference > all.worst.difference) all.worst = r.worst;
    }
    if (all.pixels == 0)
        return fail(ErrorCode::invalidInput, "the mask leaves no pixel to compare");
    Comparison out;
    out.pixels = all.pixels;
    out.differentPixels = all.different;
    out.worst = all.worst;
    out.white = peak;
    out.psnrRgb = decibels(all.rgb, 3.0 * all.pixels, peak);
    // Rounding of the two lumas alone must not make a difference.
    out.psnrY =
        all.different ? decibels(all.y, static_cast<double>(all.pixels), peak) : std::nullopt;
    out.ssimY = all.different ? meanSsim(lumaA, lumaB, peak, settings.mask, job) : 1.0;
    STX_CHECK(checkStopped());
    return out;
}

template <class P>
Result<Image<glm::u8vec4>> errorImage(const Image<P>& a, const Image<P>& b,
                                      const CompareSettings& settings, double gain) {
    STX_CHECK(checkInputs(a, b, settings));
    const double scale = gain / peakOf(a, settings);
    Image<glm::u8vec4> out(a.width(), a.height());
    parallelFor(0, a.height(), kRowsPerTask, [&](int y) {
        for (int x = 0; x < a.width(); ++x) {
            if (!settings.counts(x, y)) {
                out.at(x, y) = {0, 0, 64, 255};
                continue;
            }
            const glm::vec3 d = glm::abs(seenPixel(a.at(x, y), settings.background) -
                                         seenPixel(b.at(x, y), settings.background));
            // Black, red, yellow, white at 0, 1/3, 2/3, 1.
            const double t = 3.0 * scale * std::max({d.r, d.g, d.b});
            const auto ramp = [&](double start) {
                return static_cast<std::uint8_t>(
                    std::lround(255 * std::clamp(t - start, 0.0, 1.0)));
            };
            out.at(x, y) = {ramp(0), ramp(1), ramp(2), 255};
        }
    });
    return out;
}

}  // namespace

Result<Comparison> compare(const Image<glm::u8vec4>& a, const Image<glm::u8vec4>& b,
                           const CompareSettings& settings, const Job* job) {
    return compareImages(a, b, settings, job);
}
Result<Comparison> compare(const Image<glm::vec4>& a, const Image<glm::vec4>& b,
                           const CompareSettings& settings, const Job* job) {
    return compareImages(a, b, settings, job);
}

Result<Image<glm::u8vec4>> errorPicture(const Image<glm::u8vec4>& a, const Image<glm::u8vec4>& b,
                                        const CompareSettings& settings, double gain) {
    return errorImage(a, b, settings, gain);
}
Result<Image<glm::u8vec4>> errorPicture(const Image<glm::vec4>& a, const Image<glm::vec4>& b,
                                        const CompareSettings& settings, double gain) {
    return errorImage(a, b, settings, gain);
}

void SequenceComparison::add(const Comparison& frame) {
    const auto squared = [&](const std::optional<double>& dB, double values) {
        return dB ? values / std::pow(10.0, *dB / 10.0) : 0.0;
    };
    squaredRgb_ += squared(frame.psnrRgb, 3.0 * frame.pixels);
    squaredY_ += squared(frame.psnrY, static_cast<double>(frame.pixels));
    ssim_ += frame.ssimY;
    total_.pixels += frame.pixels;
    total_.differentPixels += frame.differentPixels;
    if (frames_ == 0 ||
        frame.worst.difference * total_.white > total_.worst.difference * frame.white) {
        total_.worst = frame.worst;
        total_.white = frame.white;
        worstFrame_ = frames_;
    }
    ++frames_;
}

Comparison SequenceComparison::total() const {
    Comparison out = total_;
    out.psnrRgb = decibels(squaredRgb_, 3.0 * out.pixels, 1.0);
    out.psnrY = decibels(squaredY_, static_cast<double>(out.pixels), 1.0);
    out.ssimY = frames_ ? ssim_ / frames_ : 1.0;
    return out;
}

}  // namespace stx
