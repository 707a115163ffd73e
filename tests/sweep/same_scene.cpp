#include <algorithm>

#include <fmt/format.h>
#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/render/compose/footprint.hpp"
#include "tests/sweep/measures.hpp"
#include "tests/sweep/random.hpp"

using namespace stx;

namespace {

/// One of both modes, by the case.
Drawn modeOf(const Pictures& pictures, int salt) {
    return {measures::pick(pictures, salt, 3) == 0 ? RenderMode::splat : RenderMode::surface};
}

/// How much a picture of a changed scene is worse against the truth than that of the scene itself.
measures::Outcome worseThanBefore(Pictures& pictures, const Drawn& how, const Frame& changed) {
    STX_TRY(const Frame* frame, pictures.of(how));
    const double before = pictures.psnr(*frame), after = pictures.psnr(changed);
    return Measure{worseBy(after, before),
                   fmt::format("{} {:.2f} dB, changed {:.2f} dB", how.name(), before, after)};
}

/// Two pictures of which neither has a reason to be better. Sources that show a place equally well
/// are chosen by tiles and in their order, so single pixels may differ; but one picture may not be
/// farther from the truth than the other.
Measure alike(const Pictures& pictures, const Drawn& how, const Frame& before, const Frame& changed,
              glm::ivec2 first = {0, 0}) {
    // Nobody sees it: see worseBy().
    constexpr double kNoDifference = 48;
    const double between = psnrBetween(before, changed);
    const double psnrA = pictures.psnr(before, first), psnrB = pictures.psnr(changed, first);
    return {between >= kNoDifference ? 0 : worseBy(psnrB, psnrA),
            fmt::format("{}: {:.2f} dB between the two, {:.2f} and {:.2f} dB from the truth",
                        how.name(), between, psnrA, psnrB),
            true};
}

/// A picture of the bundle after `change` of it and of the camera.
template <class Change>
measures::Outcome changedScene(Pictures& pictures, int salt, Change&& change) {
    Bundle bundle = pictures.captured().bundle;
    Camera camera = pictures.captured().novel;
    change(bundle, camera);
    const Drawn how = modeOf(pictures, salt);
    STX_TRY(const Frame changed, drawBundle(bundle, camera, how));
    STX_TRY(const Frame* frame, pictures.of(how));
    return alike(pictures, how, *frame, changed);
}

template <class Change>
void everyCamera(Bundle& bundle, Camera& novel, Change&& change) {
    for (ReferenceView& view : bundle.views) change(view.camera);
    change(novel);
}

template <class T>
void flip(Image<T>& image) {
    for (int y = 0; y < image.height(); ++y) std::ranges::reverse(image.row(y));
}

/// The camera of the mirror image: x becomes -x in the world and in the picture.
void mirror(Camera& camera) {
    camera.position.x = -camera.position.x;
    const glm::dquat q = camera.orientation;
    camera.orientation = glm::dquat(q.w, q.x, -q.y, -q.z);
    camera.cx = camera.width - camera.cx;
}

}  // namespace

namespace measures {

Outcome crop(Pictures& pictures) {
    const Camera& whole = pictures.captured().novel;
    const int left = pick(pictures, 11, 2) ? 13 : 37, top = pick(pictures, 12, 2) ? 13 : 37;
    Camera part = whole;
    part.width -= left;
    part.height -= top;
    if (part.width < 16 || part.height < 16) return std::nullopt;
    part.cx -= left;
    part.cy -= top;
    // The median pixel of a picture decides how much larger it is drawn and averaged: at 1.5
    // samples to a pixel twice, which is 3.4 dB better at the outlines of a pair of solids.
    const Footprint footprint(pictures.captured().bundle);
    if (footprint.factor(whole) != footprint.factor(part)) return std::nullopt;
    const Drawn how = modeOf(pictures, 13);
    STX_TRY(const Frame cut, drawBundle(pictures.captured().bundle, part, how));
    STX_TRY(const Frame* frame, pictures.of(how));
    // What is at the border of the part has other neighbours in the whole.
    constexpr int kBorder = 4;
    const int width = part.width - 2 * kBorder, height = part.height - 2 * kBorder;
    Frame a, b;
    a.colour = b.colour = Image<glm::vec4>(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            a.colour.at(x, y) = cut.colour.at(x + kBorder, y + kBorder);
            b.colour.at(x, y) = frame->colour.at(x + left + kBorder, y + top + kBorder);
        }
    }
    return alike(pictures, how, b, a, {left + kBorder, top + kBorder});
}

Outcome otherOrder(Pictures& pictures) {
    return changedScene(pictures, 21, [](Bundle& bundle, Camera&) {
        std::ranges::reverse(bundle.views);
        std::ranges::rotate(bundle.views, bundle.views.begin() + bundle.views.size() / 3);
    });
}

Outcome viewTwice(Pictures& pictures) {
    const std::size_t which =
        static_cast<std::size_t>(pick(pictures, 31, int(pictures.captured().bundle.views.size())));
    Bundle bundle = pictures.captured().bundle;
    bundle.views.push_back(bundle.views[which]);
    bundle.views.back().name = "again";
    const Drawn how = modeOf(pictures, 32);
    STX_TRY(const Frame changed, drawBundle(bundle, pictures.captured().novel, how));
    return worseThanBefore(pictures, how, changed);
}

