#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "lib/model/median_distance.hpp"
#include "lib/refine/poses.hpp"
#include "lib/registration/camera_moves.hpp"
#include "tests/naive_warp.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/sensor.hpp"

using namespace stx;

namespace {

/// The case as a sensor has it, drawn in a mode that follows from the case.
struct Recorded {
    Bundle bundle;
    std::string what;  ///< sensor::recorded(), and the mode
    Drawn how;

    explicit Recorded(const Pictures& pictures) {
        bundle = sensor::recorded(pictures.captured(), what);
        if (what.empty()) what = "exact";
        how.mode = measures::pick(pictures, 321, 3) == 0 ? RenderMode::splat : RenderMode::surface;
        what += fmt::format(", {}", how.name());
    }
};

/// What a tracker takes for the poses of cameras: off by a part of the distance and as many
/// radians, cameras near each other alike, the novel one, too.
struct Drift {
    double share, distance;
    std::array<double, 6> phase;

    explicit Drift(const Captured& captured) {
        Random random(captured.from.seed * 7727 + std::uint64_t(captured.from.number));
        share = random.logBetween(0.002, 0.01);
        for (double& p : phase) p = random.between(0, 6.28);
        distance = medianDistance(captured.bundle.views.front());
    }
    [[nodiscard]] Camera of(Camera camera) const {
        const glm::dvec3 from = camera.position / distance, to = camera.forward();
        const auto wave = [&](int k) {
            const auto at = static_cast<std::size_t>(k);
            return share * std::sin(phase[at] + 2 * (from[k % 3] + to[(k + 1) % 3]));
        };
        camera.position += distance * glm::dvec3(wave(0), wave(1), wave(2));
        camera.orientation =
            glm::normalize(glm::dquat(glm::dvec3(wave(3), wave(4), wave(5))) * camera.orientation);
        return camera;
    }
};

/// The nearest point of all views in each pixel. Where a texel is `texel` pixels wide and that is
/// more than one, a point fills as many: single pixels would be judged at the points alone, where
/// each view knows the colour.
NaiveWarp warpOfAll(const Bundle& bundle, const Camera& to, double texel) {
    const auto reduced = [&](int size) { return std::max(1, int(std::lround(size / texel))); };
    const Camera camera = texel > 1 ? to.resized(reduced(to.width), reduced(to.height)) : to;
    NaiveWarp warp = naiveWarp(bundle.views.front(), camera);
    for (std::size_t i = 1; i < bundle.views.size(); ++i) {
        const NaiveWarp other = naiveWarp(bundle.views[i], camera);
        for (std::size_t k = 0; k < warp.picture.count(); ++k) {
            if (!(other.distance.data()[k] < warp.distance.data()[k])) continue;
            warp.picture.data()[k] = other.picture.data()[k];
            warp.covered.data()[k] = other.covered.data()[k];
            warp.distance.data()[k] = other.distance.data()[k];
        }
    }
    if (camera.width == to.width && camera.height == to.height) return warp;
    NaiveWarp out{Image<glm::u8vec4>(to.width, to.height), Image<std::uint8_t>(to.width, to.height),
                  Image<float>(to.width, to.height)};
    for (int y = 0; y < to.height; ++y) {
        for (int x = 0; x < to.width; ++x) {
            const int u = x * camera.width / to.width, v = y * camera.height / to.height;
            out.picture.at(x, y) = warp.picture.at(u, v);
            out.covered.at(x, y) = warp.covered.at(u, v);
            out.distance.at(x, y) = warp.distance.at(u, v);
        }
    }
    return out;
}

/// Takes out of `judged` the pixels that show the surface where no recorded view has a point of it
/// that it does not see at a grazing angle: a warp that fills whole texels covers them beside those
/// that have one, and where edges were moved or noise decides which texels of an outline meet,
/// whatever is drawn right is so by chance.
void keepKnown(const Captured& captured, const Bundle& recorded, Image<std::uint8_t>& judged) {
    // Share of the distance, beyond all noise: a tenth of how far edges lie before what is behind.
    constexpr double kItsOwn = 0.02;
    const auto hasPointAt = [&](std::size_t i, const Hit& hit) {
        const Camera& camera = captured.bundle.views[i].camera;
        const glm::dvec3 p(camera.cameraFromWorld() * glm::dvec4(hit.point, 1));
        if (!(p.z < 0)) return false;
        const glm::dvec2 place(camera.project(p));
        if (-glm::dot(camera.viewDirection(place.x, place.y), hit.normal) < kGrazing) return false;
        const glm::ivec2 at(glm::floor(place));
        const Image<float>& depth = recorded.views[i].depth;
        return depth.contains(at.x, at.y) && hasPoint(depth.at(at.x, at.y)) &&
               std::abs(depth.at(at.x, at.y) + p.z) <= kItsOwn * -p.z;
    };
    for (int y = 0; y < judged.height(); ++y) {
        for (int x = 0; x < judged.width(); ++x) {
            if (!judged.at(x, y)) continue;
            const Hit hit = captured.scene.trace(captured.novel, x + 0.5, y + 0.5);
            if (!hit.any()) continue;
            bool known = false;
            for (std::size_t i = 0; i < recorded.views.size(); ++i)
                known = known || hasPointAt(i, hit);
            if (!known) judged.at(x, y) = 0;
        }
    }
}

}  // namespace

