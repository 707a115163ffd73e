// Parses JSON. The frames of long films, most of a file's bytes, are parsed on several threads.

#include <algorithm>
#include <string_view>
#include <vector>

#include "formats/imagesets/json_values.hpp"
#include "lib/base/parallel.hpp"

namespace stx::imagesets {
namespace {

/// Shorter lists are parsed in less time than threads take to start.
constexpr std::size_t kManyFrames = 500;
/// Deeper nesting would be no set of images and exhausts the stack of whoever walks through it.
constexpr int kDeepest = 64;

/// Where the list `frames` of the outermost object is.
struct FrameList {
    std::size_t open = 0;             ///< its bracket
    std::vector<std::size_t> breaks;  ///< its commas, and the closing bracket as the last
    bool whole = false;
};

bool endsWithFramesKey(std::string_view before) {
    const auto trim = [&] {
        before.remove_suffix(before.size() - (before.find_last_not_of(" \t\r\n") + 1));
    };
    trim();
    if (!before.ends_with(':')) return false;
    before.remove_suffix(1);
    trim();
    return before.ends_with("\"frames\"");
}

/// Looks through the brackets of a text that may be anything.
Result<FrameList> findFrames(std::string_view text) {
    FrameList list;
    int depth = 0;
    bool inText = false, inList = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (inText) {
            if (c == '\\') ++i;
            if (c == '"') inText = false;
        } else if (c == '"') {
            inText = true;
        } else if (c == '[' || c == '{') {
            if (++depth > kDeepest)
                return fail(ErrorCode::invalidInput, "lists are nested deeper than {}", kDeepest);
            if (c == '[' && depth == 2 && !list.whole && endsWithFramesKey(text.substr(0, i))) {
                list.open = i;
                inList = true;
            }
        } else if (c == ']' || c == '}') {
            if (--depth == 1 && inList) {
                list.breaks.push_back(i);
                list.whole = true;
                inList = false;
            }
        } else if (c == ',' && inList && depth == 2) {
            list.breaks.push_back(i);
        }
    }
    return list;
}

/// The same as Json::parse(text), or null where its parts are not valid by themselves.
Json parsedInParts(std::string_view text, const FrameList& list) {
    const std::string standIn = "the frames, parsed by themselves";
    std::string rest(text.substr(0, list.open));
    rest += '"' + standIn + '"';
    rest += text.substr(list.breaks.back() + 1);
    Json json = Json::parse(rest, nullptr, false);
    const auto place = json.is_object() ? json.find("frames") : json.end();
    // Another `frames` after it would have taken its place.
    if (place == json.end() || *place != standIn) return nullptr;
    std::vector<Json> frames(list.breaks.size());
    parallelFor(0, static_cast<std::int64_t>(frames.size()), [&](std::int64_t k) {
        const auto i = static_cast<std::size_t>(k);
        const std::size_t from = (i == 0 ? list.open : list.breaks[i - 1]) + 1;
        frames[i] = Json::parse(text.begin() + from, text.begin() + list.breaks[i], nullptr, false);
    });
    if (std::ranges::any_of(frames, &Json::is_discarded)) return nullptr;
    *place = std::move(frames);
    return json;
}

}  // namespace

Result<Json> parseJson(ByteSpan bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    STX_TRY(const FrameList frames, findFrames(text));
    try {
        if (frames.whole && frames.breaks.size() >= kManyFrames)
            if (Json json = parsedInParts(text, frames); !json.is_null()) return json;
        return Json::parse(text.begin(), text.end());
    } catch (const Json::parse_error& e) {
        const auto before = text.substr(0, std::min(e.byte, text.size()));
        return failAt(fmt::format("line {}", 1 + std::ranges::count(before, '\n')),
                      ErrorCode::invalidInput, "this is not valid JSON");
    } catch (const std::exception&) {
        return fail(ErrorCode::invalidInput, "this is not valid JSON");
    }
}

}  // namespace stx::imagesets
