#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/imagesets/export.hpp"
#include "lib/model/bundle.hpp"

/// The files of an image set that is written, one by one.
namespace stx::imagesets {

using OutputJson = nlohmann::ordered_json;

/// Where a set keeps the bundle's environment, named as stx:environment.
inline constexpr const char* kEnvironmentFile = "environment.exr";

/// Names of the views that are safe in any file system, each once.
[[nodiscard]] std::vector<std::string> fileNames(const Bundle& bundle);

/// Colour as PNG, or OpenEXR where it is linear and the options do not ask for PNG of 16 bits:
/// colourEnding() is added to the name.
[[nodiscard]] Result<void> writeColour(const ReferenceView& view,
                                       const std::filesystem::path& withoutEnding,
                                       const ExportOptions& options);
[[nodiscard]] const char* colourEnding(bool linear, const ExportOptions& options);

/// What of linear colour is lost where the options ask for PNG.
class ColourLoss {
  public:
    /// From several threads.
    void look(const ReferenceView& view, const ExportOptions& options);
    /// Notes what was found.
    void note(Job& job) const;

  private:
    std::atomic<bool> clipped_ = false, rounded_ = false;
};

/// How far integer depth reaches, times the farthest distance, where it does not count in
/// millimetres: in scenes that are too small and in those that are too large for them.
struct DepthReach {
    double small = 1, large = 1;
};
/// The unit of integer depth for distances up to `farthest`, scene units: 0.001, which nerfstudio
/// takes without being asked, where that has at least 1,000 steps and codes for all of them. A note
/// says it.
[[nodiscard]] double integerDepthUnit(double farthest, const DepthReach& reach, Job& job);

/// ".exr", ".png" or ".npy".
[[nodiscard]] const char* endingOf(ExportOptions::Depth depth);
/// Depth as floats of OpenEXR or NumPy, by the file's ending, or as 16-bit PNG of code(distance),
/// rounded to 1..65535; 0 is not a point.
[[nodiscard]] Result<void> writeFloatDepth(const ReferenceView& view,
                                           const std::filesystem::path& file);
[[nodiscard]] Result<void> writeIntegerDepth(const ReferenceView& view,
                                             const std::filesystem::path& file,
                                             const std::function<double(double)>& code);

/// Folders images/ and depth/ in a new one. `folder` is what errors name.
[[nodiscard]] Result<void> makeImageFolders(const std::filesystem::path& in,
                                            const std::filesystem::path& folder);
/// The text of a set's file. Errors: names that are not UTF-8.
[[nodiscard]] Result<std::string> setText(const OutputJson& json);

/// What brings a view back to the bit; other programs do not look at it.
void addOwnKeys(OutputJson& json, const ViewHeader& view, glm::dvec3 origin);
/// A view in the frames of transforms.json, with images/NAME and depth/NAME.
[[nodiscard]] OutputJson transformsFrame(const ViewHeader& view, bool linear,
                                         const std::string& name, const ExportOptions& options,
                                         glm::dvec3 origin);

}  // namespace stx::imagesets