namespace measures {

Outcome recordedBelowWarp(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    const Recorded recorded(pictures);
    const Camera& novel = pictures.captured().novel;
    NaiveWarp warp = warpOfAll(recorded.bundle, novel, pictures.captured().from.magnification);
    keepKnown(pictures.captured(), recorded.bundle, warp.covered);
    Frame warped;
    warped.colour = Image<glm::vec4>(novel.width, novel.height, glm::vec4(0));
    for (std::size_t k = 0; k < warp.picture.count(); ++k) {
        // Before black, as truth and frames are compared.
        const glm::vec4 c = glm::vec4(warp.picture.data()[k]) / 255.0f;
        warped.colour.data()[k] = {glm::vec3(c) * c.a, c.a};
    }
    STX_TRY(const Frame drawn, drawBundle(recorded.bundle, novel, recorded.how));
    const auto a = pictures.psnrWhere(drawn, warp.covered),
               b = pictures.psnrWhere(warped, warp.covered);
    if (!a || !b) return std::nullopt;
    return Measure{worseBy(*a, *b),
                   fmt::format("{}: {:.2f} dB, naive warp {:.2f} dB", recorded.what, *a, *b)};
}

Outcome refiningIsWorse(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    const Recorded recorded(pictures);
    const Camera& novel = pictures.captured().novel;
    Drawn asItIs = recorded.how;
    asItIs.refined = false;
    STX_TRY(const Frame refined, drawBundle(recorded.bundle, novel, recorded.how));
    STX_TRY(const Frame before, drawBundle(recorded.bundle, novel, asItIs));
    // Of the views without the faults of the sensor: refining can give back no more, and where
    // faults happen to draw better than that, the picture does not tell.
    STX_TRY(const Frame exact, drawBundle(pictures.captured().bundle, novel, asItIs));
    Image<std::uint8_t> judged(novel.width, novel.height, 255);
    keepKnown(pictures.captured(), recorded.bundle, judged);
    const auto a = pictures.psnrWhere(refined, judged), b = pictures.psnrWhere(before, judged),
               c = pictures.psnrWhere(exact, judged);
    if (!a || !b || !c) return std::nullopt;
    return Measure{worseBy(*a, std::min(*b, *c)),
                   fmt::format("{}: refined {:.2f} dB, as it is {:.2f} dB, exact {:.2f} dB",
                               recorded.what, *a, *b, *c)};
}

Outcome aligningIsWorse(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    Recorded recorded(pictures);
    // What an import aligns by itself.
    if (!std::ranges::all_of(recorded.bundle.views, &ReferenceView::depthMayBeUnknown))
        return std::nullopt;
    const Captured& captured = pictures.captured();
    const Drift drift(captured);
    for (std::size_t i = 0; i < recorded.bundle.views.size(); ++i)
        recorded.bundle.views[i].camera = drift.of(captured.bundle.views[i].camera);
    const Camera given = drift.of(captured.novel);
    Bundle aligned = recorded.bundle;
    Job job;
    STX_TRY(const RefineStepReport done, alignPoses(aligned, AlignPoses::found, job));
    if (done.views == 0) return std::nullopt;
    std::vector<MovedCamera> views;
    for (const ReferenceView& view : aligned.views) views.push_back(MovedCamera::of(view));
    STX_TRY(const Frame after,
            drawBundle(aligned, MovesOfNeighbours(views).aligned(given), recorded.how));
    STX_TRY(const Frame before, drawBundle(recorded.bundle, given, recorded.how));
    const double a = pictures.psnr(after), b = pictures.psnr(before);
    return Measure{worseBy(a, b), fmt::format("{}, poses off by {:.2f} %: aligned {:.2f} dB, as "
                                              "they are {:.2f} dB",
                                              recorded.what, 100 * drift.share, a, b)};
}

}  // namespace measures
