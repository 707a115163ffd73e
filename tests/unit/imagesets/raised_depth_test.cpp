// Depth of a photograph that is several times smaller than its picture, as phones store it: views
// of Middlebury sets whose disparity was reduced, beside the disparity that they have, and drawn
// from where other pictures of the set were taken. Ratios to the nearest sample only.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "formats/files/files.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/factory.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

constexpr double kBaseline = 160, kFullFocal = 3740;

struct ReducedSet {
    const char* folder;
    double size;    ///< of the original pictures: 1, or a third
    double offset;  ///< of disparity in the original size (dmin)
    double factor;  ///< how many times depth is smaller than the picture
    std::vector<int> others;

    [[nodiscard]] double focal() const { return kFullFocal * size; }
    /// Of 1/z: a pixel of disparity in the original size.
    [[nodiscard]] double pixelOfDisparity() const { return size / (focal() * kBaseline); }
};

Result<Bundle> viewOneOf(const ReducedSet& set, const std::filesystem::path& folder, Job& job) {
    const TemporaryFolder alone;
    for (const char* name : {"disp1.png", "view1.png"})
        std::filesystem::copy_file(folder / name, alone / name);
    ImageSetOptions options;
    options.focal = set.focal();
    options.baseline = kBaseline;
    options.disparityOffset = set.offset * set.size;
    options.disparityScale = 1 / set.size;
    options.refine = *RefineSettings::from("off");
    return readImageSet(alone.path(), options, job);
}

/// 1/z, with that of the farther side where a row has none.
Image<double> withoutHoles(const Image<float>& depth) {
    Image<double> out(depth.width(), depth.height(), 0);
    for (int y = 0; y < depth.height(); ++y) {
        for (int x = 0; x < depth.width(); ++x) {
            double farthest = 1e30;
            for (const int way : {-1, 1}) {
                int u = x;
                while (depth.contains(u, y) && !hasPoint(depth.at(u, y))) u += way;
                if (depth.contains(u, y))
                    farthest = std::min(farthest, 1.0 / static_cast<double>(depth.at(u, y)));
            }
            out.at(x, y) = farthest < 1e30 ? farthest : y > 0 ? out.at(x, y - 1) : 0;
        }
    }
    return out;
}

/// The mean of 1/z under each coarse pixel.
Image<double> reducedBy(const Image<double>& fine, double factor) {
    const int w = static_cast<int>(std::lround(fine.width() / factor)),
              h = static_cast<int>(std::lround(fine.height() / factor));
    Image<double> sum(w, h, 0), count(w, h, 0);
    for (int y = 0; y < fine.height(); ++y) {
        for (int x = 0; x < fine.width(); ++x) {
            const int u = x * w / fine.width(), v = y * h / fine.height();
            sum.at(u, v) += fine.at(x, y);
            count.at(u, v) += 1;
        }
    }
    for (std::size_t i = 0; i < sum.count(); ++i) sum.data()[i] /= count.data()[i];
    return sum;
}

/// View 1 with its reduced depth as a JPEG beside it, read as a photograph.
struct AsPhoto {
    TemporaryFolder folder;
    ImageSetOptions options;

    AsPhoto(const ReducedSet& set, const std::filesystem::path& from, const Camera& camera,
            const Image<double>& reduced) {
        std::filesystem::copy_file(from / "view1.png", folder / "view1.png");
        const auto [far, near] =
            std::minmax_element(reduced.pixels().begin(), reduced.pixels().end());
        Rgba8Image codes(reduced.width(), reduced.height());
        for (std::size_t i = 0; i < codes.count(); ++i)
            codes.data()[i] = glm::u8vec4(glm::u8vec3(static_cast<std::uint8_t>(std::lround(
                                              255 * (reduced.data()[i] - *far) / (*near - *far)))),
                                          255);
        FrameOptions quality;
        quality.jpegQuality = 85;
        EXPECT_TRUE(writePicture(codes, folder / "depth.jpg", quality));
        options.from = "photo";
        options.depthPattern = "depth.jpg";
        options.photo.nearIs = NearIs::white;
        options.depthMin = 1 / *near;
        options.depthMax = 1 / *far;
        options.intrinsics[0] = options.intrinsics[1] = set.focal();
        options.intrinsics[2] = camera.cx;
        options.intrinsics[3] = camera.cy;
    }
    [[nodiscard]] ReferenceView read(const char* refine) {
        options.refine = *RefineSettings::from(refine);
        Job job;
        auto bundle = readImageSet(folder / "view1.png", options, job);
        if (!bundle) {
            ADD_FAILURE() << bundle.error().text();
            return {};
        }
        return std::move(bundle->views[0]);
    }
};

