// A folder with one equirectangular picture and its depth (ray length), or an OpenEXR file with
// both, and no camera: it is at the origin and looks along -Z in the middle of the picture.

#include <algorithm>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/set_options.hpp"

namespace stx::imagesets {
namespace {

template <class T>
Image<T> upperHalf(const Image<T>& image) {
    Image<T> half(image.width(), image.height() / 2);
    std::copy_n(image.data(), half.count(), half.data());
    return half;
}

/// Two pictures all around, one above the other, are a pair for two eyes.
bool isPair(int width, int height) {
    return width == height && height % 2 == 0;
}

/// Colour and depth; of a pair the upper picture, which by custom is the left eye's.
Result<StoredView> loadPanorama(const SetView& set, const YuvColour& yuv, bool deep, Job& job) {
    StoredView stored;
    STX_TRY(auto colour, readColour(set.texture, yuv, deep, job));
    stored.texture = std::move(colour.texture);
    stored.alpha = colour.alpha;
    STX_TRY(auto depth, readDepth(set.depth, job));
    stored.depth = std::move(depth.values);
    stored.largest = depth.largest;
    const int width = stored.texture.width(), height = stored.texture.height();
    if (isPair(width, height)) {
        if (const auto* coded = stored.texture.rgba8())
            stored.texture = upperHalf(*coded);
        else
            stored.texture = upperHalf(*stored.texture.rgbaFloat());
        job.note(fmt::format(
            "'{}' is {}x{}: two pictures all around for two eyes; the upper one (left) is read",
            set.texture.name, width, height));
    }
    if (isPair(stored.depth.width(), stored.depth.height())) stored.depth = upperHalf(stored.depth);
    return stored;
}

SetDescription setOf(PictureSource texture, PictureSource depth, const ImageSetOptions& options) {
    SetView view;
    view.name = "panorama";
    view.panorama = Panorama();
    view.texture = std::move(texture);
    view.depth = std::move(depth);
    view.load = [yuv = options.yuv, deep = options.deepColour](const SetView& set, Job& job) {
        return loadPanorama(set, yuv, deep, job);
    };
    view.distances = integersOrFloats(options, std::nullopt);
    SetDescription set;
    set.views.push_back(std::move(view));
    return set;
}

}  // namespace

Result<SetDescription> describePanorama(const path& given, const ImageSetOptions& options,
                                        Job& job) {
    const std::string where = inQuotes(given.string());
    std::error_code ec;
    if (given.extension() == ".exr" && std::filesystem::is_regular_file(given, ec)) {
        // Both in one file, as 'stx render --projection equirectangular' writes them.
        STX_TRY(const auto source,
                sourceInside(folderOf(given), given.filename().string(), where, job.limits));
        return setOf(source, source, options);
    }
    if (!std::filesystem::is_directory(given, ec))
        return failAt(where, ErrorCode::invalidInput,
                      "a folder with one picture and its depth, or an .exr file with both, is "
                      "expected");
    std::string texture = filled(options.texturePattern, {"", 0, 0, options.frame});
    std::string depth = filled(options.depthPattern, {"", 0, 0, options.frame});
    std::string depthArray;
    for (const std::string& name : filesIn(given)) {
        std::string ending = path(name).extension().string();
        std::transform(ending.begin(), ending.end(), ending.begin(),
                       [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
        static constexpr std::string_view kEndings[] = {".png", ".jpg",  ".jpeg", ".exr",
                                                        ".tif", ".tiff", ".pfm",  ".hdr"};
        const bool array = ending == ".npy" || ending == ".npz";
        if (std::find(std::begin(kEndings), std::end(kEndings), ending) == std::end(kEndings) &&
            !array)
            continue;
        const bool isDepth = name.find("depth") != std::string::npos ||
                             name.find("Depth") != std::string::npos || ending == ".pfm";
        if (array) {
            // Beside pictures there may be any: poses, intrinsics.
            if (isDepth && depthArray.empty()) depthArray = name;
            continue;
        }
        std::string& to = isDepth ? depth : texture;
        if (!(isDepth ? options.depthPattern : options.texturePattern).empty()) continue;
        if (!to.empty())
            return failAt(where, ErrorCode::invalidInput,
                          "both '{}' and '{}' could be the {}; name them with --texture and "
                          "--depth, or write a cameras.json",
                          to, name, isDepth ? "depth" : "picture");
        to = name;
    }
    if (depth.empty()) depth = depthArray;
    if (texture.empty() || depth.empty())
        return failAt(where, ErrorCode::io,
                      "no {} was found in it; a panorama is a picture and a depth image with "
                      "'depth' in its name",
                      texture.empty() ? "picture" : "depth image");
    STX_TRY(auto textureSource, sourceInside(given, texture, where, job.limits));
    STX_TRY(auto depthSource, sourceInside(given, depth, where, job.limits));
    // Any picture with depth beside it is taken for a panorama. One that cannot be opened is an
    // error where it is read.
    if (const auto size = imageSizeOf(textureSource, job);
        size && options.from != "panorama" && !sameShape(*size, {2 * size->y, size->y}) &&
        !isPair(size->x, size->y))
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is {}x{}; a panorama is twice as wide as it is high (--from panorama "
                      "reads it as one all the same)",
                      texture, size->x, size->y);
    return setOf(std::move(textureSource), std::move(depthSource), options);
}

}  // namespace stx::imagesets
