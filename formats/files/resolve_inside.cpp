// Names that files give to other files.

#include <sys/stat.h>

#include <algorithm>
#include <optional>
#include <system_error>

#include "formats/files/files.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/shown_name.hpp"

namespace stx {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> cannotOpen(const fs::path& path, const std::error_code& why) {
    return fail(ErrorCode::io, "cannot open '{}': {}", shownName(path).string(), why.message());
}

bool hasScheme(std::string_view name) {
    const auto colon = name.find(':');
    if (colon == std::string_view::npos || colon == 0) return false;
    for (std::size_t i = 0; i < colon; ++i) {
        const char c = name[i];
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        const bool other = (c >= '0' && c <= '9') || c == '+' || c == '.' || c == '-';
        if (!letter && (i == 0 || !other)) return false;
    }
    return true;
}

bool isInside(const fs::path& path, const fs::path& folder) {
    auto p = path.begin();
    for (auto f = folder.begin(); f != folder.end(); ++f, ++p) {
        if (f->empty()) continue;
        if (p == path.end() || *p != *f) return false;
    }
    return true;
}

/// A regular file of this name in `base`, when folders alone lead to it: not up, and through no
/// link. Sets have tens of thousands of such names, so they are not taken apart as paths.
std::optional<fs::path> plainFile(const std::string& base, std::string_view name) {
    std::string at = base;
    if (!at.ends_with('/')) at += '/';
    while (true) {
        const std::size_t end = std::min(name.find('/'), name.size());
        const std::string_view part = name.substr(0, end);
        if (part.empty() || part == "." || part == "..") return std::nullopt;
        at += part;
        struct stat status {};
        if (::lstat(at.c_str(), &status) != 0) return std::nullopt;
        if (end == name.size()) {
            if (!S_ISREG(status.st_mode)) return std::nullopt;
            return fs::path(std::move(at));
        }
        if (!S_ISDIR(status.st_mode)) return std::nullopt;
        at += '/';
        name.remove_prefix(end + 1);
    }
}

Result<fs::path> findInside(const fs::path& folder, std::string_view name, const Limits& limits) {
    const auto refuse = [&](std::string_view why) {
        return fail(ErrorCode::invalidInput,
                    "the name '{}' {}; only files in the folder of the file that names them are "
                    "opened",
                    name.substr(0, 200), why);
    };
    if (name.empty()) return fail(ErrorCode::invalidInput, "a file name is empty");
    if (name.find('\0') != std::string_view::npos) return refuse("holds a zero byte");
    if (hasScheme(name)) return refuse("is a URL or has a drive letter");

    std::error_code ec;
    const fs::path base = folder.empty() ? fs::path(".") : folder;
    // That of /dev/stdin, where no file is beside what comes in.
    if (base == "/dev" && fs::path(name).is_relative())
        return fail(ErrorCode::io,
                    "'{}' lies beside the file that names it, and standard input has no folder; "
                    "give that file's name in place of -",
                    name.substr(0, 200));
    // Nearly all names are of this kind.
    if (auto plain = plainFile(base.native(), name)) return *std::move(plain);
    std::string spelled(name);
    // Backslashes are separators in files written on Windows, and seldom part of a name here.
    if (spelled.find('\\') != std::string::npos && !fs::exists(base / spelled, ec))
        std::replace(spelled.begin(), spelled.end(), '\\', '/');
    const fs::path relative(spelled);
    if (!limits.allowOutside) {
        if (relative.is_absolute()) return refuse("is an absolute path");
        const fs::path normal = relative.lexically_normal();
        if (!normal.empty() && *normal.begin() == "..") return refuse("leaves its folder by '..'");
    }
    const fs::path joined = base / relative;
    const fs::path realBase = fs::canonical(base, ec);
    if (ec) return cannotOpen(base, ec);
    const fs::path real = fs::canonical(joined, ec);
    if (ec) return cannotOpen(joined, ec);
    if (!limits.allowOutside && !isInside(real, realBase))
        return refuse("leads out of its folder by a link");
    if (!fs::is_regular_file(real, ec)) return refuse("is not a regular file");
    return joined;
}

}  // namespace

Result<fs::path> resolveInside(const fs::path& folder, std::string_view name,
                               const Limits& limits) {
    auto file = findInside(folder, name, limits);
    if (file) rememberNamedFile(*file);
    return file;
}

}  // namespace stx
