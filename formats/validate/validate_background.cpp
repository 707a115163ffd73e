#include "formats/validate/validate_background.hpp"

#include <algorithm>

#include "formats/mpeg4/mapping/background.hpp"

namespace stx {

using namespace mpeg4;

namespace {

void checkPictures(const Node& node, const PictureReader& pictures, const std::string& where) {
    std::vector<glm::ivec2> sizes;
    std::string listed, missing;
    int there = 0;
    for (std::size_t f = 0; f < 6; ++f) {
        const char* face = kCubeFaceNames[f];
        const NodePtr texture = faceTexture(node, static_cast<CubeFace>(f));
        if (!texture) {
            missing += (missing.empty() ? "no " : ", ") + fmt::format("{}Url", face);
            continue;
        }
        ++there;
        const std::string what = fmt::format("{}Url", face);
        const auto info = pictures.probe(*texture, what, where);
        if (!info) continue;
        (void)pictures.decode(*texture, what, where);
        sizes.emplace_back(info->width, info->height);
        listed += (listed.empty() ? "" : ", ") +
                  fmt::format("{} {}", face, sizeText(info->width, info->height));
    }
    const auto fits = [&](glm::ivec2 size) { return size.x == size.y && size == sizes[0]; };
    if (!std::ranges::all_of(sizes, fits))
        pictures.findings.add(8001, where, listed, "six squares of one size");
    if (there > 0 && there < 6) pictures.findings.add(8002, where, missing, "all six pictures");
}

void checkGradient(const Node& node, const char* what, const std::string& where,
                   Findings& findings) {
    const auto& colours = node.get<std::vector<Color>>(fmt::format("{}Color", what));
    const auto& angles = node.get<std::vector<float>>(fmt::format("{}Angle", what));
    const bool count = colours.empty() ? angles.empty() : angles.size() + 1 == colours.size();
    float before = 0;
    bool rise = true;
    for (const float angle : angles) {
        rise = rise && angle >= before && angle <= 3.1415927f;
        before = angle;
    }
    if (!count || !rise)
        findings.add(8003, where,
                     fmt::format("{} {}Color and {} {}Angle{}", colours.size(), what, angles.size(),
                                 what, rise ? "" : " that do not rise from 0 to 3.1415927"),
                     "one angle less than colours, rising");
}

}  // namespace

void checkBackgrounds(const std::vector<ShownBackground>& backgrounds,
                      const PictureReader& pictures) {
    for (const ShownBackground& background : backgrounds) {
        const Node& node = *background.node;
        const std::string where =
            node.defName.empty() ? "Background" : fmt::format("Background '{}'", node.defName);
        checkPictures(node, pictures, where);
        checkGradient(node, "sky", where, pictures.findings);
        checkGradient(node, "ground", where, pictures.findings);
    }
}

}  // namespace stx
