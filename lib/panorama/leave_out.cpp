#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"
#include "lib/panorama/footprints.hpp"
#include "lib/panorama/panorama.hpp"
#include "lib/panorama/work_copy.hpp"

namespace stx {

using namespace panorama;

namespace {

/// Mosaics are no wider: the check would else take as long as all pictures by each of them.
constexpr int kMostWidth = 4096;
/// Pixels that the mosaic covers by at least this share are compared.
constexpr float kCovered = 0.999f;
/// The least sum of squared light that a gain is found from, and the least mean squared error
/// (codes of 8 bits) that a PSNR is of: neither is divided by 0.
constexpr double kNoLight = 1e-9, kLeastError = 1e-3;

struct RowSums {
    glm::dvec3 product{0}, square{0};  ///< of linear light, for the gain
    std::size_t count = 0;
};

/// How well `mosaic` shows what the picture shows.
LeftOutPicture compared(const WorkCopy& copy, const PanoramaCamera& camera, const TurnLens& lens,
                        const Vignetting& vignetting, const PanoramaImage& mosaic) {
    const int width = copy.colour.width(), height = copy.colour.height();
    const glm::dmat3 worldFromCamera = glm::mat3_cast(camera.worldFromCamera);
    const Srgb8Tables& tables = srgb8Tables();
    Image<glm::vec4> seen(width, height);
    std::vector<RowSums> rows(static_cast<std::size_t>(height));
    parallelFor(0, height, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        RowSums& sums = rows[row];
        for (int x = 0; x < width; ++x) {
            glm::vec4& c = seen.at(x, y);
            const glm::dvec2 p = copy.position({x + 0.5, y + 0.5});
            c = mosaic.sample(worldFromCamera * lens.ray(p));
            const glm::u8vec4 own = copy.colour.at(x, y);
            if (c.a < kCovered || own.a < 255) {
                c.a = 0;
                continue;
            }
            const glm::dvec3 truth(tables.linear(own.r), tables.linear(own.g),
                                   tables.linear(own.b));
            c = {linearByTable(c.r), linearByTable(c.g), linearByTable(c.b), 1};
            if (!vignetting.none())
                c = glm::vec4(uncleared(glm::vec3(c), vignetting.clearing(glm::dot(p, p))), 1);
            sums.product += truth * glm::dvec3(c);
            sums.square += glm::dvec3(c) * glm::dvec3(c);
            ++sums.count;
        }
    });
    RowSums all;
    for (const RowSums& r : rows) {
        all.product += r.product;
        all.square += r.square;
        all.count += r.count;
    }
    LeftOutPicture out;
    out.covered = static_cast<double>(all.count) / static_cast<double>(seen.count());
    if (all.count == 0) return out;
    const glm::vec3 gain(all.product / glm::max(all.square, glm::dvec3(kNoLight)));
    double squares = 0;
    for (std::size_t i = 0; i < seen.count(); ++i) {
        const glm::vec4 c = seen.pixels()[i];
        if (c.a <= 0) continue;
        for (int channel = 0; channel < 3; ++channel) {
            const double off = 255.0 * srgbByTable(std::min(1.0f, c[channel] * gain[channel])) -
                               copy.colour.pixels()[i][channel];
            squares += off * off;
        }
    }
    out.psnr =
        10 * std::log10(255.0 * 255.0 /
                        std::max(kLeastError, squares / (3.0 * static_cast<double>(all.count))));
    return out;
}

}  // namespace

Result<std::vector<LeftOutPicture>> leaveEachOut(PictureSource& source,
                                                 const PanoramaAlignment& alignment,
                                                 const ComposeSettings& settings, Job& job) {
    std::vector<LeftOutPicture> out(alignment.cameras.size());
    if (alignment.used() < 2) return out;
    ComposeSettings compose = settings;
    const int natural = naturalWidth(alignment);
    compose.width = std::min(settings.width > 0 ? settings.width : natural, kMostWidth);
    const double scale = std::min(1.0, static_cast<double>(compose.width) / natural);
    for (std::size_t k = 0; k < out.size(); ++k) {
        const PanoramaCamera& camera = alignment.cameras[k];
        if (!camera.used) continue;
        PanoramaAlignment others = alignment;
        others.cameras[k].used = false;
        STX_TRY(const auto mosaic, composePanorama(source, others, compose, job));
        STX_TRY(auto picture, source.picture(static_cast<int>(k)));
        const double side = std::max(camera.size.x, camera.size.y) * scale;
        const WorkCopy copy =
            makeWorkCopy(std::move(picture), std::max(1, static_cast<int>(std::lround(side))));
        out[k] = compared(copy, camera, lensOf(alignment, camera), others.vignetting, mosaic);
    }
    return out;
}

}  // namespace stx
