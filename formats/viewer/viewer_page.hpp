#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/viewer/page_scene.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

/// How a page is written.
struct PageOptions {
    /// The input's name as `stx render` is given it, for the command that the page shows.
    std::string input;
    /// What browsers show as its name; empty: the bundle's title, else the input's name.
    std::string title;
    PageColours colours;
    OutputFile::Options output = {};
    /// The options that `stx render` needs to draw what the page holds, as `--object NAME`.
    std::vector<std::string> renderOptions = {};
};

/// What a page holds.
struct PageReport {
    std::size_t views = 0;
    std::int64_t points = 0;  ///< of the first frame that has any
    std::size_t frames = 0;
    std::uint64_t imageBytes = 0;  ///< of its PNG and JPEG files
    std::uint64_t bytes = 0;       ///< of the page
};

/// Says, where there is an environment, that pages and models leave it out.
void noteEnvironmentLeftOut(const std::shared_ptr<const Environment>& environment, Job& job);

/// Writes one HTML file, whole or not at all, that draws a bundle in any browser with WebGL 2 and
/// needs nothing else: Lee & Park's path with stx's splats (formats/viewer). The views of each
/// frame are merged into at most four textures (pack(), tight), each a PNG: colour in 8 bits, with
/// alpha where some is not full (or JPEG, as PageColours says), depth as DepthImage codes of 8 or
/// 16 bits, normals in 8 bits, tilts and sizes of splats in 8 bits. Background views have textures
/// of their own, so has what no sensor measured (unmeasuredViews()), and in films all views do:
/// images that are the same as those of the frame before are written once. Where the memory limit
/// has no room for all views of what stands still, they are merged in groups that it has room for:
/// the page's bytes depend on the limit then, since one atlas of all views has to hold all at once,
/// and many small ones take longer to draw. The page is UTF-16, takes 1.03 bytes for each of the
/// images (pageText()) and about 30 kB.
///
/// A frame of a film without points shows the background alone.
///
/// Notes: colours of linear light become 8-bit sRGB, depth of 32 bits becomes 16; what no sensor
/// measured is left out for want of memory; a page that browsers find hard to hold. Errors: those
/// of the sequence and of pack(); (invalidInput) no frame has a point; files; cancelled.
[[nodiscard]] Result<PageReport> writeViewerPage(Sequence& frames,
                                                 const std::filesystem::path& path,
                                                 const PageOptions& options, Job& job);
/// The same with an atlas' own textures, where their padding allows that.
[[nodiscard]] Result<PageReport> writeViewerPage(const Atlas& atlas,
                                                 const std::filesystem::path& path,
                                                 const PageOptions& options, Job& job);

}  // namespace stx
