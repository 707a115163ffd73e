#include "formats/imagesets/no_depth.hpp"

#include <algorithm>

namespace stx::imagesets {
namespace {

/// Calls work(image, full) with the pixels of a texture and the alpha of what is covered in full.
template <class Work>
void withPixels(Texture& texture, const Work& work) {
    if (auto* bytes = texture.rgba8())
        work(*bytes, std::uint8_t{255});
    else
        work(*texture.rgbaFloat(), 1.0f);
}

/// Makes a picture transparent where its depth, which may be smaller, has the distance of nothing.
/// Whether there was such a pixel.
bool clearNothing(StoredView& stored) {
    const Image<float>& depth = stored.depth;
    const auto nothing = [](float d) { return d >= kDistanceOfNothing; };
    if (std::ranges::none_of(depth.pixels(), nothing)) return false;
    withPixels(stored.texture, [&](auto& image, auto full) {
        for (int y = 0; y < image.height(); ++y) {
            for (int x = 0; x < image.width(); ++x) {
                auto& alpha = image.at(x, y).a;
                if (!stored.alpha) alpha = full;
                const auto in = [](int at, int size, int of) {
                    return static_cast<int>(static_cast<std::int64_t>(at) * of / size);
                };
                // Pixels that are covered in part are the silhouette of points beside them.
                if (alpha == full && nothing(depth.at(in(x, image.width(), depth.width()),
                                                      in(y, image.height(), depth.height()))))
                    alpha = 0;
            }
        }
    });
    stored.alpha = true;
    return true;
}

/// Whether a pixel of the depth has no distance though all that the picture shows in it is fully
/// opaque. The picture may be finer than its depth, and outlines then are inside pixels of depth.
bool lacksDepthInside(StoredView& stored) {
    const Image<float>& depth = stored.depth;
    bool found = false;
    withPixels(stored.texture, [&](const auto& image, auto full) {
        // The first and the last pixel of the picture, by one axis, that one of depth touches.
        const auto first = [](int at, int size, int of) {
            return static_cast<int>(static_cast<std::int64_t>(at) * size / of);
        };
        const auto last = [](int at, int size, int of) {
            return static_cast<int>((static_cast<std::int64_t>(at + 1) * size - 1) / of);
        };
        const int dw = depth.width(), dh = depth.height();
        for (int y = 0; y < dh && !found; ++y) {
            for (int x = 0; x < dw && !found; ++x) {
                if (depth.at(x, y) > 0) continue;
                bool opaque = true;
                for (int j = first(y, image.height(), dh); j <= last(y, image.height(), dh); ++j)
                    for (int i = first(x, image.width(), dw); i <= last(x, image.width(), dw); ++i)
                        opaque = opaque && image.at(i, j).a == full;
                found = opaque;
            }
        }
    });
    return found;
}

}  // namespace

void coverOnlyPoints(Texture& texture, Image<float>& depth, bool ownAlpha, bool mayBeUnknown) {
    withPixels(texture, [&](auto& image, auto full) {
        for (std::size_t i = 0; i < depth.count(); ++i) {
            auto& alpha = image.data()[i].a;
            if (!ownAlpha) alpha = full;
            if (alpha == 0) depth.data()[i] = kNoDepth;
            if (!hasPoint(depth.data()[i]) && alpha == full && !mayBeUnknown) alpha = 0;
        }
    });
}

NoDepth noDepthOf(const SetView& set, const ImageSetOptions& options, StoredView& stored) {
    if (options.noDepth) return *options.noDepth;
    // Its pixels are not the picture's, and each camera sees what the other does not.
    if (set.depthCamera) return NoDepth::unknown;
    // An export of ours.
    if (set.planes || set.noDepth || set.pruned) return set.noDepth.value_or(NoDepth::empty);
    bool open = false;
    if (stored.alpha)
        withPixels(stored.texture, [&](auto& image, auto full) {
            open = std::ranges::any_of(image.pixels(), [&](const auto& p) { return p.a < full; });
        });
    if (clearNothing(stored)) return NoDepth::unknown;
    // What the picture shows is there: a sensor missed it, or stereo found nothing.
    return open && !lacksDepthInside(stored) ? NoDepth::empty : NoDepth::unknown;
}

bool openEverywhere(const StoredView& stored) {
    if (!stored.alpha) return false;
    const auto pixels = static_cast<std::size_t>(stored.texture.width()) *
                        static_cast<std::size_t>(stored.texture.height());
    for (std::size_t i = 0; i < pixels; ++i)
        if (stored.texture.alpha(i) >= 1.0f) return false;
    return true;
}

void dropImpossible(Image<float>& distances) {
    for (float& d : distances.pixels())
        if (!(d > 0 && d < kDistanceOfNothing)) d = kNoDepth;
}

}  // namespace stx::imagesets
