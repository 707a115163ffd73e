#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>

#include "formats/images/images.hpp"
#include "formats/mpeg4/scene/document.hpp"

namespace stx::mpeg4 {

/// Decoded pictures of streams, the least recently used of which go first. Safe from several
/// threads.
class PictureCache {
  public:
    struct Key {
        const ElementaryStream* stream = nullptr;
        std::size_t sample = 0;
        bool codes = false;  ///< StreamImages::Samples::codes
        auto operator<=>(const Key&) const = default;
    };

    explicit PictureCache(std::uint64_t bytes) : room_(bytes) {}

    /// Null when it is not here.
    [[nodiscard]] std::shared_ptr<const DecodedImage> find(const Key& key);
    void keep(const Key& key, const DecodedImage& image);

  private:
    struct Entry {
        Key key;
        std::shared_ptr<const DecodedImage> image;
        std::uint64_t bytes = 0;
    };
    std::mutex mutex_;
    std::list<Entry> entries_;  ///< the last used first
    std::map<Key, std::list<Entry>::iterator> byKey_;
    std::uint64_t room_ = 0, used_ = 0;
};

}  // namespace stx::mpeg4
