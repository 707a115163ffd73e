#include "lib/panorama/work_copy.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::panorama {
namespace {

/// The share of [from, to) that pixel i covers.
float share(double from, double to, int i) {
    return static_cast<float>(std::max(0.0, std::min(to, i + 1.0) - std::max<double>(from, i)));
}

Rgba8Image reduced(const Rgba8Image& picture, int width, int height) {
    Rgba8Image out(width, height);
    const double sx = static_cast<double>(picture.width()) / width;
    const double sy = static_cast<double>(picture.height()) / height;
    parallelForBlocks(0, height, 16, [&](std::int64_t begin, std::int64_t end) {
        std::vector<glm::vec4> sums(static_cast<std::size_t>(picture.width()));
        for (auto y = static_cast<int>(begin); y < end; ++y) {
            std::fill(sums.begin(), sums.end(), glm::vec4(0));
            const double top = y * sy, bottom = (y + 1) * sy;
            const int last = std::min(picture.height(), static_cast<int>(std::ceil(bottom)));
            for (int row = static_cast<int>(top); row < last; ++row) {
                const float w = share(top, bottom, row);
                const auto from = picture.row(row);
                for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += w * glm::vec4(from[x]);
            }
            for (int x = 0; x < width; ++x) {
                const double left = x * sx, right = (x + 1) * sx;
                const int end2 = std::min(picture.width(), static_cast<int>(std::ceil(right)));
                glm::vec4 sum(0);
                for (int column = static_cast<int>(left); column < end2; ++column)
                    sum += share(left, right, column) * sums[column];
                out.at(x, y) =
                    glm::u8vec4(glm::clamp(sum / static_cast<float>(sx * sy) + 0.5f, 0.0f, 255.0f));
            }
        }
    });
    return out;
}

}  // namespace

WorkCopy makeWorkCopy(Rgba8Image picture, int maxSide) {
    WorkCopy copy;
    copy.fullSize = picture.size();
    const int side = std::max(picture.width(), picture.height());
    if (side > maxSide) {
        const double scale = static_cast<double>(maxSide) / side;
        copy.colour =
            reduced(picture, std::max(1, static_cast<int>(std::lround(picture.width() * scale))),
                    std::max(1, static_cast<int>(std::lround(picture.height() * scale))));
    } else {
        copy.colour = std::move(picture);
    }
    copy.grey = Image<std::uint8_t>(copy.colour.width(), copy.colour.height());
    for (std::size_t i = 0; i < copy.grey.count(); ++i) {
        const glm::u8vec4 p = copy.colour.pixels()[i];
        // Luma of ITU-R BT.601, in 256ths.
        copy.grey.pixels()[i] =
            static_cast<std::uint8_t>((77u * p.r + 150u * p.g + 29u * p.b + 128u) >> 8);
    }
    return copy;
}

// By 1 3 3 1 (eighths) in both directions.
Image<float> halved(const Image<float>& image) {
    const int width = std::max(1, image.width() / 2), height = std::max(1, image.height() / 2);
    const auto clampX = [&](int x) { return std::clamp(x, 0, image.width() - 1); };
    const auto clampY = [&](int y) { return std::clamp(y, 0, image.height() - 1); };
    Image<float> rows(image.width(), height), out(width, height);
    for (int y = 0; y < height; ++y) {
        const auto a = image.row(clampY(2 * y - 1)), b = image.row(clampY(2 * y)),
                   c = image.row(clampY(2 * y + 1)), d = image.row(clampY(2 * y + 2));
        const auto to = rows.row(y);
        for (std::size_t x = 0; x < to.size(); ++x)
            to[x] = 0.125f * (a[x] + d[x]) + 0.375f * (b[x] + c[x]);
    }
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x)
            out.at(x, y) =
                0.125f * (rows.at(clampX(2 * x - 1), y) + rows.at(clampX(2 * x + 2), y)) +
                0.375f * (rows.at(clampX(2 * x), y) + rows.at(clampX(2 * x + 1), y));
    }
    return out;
}

float sampleLinear(const Image<float>& image, double x, double y) {
    x = std::clamp(x - 0.5, 0.0, image.width() - 1.0);
    y = std::clamp(y - 0.5, 0.0, image.height() - 1.0);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
    const auto tx = static_cast<float>(x - x0), ty = static_cast<float>(y - y0);
    const float top = image.at(x0, y0) + (image.at(x1, y0) - image.at(x0, y0)) * tx;
    const float bottom = image.at(x0, y1) + (image.at(x1, y1) - image.at(x0, y1)) * tx;
    return top + (bottom - top) * ty;
}

}  // namespace stx::panorama
