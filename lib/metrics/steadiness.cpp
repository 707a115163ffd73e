#include "lib/metrics/steadiness.hpp"

#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/metrics/seen_pixel.hpp"

namespace stx {

template <class P>
void Steadiness::addFrame(const Image<P>& picture, const Image<P>& truth,
                          const CompareSettings& settings, double white) {
    if (frames_ == 0) firstWhite_ = white_ = white;
    const auto before = static_cast<float>(white / white_);
    white_ = white;
    const bool follows = error_.size() == picture.size();
    if (!follows) error_ = Image<glm::vec3>(picture.width(), picture.height());
    // Rows are added up in their order, so that the sum is the same on any number of threads.
    std::vector<double> sums(static_cast<std::size_t>(picture.height()), 0.0);
    std::vector<std::int64_t> counts(sums.size(), 0);
    parallelFor(0, picture.height(), [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        const auto at = static_cast<std::size_t>(row);
        for (int x = 0; x < picture.width(); ++x) {
            const glm::vec3 error = metrics::seenPixel(picture.at(x, y), settings.background) -
                                    metrics::seenPixel(truth.at(x, y), settings.background);
            const glm::vec3 change = glm::abs(error - before * error_.at(x, y));
            error_.at(x, y) = error;
            if (!settings.counts(x, y)) continue;
            sums[at] += change.r + change.g + change.b;
            ++counts[at];
        }
    });
    const int frame = frames_++;
    if (!follows) return;
    double sum = 0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        sum += sums[i];
        count += counts[i];
    }
    const double mean =
        count > 0 ? sum / (3.0 * static_cast<double>(count)) * (firstWhite_ / white) : 0.0;
    ++steps_;
    sum_ += mean;
    if (steps_ > 1 && mean <= worst_) return;
    worst_ = mean;
    worstFrame_ = frame;
}

void Steadiness::add(const Image<glm::u8vec4>& picture, const Image<glm::u8vec4>& truth,
                     const CompareSettings& settings) {
    addFrame(picture, truth, settings, 255.0);
}

void Steadiness::add(const Image<glm::vec4>& picture, const Image<glm::vec4>& truth,
                     const CompareSettings& settings) {
    addFrame(picture, truth, settings, settings.peak);
}

}  // namespace stx
