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

/// Views as the viewer reads them.
struct PageScene {
    nlohmann::ordered_json description;  ///< all but "pages", the numbers of the images
    std::vector<PageImages> pages;
    std::vector<std::size_t> owners;  ///< of each page: the number of the atlas that it is of
};

/// A bundle with 8-bit sRGB colour, which `what` ("the page") has. What is lossy is noted. `spool`,
/// if any, is that of the bundle.
void codeColours(Bundle& bundle, std::string_view what, Job& job, PixelSpool* spool = nullptr);
/// A bundle with 8-bit sRGB colour and depth of 8 or 16 bits, as the viewer's textures hold them.
/// What is lossy is noted.
void makeViewable(Bundle& bundle, Job& job);
/// The views of a bundle, which makeViewable() has seen, in textures as small as hold them; with
/// `apart` those of each view in textures of their own, so that what did not change in the next
/// frame is the same image. Then a view without content has none: an atlas without views. Errors:
/// those of pack().
[[nodiscard]] Result<std::vector<Atlas>> packForPage(const Bundle& bundle, bool apart, Job& job);
/// Takes away the JPEG files of views whose colours are not exactly those that they decode to.
void keepExactFiles(Bundle& bundle, const Limits& limits);
/// All atlases as one scene; ColourFile of views have passed keepExactFiles(). Errors: one that
/// fails check() but for those without views, linear colour or depth of 32 bits (invalidInput),
/// memory.
[[nodiscard]] Result<PageScene> pageScene(std::span<const Atlas> atlases,
                                          const PageColours& colours, Job& job);

/// A vector, as JSON has it.
[[nodiscard]] std::vector<double> listOf(glm::dvec3 v);
/// A camera, as the viewer reads it, with its name.
[[nodiscard]] nlohmann::ordered_json pageCamera(const Camera& camera, const std::string& name);

}  // namespace stx
