#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "lib/registration/disagreement.hpp"
#include "lib/render/around/around.hpp"
#include "lib/render/surface/prepare/source.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

constexpr Drawn kNormal{RenderMode::surface, Quality::normal},
    kBest{RenderMode::surface, Quality::best}, kSplat{RenderMode::splat, Quality::normal};
constexpr std::array kWays{kNormal, kBest, kSplat};
constexpr std::array kWayNames{"normal", "best", "splat"};

}  // namespace

namespace measures {

int pick(const Pictures& pictures, int salt, int below) {
    const SweepCase& c = pictures.captured().from;
    Random random(c.seed * 6151 + static_cast<std::uint64_t>(c.number) * 31 +
                  static_cast<std::uint64_t>(salt));
    return random.whole(0, below - 1);
}

Outcome openWhereSeen(Pictures& pictures, std::span<const Drawn> ways) {
    Measure out;
    for (std::size_t i = 0; i < ways.size(); ++i) {
        STX_TRY(const Frame* frame, pictures.of(ways[i]));
        const auto open = pictures.openShare(*frame, 2);
        if (!open) return std::nullopt;
        out.found = std::max(out.found, *open);
        out.what += fmt::format("{}{} {:.2f} %", i ? ", " : "open: ", kWayNames[i], *open);
    }
    return out;
}

Outcome openWhereSeen(Pictures& pictures) {
    return openWhereSeen(pictures, kWays);
}

// A room that two places see all around, from amid it or beside a wall: surfaces reach behind the
// camera.
Outcome openInside(Pictures& pictures, glm::dvec3 eye, double degrees,
                   std::span<const Drawn> ways) {
    Captured inside = pictures.captured();
    if (inside.from.shape != SweepCase::room) return std::nullopt;
    const auto turn = [&](int salt) {
        const auto angle = [&](int k) {
            return glm::radians(static_cast<double>(pick(pictures, salt + k, 360)));
        };
        return glm::dquat(glm::dvec3(angle(0), angle(1), angle(2)));
    };
    inside.bundle.views.clear();
    for (const double beside : {-0.3, 0.2}) {
        Camera pose;
        pose.position = {beside, 0.1, 0.6 - beside};
        pose.orientation = turn(beside < 0 ? 353 : 359);
        for (const Camera& face : facesAround(pose, std::clamp(inside.from.width, 24, 96) / 2)) {
            inside.bundle.views.push_back(look(inside.scene, face));
            inside.bundle.views.back().name = fmt::format("face{}", inside.bundle.views.size());
        }
    }
    const double across = glm::radians(degrees);
    inside.novel = Camera::fromFieldOfView(eye, turn(367), {across, across}, false, 96, 96);
    inside.truth = look(inside.scene, inside.novel);
    Pictures shown(inside);
    auto open = openWhereSeen(shown, ways);
    if (open && *open)
        (*open)->what += fmt::format("; {:.0f} degrees across at {:.2f} {:.2f} {:.2f}", degrees,
                                     eye.x, eye.y, eye.z);
    return open;
}

Outcome openInWidePictures(Pictures& pictures) {
    return openInside(pictures, {0, 0, 0.6}, 140 + pick(pictures, 349, 30), kWays);
}

Outcome openBesideWalls(Pictures& pictures) {
    // In scene units; the room is six across, and texels are up to half a unit wide.
    const double gap = 0.02 + 0.01 * pick(pictures, 373, 30);
    return openInside(pictures, {3 - gap, 0, 0.6}, 60 + pick(pictures, 379, 80),
                      std::span(kWays).first(2));
}

Outcome drawnWhereEmpty(Pictures& pictures) {
    Measure out;
    for (std::size_t i = 0; i < kWays.size(); ++i) {
        STX_TRY(const Frame* frame, pictures.of(kWays[i]));
        const auto drawn = pictures.drawnShare(*frame);
        if (!drawn) return std::nullopt;
        out.found = std::max(out.found, *drawn);
        out.what += fmt::format("{}{} {:.2f} %", i ? ", " : "drawn: ", kWayNames[i], *drawn);
    }
    return out;
}

// Views of a room are covered up to their borders, so that what is hidden is filled; and through a
// side without a wall they see that nothing is there.
Outcome filledWhereEmpty(Pictures& pictures) {
    Captured open = pictures.captured();
    if (open.from.shape != SweepCase::room) return std::nullopt;
    // The wall that the picture shows in one of its corners.
    Scene walls;
    walls.solids = {open.scene.solids.front()};
    const int corner = pick(pictures, 331, 4);
    const Hit wall = walls.trace(open.novel, corner & 1 ? open.novel.width - 1 : 1,
                                 corner & 2 ? open.novel.height - 1 : 1);
    open.scene.solids.front().openFace = wall.surface % 8;
    for (ReferenceView& view : open.bundle.views) {
        ReferenceView seen = look(open.scene, view.camera);
        seen.name = view.name;
        view = std::move(seen);
    }
    open.truth = look(open.scene, open.novel);
    const Pictures opened(open);
    STX_TRY(const Frame plain, drawBundle(open.bundle, open.novel, kNormal));
    STX_TRY(const Frame filled, drawBundle(open.bundle, open.novel, kNormal, true));
    const auto before = opened.drawnShare(plain), after = opened.drawnShare(filled);
    if (!before || !after) return std::nullopt;
    return Measure{*after - *before, fmt::format("drawn without filling {:.2f} %, with it {:.2f} %",
                                                 *before, *after)};
}

Outcome betterQualityCoversLess(Pictures& pictures) {
    STX_TRY(const Frame* normal, pictures.of(kNormal));
    STX_TRY(const Frame* best, pictures.of(kBest));
    const auto n = pictures.openShare(*normal, 1), b = pictures.openShare(*best, 1);
    if (!n || !b) return std::nullopt;
    return Measure{*b - *n, fmt::format("open: normal {:.2f} %, best {:.2f} %", *n, *b)};
}

Outcome betterQualityIsWorse(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    STX_TRY(const Frame* normal, pictures.of(kNormal));
    STX_TRY(const Frame* best, pictures.of(kBest));
    const double n = pictures.psnr(*normal), b = pictures.psnr(*best);
    return Measure{worseBy(b, n), fmt::format("normal {:.2f} dB, best {:.2f} dB", n, b)};
}

Outcome exactDepthIsRepaired(Pictures& pictures) {
    const PageSet pages(pictures.captured().bundle);
    RefineReport report;
    RefineStepReport light;
    const PageSet refined = pages.inOneLight({}, light).refined({}, &report);
    report.of(RefineStep::exposure) = light;
    const bool same = refined.exactDepth() && !report.changed();
    return Measure{same ? 0.0 : 1.0, report.text()};
}

Outcome exactViewsDisagree(Pictures& pictures) {
    const Bundle& bundle = pictures.captured().bundle;
    const DepthDisagreement found = measureDepthDisagreement(bundle);
    const auto off = std::ranges::count_if(found.views, &ViewDisagreement::disagrees);
    return Measure{static_cast<double>(off),
                   disagreementNote(bundle, found, false).value_or("all agree")};
}

Outcome surfaceBelowSplats(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    STX_TRY(const Frame* surface, pictures.of(kNormal));
    STX_TRY(const Frame* splats, pictures.of(kSplat));
    const double a = pictures.psnr(*surface), b = pictures.psnr(*splats);
    return Measure{worseBy(a, b), fmt::format("surface {:.2f} dB, splat {:.2f} dB", a, b)};
}

Bundle noisyViews(const Pictures& pictures, double& share) {
    constexpr std::array kShares{0.002, 0.005, 0.01};
    share = kShares[std::size_t(pick(pictures, 311, int(kShares.size())))];
    Bundle noisy = pictures.captured().bundle;
    noisy::addNoise(noisy, share);
    return noisy;
}

Outcome noisySurfaceBelowSplats(Pictures& pictures) {
    if (pictures.seenCount(1) < kFewest) return std::nullopt;
    double share = 0;
    const Bundle noisy = noisyViews(pictures, share);
    STX_TRY(const Frame surface, drawBundle(noisy, pictures.captured().novel, kNormal));
    STX_TRY(const Frame splats, drawBundle(noisy, pictures.captured().novel, kSplat));
    const double a = pictures.psnr(surface), b = pictures.psnr(splats);
    return Measure{
        worseBy(a, b),
        fmt::format("noise of {:.1f} %: surface {:.2f} dB, splat {:.2f} dB", 100 * share, a, b)};
}

}  // namespace measures