Outcome viewOfFewPixels(Pictures& pictures) {
    const Captured& captured = pictures.captured();
    const std::size_t which =
        static_cast<std::size_t>(pick(pictures, 35, int(captured.bundle.views.size())));
    const Camera& fine = captured.bundle.views[which].camera;
    const int fewer = 3 + pick(pictures, 36, 8);
    Bundle bundle = captured.bundle;
    bundle.views.push_back(look(captured.scene, fine.resized(std::max(1, fine.width / fewer),
                                                             std::max(1, fine.height / fewer))));
    bundle.views.back().name = "few pixels";
    bundle.views.back().depthBits = captured.bundle.views[which].depthBits;
    const Drawn how{RenderMode::splat};
    STX_TRY(const Frame changed, drawBundle(bundle, captured.novel, how));
    return worseThanBefore(pictures, how, changed);
}

Outcome viewOfNothing(Pictures& pictures) {
    return changedScene(pictures, 41, [](Bundle& bundle, Camera&) {
        ReferenceView nothing = bundle.views[0];
        nothing.name = "nothing";
        // It looks the other way, from far behind.
        nothing.camera.position *= 3.0;
        nothing.camera.orientation = nothing.camera.orientation * glm::dquat(0, 0, 1, 0);
        std::ranges::fill(nothing.depth.pixels(), kNoDepth);
        std::ranges::fill(nothing.texture.rgba8()->pixels(), glm::u8vec4(0));
        bundle.views.insert(bundle.views.begin() + 1, std::move(nothing));
    });
}

Outcome turned(Pictures& pictures) {
    const glm::dquat quarter =
        glm::angleAxis(glm::half_pi<double>(),
                       std::array{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0),
                                  glm::dvec3(0, 0, 1)}[std::size_t(pick(pictures, 51, 3))]);
    return changedScene(pictures, 52, [&](Bundle& bundle, Camera& novel) {
        everyCamera(bundle, novel, [&](Camera& camera) {
            camera.position = quarter * camera.position;
            camera.orientation = glm::normalize(quarter * camera.orientation);
        });
    });
}

Outcome scaled(Pictures& pictures) {
    const double scale = pick(pictures, 61, 2) ? 1000 : 0.001;
    return changedScene(pictures, 62, [&](Bundle& bundle, Camera& novel) {
        everyCamera(bundle, novel, [&](Camera& camera) {
            camera.position *= scale;
            if (camera.orthographic) camera.fx /= scale, camera.fy /= scale;
        });
        for (ReferenceView& view : bundle.views) {
            view.nearPlane *= scale;
            view.farPlane *= scale;
            for (float& depth : view.depth.pixels())
                if (hasPoint(depth)) depth = static_cast<float>(depth * scale);
        }
    });
}

Outcome movedFar(Pictures& pictures) {
    const glm::dvec3 away(1e6, -2e6, 1e6);
    return changedScene(pictures, 71, [&](Bundle& bundle, Camera& novel) {
        everyCamera(bundle, novel, [&](Camera& camera) { camera.position += away; });
    });
}

Outcome mirrored(Pictures& pictures) {
    Bundle bundle = pictures.captured().bundle;
    Camera camera = pictures.captured().novel;
    everyCamera(bundle, camera, mirror);
    for (ReferenceView& view : bundle.views) {
        flip(view.depth);
        flip(*view.texture.rgba8());
    }
    const Drawn how = modeOf(pictures, 81);
    STX_TRY(Frame changed, drawBundle(bundle, camera, how));
    flip(changed.colour);
    STX_TRY(const Frame* frame, pictures.of(how));
    return alike(pictures, how, *frame, changed);
}

Outcome threads(Pictures& pictures) {
    const Drawn how = modeOf(pictures, 91);
    std::array<Frame, 2> frames;
    for (int i = 0; i < 2; ++i) {
        const ThreadLimit limit(i + 1);
        STX_TRY(frames[std::size_t(i)],
                drawBundle(pictures.captured().bundle, pictures.captured().novel, how, true));
    }
    std::int64_t different = 0;
    for (std::size_t i = 0; i < frames[0].colour.count(); ++i)
        different += frames[0].colour.data()[i] != frames[1].colour.data()[i];
    return Measure{double(different), fmt::format("{}: {} pixels differ", how.name(), different)};
}

Outcome gpu(Pictures& pictures) {
    Drawn how = modeOf(pictures, 101);
    STX_TRY(const Frame* frame, pictures.of(how));
    const Frame onProcessor = *frame;
    how.backend = Backend::gpu;
    auto drawn = pictures.of(how);
    // A machine without a driver says nothing about pictures.
    if (!drawn && drawn.error().code == ErrorCode::unsupported) return std::nullopt;
    if (!drawn) return tl::unexpected(drawn.error());
    const double a = pictures.psnr(onProcessor), b = pictures.psnr(**drawn);
    return Measure{worseBy(b, a),
                   fmt::format("{}: processor {:.2f} dB, GPU {:.2f} dB", how.name(), a, b)};
}

}  // namespace measures
