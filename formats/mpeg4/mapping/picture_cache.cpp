#include "formats/mpeg4/mapping/picture_cache.hpp"

namespace stx::mpeg4 {

std::shared_ptr<const DecodedImage> PictureCache::find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = byKey_.find(key);
    if (found == byKey_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->image;
}

void PictureCache::keep(const Key& key, const DecodedImage& image) {
    const std::uint64_t bytes =
        static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height) *
        static_cast<std::uint64_t>(image.channels) * (static_cast<std::uint64_t>(image.bits()) / 8);
    if (bytes > room_) return;
    auto copy = std::make_shared<const DecodedImage>(image);
    const std::lock_guard lock(mutex_);
    if (byKey_.contains(key)) return;
    while (used_ + bytes > room_) {
        used_ -= entries_.back().bytes;
        byKey_.erase(entries_.back().key);
        entries_.pop_back();
    }
    entries_.push_front({key, std::move(copy), bytes});
    byKey_[key] = entries_.begin();
    used_ += bytes;
}

}  // namespace stx::mpeg4
