#pragma once

#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"
#include "formats/viewer/page_scene.hpp"

namespace stx {

/// Writes the parts of a page as they come. Images and scenes that are the same as those of the
/// frame before are written once; what compares them is kept only where `moves`.
class PageWriter {
  public:
    PageWriter(OutputFile file, std::string_view title, bool moves);

    Result<void> begin();
    /// The images of an atlas, number `atlas` of the scene in `slot` (0 and up), with their numbers
    /// behind `pages`, an array.
    Result<void> addImages(std::size_t slot, std::size_t atlas, std::vector<PageImages> images,
                           nlohmann::ordered_json& pages);
    /// The number of a scene; that of the frame before when it is the same.
    Result<int> addScene(std::size_t slot, const nlohmann::ordered_json& description);
    /// `data`: what the page knows beside its scenes.
    Result<void> finish(const nlohmann::ordered_json& data);

    [[nodiscard]] std::uint64_t imageBytes() const { return imageBytes_; }  ///< files
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }            ///< all

  private:
    struct Image {
        int number = -1;
        Bytes bytes;
    };
    struct Slot {
        /// By the atlas, its page and the name.
        std::map<std::tuple<std::size_t, std::size_t, std::string>, Image> images;
        int number = -1;
        std::string text;
    };

    Slot& slot(std::size_t index);
    Result<void> write(std::string_view text);
    /// `text` as pageText() gives it.
    Result<void> element(std::string_view id, std::string_view text);

    OutputFile file_;
    bool moves_;
    std::string head_, end_;
    std::vector<Slot> slots_;
    int images_ = 0, scenes_ = 0;
    std::uint64_t imageBytes_ = 0, bytes_ = 0;
};

}  // namespace stx
