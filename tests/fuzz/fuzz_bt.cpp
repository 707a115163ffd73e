// BT: what reads, writes, and reads back the same; and the way from the scene to bundles,
// at its first moment and in time.

#include <algorithm>
#include <cctype>
#include <cstring>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/text/bt.hpp"
#include "tests/fuzz/scene_in_time.hpp"
#include "tests/fuzz/text_round_trip.hpp"
#include "tests/same_scenes.hpp"

using namespace stx;
using namespace stx::mpeg4;

/// Whether a name may have a character that is written as '_', or begins as a number does and gets
/// a '_' before it: names in buffers are bytes of these. DEF may be written in small letters.
static bool mayRename(std::string text) {
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    for (auto at = text.find("DEF"); at != text.npos; at = text.find("DEF", at + 3)) {
        const auto name = text.find_first_not_of(" \t\r\n,", at + 3);
        if (name == text.npos) continue;
        if (std::strchr("-0123456789", text[name])) return true;
        const auto end = std::min(text.find_first_of(" \t\r\n,{[", name), text.size());
        if (text.substr(name, end - name).find_first_of("+.'\"#") != text.npos) return true;
    }
    return std::ranges::any_of(text, [](char c) {
        return std::ispunct(static_cast<unsigned char>(c))
                   ? !std::strchr("_-+.,#\"'{}[]", c)
                   : std::iscntrl(static_cast<unsigned char>(c)) && !std::strchr("\t\r\n", c);
    });
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const auto trip = textRoundTrip(text, readBt, writeBt, job);
    if (!trip) return 0;
    // What was written has plain names.
    const auto plain =
        mayRename(std::string(text)) ? textRoundTrip(trip->written, readBt, writeBt, job) : trip;
    if (!plain) violated("what is written reads");
    if (!sameFrames(plain->document.frames, plain->again.frames, {.ids = false, .names = false}))
        violated("what is written reads back the same");
    SceneReadOptions options;
    options.decode = tinyPicture;
    const auto bundle = bundleFromScene(trip->document, options, job);
    if (bundle && !bundle->check()) violated("a bundle that is read keeps its rules");
    sceneInTime(trip->document, job);
    return 0;
}
