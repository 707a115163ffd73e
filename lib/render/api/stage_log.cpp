#include "lib/render/api/stage_log.hpp"

#include <algorithm>

namespace stx {

void StageLog::add(std::string_view name, double milliseconds, std::int64_t pixels, bool once) {
    const std::scoped_lock lock(mutex_);
    auto entry = std::find_if(entries_.begin(), entries_.end(),
                              [&](const Entry& e) { return e.name == name; });
    if (entry == entries_.end()) {
        entries_.emplace_back();
        entry = entries_.end() - 1;
        entry->name = name;
        entry->once = once;
    }
    entry->milliseconds += milliseconds;
    entry->pixels += pixels;
}

std::vector<StageLog::Entry> StageLog::entries() const {
    const std::scoped_lock lock(mutex_);
    return entries_;
}

}  // namespace stx
