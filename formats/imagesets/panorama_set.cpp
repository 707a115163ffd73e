// A folder with one equirectangular picture and its depth (ray length), and no camera: it is at
// the origin and looks along -Z in the middle of the picture.

#include <algorithm>

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/messages.hpp"
#include "formats/imagesets/patterns.hpp"

namespace stx::imagesets {

Result<SetDescription> describePanorama(const path& given, const ImageSetOptions& options,
                                        Job& job) {
    const std::string where = inQuotes(given.string());
    std::error_code ec;
    if (!std::filesystem::is_directory(given, ec))
        return failAt(where, ErrorCode::invalidInput,
                      "a folder with one picture and its depth is expected");
    std::string texture = filled(options.texturePattern, {"", 0, 0, options.frame});
    std::string depth = filled(options.depthPattern, {"", 0, 0, options.frame});
    for (const std::string& name : filesIn(given)) {
        std::string ending = path(name).extension().string();
        std::transform(ending.begin(), ending.end(), ending.begin(),
                       [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
        static constexpr std::string_view kEndings[] = {".png", ".jpg",  ".jpeg", ".exr",
                                                        ".tif", ".tiff", ".pfm",  ".hdr"};
        if (std::find(std::begin(kEndings), std::end(kEndings), ending) == std::end(kEndings))
            continue;
        const bool isDepth = name.find("depth") != std::string::npos ||
                             name.find("Depth") != std::string::npos || ending == ".pfm";
        std::string& to = isDepth ? depth : texture;
        if (!(isDepth ? options.depthPattern : options.texturePattern).empty()) continue;
        if (!to.empty())
            return failAt(where, ErrorCode::invalidInput,
                          "both '{}' and '{}' could be the {}; name them with --texture and "
                          "--depth, or write a cameras.json",
                          to, name, isDepth ? "depth" : "picture");
        to = name;
    }
    if (texture.empty() || depth.empty())
        return failAt(where, ErrorCode::io,
                      "no {} was found in it; a panorama is a picture and a depth image with "
                      "'depth' in its name",
                      texture.empty() ? "picture" : "depth image");
    SetView view;
    view.name = "panorama";
    view.panorama = Panorama();
    STX_TRY(view.texture, sourceInside(given, texture, where, job.limits));
    STX_TRY(view.depth, sourceInside(given, depth, where, job.limits));
    view.distances = [](Image<float>& values, const Camera& camera, int bits,
                        Job& notes) -> Result<void> {
        if (bits == 32) return {};
        if (bits != 16)
            return fail(ErrorCode::invalidInput,
                        "the depth has {} bits; 16 (millimetres) or floats are expected", bits);
        return scaledIntegers(0.001)(values, camera, bits, notes);
    };
    SetDescription set;
    set.views.push_back(std::move(view));
    return set;
}

}  // namespace stx::imagesets