/// Share of the pixels that are off by more than 8 pixels of disparity.
double shareOff(const ReducedSet& set, const Image<float>& depth, const Image<float>& truth) {
    int off = 0, count = 0;
    for (std::size_t i = 0; i < truth.count(); ++i) {
        if (!hasPoint(truth.data()[i])) continue;
        ++count;
        off += std::abs(1.0 / static_cast<double>(depth.data()[i]) -
                        1.0 / static_cast<double>(truth.data()[i])) > 8 * set.pixelOfDisparity();
    }
    return 1.0 * off / count;
}

/// Decibels of what a view shows of another picture of the set. Drawn without `rims`, which make
/// up for edges of depth that lie wrong.
double decibelsFrom(const ReducedSet& set, const ReferenceView& view, int number,
                    const std::filesystem::path& folder) {
    Job job;
    Bundle bundle;
    bundle.views = {view};
    RenderSettings settings;
    settings.fill = Fill::none;
    settings.without.add(Stage::rims);
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    if (!renderer) {
        ADD_FAILURE() << renderer.error().text();
        return 0;
    }
    Camera camera = view.camera;
    camera.position.x += kBaseline * (number - 1) / 4;
    camera.cx += set.offset * set.size * (number - 1) / 4;
    const Rgba8Image drawn = rgba8From(*(*renderer)->render(camera));
    const auto file = folder / fmt::format("view{}.png", number);
    const auto bytes = readFile(file, job.limits);
    EXPECT_TRUE(bytes);
    const auto image = decodeImage(*bytes, file.string(), job.limits);
    EXPECT_TRUE(image);
    Image<std::uint8_t> covered(drawn.width(), drawn.height(), 0);
    for (std::size_t i = 0; i < covered.count(); ++i)
        covered.data()[i] = drawn.data()[i].a == 255 ? 255 : 0;
    Rgba8Image truth = rgba8From(*image);
    for (auto& c : truth.pixels()) c.a = 255;
    CompareSettings of;
    of.mask = &covered;
    const auto compared = compare(drawn, truth, of);
    if (!compared) {
        ADD_FAILURE() << compared.error().text();
        return 0;
    }
    return *compared->psnrRgb;
}

// `share`: of the pixels that are off with the nearest sample, how many may be with raised depth;
// `gain`: dB.
void edgesAreNearer(const ReducedSet& set, double share, double gain) {
    REQUIRE_SHARED(folder, std::string("data/imagesets/") + set.folder);
    Job job;
    const auto whole = viewOneOf(set, folder, job);
    ASSERT_TRUE(whole) << whole.error().text();
    const ReferenceView& view = whole->views[0];
    AsPhoto photo(set, folder, view.camera, reducedBy(withoutHoles(view.depth), set.factor));
    const ReferenceView raised = photo.read("auto");
    ASSERT_EQ(raised.depth.width(), view.depth.width());
    // The same without the step: each pixel has the depth of the sample that it is in.
    const ReferenceView coarse = photo.read("auto,-raise");
    ReferenceView nearest = raised;
    for (int y = 0; y < view.depth.height(); ++y)
        for (int x = 0; x < view.depth.width(); ++x)
            nearest.depth.at(x, y) =
                coarse.depth.at(x * coarse.depth.width() / view.depth.width(),
                                y * coarse.depth.height() / view.depth.height());
    const double offNearest = shareOff(set, nearest.depth, view.depth),
                 off = shareOff(set, raised.depth, view.depth);
    std::printf("  %s: %.3f %% of the pixels are off, %.3f %% with the nearest sample\n",
                set.folder, 100 * off, 100 * offNearest);
    EXPECT_LE(off, share * offNearest);
    for (const int number : set.others) {
        const double without = decibelsFrom(set, nearest, number, folder),
                     with = decibelsFrom(set, raised, number, folder);
        std::printf("  view %d: %.2f dB, %.2f with the nearest sample\n", number, with, without);
        EXPECT_GE(with, without + gain);
    }
}

}  // namespace

TEST(RaisedDepth, EdgesOfAloeAreWhereThePictureHasThem) {
    edgesAreNearer({"middlebury2006-aloe", 1, 270, 5.25, {3, 5}}, 0.3, 1.8);
}

// Constants were not chosen on these.
TEST(RaisedDepth, EdgesOfBooksAre) {
    edgesAreNearer({"middlebury2005-books", 1.0 / 3, 200, 3, {5}}, 0.4, 0.4);
}
TEST(RaisedDepth, EdgesOfDollsAre) {
    edgesAreNearer({"middlebury2005-dolls", 1.0 / 3, 200, 3, {5}}, 0.5, 0.8);
}
// Bars of two pixels, which are lost in the reduced depth, leave nothing to gain in decibels.
TEST(RaisedDepth, EdgesOfLaundryAre) {
    edgesAreNearer({"middlebury2005-laundry", 1.0 / 3, 230, 3, {5}}, 0.5, -0.7);
}

}  // namespace stx
