#include "formats/video/ffmpeg/logged.hpp"

#include <array>
#include <cstdarg>
#include <cstdio>

#include "formats/video/ffmpeg/av.hpp"

namespace stx::video {
namespace {

LoggedErrors logged;  // one thread reads and decodes

AVClassCategory kindOf(void* speaker) {
    const AVClass* const of = speaker ? *static_cast<const AVClass**>(speaker) : nullptr;
    if (!of) return AV_CLASS_CATEGORY_NA;
    return of->get_category ? of->get_category(speaker) : of->category;
}

void listen(void* speaker, int level, const char* format, std::va_list values) {
    if (level > AV_LOG_ERROR) return;
    std::string& kept =
        kindOf(speaker) == AV_CLASS_CATEGORY_DEMUXER ? logged.demuxer : logged.other;
    if (!kept.empty()) return;
    std::array<char, 512> text{};
    std::vsnprintf(text.data(), text.size(), format, values);
    kept = text.data();
    while (!kept.empty() && (kept.back() == '\n' || kept.back() == '.')) kept.pop_back();
}

}  // namespace

const LoggedErrors& loggedErrors() {
    return logged;
}

void forgetErrors() {
    logged = {};
}

void listenToErrors() {
    av_log_set_callback(listen);
}

}  // namespace stx::video
