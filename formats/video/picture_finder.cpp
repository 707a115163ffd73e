#include "formats/video/picture_finder.hpp"

#include <algorithm>

namespace stx {
namespace {

/// Places to begin from that are tried: a picture can need more than the last one before it.
constexpr int kMostBeginnings = 3;

}  // namespace

std::size_t PictureFinder::syncBefore(std::size_t unit, std::size_t from) const {
    // What is shown before the picture at which decoding begins may need those before that one.
    for (std::size_t i = std::min(unit, from) + 1; i-- > 0;)
        if (units_[i].sync && units_[i].time <= units_[unit].time) return i;
    return 0;
}

bool PictureFinder::isReady(std::int64_t time) const {
    return std::ranges::find(ready_, time) != ready_.end();
}

Result<void> PictureFinder::feedUntil(std::int64_t time) {
    while (!ended_ && !isReady(time)) {
        // Later ones come out only when all before them have.
        if (!ready_.empty() && ready_.back() > time) break;
        auto answer = source_.feed(*next_, time);
        if (!answer) {
            next_.reset();
            ready_.clear();
            return tl::unexpected(answer.error());
        }
        ++*next_;
        video::Unpacker in(*answer);
        ended_ = in.get<std::uint8_t>() != 0;
        ready_.clear();
        while (in.ok() && !in.rest().empty()) ready_.push_back(in.get<std::int64_t>());
    }
    return {};
}

Result<VideoPicture> PictureFinder::find(std::size_t unit, const Limits& limits) {
    const std::int64_t time = units_[unit].time;
    std::size_t begin = syncBefore(unit, unit);
    const bool goOn = next_ && !ended_ && *next_ >= begin && *next_ <= units_.size() &&
                      (ready_.empty() || ready_.back() < time);
    int beginnings = 0;
    for (bool first = true; !isReady(time); first = false) {
        if (!(first && goOn)) {
            next_.reset();
            ended_ = false;
            ready_.clear();
            STX_CHECK(source_.begin(begin));
            next_ = begin;
        }
        STX_CHECK(feedUntil(time));
        if (isReady(time)) break;
        if (first && goOn) continue;
        if (begin == 0 || ++beginnings == kMostBeginnings)
            return fail(ErrorCode::invalidInput, "its decoder gives no picture; it is damaged");
        begin = syncBefore(unit, begin - 1);
    }
    video::Packer wanted;
    wanted.put(time);
    STX_TRY(auto answer, process_.ask(video::Tag::take, wanted.bytes, video::Tag::picture));
    return VideoPicture::from(std::move(answer), limits);
}

}  // namespace stx
