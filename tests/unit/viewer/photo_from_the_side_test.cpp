// The model of a photograph with what is behind it, drawn from the side by a rasteriser of the
// test's own: nothing is open inside the frame.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "formats/imagesets/image_sets.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/viewer/surfaces_glb.hpp"
#include "lib/background/behind_photo.hpp"
#include "lib/model/median_distance.hpp"
#include "lib/render/surface/view_surfaces.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"

namespace photo_from_the_side_test {

using namespace stx;

/// The pixels of a picture on whose middles a triangle lies.
class Covered {
  public:
    explicit Covered(const Camera& camera)
        : camera_(camera), on_(camera.width, camera.height, std::uint8_t{0}) {}

    void add(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
        const glm::dvec2 p[3] = {at(a), at(b), at(c)};
        const auto side = [](glm::dvec2 from, glm::dvec2 to, glm::dvec2 q) {
            return (to.x - from.x) * (q.y - from.y) - (to.y - from.y) * (q.x - from.x);
        };
        const glm::dvec2 low = glm::max(glm::ceil(glm::min(p[0], glm::min(p[1], p[2]))), 0.0);
        const glm::dvec2 high =
            glm::min(glm::floor(glm::max(p[0], glm::max(p[1], p[2]))), glm::dvec2(on_.size() - 1));
        for (double y = low.y; y <= high.y; ++y) {
            for (double x = low.x; x <= high.x; ++x) {
                const glm::dvec2 q(x, y);
                const double u = side(p[0], p[1], q), v = side(p[1], p[2], q),
                             w = side(p[2], p[0], q);
                if ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0))
                    on_.at(static_cast<int>(x), static_cast<int>(y)) = 1;
            }
        }
    }
    /// Share of the picture.
    [[nodiscard]] double open() const {
        return static_cast<double>(std::ranges::count(on_.pixels(), std::uint8_t{0})) /
               static_cast<double>(on_.count());
    }

  private:
    /// With the middle of the first pixel at 0, 0.
    [[nodiscard]] glm::dvec2 at(glm::dvec3 world) const {
        const glm::dvec3 inCamera =
            glm::conjugate(camera_.orientation) * (world - camera_.position);
        return glm::dvec2(camera_.project(inCamera)) - 0.5;
    }

    Camera camera_;
    Image<std::uint8_t> on_;
};

/// A photograph's camera for pictures `smaller` times as large, moved to a side by a share of the
/// median distance; what is in the middle there stays in the middle.
Camera fromTheSide(const ReferenceView& photo, glm::dvec2 share, int smaller) {
    Camera camera = photo.camera;
    camera.width /= smaller;
    camera.height /= smaller;
    for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value /= smaller;
    const double distance = medianDistance(photo);
    const glm::dvec3 target = camera.position + distance * camera.forward();
    const glm::dvec3 up = camera.orientation * glm::dvec3(0, 1, 0);
    camera.position += camera.orientation * glm::dvec3(distance * share, 0);
    camera.orientation = *lookAt(camera.position, target, up);
    return camera;
}

constexpr glm::dvec2 kSides[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

/// A photograph, and what is behind it as far as an eye goes by 8 %.
Result<Bundle> withBehind(const std::filesystem::path& file, Job& job) {
    STX_TRY(Bundle bundle, readImageSet(file, {}, job));
    STX_CHECK(addBehind(bundle, {}, job));
    return bundle;
}

/// A wall, a card that leaves the frame below, one behind it that leaves it on the right.
ReferenceView cardsBeforeWall() {
    constexpr int kWidth = 640, kHeight = 480;
    ReferenceView view;
    view.name = "photo";
    view.camera.width = kWidth;
    view.camera.height = kHeight;
    view.camera.fx = view.camera.fy = 600;
    view.camera.cx = kWidth * 0.5;
    view.camera.cy = kHeight * 0.5;
    view.nearPlane = 1;
    view.farPlane = 8;
    view.depthBits = 32;
    view.depth = Image<float>(kWidth, kHeight, 4.0f);
    Rgba8Image colour(kWidth, kHeight, glm::u8vec4(200, 190, 170, 255));
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const bool front = x >= 200 && x < 380 && y >= 230, middle = x >= 320 && y >= 160;
            if (front || middle) {
                view.depth.at(x, y) = front ? 2.0f : 2.8f;
                colour.at(x, y) =
                    front ? glm::u8vec4(30, 60, 180, 255) : glm::u8vec4(150, 40, 40, 255);
            }
        }
    }
    view.texture = std::move(colour);
    return view;
}

/// Depth with fine steps in front of a wall, and of eight bits with far things whose steps are
/// large shares of their distance.
class ModelOfAPhone : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(PhotoFromTheSide, ModelOfAPhone,
                         testing::Values("apple-jpeg/selfie-absolute.jpg", "gdepth/lens-blur.jpg"));

TEST_P(ModelOfAPhone, IsClosed) {
    REQUIRE_SHARED(file, std::string("data/phones/") + GetParam());
    Job job;
    const auto bundle = withBehind(file, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto surfaces = viewSurfaces(*bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    for (const int percent : {5, 8}) {
        double open = 0;
        for (const glm::dvec2 side : kSides) {
            Covered covered(fromTheSide(bundle->views[0], 0.01 * percent * side, 3));
            for (const ViewSurface& s : *surfaces)
                for (std::size_t t = 0; t < s.triangles.size(); t += 3)
                    covered.add(s.positions[s.triangles[t]], s.positions[s.triangles[t + 1]],
                                s.positions[s.triangles[t + 2]]);
            open += covered.open() / static_cast<double>(std::size(kSides));
        }
        std::printf("  at %d %%: %.4f %% of the picture is open\n", percent, 100 * open);
        EXPECT_LE(open, 1e-5) << percent;
    }
}

TEST(PhotoFromTheSide, AFileOfWhatLeavesTheFrameIsClosed) {
    Job job;
    Bundle bundle;
    bundle.views = {cardsBeforeWall()};
    ASSERT_TRUE(addBehind(bundle, {}, job));
    const TemporaryFolder folder;
    const auto report = writeSurfaces(folder / "model.glb", bundle, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    const auto mesh = readMesh(folder / "model.glb", job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    for (const int percent : {5, 8}) {
        double open = 0;
        for (const glm::dvec2 side : kSides) {
            Covered covered(fromTheSide(bundle.views[0], 0.01 * percent * side, 1));
            for (const auto& t : mesh->triangles)
                covered.add(mesh->positions[t[0]], mesh->positions[t[1]], mesh->positions[t[2]]);
            open += covered.open() / static_cast<double>(std::size(kSides));
        }
        std::printf("  at %d %%: %.4f %% of the picture is open\n", percent, 100 * open);
        EXPECT_LE(open, 1e-5) << percent;
    }
}

}  // namespace photo_from_the_side_test
