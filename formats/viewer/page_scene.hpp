#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"

namespace stx {

/// The textures of one page of an atlas as PNG files, by the names that the viewer has for them:
/// "colour", "depth", "normal", "splat"; colour may be JPEG, with "alpha" where some is not full,
/// or missing where the pictures of the views themselves, "view0" and so on, are with the first
/// page. See writeViewerPage() for what they hold.
using PageImages = std::map<std::string, Bytes>;

/// How colour is written.
struct PageColours {
    int jpegQuality = 0;  ///< 0 = PNG, exact; 1..100 = JPEG, alpha beside it exact
    /// Where the input's colours are JPEG files (ColourFile) these are copied, whatever else holds.
    bool copies = false;
};

/// A bundle with 8-bit sRGB colour, which `what` ("the page") has. What is lossy is noted. `spool`,
/// if any, is that of the bundle.
void codeColours(Bundle& bundle, std::string_view what, Job& job, PixelSpool* spool = nullptr);
/// A bundle with 8-bit sRGB colour and depth of 8 or 16 bits, as the viewer's textures hold them.
/// What is lossy is noted.
void makeViewable(Bundle& bundle, Job& job);
/// The views of a bundle, which makeViewable() has seen, in textures as small as hold them. Errors:
/// those of pack().
[[nodiscard]] Result<Atlas> packForPage(const Bundle& bundle, Job& job);
/// Takes away the JPEG files of views whose colours are not exactly those that they decode to.
void keepExactFiles(Bundle& bundle, const Limits& limits);

/// Views as the viewer reads them, atlas by atlas.
class PageScene {
  public:
    explicit PageScene(const PageColours& colours) : colours_(colours) {}

    /// The images of the pages of an atlas, whose views come behind those that are there; one
    /// without views has none. ColourFile of its views have passed keepExactFiles(). Errors: one
    /// that fails check(), linear colour or depth of 32 bits (invalidInput), memory.
    [[nodiscard]] Result<std::vector<PageImages>> add(const Atlas& atlas, Job& job);
    /// What the viewer knows of them. `pages`: the numbers of the images of each page, by name.
    [[nodiscard]] nlohmann::ordered_json description(nlohmann::ordered_json pages) const;

  private:
    PageColours colours_;
    bool pruned_ = false;
    int padding_ = 0;
    std::size_t pages_ = 0;
    nlohmann::ordered_json views_ = nlohmann::ordered_json::array(),
                           rectangles_ = nlohmann::ordered_json::array();
};

/// A vector, as JSON has it.
[[nodiscard]] std::vector<double> listOf(glm::dvec3 v);
/// A camera, as the viewer reads it, with its name.
[[nodiscard]] nlohmann::ordered_json pageCamera(const Camera& camera, const std::string& name);

}  // namespace stx
