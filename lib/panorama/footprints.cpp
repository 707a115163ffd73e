#include "lib/panorama/footprints.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "lib/base/parallel_try.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/panorama/kernels.hpp"
#include "lib/panorama/work_copy.hpp"

namespace stx::panorama {
namespace {

/// Footprint::inside of cells that a picture sees is at least this: 0 is not seen.
constexpr double kLeastInside = 1e-4;
/// A picture fills cells that are farther from its edge than this, in cells or as a share of its
/// shorter side's half.
constexpr double kFilledCells = 1.5, kFilledShare = 0.3;
/// The pixels whose light is mixed at a position are within this of it.
constexpr double kShownPixels = 0.5;
/// The smallest copy of a picture that its cells are taken from, pixels of its longer side.
constexpr int kLeastCopy = 8;
/// A picture that sees a pole, or nearly so, radians, has cells all around.
constexpr double kAtPole = 1e-3;
/// Cells that are added around what a picture sees.
constexpr double kCellsAround = 2;
/// Cells across a picture, and along the grid at least and at most.
constexpr double kPictureCells = 160, kFewestCells = 256, kMostCells = 2048;
/// Bytes of a cell beside its three colours (the picture's, coded, the correction): how far inside
/// it is, its distance from the middle, its costs and labels.
constexpr std::uint64_t kOtherBytes = 20;

glm::dvec2 extentOf(glm::ivec2 size) {
    return glm::dvec2(size) / glm::length(glm::dvec2(size));
}

/// Linear light between the pixels of a small copy.
glm::vec3 linearAt(const Image<glm::vec3>& image, glm::dvec2 pixel) {
    const double px = std::clamp(pixel.x - 0.5, 0.0, image.width() - 1.0);
    const double py = std::clamp(pixel.y - 0.5, 0.0, image.height() - 1.0);
    const int x0 = static_cast<int>(px), y0 = static_cast<int>(py);
    const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
    const auto tx = static_cast<float>(px - x0), ty = static_cast<float>(py - y0);
    return glm::mix(glm::mix(image.at(x0, y0), image.at(x1, y0), tx),
                    glm::mix(image.at(x0, y1), image.at(x1, y1), tx), ty);
}

/// Whether the picture shows all of the pixels within `reach` of a position.
bool showsAround(const Rgba8Image& picture, glm::dvec2 pixel, double reach) {
    const auto first = glm::max(glm::ivec2(glm::floor(pixel - reach)), glm::ivec2(0));
    const auto last = glm::min(glm::ivec2(glm::floor(pixel + reach)), picture.size() - 1);
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
            if (picture.at(x, y).a < 255) return false;
    return true;
}

Footprint footprintOf(Rgba8Image picture, const PanoramaCamera& camera, const TurnLens& lens,
                      int gridWidth) {
    Footprint f;
    f.box = boxOf(camera, lens, gridWidth);
    f.colour = Image<glm::vec3>(f.box.width, f.box.height, glm::vec3(0));
    f.inside = Image<float>(f.box.width, f.box.height, 0.0f);
    f.radius2 = Image<float>(f.box.width, f.box.height, 0.0f);
    f.whole = Image<std::uint8_t>(f.box.width, f.box.height, 0);
    // As many pixels as the grid has cells in the middle of the picture.
    const double cells = gridWidth / (2 * M_PI) * lens.focal;  // along half a diagonal
    const glm::dvec2 extent = extentOf(camera.size);
    const WorkCopy copy = makeWorkCopy(
        std::move(picture),
        std::max(kLeastCopy,
                 static_cast<int>(std::lround(2 * cells * std::max(extent.x, extent.y)))));
    Image<glm::vec3> light(copy.colour.width(), copy.colour.height());
    const Srgb8Tables& tables = srgb8Tables();
    for (std::size_t i = 0; i < light.count(); ++i) {
        const glm::u8vec4 p = copy.colour.pixels()[i];
        light.pixels()[i] = {tables.linear(p.r), tables.linear(p.g), tables.linear(p.b)};
    }
    RowOfRays row;
    row.worldFromCamera = glm::mat3_cast(camera.worldFromCamera);
    row.lens = lens;
    row.extent = extent;
    row.size = light.size();
    const auto width = static_cast<std::size_t>(f.box.width);
    std::vector<double> sines(width), cosines(width), px(width), py(width);
    for (std::size_t x = 0; x < width; ++x) {
        const double longitude =
            M_PI * (1 - 2 * (f.box.x + static_cast<double>(x) + 0.5) / gridWidth);
        sines[x] = std::sin(longitude);
        cosines[x] = std::cos(longitude);
    }
    row.sines = sines.data();
    row.cosines = cosines.data();
    row.count = width;
    const double shorter = std::min(extent.x, extent.y);
    for (int y = 0; y < f.box.height; ++y) {
        const double latitude = M_PI * (0.5 - 2 * (f.box.y + y + 0.5) / gridWidth);
        row.sine = std::sin(latitude);
        row.cosine = std::cos(latitude);
        positionsOf(row, px.data(), py.data());
        for (int x = 0; x < f.box.width; ++x) {
            const glm::dvec2 pixel(px[x], py[x]);
            const glm::dvec2 p = glm::abs(2.0 * pixel / row.size - 1.0) * extent;
            const glm::dvec2 inner = extent - p;
            const double border = std::min(inner.x, inner.y);
            if (border <= 0 || !showsAround(copy.colour, pixel, kShownPixels)) continue;
            f.inside.at(x, y) = static_cast<float>(std::max(kLeastInside, border / shorter));
            f.whole.at(x, y) = (border * cells > kFilledCells || border > kFilledShare * shorter) &&
                               showsAround(copy.colour, pixel, kFilledCells);
            f.radius2.at(x, y) = static_cast<float>(glm::dot(p, p));
            f.colour.at(x, y) = linearAt(light, pixel);
        }
    }
    return f;
}

}  // namespace

TurnLens lensOf(const PanoramaAlignment& alignment, const PanoramaCamera& camera) {
    const double focal = camera.focal / (0.5 * glm::length(glm::dvec2(camera.size)));
    const double factor = focal / alignment.focal;
    return {focal, alignment.k1 * factor * factor};
}

GridBox boxOf(const PanoramaCamera& camera, const TurnLens& lens, int gridWidth) {
    const glm::dvec3 ahead = camera.worldFromCamera * glm::dvec3(0, 0, -1);
    const double latitude = std::asin(std::clamp(ahead.y, -1.0, 1.0));
    const double radius = std::acos(std::clamp(-lens.ray(extentOf(camera.size)).z, -1.0, 1.0)) +
                          kCellsAround * 2 * M_PI / gridWidth;
    const int gridHeight = gridWidth / 2;
    const double perRadian = gridWidth / (2 * M_PI);
    GridBox box;
    box.y = std::max(0, static_cast<int>(std::floor((M_PI_2 - latitude - radius) * perRadian)));
    box.height = std::min(gridHeight,
                          static_cast<int>(std::ceil((M_PI_2 - latitude + radius) * perRadian))) -
                 box.y;
    box.width = gridWidth;
    if (std::abs(latitude) + radius < M_PI_2 - kAtPole) {
        const double half = std::asin(std::sin(radius) / std::cos(latitude));
        const glm::dvec2 middle = PanoramaImage::position(ahead, gridWidth);
        box.x = static_cast<int>(std::floor(middle.x - half * perRadian));
        box.width =
            std::min(gridWidth, static_cast<int>(std::ceil(middle.x + half * perRadian)) - box.x);
    }
    return box;
}

int gridWidthFor(const PanoramaAlignment& alignment, int panoramaWidth) {
    double angle = 0;
    int used = 0;
    for (const PanoramaCamera& camera : alignment.cameras) {
        if (!camera.used) continue;
        angle += 2 * std::atan(std::max(camera.size.x, camera.size.y) / (2 * camera.focal));
        ++used;
    }
    const double cells = 2 * M_PI * kPictureCells / (angle / std::max(used, 1));
    const int width = static_cast<int>(std::clamp(cells, kFewestCells, kMostCells)) / 2 * 2;
    return std::min(width, panoramaWidth);
}

Result<std::vector<Footprint>> footprintsOf(PictureSource& source,
                                            const PanoramaAlignment& alignment, int gridWidth,
                                            Job& job) {
    std::vector<int> used;
    for (std::size_t k = 0; k < alignment.cameras.size(); ++k)
        if (alignment.cameras[k].used) used.push_back(static_cast<int>(k));
    std::uint64_t cells = 0;
    for (const int k : used) {
        const PanoramaCamera& camera = alignment.cameras[k];
        const GridBox box = boxOf(camera, lensOf(alignment, camera), gridWidth);
        cells += static_cast<std::uint64_t>(box.width) * static_cast<std::uint64_t>(box.height);
    }
    STX_CHECK(
        job.limits.checkAllocation(cells, 3 * sizeof(glm::vec3) + kOtherBytes, "finding seams"));
    std::vector<Footprint> out(used.size());
    std::atomic<std::int64_t> done = 0;
    const auto count = static_cast<std::int64_t>(used.size());
    const auto made = parallelTry(0, count, [&](std::size_t at) -> Result<void> {
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto picture, source.picture(used[at]));
        const PanoramaCamera& camera = alignment.cameras[used[at]];
        out[at] = footprintOf(std::move(picture), camera, lensOf(alignment, camera), gridWidth);
        out[at].picture = used[at];
        job.progress(++done, count, "laying out pictures");
        return {};
    });
    STX_CHECK(made);
    return out;
}

}  // namespace stx::panorama
